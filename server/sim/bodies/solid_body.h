#pragma once

#include "common/error.h"
#include "common/frame.h"
#include "server/sim/contact/collision_mesh.h"
#include "server/sim/contact/detect.h"
#include "server/sim/rigid/rigid_world.h"
#include "server/sim/scene.h"

#include <string>
#include <vector>

namespace crumple::sim {

// One rigid body of a world: its part in RigidWorld, and the proxy tets that soft bodies meet.
struct SolidBody {
  BodyId id;
  RigidModel model;
  TetMesh proxy;                                // body axes; empty for planes
  contact::CollisionMesh collision;
  std::vector<contact::CollisionPlane> planes;  // in W; fixed bodies only
  std::vector<Vec3> x;                          // proxy nodes in W [m]

  // Adds the body to `rigid`.
  static Result<SolidBody> make(BodyId id, const BodyDescription& body, const RigidModel& model, RigidWorld& rigid,
                                const std::string& field);
  void follow(const Pose& X_WB);                // x from the pose
  BodyTopology topology(const BodyDescription& body, double plane_reach) const;  // see draw_mesh
};

}  // namespace crumple::sim
