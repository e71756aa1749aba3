#pragma once

#include "server/sim/mesh/surface_mesh.h"

namespace crumple::sim {

// A graphical surface in pieces that stay whole when the mesh that carries them breaks: "splinters" [Parker & O'Brien 2009,
// section 5]. Best far smaller than a tet.
struct SplinterMesh {
  // Where splinters lie against each other: triangles that nobody sees before one of them is torn away.
  struct Patch {
    int splinter = 0;
    std::vector<int> others;  // that it lies against, one at least
  };

  SurfaceMesh surface;        // no two splinters have a vertex in common
  int count = 0;              // splinters
  std::vector<int> splinter;  // one a vertex, [0, count)
  std::vector<int> patch;     // one a triangle: into `patches`; -1: part of the whole's surface
  std::vector<Patch> patches;
};

// Rejects: what validate rejects in the surface; lists of another length; ids out of range; triangles of several
// splinters, or of another one than their patch; splinters without a vertex.
Result<void> validate(const SplinterMesh& mesh, const std::string& field);

}  // namespace crumple::sim
