#include "server/io/vtu_writer.h"

#include <cstring>
#include <span>

#include "common/text.h"
#include "server/io/write_file.h"

namespace crumple::io {
namespace {

std::string base64(std::string_view bytes) {
  static constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string encoded;
  encoded.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto at = [&](std::size_t k) { return k < bytes.size() ? static_cast<unsigned char>(bytes[k]) : 0u; };
    const unsigned group = at(i) << 16 | at(i + 1) << 8 | at(i + 2);
    encoded += kAlphabet[group >> 18 & 63];
    encoded += kAlphabet[group >> 12 & 63];
    encoded += i + 1 < bytes.size() ? kAlphabet[group >> 6 & 63] : '=';
    encoded += i + 2 < bytes.size() ? kAlphabet[group & 63] : '=';
  }
  return encoded;
}

// <DataArray> with VTK's inline binary form: the byte count as UInt32, then the values, in one base64 text.
template <class T>
std::string data_array(const char* type, const char* name, int components, std::span<const T> values) {
  const std::uint32_t size = static_cast<std::uint32_t>(values.size_bytes());
  std::string bytes(sizeof size + size, '\0');
  std::memcpy(bytes.data(), &size, sizeof size);
  if (size > 0) std::memcpy(bytes.data() + sizeof size, values.data(), size);
  return text("<DataArray type=\"", type, "\" Name=\"", name, "\" NumberOfComponents=\"", components,
              "\" format=\"binary\">", base64(bytes), "</DataArray>\n");
}

std::vector<double> flat(const std::vector<Vec3>& vectors) {
  std::vector<double> values;
  values.reserve(3 * vectors.size());
  for (const Vec3& v : vectors) values.insert(values.end(), {v.x(), v.y(), v.z()});
  return values;
}

}  // namespace

Result<void> write_vtu(const std::filesystem::path& file, const sim::FemView& body) {
  std::vector<std::int32_t> corners, ends;
  std::vector<double> plastic;
  for (std::size_t t = 0; t < body.tets.size(); ++t) {
    corners.insert(corners.end(), body.tets[t].begin(), body.tets[t].end());
    ends.push_back(static_cast<std::int32_t>(corners.size()));
    plastic.push_back(body.plastic_strain[t].norm());
  }
  std::vector<std::int32_t> material(body.material_id.begin(), body.material_id.end());
  material.resize(body.tets.size(), 0);
  constexpr std::uint8_t kVtkTetra = 10;
  const std::vector<std::uint8_t> types(body.tets.size(), kVtkTetra);

  std::string xml = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n";
  xml += text("<UnstructuredGrid><Piece NumberOfPoints=\"", body.x.size(), "\" NumberOfCells=\"", body.tets.size(), "\">\n");
  xml += "<Points>" + data_array<double>("Float64", "Points", 3, flat(body.x)) + "</Points>\n<Cells>\n";
  xml += data_array<std::int32_t>("Int32", "connectivity", 1, corners);
  xml += data_array<std::int32_t>("Int32", "offsets", 1, ends);
  xml += data_array<std::uint8_t>("UInt8", "types", 1, types);
  xml += "</Cells>\n<PointData Vectors=\"velocity\">" + data_array<double>("Float64", "velocity", 3, flat(body.v));
  xml += "</PointData>\n<CellData Scalars=\"von_mises\">";
  xml += data_array<double>("Float64", "von_mises", 1, body.von_mises);
  xml += data_array<double>("Float64", "plastic_strain", 1, plastic);
  xml += data_array<std::int32_t>("Int32", "material", 1, material);
  xml += "</CellData>\n</Piece></UnstructuredGrid>\n</VTKFile>\n";
  return write_file(file, xml);
}

Result<void> write_pvd(const std::filesystem::path& file, const VtuSeries& series) {
  std::string xml = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n";
  for (std::size_t i = 0; i < series.files.size(); ++i) {
    xml += text("<DataSet timestep=\"", series.times[i], "\" part=\"0\" file=\"", series.files[i], "\"/>\n");
  }
  return write_file(file, xml + "</Collection>\n</VTKFile>\n");
}

}  // namespace crumple::io
