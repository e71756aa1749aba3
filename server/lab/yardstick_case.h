#pragma once

#include "common/error.h"
#include "server/sim/fem/rest_body.h"
#include "server/sim/mesh/tet_mesh.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

// A case of a reference collection: a folder with case.json (material, runs) and level files (mesh, supports, loads).
namespace crumple::lab {

using Json = nlohmann::json;

struct Dirichlet {
  int node;
  int dof;       // 0..2
  double value;  // displacement [m]
};

struct Level {
  sim::TetMesh mesh;
  std::vector<Dirichlet> dirichlet;
  Eigen::VectorXd loads;             // 3n, dead forces [N]
  std::vector<Vec3> initial_velocity;  // one a node, or empty [m/s]
  int tip = -1;                      // sets.tip[0], or -1

  // One a dof: has a Dirichlet row.
  std::vector<char> fixed_dofs() const;
};

struct Material {
  double young = 0;    // [Pa]
  double poisson = 0;  // [-]
  double density = 0;  // [kg/m^3]
  sim::fem::ElementKind element = sim::fem::ElementKind::linear_tetrahedra;
};

// What the caller may set instead of the case's material.
struct MaterialOverride {
  std::optional<double> young, poisson;
  sim::fem::ElementKind element = sim::fem::ElementKind::linear_tetrahedra;
};

// A dynamic run of case.json.
struct Run {
  std::string level;
  bool corotational = true;
  bool loads = false;
  Vec3 gravity = Vec3::Zero();         // [m/s^2]
  double end = 0;                      // [s]
  std::vector<double> snapshots;       // [s]
};

// Errors name file and field: a missing file, JSON that does not parse, a missing or wrong field, ids out of range.
Result<Json> read_json(const std::filesystem::path& file);
Result<Level> read_level(const std::filesystem::path& case_dir, const std::string& level);
Result<Material> read_material(const std::filesystem::path& case_dir, const MaterialOverride& override);
Result<Run> read_run(const std::filesystem::path& case_dir, const std::string& name);

// A level made of a material. The references know no clamped basis matrices: neither has this body. Errors: those of
// make_rest_body.
Result<sim::fem::RestBody> rest_body(const Level& level, const Material& material);

}  // namespace crumple::lab
