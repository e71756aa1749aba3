#pragma once

#include "server/sim/example_based/example_set.h"
#include "server/sim/fem/fem_material.h"
#include "server/sim/linear_solver/conjugate_gradient.h"
#include "server/sim/scene.h"

#include <string>
#include <vector>

// What is compared: one table (method.cpp). A new element, rotation rule, integrator, solver, contact law or example
// option is one more row of it; checks and maps take it up by its family.
namespace crumple::lab::stability {

class SoftTrial;
class ContactTrial;

enum class Family {
  fem,      // element, rotation rule, integrator and solver of one body
  contact,  // bodies on each other
  plasticity,
  fracture,
  example,  // example-based deformation
  shape,    // collision shape of a rigid or example-based body
  world     // the core as it stands: one method
};

enum class Standing {
  offered,    // a scene can ask for it
  paper,      // raw form of one of the papers; may be offered as well
  comparison  // exists in the lab only, to show why it was not chosen
};

class StepTimes;

struct FemMethod {
  Mat3 (*rotation)(const Mat3& F) = nullptr;
  void (*choose)(sim::fem::FemMaterial& material) = nullptr;  // null: the material as it is
  bool float_matrix = false;
  bool iterates = true;                                                            // has an iteration cap
  sim::linear_solver::SolverKind solver = sim::linear_solver::SolverKind::jacobi;  // of a world that steps like it
  sim::linear_solver::SolveReport (*step)(SoftTrial& trial, double dt) = nullptr;
  StepTimes* times = nullptr;  // takes the processor times of a trial's steps; null: nobody asks
  sim::Integrator integrator = sim::Integrator::backward_euler;  // that `step` goes by: what its decay is held to
  sim::fem::ElementKind element = sim::fem::ElementKind::linear_tetrahedra;
};

struct ContactMethod {
  sim::ContactSettings settings;
  bool rigid = false;                                           // blocks are rigid boxes
  bool guarded = false;                                         // with the running server's guard
  void (*material)(sim::fem::FemMaterial& material) = nullptr;  // of soft blocks; null: as it is
  void (*push)(ContactTrial& trial) = nullptr;                  // explicit forces before each step; null: none
  StepTimes* times = nullptr;
  sim::Integrator integrator = sim::Integrator::backward_euler;
  sim::fem::ElementKind element = sim::fem::ElementKind::linear_tetrahedra;  // of soft blocks
};

struct ExampleMethod {
  sim::example_based::ExampleParameters::Step step = sim::example_based::ExampleParameters::Step::equation8;
  bool raw_rates = false;
  bool aligned = true;  // QLERP's signs; the core always aligns, the lab undoes it
};

struct Method {
  std::string key;   // in files: short, no comma
  std::string name;  // for people
  Family family = Family::world;
  Standing standing = Standing::offered;
  bool mapped = false;  // drawn in the heat maps of its family
  // Plasticity: how bodies step, the default where it has no `step`; fracture: its integrator and element.
  FemMethod fem;
  ContactMethod contact;
  bool raw = false;  // plasticity: creep per update; fracture: toughness in newtons
  sim::fem::FlowRule flow = sim::fem::FlowRule::additive;  // plasticity
  ExampleMethod example;
  bool triangles = false;  // shape: triangle mesh instead of convex parts
  StepTimes* times = nullptr;

  // The method with somebody who asks how long steps take.
  Method timed(StepTimes& to) const;
};

const std::vector<Method>& all_methods();
std::vector<const Method*> methods_of(Family family);
const Method* find_method(const std::string& key);  // null if there is none
const char* name_of(Standing standing);

}  // namespace crumple::lab::stability
