#include "server/grpc/convert.h"

#include "crumple/v1/error.pb.h"

namespace crumple::grpc_server {
namespace {

void set(v1::Vec3* message, const Vec3& v) {
  message->set_x(v.x());
  message->set_y(v.y());
  message->set_z(v.z());
}

}  // namespace

grpc::Status to_status(const Error& error) {
  const auto code = static_cast<grpc::StatusCode>(error.code);
  if (error.field.empty()) return {code, error.message};
  v1::BadRequest request;
  auto* violation = request.add_field_violations();
  violation->set_field(error.field);
  violation->set_description(error.message);
  v1::ErrorStatus status;
  status.set_code(code);
  status.set_message(error.text());
  auto* detail = status.add_details();
  detail->set_type_url("type.googleapis.com/google.rpc.BadRequest");
  detail->set_value(request.SerializeAsString());
  return {code, error.text(), status.SerializeAsString()};
}

Error within(const std::string& prefix, Error error) {
  const bool joined = error.field.empty() || error.field.front() == '[';
  error.field = prefix + (joined ? "" : ".") + error.field;
  return error;
}

v1::WorldStatus to_message(const WorldStatus& status) {
  v1::WorldStatus message;
  message.set_world(status.id);
  message.set_name(status.name);
  message.set_state(static_cast<v1::WorldStatus::State>(status.state));
  message.set_step(status.step);
  message.set_time(status.time);
  message.set_dt(status.dt);
  message.set_real_time_factor(status.real_time_factor);
  message.set_step_ms(status.step_ms);
  message.set_dropped_seconds(status.dropped_seconds);
  message.set_bodies(status.bodies);
  message.set_asleep(status.asleep);
  message.set_viewers(status.viewers);
  message.set_failure(status.failure);
  return message;
}

v1::BodyStatus to_message(const BodyStatus& body) {
  v1::BodyStatus message;
  message.set_id(body.id);
  message.set_name(body.name);
  message.set_model(static_cast<v1::BodyStatus::Model>(body.model));
  set(message.mutable_pose()->mutable_position(), body.pose.p_WB);
  v1::Quaternion* q = message.mutable_pose()->mutable_quaternion();
  q->set_w(body.pose.R_WB.w());
  q->set_x(body.pose.R_WB.x());
  q->set_y(body.pose.R_WB.y());
  q->set_z(body.pose.R_WB.z());
  set(message.mutable_velocity(), body.velocity);
  message.set_asleep(body.asleep);
  return message;
}

v1::StepResponse to_message(const StepSummary& summary) {
  v1::StepResponse message;
  message.set_step(summary.step);
  message.set_time(summary.time);
  message.set_steps(summary.steps);
  message.set_wall_ms(summary.wall_ms);
  message.set_contacts(summary.contacts);
  message.set_solver_iterations(summary.solver_iterations);
  message.set_capped_solves(summary.capped_solves);
  message.set_splits(summary.splits);
  message.set_plastic_impulses(summary.plastic_impulses);
  message.set_worst_residual(summary.worst_residual);
  message.set_worst_penetration(summary.worst_penetration);
  message.set_state_hash(summary.state_hash);
  return message;
}

}  // namespace crumple::grpc_server
