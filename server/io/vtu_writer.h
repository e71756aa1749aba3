#pragma once

#include "common/error.h"
#include "server/sim/world.h"

#include <filesystem>
#include <string>
#include <vector>

namespace crumple::io {

// One finite-element body at one time as a VTK unstructured grid (.vtu, little-endian, base64): points in W [m], tets,
// and per tet von Mises stress [Pa], |eps^P| [-] and the material (0: the body's, k: of region k - 1), per node velocity
// [m/s]. ParaView and meshio read it.
Result<void> write_vtu(const std::filesystem::path& file, const sim::FemView& body);

// The time series of one body: a .pvd that names the .vtu files, relative to itself.
struct VtuSeries {
  std::vector<double> times;        // [s]
  std::vector<std::string> files;
};
Result<void> write_pvd(const std::filesystem::path& file, const VtuSeries& series);

}  // namespace crumple::io
