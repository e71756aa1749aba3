#pragma once

#include "common/error.h"
#include "common/types.h"
#include "server/sim/command.h"

#include <limits>
#include <string>

// What the gate lets in: the limits of every number that comes from outside, and the checker that names the first
// breach. scene.h repeats them beside the fields.
namespace crumple::sim {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// [low, high], or without an end whose `above` or `below` is set. Infinity is a number only if high is infinite.
struct Range {
  double low = -kInfinity;
  double high = kInfinity;
  bool above = false;  // low itself is out
  bool below = false;  // high itself is out
};

namespace limits {
// world
inline constexpr double kGravity = 1e4;          // |.| [m/s^2]
inline constexpr Range kTimeStep{1e-6, 0.2};     // [s]
inline constexpr Range kReferenceStep{1e-6, 1};  // creep_dt, rate_dt [s]
inline constexpr Range kSubsteps{1, 100};
inline constexpr Range kRigidIterations{1, 10'000};
inline constexpr int kMaxBodies = 10'000;
inline constexpr int kMaxJoints = 10'000;
inline constexpr Range kBearing{0, kInfinity, false, true};  // strength [N], bending [N m]
inline constexpr Range kBreaks{1, 1e6};
inline constexpr Range kJointTime{0, 1};  // [s]
inline constexpr int kMaxScript = 100'000;
inline constexpr int kMaxNameBytes = 256;
// contact
inline constexpr Range kPhi{0, 1e15};           // [N s / m^3]
inline constexpr Range kKappa{0, 1e6};          // [-]
inline constexpr Range kRecoverySteps{1, 1e6};  // [-]
inline constexpr Range kRecoverySpeed{0, 1e3};  // [m/s]
// sleep
inline constexpr Range kSleepSpeed{0, 10};         // [m/s]
inline constexpr Range kSleepTime{0, 1e3};         // [s]
inline constexpr Range kWakeAcceleration{0, 1e6};  // [m/s^2]
// bodies
inline constexpr double kVelocity = 1e4;             // |.| [m/s]
inline constexpr double kAngularVelocity = 1e4;      // |.| [rad/s]
inline constexpr Range kUnit{0, 1};                  // colours, opacity, restitution
inline constexpr Range kDensity{0, 1e6, true};       // [kg/m^3]
inline constexpr Range kMass{0, 1e9};                // [kg]
inline constexpr Range kFriction{0, 10};             // [-]
inline constexpr Range kLength{1e-4, kMaxPosition};  // extents of shapes [m]
inline constexpr Range kTime{0, 1e9};                // [s]
inline constexpr int kMaxKeys = 100'000;             // of one motion
inline constexpr int kMaxMotions = 1'000;            // of one body
inline constexpr int kMaxShapes = 1'000;             // of one body
inline constexpr int kMaxHullPoints = 10'000;
// finite elements
inline constexpr Range kYoung{0, 1e13, true};           // [Pa]
inline constexpr Range kPoisson{0, 0.5, false, true};   // [-]
inline constexpr Range kDampingMass{0, 1e4};            // [1/s]
inline constexpr Range kDampingStiffness{0, 10};        // [s]
inline constexpr Range kYield{0, kInfinity};            // [-]
inline constexpr Range kMaxPlastic{0, 10};              // [-]
inline constexpr Range kToughness{0, kInfinity, true};  // [Pa] or [N]
inline constexpr Range kDust{0, 1e6};                   // [1/m^2]
inline constexpr Range kRigidFragments{0, 1e6};         // [tets]
inline constexpr Range kCount{1, 1e6};                  // fracture_interval, max_splits_per_step
inline constexpr Range kTolerance{1e-14, 0.5};          // [-]
inline constexpr Range kIterations{1, 1e5};
inline constexpr Range kClampLimit{0, 1e9};  // [1/m]
// examples
inline constexpr Range kAlpha{0, 1e9};              // [1/m]
inline constexpr Range kBeta{0, 1e12};              // [N s]
inline constexpr Range kGamma{0, 1e6, true};        // [m]
inline constexpr Range kLambda{0, 1, false, true};  // [-]
inline constexpr Range kRestitutionRate{0, 1e6};    // mu [1/s], nu [-]
inline constexpr Range kGoalTolerance{0, 0.1};      // of the body's size [-]
inline constexpr Range kFatigueTime{0, 1e6};        // [s]
// commands
inline constexpr Range kRadius{0, kMaxPosition};  // [m]
}  // namespace limits

// Goes through a list of rules and keeps the first that is broken; later ones are not looked at.
class FirstBreach {
 public:
  bool ok() const { return result_.has_value(); }
  Result<void> result() const { return result_; }

  void require(bool holds, const std::string& field, const std::string& message);
  void number(double value, const Range& range, const std::string& field);
  // A list's length.
  void count(std::size_t value, std::size_t low, std::size_t high, const std::string& field);
  // Every component finite and |v| <= limit.
  void vector(const Vec3& v, double limit, const std::string& field);
  // Position within kMaxPosition; quaternion of unit length within 1e-6.
  void pose(const Pose& pose, const std::string& field);
  // Another gate's answer.
  void take(const Result<void>& other);

 private:
  Result<void> result_;
};

// "3", "0.5", "1e+13", "nan": as short as it stays exact.
std::string number_text(double value);

}  // namespace crumple::sim
