#include "server/scene_convert/event_convert.h"

namespace crumple::scene_convert {

v1::Event to_message(const sim::Event& event) {
  v1::Event message;
  message.set_sequence(event.sequence);
  message.set_step(event.step);
  message.set_time(event.time);
  message.set_kind(static_cast<v1::Event::Kind>(static_cast<int>(event.kind) + 1));  // 0 is "unspecified"
  message.set_body(event.body);
  message.mutable_point()->set_x(event.point.x());
  message.mutable_point()->set_y(event.point.y());
  message.mutable_point()->set_z(event.point.z());
  message.set_magnitude(event.magnitude);
  message.set_count(event.count);
  message.set_fragments(event.fragments);
  message.set_epoch(event.epoch);
  message.set_message(event.message);
  const std::vector<float> numbers = numbers_of(event.particles);
  message.mutable_particles()->Add(numbers.begin(), numbers.end());
  return message;
}

}  // namespace crumple::scene_convert
