#include "server/io/gltf_export.h"

#include "common/text.h"
#include "server/authoring/painted_regions.h"
#include "server/io/gltf_component.h"
#include "server/io/gltf_document.h"
#include "server/sim/mesh/embedding.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace crumple::io {
namespace {

using sim::example_based::BoneTransform;
using sim::example_based::ExampleSet;
using sim::example_based::Handle;

enum Target { kNone = 0, kVertices = 34962, kIndices = 34963 };

// The document and its one buffer.
class Writer {
 public:
  Json document{{"asset", {{"version", "2.0"}, {"generator", "crumple-rig"}}},
                {"accessors", Json::array()},
                {"bufferViews", Json::array()}};

  // items: one column an item. Returns the accessor's id.
  template <class T>
  int add(const Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>& items, int component_type, Target target,
          bool with_bounds = false) {
    static constexpr const char* kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const auto bytes = static_cast<std::size_t>(items.size()) * sizeof(T);
    Json view{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes}};
    if (target != kNone) view["target"] = static_cast<int>(target);
    document["bufferViews"].push_back(view);
    Json accessor{{"bufferView", document["bufferViews"].size() - 1},
                  {"componentType", component_type},
                  {"count", items.cols()},
                  {"type", items.rows() == 16 ? "MAT4" : kTypes[items.rows()]}};
    if (with_bounds)
      for (Eigen::Index k = 0; k < items.rows(); ++k) {
        accessor["min"].push_back(items.row(k).minCoeff());
        accessor["max"].push_back(items.row(k).maxCoeff());
      }
    document["accessors"].push_back(accessor);
    binary_.append(reinterpret_cast<const char*>(items.data()), bytes);
    binary_.resize((binary_.size() + 3) / 4 * 4);
    return static_cast<int>(document["accessors"].size()) - 1;
  }

  std::string bytes() {
    document["buffers"] = {{{"byteLength", binary_.size()}}};
    std::string json = document.dump(-1, ' ', false, Json::error_handler_t::replace);
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    append(out, 2);
    append(out, 28 + json.size() + binary_.size());
    append(out, json.size());
    out += "JSON" + json;
    append(out, binary_.size());
    out += std::string("BIN\0", 4) + binary_;
    return out;
  }

 private:
  static void append(std::string& out, std::size_t value) {
    const auto small = static_cast<std::uint32_t>(value);
    out.append(reinterpret_cast<const char*>(&small),
               sizeof small);  // little-endian, as the machines that we build for
  }

  std::string binary_;
};

using MatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic>;
using MatrixX16 = Eigen::Matrix<std::uint16_t, Eigen::Dynamic, Eigen::Dynamic>;
using MatrixX32 = Eigen::Matrix<std::uint32_t, Eigen::Dynamic, Eigen::Dynamic>;

MatrixXf columns(const std::vector<Vec3>& x) {
  MatrixXf out(3, static_cast<Eigen::Index>(x.size()));
  for (std::size_t i = 0; i < x.size(); ++i) out.col(static_cast<Eigen::Index>(i)) = x[i].cast<float>();
  return out;
}

// Of the nodes' values (one row a node) at the drawn vertices, one row a vertex; shares of a tet outside of it count as
// 0.
Eigen::MatrixXd at_vertices(const ExampleSet& set, const sim::Embedding& embedding, const Eigen::MatrixXd& at_nodes) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(embedding.tet.size()), at_nodes.cols());
  for (std::size_t v = 0; v < embedding.tet.size(); ++v) {
    const Eigen::Vector4d share = embedding.weights[v].cwiseMax(0) / embedding.weights[v].cwiseMax(0).sum();
    for (int k = 0; k < 4; ++k)
      out.row(static_cast<Eigen::Index>(v)) +=
          share[k] * at_nodes.row(set.mesh.tets[static_cast<std::size_t>(embedding.tet[v])][k]);
  }
  return out;
}

// The bones' own handles, or the means of the nodes they move.
std::vector<Handle> handles_of(const ExampleSet& set) {
  if (!set.handles.empty()) return set.handles;
  std::vector<Handle> out;
  for (int b = 0; b < set.bone_count(); ++b) {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < set.vertex_count(); ++i) sum += set.W(i, b) * set.mesh.X[static_cast<std::size_t>(i)];
    out.push_back({text("bone ", b), sum / std::max(set.W.col(b).sum(), 1e-12)});
  }
  return out;
}

void add_weights(const Eigen::MatrixXd& W, Writer& writer, Json& attributes, std::vector<std::string>& notes) {
  const Eigen::Index V = W.rows();
  const int sets = W.cols() > 4 ? 2 : 1, kept = std::min<int>(4 * sets, static_cast<int>(W.cols()));
  MatrixX16 joints[2] = {MatrixX16::Zero(4, V), MatrixX16::Zero(4, V)};
  MatrixXf weights[2] = {MatrixXf::Zero(4, V), MatrixXf::Zero(4, V)};
  double lost = 0;
  std::vector<int> order(static_cast<std::size_t>(W.cols()));
  for (Eigen::Index v = 0; v < V; ++v) {
    std::iota(order.begin(), order.end(), 0);
    std::partial_sort(order.begin(), order.begin() + kept, order.end(),
                      [&](int a, int b) { return W(v, a) != W(v, b) ? W(v, a) > W(v, b) : a < b; });
    double sum = 0;
    for (int k = 0; k < kept; ++k) sum += std::max(W(v, order[k]), 0.0);
    lost = std::max(lost, 1 - sum / W.row(v).cwiseMax(0).sum());
    for (int k = 0; k < kept; ++k) {
      const auto weight = static_cast<float>(W(v, order[k]) / sum);
      if (!(weight > 0)) continue;
      joints[k / 4](k % 4, v) = static_cast<std::uint16_t>(order[k]);
      weights[k / 4](k % 4, v) = weight;
    }
  }
  for (int s = 0; s < sets; ++s) {
    attributes[text("JOINTS_", s)] = writer.add(joints[s], kUnsignedShort, kVertices);
    attributes[text("WEIGHTS_", s)] = writer.add(weights[s], kFloat, kVertices);
  }
  if (lost > 0.01)
    notes.push_back(text("the eight largest weights of a vertex leave out up to ", 100 * lost, " % of it"));
}

void add_colours(const ExampleSet& set, const sim::Embedding& embedding, Writer& writer, Json& attributes,
                 std::vector<std::string>& notes) {
  if (set.alpha_scale.empty() && set.beta_scale.empty()) return;
  Eigen::MatrixXd channels = Eigen::MatrixXd::Constant(set.vertex_count(), 2, 0.5);
  bool outside = false;
  const auto fill = [&](const std::vector<double>& scale, int column) {
    for (std::size_t i = 0; i < scale.size(); ++i) {
      channels(static_cast<Eigen::Index>(i), column) = authoring::region_channel(scale[i]);
      outside = outside || std::abs(authoring::region_scale(channels(static_cast<Eigen::Index>(i), column)) -
                                    scale[i]) > 1e-6 * scale[i] + 1e-12;
    }
  };
  fill(set.alpha_scale, 0);
  fill(set.beta_scale, 1);
  if (outside) notes.push_back("regions weaker or stronger than 16 times are written as 16 times");
  const Eigen::MatrixXd at = at_vertices(set, embedding, channels);
  MatrixXf colours(4, at.rows());
  colours.row(0) = at.col(0).transpose().cast<float>();
  colours.row(1).setConstant(0.5f);
  colours.row(2) = at.col(1).transpose().cast<float>();
  colours.row(3).setOnes();
  attributes["COLOR_0"] = writer.add(colours, kFloat, kVertices);
}

// Nodes 0 .. B - 1 are the joints.
void add_animations(const ExampleSet& set, const std::vector<Handle>& handles, Writer& writer) {
  MatrixXf zero(1, 1);
  zero(0, 0) = 0;
  int time = -1;
  for (std::size_t e = 1; e < set.examples.size(); ++e) {
    if (time < 0) time = writer.add(zero, kFloat, kNone, true);
    Json animation{{"name", set.examples[e].name}, {"channels", Json::array()}, {"samplers", Json::array()}};
    for (int b = 0; b < set.bone_count(); ++b) {
      const BoneTransform& T = set.examples[e].bones[static_cast<std::size_t>(b)];
      const Quat q = T.q.normalized();
      const MatrixXf place = (q * handles[static_cast<std::size_t>(b)].position + T.t).cast<float>();
      const MatrixXf turn = q.coeffs().cast<float>();  // x, y, z, w in both
      for (const auto& [path, key] : {std::pair("translation", &place), {"rotation", &turn}}) {
        animation["channels"].push_back(
            {{"sampler", animation["samplers"].size()}, {"target", {{"node", b}, {"path", path}}}});
        animation["samplers"].push_back(
            {{"input", time}, {"output", writer.add(*key, kFloat, kNone)}, {"interpolation", "STEP"}});
      }
    }
    writer.document["animations"].push_back(animation);
  }
}

}  // namespace

Result<std::string> gltf_of(const ExampleSet& set, std::vector<std::string>& notes) {
  sim::SurfaceMesh surface = set.render;
  if (surface.triangles.empty()) {
    surface.vertices = set.mesh.X;
    for (const auto& face : sim::surface_faces(set.mesh.tets)) surface.triangles.push_back(face.nodes);
  }
  if (surface.triangles.empty() || set.bone_count() < 1)
    return invalid("asset", "has no triangle or no bone, must have both");
  const sim::Embedding embedding = sim::embed(surface.vertices, set.mesh);
  const std::vector<Handle> handles = handles_of(set);

  Writer writer;
  Json attributes{{"POSITION", writer.add(columns(surface.vertices), kFloat, kVertices, true)}};
  add_weights(at_vertices(set, embedding, set.W), writer, attributes, notes);
  add_colours(set, embedding, writer, attributes, notes);
  MatrixX32 indices(1, static_cast<Eigen::Index>(3 * surface.triangles.size()));
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      indices(0, static_cast<Eigen::Index>(3 * t + static_cast<std::size_t>(k))) =
          static_cast<std::uint32_t>(surface.triangles[t][k]);
  const int triangles = writer.add(indices, kUnsignedInt, kIndices);
  writer.document["meshes"] = {
      {{"name", "surface"}, {"primitives", {{{"attributes", attributes}, {"indices", triangles}}}}}};

  const int B = set.bone_count();
  MatrixXf bind = MatrixXf::Zero(16, B);
  Json nodes = Json::array(), joints = Json::array();
  for (int b = 0; b < B; ++b) {
    const Vec3f p = handles[static_cast<std::size_t>(b)].position.cast<float>();
    for (int k = 0; k < 4; ++k) bind(5 * k, b) = 1;
    bind.col(b).segment<3>(12) = -p;
    nodes.push_back({{"name", handles[static_cast<std::size_t>(b)].name}, {"translation", {p.x(), p.y(), p.z()}}});
    joints.push_back(b);
  }
  Json children = joints;
  children.push_back(B);
  nodes.push_back({{"name", "surface"}, {"mesh", 0}, {"skin", 0}});
  nodes.push_back({{"name", "rig"}, {"children", children}});
  writer.document["nodes"] = nodes;
  writer.document["skins"] = {{{"joints", joints}, {"inverseBindMatrices", writer.add(bind, kFloat, kNone)}}};
  writer.document["scenes"] = {{{"nodes", {B + 1}}}};
  writer.document["scene"] = 0;
  add_animations(set, handles, writer);
  return writer.bytes();
}

}  // namespace crumple::io
