#include <chrono>
#include <iomanip>
#include <ostream>
#include <thread>

#include "client/cli/commands.h"
#include "client/sdk/stream_file.h"

namespace crumple::cli {
namespace {

using Clock = std::chrono::steady_clock;

client::WatchOptions watch_options(const Options& options) {
  client::WatchOptions watch;
  if (options.exact) watch.codec = Codec::float32;
  watch.values = options.values;
  watch.max_rate_hz = options.rate;
  return watch;
}

std::unexpected<Failure> own(const Error& error) { return std::unexpected(Failure(error, kUsage)); }

// Hands over updates until a limit, `stop` or an error. An error of
// take(update), which is one of this side, ends it too. Answers the number of frames.
template <class Take>
std::expected<std::uint64_t, Failure> follow(client::WatchStream& stream, const Options& options, const std::atomic<bool>& stop, Take take) {
  const auto begin = Clock::now();
  std::uint64_t frames = 0;
  while (!stop && (options.frames == 0 || frames < options.frames)) {
    if (options.seconds > 0 && std::chrono::duration<double>(Clock::now() - begin).count() >= options.seconds) break;
    const auto update = stream.next_encoded(std::chrono::milliseconds(100));
    if (!update) return std::unexpected(update.error());
    if (!*update) continue;
    if (const Result<void> taken = take(**update); !taken) return own(taken.error());
    if (std::holds_alternative<client::EncodedFrame>(**update)) ++frames;
  }
  return frames;
}

void print(const client::EncodedUpdate& update, bool events, std::ostream& out) {
  if (const auto* frame = std::get_if<client::EncodedFrame>(&update)) {
    out << "step " << frame->step << "  time " << frame->time << " s  factor " << frame->real_time_factor << "  step time "
        << frame->step_ms << " ms  " << frame->payload->size() << " bytes\n";
  } else if (const auto* gap = std::get_if<EventGap>(&update)) {
    out << "events " << gap->first << " to " << gap->last << " were lost: too slow\n";
  } else if (const auto* event = std::get_if<client::WorldEvent>(&update); event && events) {
    out << "event " << event->sequence << "  step " << event->step << "  " << to_string(event->kind) << "  "
        << event->message << '\n';
  } else if (const auto* topology = std::get_if<client::EncodedTopology>(&update); topology && events) {
    out << "topology epoch " << topology->epoch;
    if (topology->base) out << " since " << *topology->base;
    if (topology->parts > 1) out << " part " << topology->part + 1 << " of " << topology->parts;
    out << "  " << topology->payload->size() << " bytes\n";
  }
}

}  // namespace

Outcome watch(SimulationClient& client, const Options& options, std::ostream& out, const std::atomic<bool>& stop) {
  const auto stream = client.watch(options.world, watch_options(options));
  if (!stream) return std::unexpected(stream.error());
  const auto frames = follow(**stream, options, stop, [&](const client::EncodedUpdate& update) -> Result<void> {
    print(update, options.events, out);
    out.flush();
    return {};
  });
  if (!frames) return std::unexpected(frames.error());
  return {};
}

Outcome progress(SimulationClient& client, const Options& options, std::ostream& out, const std::atomic<bool>& stop) {
  bool reached = false;
  while (!stop && !reached) {
    const auto info = client.world(options.world);
    if (!info) return std::unexpected(info.error());
    const WorldStatus& status = info->status;
    if (status.state == WorldState::failed) return std::unexpected(Error{ErrorCode::internal, "", status.failure});
    reached = options.until > 0 && status.step >= options.until;
    out << std::fixed << std::setprecision(2) << "\rstep " << status.step << "  time " << status.time << " s  real time "
        << status.real_time_factor << " x  step " << status.step_ms << " ms  viewers " << status.viewers << "   ";
    out.flush();
    // Nothing to wait on: a status is asked for four times a second.
    if (!reached) std::this_thread::sleep_for(std::chrono::milliseconds(250));
  }
  out << '\n';
  return {};
}

Outcome record(SimulationClient& client, const Options& options, std::ostream& out, const std::atomic<bool>& stop) {
  auto file = client::StreamFileWriter::create(options.file);
  if (!file) return own(file.error());
  const auto stream = client.watch(options.world, watch_options(options));
  if (!stream) return std::unexpected(stream.error());
  const auto frames = follow(**stream, options, stop, [&](const client::EncodedUpdate& update) { return file->write(update); });
  if (const Result<void> finished = file->finish(); !finished) return own(finished.error());
  if (!frames) return std::unexpected(frames.error());  // what came until then is in the file
  out << *frames << " frames, " << file->bytes() << " bytes\n";
  return {};
}

}  // namespace crumple::cli
