#include "client/cli/commands.h"

#include <filesystem>
#include <iomanip>
#include <ostream>
#include <sstream>

#include "client/sdk/message_file.h"

namespace crumple::cli {
namespace {

const char* to_text(WorldState state) {
  switch (state) {
    case WorldState::paused: return "paused";
    case WorldState::playing: return "playing";
    case WorldState::stepping: return "stepping";
    case WorldState::failed: return "failed";
  }
  return "unknown";
}

const char* to_text(BodyModel model) {
  switch (model) {
    case BodyModel::rigid: return "rigid";
    case BodyModel::fixed: return "fixed";
    case BodyModel::fem: return "fem";
    case BodyModel::example_based: return "example";
  }
  return "unknown";
}

std::string hash_text(std::uint64_t hash) {
  std::ostringstream out;
  out << std::hex << std::setw(16) << std::setfill('0') << hash;
  return out.str();
}

void print_status(const WorldStatus& world, std::ostream& out) {
  out << "world " << world.id << "  " << world.name << "  " << to_text(world.state) << "  step " << world.step
      << "  time " << world.time << " s  factor " << world.real_time_factor << "  step time " << world.step_ms
      << " ms  bodies " << world.bodies << "  asleep " << world.asleep << "  viewers " << world.viewers;
  if (!world.failure.empty()) out << "  failure: " << world.failure;
  out << '\n';
}

// An error of this side.
std::unexpected<Failure> own(const Error& error) { return std::unexpected(Failure(error, kUsage)); }

// Hands an error of the server on, or uses the value.
template <class T, class Use>
Outcome with(const Result<T>& result, Use use) {
  if (!result) return std::unexpected(result.error());
  use(*result);
  return {};
}

std::expected<WorldId, Failure> create_world(SimulationClient& client, const Options& options) {
  std::error_code ignored;
  if (options.on_server || !std::filesystem::is_regular_file(options.scene, ignored))
    return client.create_world_from_file(options.scene, options.name);
  const Result<v1::Scene> scene = client::read_scene_message(options.scene);
  if (!scene) return own(scene.error());
  return client.create_world(*scene, options.name);
}

}  // namespace

Result<Vec3> parse_vec3(const std::string& text, const std::string& field) {
  std::istringstream in(text);
  Vec3 v;
  char comma1 = 0, comma2 = 0;
  in >> v.x() >> comma1 >> v.y() >> comma2 >> v.z();
  if (in.fail() || comma1 != ',' || comma2 != ',' || in.peek() != std::istringstream::traits_type::eof())
    return invalid(field, "is \"" + text + "\", must be three numbers x,y,z");
  return v;
}

Outcome create(SimulationClient& client, const Options& options, std::ostream& out) {
  const auto world = create_world(client, options);
  if (!world) return std::unexpected(world.error());
  out << *world << '\n';
  if (options.play) return client.play(*world);
  return {};
}

Outcome scenes(SimulationClient& client, const Options&, std::ostream& out) {
  return with(client.list_scenes(), [&](const auto& names) {
    for (const std::string& name : names) out << name << '\n';
  });
}

Outcome list(SimulationClient& client, const Options&, std::ostream& out) {
  return with(client.list_worlds(), [&](const auto& worlds) {
    for (const WorldStatus& world : worlds) print_status(world, out);
  });
}

Outcome info(SimulationClient& client, const Options& options, std::ostream& out) {
  return with(client.world(options.world, /*bodies=*/true), [&](const WorldInfo& info) {
    print_status(info.status, out);
    for (const BodyStatus& body : info.bodies) {
      const Vec3& p = body.pose.p_WB;
      const Vec3& v = body.velocity;
      out << "body " << body.id << "  " << body.name << "  " << to_text(body.model) << "  at " << p.x() << ',' << p.y()
          << ',' << p.z() << " m  velocity " << v.x() << ',' << v.y() << ',' << v.z() << " m/s" << (body.asleep ? "  asleep" : "") << '\n';
    }
  });
}

Outcome remove(SimulationClient& client, const Options& options, std::ostream&) {
  return client.delete_world(options.world);
}

Outcome play(SimulationClient& client, const Options& options, std::ostream&) {
  return client.play(options.world, options.speed);
}

Outcome pause(SimulationClient& client, const Options& options, std::ostream& out) {
  return with(client.pause(options.world), [&](std::uint64_t step) { out << "step " << step << '\n'; });
}

Outcome step(SimulationClient& client, const Options& options, std::ostream& out) {
  return with(client.step(options.world, options.steps, options.hash), [&](const StepSummary& sum) {
    out << "step " << sum.step << "  time " << sum.time << " s  took " << sum.steps << " steps in " << sum.wall_ms
        << " ms  contacts " << sum.contacts << "  splits " << sum.splits << "  dents " << sum.plastic_impulses;
    if (sum.capped_solves > 0) out << "  capped solves " << sum.capped_solves << " (residual " << sum.worst_residual << ')';
    out << '\n';
    if (options.hash) out << "hash " << hash_text(sum.state_hash) << '\n';
  });
}

Outcome push(SimulationClient& client, const Options& options, std::ostream& out) {
  if (options.impulse.empty() == options.force.empty()) return own({ErrorCode::invalid_argument, "", "give either --impulse or --force"});
  const bool is_impulse = options.force.empty();
  const Result<Vec3> vector = parse_vec3(is_impulse ? options.impulse : options.force, is_impulse ? "--impulse" : "--force");
  if (!vector) return own(vector.error());
  const Result<Vec3> at = parse_vec3(options.at, "--at");
  if (!at) return own(at.error());
  v1::Command command = is_impulse ? client::impulse_command(options.body, *vector, *at)
                                   : client::force_command(options.body, *vector, *at, options.duration);
  if (options.radius >= 0) {
    if (is_impulse) {
      command.mutable_apply_impulse()->set_radius(options.radius);
    } else {
      command.mutable_apply_force()->set_radius(options.radius);
    }
  }
  return with(client.apply(options.world, command), [&](std::uint64_t step) { out << "acts in step " << step << '\n'; });
}

Outcome script(SimulationClient& client, const Options& options, std::ostream& out) {
  const auto commands = client::read_script_message(options.file);
  if (!commands) return own(commands.error());
  return with(client.run_script(options.world, *commands, options.absolute),
              [&](double time) { out << "taken at time " << time << " s\n"; });
}

Outcome hash(SimulationClient& client, const Options& options, std::ostream& out) {
  return with(client.world(options.world, false, /*state_hash=*/true), [&](const WorldInfo& info) {
    out << "step " << info.status.step << "  hash " << hash_text(info.state_hash) << '\n';
  });
}

}  // namespace crumple::cli
