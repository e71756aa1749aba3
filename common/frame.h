#pragma once

#include "common/types.h"

#include <string>
#include <vector>

// What one viewer sees. A Topology says what there is to draw; a Frame says where it is at one step.
// Both are plain values and know no transport.
namespace crumple {

enum class BodyModel : std::uint8_t { rigid, fixed, fem, example_based };

// Draw data of one body that changes only when the body breaks.
struct BodyTopology {
  BodyId id = 0;
  std::uint32_t epoch = 0;              // since which it is as it is
  std::string name;
  BodyModel model = BodyModel::rigid;
  bool deformable = false;              // false: `vertices` move with the frame's pose alone
  std::vector<Vec3f> vertices;          // rigid: in body axes [m]. Deformable: at the time of the topology, in W
  std::vector<Triangle> triangles;
  std::array<float, 3> colour{0.7f, 0.7f, 0.7f};  // linear RGB in [0, 1]
  float opacity = 1.0f;
  std::vector<std::string> channels;    // what values there are: "stress", or a body's examples other than rest
};

// Everything to draw, valid for frames of the same epoch. The epoch rises when bodies break, and becomes theirs.
struct Topology {
  std::uint32_t epoch = 0;
  std::vector<BodyTopology> bodies;     // indexed by BodyId
};

struct BodyFrame {
  BodyId id = 0;
  Pose pose;                            // X_WB of the body's axes
  std::vector<Vec3f> positions;         // deformable bodies: one a topology vertex, in W [m]; else empty
  std::vector<float> values;            // on request: for each channel one a vertex, channel after channel; over
                                        // the channels they sum to [0, 1], an example's is its weight; else empty
};

struct Frame {
  std::uint64_t step = 0;
  double time = 0;                      // simulated [s]
  std::uint32_t epoch = 0;              // of the topology these vertices belong to
  double step_ms = 0;                   // wall time of the step that made it
  double real_time_factor = 0;          // simulated over wall time, smoothed; 0 when not clocked
  std::vector<BodyFrame> bodies;
};

}  // namespace crumple
