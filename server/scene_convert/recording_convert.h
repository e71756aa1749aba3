#pragma once

#include "common/error.h"
#include "crumple/v1/scene.pb.h"

namespace crumple::scene_convert {

// What a batch run writes.
struct RecordingSettings {
  int every = 1;       // steps between two records, [1, 1e6]
  bool frames = true;  // the stream's frames
  bool vtu = false;    // finite-element bodies
  bool ply = false;    // every other body
  bool csv = true;     // energies, events, timings
};

// Errors: path recording.every, recording.formats[i].
Result<RecordingSettings> to_recording(const v1::Recording& message);

}  // namespace crumple::scene_convert
