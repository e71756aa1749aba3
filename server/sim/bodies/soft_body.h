#pragma once

#include "common/error.h"
#include "server/sim/bodies/piece_ref.h"
#include "server/sim/bodies/rigid_fragment.h"
#include "server/sim/contact/self_contact.h"
#include "server/sim/fem/bdf2.h"
#include "server/sim/fem/elements.h"
#include "server/sim/fem/fem_state.h"
#include "server/sim/fem/warped_factor.h"
#include "server/sim/fracture/fracture_step.h"
#include "server/sim/fracture/fragments.h"
#include "server/sim/linear_solver/multigrid_hierarchy.h"
#include "server/sim/scene.h"
#include "server/sim/state_hash.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace crumple::sim {

struct FractureOutcome {
  int splits = 0;
  Vec3 point = Vec3::Zero();    // of the first split, in W [m]

  void operator+=(const FractureOutcome& later) {
    if (splits == 0) point = later.point;
    splits += later.splits;
  }
};

// What a scene says about all of its finite-element bodies.
struct SoftBodyOptions {
  double dt = 1.0 / 60;  // [s]
  Integrator integrator = Integrator::backward_euler;
  std::optional<bool> float_solver;  // not said: fem::takes_float
  bool watched = true;  // energy() and prescribed_work() will be asked for
};

// A finite-element mesh of a world: rest data, state, and what the stages of a step do to it. Pieces leave it as it breaks, large
// ones as meshes like it, small ones as rigid fragments; arrays of nodes and tets are those of what is left, which may be nothing.
class SoftBody {
 public:
  static Result<SoftBody> make(BodyId id, const BodyDescription& body, const FemModel& model,
                               const SoftBodyOptions& options, const std::string& field);

  BodyId id;                                    // of the scene's body
  int piece = 0;                                // which one of that body's pieces (fem_object.h)
  std::vector<Tet> tets;
  std::vector<Vec3> X;                          // rest positions in the body's axes; grows with splits
  fem::RestBody rest;
  fem::FemState state;
  std::vector<Vec3> v_before;                   // velocities before the last advance() [m/s]; none: not known
  fem::StepSystem system;
  double mean_tet_volume = 0;                   // [m^3]
  linear_solver::MultigridHierarchy hierarchy;  // coarse levels of `system`
  fem::WarpedFactor factor;                     // of `system` at rest
  Eigen::VectorXd impulse;                      // 3n: asked for by commands in this step [N s]
  contact::CollisionMesh collision;
  std::optional<contact::SelfContact> self_contact;  // where the model asks for it
  std::vector<char> fixed;              // one a node: prescribed
  std::vector<RigidFragment> fragments;  // in the order in which they left
  bool frozen = false;

  // Of several the one that says what goes for the whole body (fem/material_region.h).
  const fem::FemMaterial& material() const { return rest.material; }
  int node_count() const { return static_cast<int>(X.size()); }
  bool is_empty() const { return tets.empty(); }
  bool is_whole() const { return whole_; }  // has never split
  int components() const { return static_cast<int>(collision.components.size()); }  // face-connected, without rigid fragments

  // Assembles the body as it is made, so that what a matrix needs once is there before the first step.
  void prepare(const Vec3& gravity, double dt, const ThreadPool& pool);
  void make_factors(double dt, const ThreadPool& pool);  // of the prepared system, for all formulas that steps of dt may have
  // Velocities that take scripted nodes from where they are to their place at time + dt.
  void prescribe(double time, double dt);
  // Something jumps in this step, or in the next if this one is done: it is one of backward Euler, and so is the one after.
  void restart();
  // Also takes in `impulse`, as a force over dt. By the scene's integrator; where that is BDF2, by backward Euler after
  // restart(), in a step with a command, near inversion, and where nothing is remembered.
  void assemble(const Vec3& gravity, double dt, const ThreadPool& pool);
  // Again, for a part h of the step from the present state on, by backward Euler.
  void assemble_part(const Vec3& gravity, double h, const ThreadPool& pool);
  // v := v+, x := x+ of the formula that was assembled; freezes the body where it was if that is not finite. Returns false then.
  bool advance(Eigen::Ref<const Eigen::VectorXd> v_plus, double dt);
  void freeze();
  bool was_rough() const { return was_rough_; }  // its last step was of backward Euler where BDF2 is asked for

  // Islands that sleep; fragments sleep for themselves. Largest |impulse| asked for in this step over the mass of a free node
  // [m/s]; largest velocity that the script asks of a node [m/s]; whether no node is free; a halt, also of what the script
  // asked by rounding.
  double strongest_push() const;
  void forget_pushes();
  double driven_speed() const;
  bool is_kinematic() const;
  void stop();
  // Of a body without a free node, in place of assemble and advance: what is drawn of its stress, and its motion.
  void assemble_kinematic(const ThreadPool& pool);
  void follow_script(double dt);

  // What the guard looks at, after assemble: energies of free nodes and elements before this step [J], and the work done
  // in the last step by commands (so far as advance was called) and, through the elements, by prescribed nodes.
  struct Energy {
    double moving = 0;         // kinetic + elastic
    double gravitational = 0;
  };
  Energy energy(const Vec3& gravity) const;
  int inverted(const ThreadPool& pool) const;  // tets of negative volume; of a body that was assembled in this step
  double command_work() const { return command_work_; }
  double prescribed_work() const { return prescribed_work_; }
  // Of scripts on their nodes in the step that was just done, by the forces at its end and their own mass [J].
  double prescribed_work_now(const Vec3& gravity, double dt) const;
  bool balance_holds() const { return !changed_while_prescribed_; }  // false: driven nodes split
  void begin_account() { command_work_ = 0, changed_while_prescribed_ = false; }
  void use_rotation(bool safe);  // SVD, or what the materials say
  void plastic_flow(double dt, double creep_dt, const ThreadPool& pool);
  // Separation tensors and node splitting (section 5). After a split the topology is another.
  FractureOutcome fracture(std::uint64_t seed, std::uint64_t step, const ThreadPool& pool);
  // The same where v+ would take the body and after what would flow there; positions, velocities and plastic strain stay
  // those of before. `round`: of several in a step.
  // v_ahead: v+; gets the entries of new nodes.
  FractureOutcome fracture_ahead(Eigen::VectorXd& v_ahead, double dt, double creep_dt,
                                 std::uint64_t seed, std::uint64_t step, int round, const ThreadPool& pool);

  // Where nodes and tets of before went when pieces left: with `piece` -1 they stayed, under a new id; else it is which one
  // of those that left, first the fragments, then the meshes.
  struct HandOver {
    int fragments = 0;            // new ones, at the end of `fragments`
    std::vector<SoftBody> meshes;
    std::vector<NodeRef> node;
    std::vector<TetRef> tet;

    int count() const { return fragments + static_cast<int>(meshes.size()); }
  };
  // At the end of a step, elements up to date. Pieces of at most as many tets as the scene says go on as rigid fragments,
  // unless they hang on a prescribed node or are still strained by 10 %; larger ones, but for the largest, as meshes, and small
  // ones that may not leave as rigid ones together as one: the islands of Parker & O'Brien 2009, section 4, dissolve when they
  // break. What has a node in common stays together.
  HandOver hand_over(const ThreadPool& pool);

  void push(const Vec3& impulse_W, int node);   // to be taken in by the next step [N s]

  // Fragments included.
  double mass() const;                          // [kg]
  Vec3 mass_moment() const;                     // sum of m x [kg m]
  Vec3 centre_of_mass() const { return mass_moment() / mass(); }
  Vec3 momentum() const;

  std::vector<double> von_mises() const;        // one a tet [Pa]
  std::vector<float> node_values() const;       // stress as it is drawn, in [0, 1]
  void hash(StateHash& hash) const;

 private:
  // Nodes that follow keys; no keys: held. `at_start`: where each was at t = 0, in W.
  struct DrivenNodes {
    NodeMotion motion;
    std::vector<Vec3> at_start;
  };
  void follow_tets();                  // what the solve and contact need of the tets
  void follow_mesh(contact::CollisionMesh mesh);
  bool is_near_rest(int t) const;
  struct Leaving {
    std::vector<int> as;         // by component: which one of those that leave, -1: it stays
    int fragments = 0, meshes = 0;
  };
  Leaving leaving(const fracture::Fragments& components);
  struct Part {
    std::vector<int> components, tets, nodes;  // of before, ascending
  };
  RigidFragment::Piece rigid_part(const Part& own, const HandOver& moved) const;
  SoftBody mesh_part(const Part& own) const;
  void keep_part(const Part& own);
  void follow_parting(const HandOver& moved, int piece, const std::vector<Mat3>& strain, std::span<const int> own_tets,
                      contact::CollisionMesh mesh);
  void choose_formula(double dt, const ThreadPool& pool);
  void assemble_backward_euler(const Vec3& gravity, double h, const ThreadPool& pool);
  const Eigen::VectorXd& external_force(const Vec3& gravity);  // 3n, gravity and commands [N]; until the next call
  void measure(double dt);
  fem::Elements elements_now() const;  // at state.x
  bool may_break(std::uint64_t step) const;
  struct Parted {
    std::vector<int> node_origin;     // of new nodes
    std::vector<int> element_before;  // fem::follow_topology's
  };
  Parted split_nodes(std::uint64_t seed, std::uint64_t step, const ThreadPool& pool, FractureOutcome& outcome);
  std::vector<int> follow_topology();  // fem's; elements are of before

  Pose pose_at_start_;
  std::vector<DrivenNodes> driven_;
  std::vector<fem::PrescribedNode> prescribed_, prescribed_before_;
  bool changed_while_prescribed_ = false;
  Eigen::VectorXd command_force_;               // 3n [N]; empty: none in this step
  Eigen::VectorXd external_force_;              // scratch
  double command_work_ = 0;                     // [J]
  bool pushed_ = false;                         // `impulse` is not zero
  double elastic_ = 0, prescribed_work_ = 0;    // of measure() [J]
  SoftBodyOptions options_;
  bool elements_at_state_ = true;               // false: `system.elements` are those of a formula's positions
  bool was_rough_ = false;
  fem::Bdf2Scratch bdf2_;
  std::vector<fem::RotationRule> material_rotation_;  // one a material
  std::vector<double> tet_mass_;
  std::vector<double> value_scale_;             // one a material: stress drawn as 1 [Pa]
  std::vector<Vec3> x_before_;                  // scratch: positions before the step
  std::vector<Vec3> x_kept_, v_kept_;           // scratch of fracture_ahead: the state that it looks ahead from
  std::vector<Mat3> plastic_strain_kept_;
  bool whole_ = true;
  int rigid_fragment_tets_ = 0;                 // largest piece that leaves as a rigid one
  bool may_part_ = false;                       // some piece may leave, now or when it has calmed down
  bool whole_ahead_ = false;                    // fracture_ahead found nothing at the end of this step
  NodeStars stars_;                             // of a body that can break
  fracture::FractureScratch fracture_scratch_;
};

}  // namespace crumple::sim
