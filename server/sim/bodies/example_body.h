#pragma once

#include "common/error.h"
#include "common/frame.h"
#include "server/sim/contact/collision_mesh.h"
#include "server/sim/example_based/deform.h"
#include "server/sim/example_based/impulse_site.h"
#include "server/sim/rigid/rigid_world.h"
#include "server/sim/scene.h"
#include "server/sim/state_hash.h"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace crumple::sim {

struct DentOutcome {
  bool finite = true;          // false: the shape is put back to that of the last collision shape and held
  int plastic = 0;             // impulses above beta
  double strongest = 0;        // of them [N s]
  Vec3 point = Vec3::Zero();   // where the strongest acted, in W [m]
};

// What bodies of one asset share: made once, and in the caches once.
class SharedRests {
 public:
  std::shared_ptr<const example_based::ExampleRest> of(const std::shared_ptr<const example_based::ExampleSet>& set);

 private:
  std::map<std::shared_ptr<const example_based::ExampleSet>, std::shared_ptr<const example_based::ExampleRest>> rests_;
};

// One example-based body of a world: a rigid body whose shape follows the impulses it takes (Jones et al. 2016).
class ExampleBody {
 public:
  // Adds the body to `rigid`.
  static Result<ExampleBody> make(BodyId id, const BodyDescription& body, const ExampleModel& model, RigidWorld& rigid,
                                  const std::string& field, SharedRests& shared);

  BodyId id;
  double friction = 0.5;
  const example_based::ExampleRest& rest() const { return *rest_; }
  example_based::ExampleState state;
  TetMesh proxy;                       // fans of the convex parts' hulls, body axes: what soft bodies meet
  contact::CollisionMesh collision;
  std::vector<Vec3> x;                 // proxy nodes in W [m]
  // Nothing in the world but rigid bodies meets it: the proxy then follows only when the shape has come to rest.
  bool meets_only_rigid = false;

  void follow(const Pose& X_WB);       // x from the pose
  void set_parameters(const SetExampleParameters& changed);
  // An impulse of this step, from Bullet, from soft contact or from a command; both in body axes.
  void strike(const Vec3& point_B, const Vec3& impulse_B) { strikes_.push_back({point_B, impulse_B}); }
  // Sections 3.2 and 3.3: impulses into example weights, shape and restitution. Touches nothing but this body, so that
  // bodies may deform side by side; `settle` then hands over to `rigid`.
  void deform(double dt, double rate_dt, const ThreadPool& pool);
  DentOutcome settle(RigidWorld& rigid);
  // From now on `deform` notes where its time goes.
  void set_clock(double (*now_ms)()) { work_.now_ms = now_ms; }
  const example_based::ExampleTimes& times() const { return work_.times; }  // of the last `deform`
  // Without other impulses than it has now neither shape nor restitution would change any more.
  bool is_settled() const;

  BodyTopology topology(const BodyDescription& body) const;
  void capture(const Pose& X_WB, bool with_values, BodyFrame& frame) const;
  void hash(StateHash& hash) const;

 private:
  DeformableShape shape() const;       // convex parts, the surface as triangles, or every tet
  MassProperties mass_properties() const;
  void make_proxy();
  bool shape_is_due() const;
  void hold();

  std::shared_ptr<const example_based::ExampleRest> rest_;
  example_based::ExampleParameters parameters_;
  double mass_ = 0;                    // [kg], constant
  double shape_lag_ = 0;               // [m] what a vertex may move before collision shape and mass follow
  std::vector<Vec3> shape_x_;          // state.x that they were taken from
  bool shape_follows_ = true;          // they are of state.x itself
  bool held_ = false;                  // went out of range: does not deform any more
  std::optional<PreparedShape> next_shape_;             // from deform to settle
  std::vector<example_based::PointImpulse> strikes_;
  std::vector<example_based::VertexImpulse> impulses_;  // scratch
  example_based::SurfaceTree::Boxes boxes_;             // scratch
  example_based::ExampleWorkspace work_;
};

}  // namespace crumple::sim
