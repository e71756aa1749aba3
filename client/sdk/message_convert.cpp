#include "client/sdk/message_convert.h"

#include "crumple/v1/error.pb.h"

#include <algorithm>

namespace crumple::client {
namespace {

Vec3 vec3(const v1::Vec3& message) { return {message.x(), message.y(), message.z()}; }

void set(v1::Vec3* message, const Vec3& v) {
  message->set_x(v.x());
  message->set_y(v.y());
  message->set_z(v.z());
}

ErrorCode to_code(grpc::StatusCode code) {
  switch (code) {
    case grpc::INVALID_ARGUMENT:
    case grpc::NOT_FOUND:
    case grpc::ALREADY_EXISTS:
    case grpc::RESOURCE_EXHAUSTED:
    case grpc::FAILED_PRECONDITION:
    case grpc::INTERNAL:
    case grpc::UNAVAILABLE: return static_cast<ErrorCode>(code);
    case grpc::DEADLINE_EXCEEDED:
    case grpc::CANCELLED: return ErrorCode::unavailable;
    default: return ErrorCode::internal;
  }
}

}  // namespace

Error to_error(const grpc::Status& status) {
  Error error{to_code(status.error_code()), "", status.error_message()};
  v1::ErrorStatus details;
  if (status.error_details().empty() || !details.ParseFromString(status.error_details())) return error;
  for (const auto& detail : details.details()) {
    v1::BadRequest request;
    if (!detail.type_url().ends_with("/google.rpc.BadRequest") || !request.ParseFromString(detail.value())) continue;
    if (request.field_violations_size() == 0) continue;
    error.field = request.field_violations(0).field();
    error.message = request.field_violations(0).description();
  }
  return error;
}

WorldStatus from_message(const v1::WorldStatus& message) {
  WorldStatus status;
  status.id = message.world();
  status.name = message.name();
  status.state = static_cast<WorldState>(message.state());
  status.step = message.step();
  status.time = message.time();
  status.dt = message.dt();
  status.real_time_factor = message.real_time_factor();
  status.step_ms = message.step_ms();
  status.dropped_seconds = message.dropped_seconds();
  status.bodies = message.bodies();
  status.asleep = message.asleep();
  status.viewers = message.viewers();
  status.failure = message.failure();
  return status;
}

BodyStatus from_message(const v1::BodyStatus& message) {
  BodyStatus body;
  body.id = message.id();
  body.name = message.name();
  body.model = static_cast<BodyModel>(message.model());
  const v1::Quaternion& q = message.pose().quaternion();
  body.pose = {Quat(q.w(), q.x(), q.y(), q.z()), vec3(message.pose().position())};
  body.velocity = vec3(message.velocity());
  body.asleep = message.asleep();
  return body;
}

StepSummary from_message(const v1::StepResponse& message) {
  StepSummary summary;
  summary.step = message.step();
  summary.time = message.time();
  summary.steps = message.steps();
  summary.wall_ms = message.wall_ms();
  summary.contacts = message.contacts();
  summary.solver_iterations = message.solver_iterations();
  summary.capped_solves = message.capped_solves();
  summary.splits = message.splits();
  summary.plastic_impulses = message.plastic_impulses();
  summary.worst_residual = message.worst_residual();
  summary.worst_penetration = message.worst_penetration();
  summary.state_hash = message.state_hash();
  return summary;
}

WorldEvent from_message(const v1::Event& message) {
  WorldEvent event;
  event.sequence = message.sequence();
  event.step = message.step();
  event.time = message.time();
  event.kind = static_cast<EventKind>(message.kind());
  event.body = message.body();
  event.point = vec3(message.point());
  event.magnitude = message.magnitude();
  event.count = message.count();
  event.fragments = message.fragments();
  event.epoch = message.epoch();
  event.message = message.message();
  event.particles = grains_of(message.particles());
  return event;
}

v1::Event to_message(const WorldEvent& event) {
  v1::Event message;
  message.set_sequence(event.sequence);
  message.set_step(event.step);
  message.set_time(event.time);
  message.set_kind(static_cast<v1::Event::Kind>(event.kind));
  message.set_body(event.body);
  set(message.mutable_point(), event.point);
  message.set_magnitude(event.magnitude);
  message.set_count(event.count);
  message.set_fragments(event.fragments);
  message.set_epoch(event.epoch);
  message.set_message(event.message);
  const std::vector<float> numbers = numbers_of(event.particles);
  message.mutable_particles()->Add(numbers.begin(), numbers.end());
  return message;
}

std::optional<EncodedUpdate> take_update(v1::WatchResponse& message) {
  switch (message.update_case()) {
    case v1::WatchResponse::kTopology: {
      v1::TopologyUpdate& topology = *message.mutable_topology();
      EncodedTopology update{.epoch = topology.epoch(), .part = topology.part(), .parts = std::max(topology.parts(), 1u)};
      if (topology.has_base()) update.base = topology.base();
      update.payload = std::make_shared<const std::string>(std::move(*topology.mutable_payload()));
      return update;
    }
    case v1::WatchResponse::kFrame: {
      v1::FrameUpdate& frame = *message.mutable_frame();
      return EncodedFrame{frame.step(), frame.time(), frame.epoch(), frame.step_ms(), frame.real_time_factor(),
                          std::make_shared<const std::string>(std::move(*frame.mutable_payload()))};
    }
    case v1::WatchResponse::kEvent: return from_message(message.event());
    case v1::WatchResponse::kGap: return EventGap{message.gap().first(), message.gap().last()};
    case v1::WatchResponse::UPDATE_NOT_SET: break;
  }
  return std::nullopt;
}

v1::WatchResponse to_message(const EncodedUpdate& update) {
  v1::WatchResponse message;
  if (const auto* topology = std::get_if<EncodedTopology>(&update)) {
    v1::TopologyUpdate* out = message.mutable_topology();
    out->set_epoch(topology->epoch);
    if (topology->base) out->set_base(*topology->base);
    out->set_part(topology->part);
    out->set_parts(topology->parts);
    out->set_payload(*topology->payload);
  } else if (const auto* frame = std::get_if<EncodedFrame>(&update)) {
    v1::FrameUpdate* out = message.mutable_frame();
    out->set_step(frame->step);
    out->set_time(frame->time);
    out->set_epoch(frame->epoch);
    out->set_step_ms(frame->step_ms);
    out->set_real_time_factor(frame->real_time_factor);
    out->set_payload(*frame->payload);
  } else if (const auto* event = std::get_if<WorldEvent>(&update)) {
    *message.mutable_event() = to_message(*event);
  } else {
    message.mutable_gap()->set_first(std::get<EventGap>(update).first);
    message.mutable_gap()->set_last(std::get<EventGap>(update).last);
  }
  return message;
}

}  // namespace crumple::client
