#pragma once

#include "common/error.h"
#include "server/sim/example_based/example_set.h"
#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/mesh/tet_mesh.h"

#include <string>

namespace crumple::scene_convert {

// Where the meshes come from that a scene names instead of containing. Errors leave `field` empty; the conversion
// puts the path of the naming field there. What is returned has passed its validate().
class MeshSource {
 public:
  virtual ~MeshSource() = default;
  virtual Result<sim::SurfaceMesh> surface(const std::string& name) const = 0;
  virtual Result<sim::TetMesh> tets(const std::string& name) const = 0;
  virtual Result<sim::example_based::ExampleSet> examples(const std::string& name) const = 0;
};

// For calls: every name is an error.
class NoFiles final : public MeshSource {
 public:
  Result<sim::SurfaceMesh> surface(const std::string& name) const override;
  Result<sim::TetMesh> tets(const std::string& name) const override;
  Result<sim::example_based::ExampleSet> examples(const std::string& name) const override;
};

}  // namespace crumple::scene_convert
