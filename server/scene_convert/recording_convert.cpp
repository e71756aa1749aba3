#include "server/scene_convert/recording_convert.h"

#include "server/sim/limits.h"

namespace crumple::scene_convert {

Result<RecordingSettings> to_recording(const v1::Recording& message) {
  RecordingSettings settings;
  sim::FirstBreach breach;
  if (message.has_every()) {
    breach.number(message.every(), {1, 1e6}, "recording.every");
    settings.every = message.every();
  }
  if (message.formats_size() > 0) settings.frames = settings.csv = false;
  for (int i = 0; i < message.formats_size(); ++i) switch (message.formats(i)) {
      case v1::Recording::FRAMES:
        settings.frames = true;
        break;
      case v1::Recording::VTU:
        settings.vtu = true;
        break;
      case v1::Recording::PLY:
        settings.ply = true;
        break;
      case v1::Recording::CSV:
        settings.csv = true;
        break;
      default:
        breach.require(false, "recording.formats[" + std::to_string(i) + "]",
                       "is " + std::to_string(message.formats(i)) + ", must be one of FRAMES, VTU, PLY, CSV");
    }
  if (!breach.ok()) return std::unexpected(breach.result().error());
  return settings;
}

}  // namespace crumple::scene_convert
