#include "common/position_codec.h"

#include "common/zigzag.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

namespace crumple {
namespace {

constexpr int kSteps = 65535;  // of a box's side

struct Box {
  Vec3f low, size;  // [m]
  Vec3 scale;       // [steps/m]

  Box(const Vec3f& its_low, const Vec3f& its_size) : low(its_low), size(its_size) {
    for (int a = 0; a < 3; ++a) scale[a] = size[a] > 0 ? kSteps / static_cast<double>(size[a]) : 0;
  }
  // The nearest step, for what is outside that of the box's side.
  std::uint16_t step(double coordinate, int axis) const {
    const double steps = std::clamp((coordinate - low[axis]) * scale[axis], 0.0, double{kSteps});
    return static_cast<std::uint16_t>(static_cast<int>(steps + 0.5));
  }
  float coordinate(std::uint16_t step, int axis) const {
    return static_cast<float>(low[axis] + static_cast<double>(size[axis]) * step / kSteps);
  }
};

// Steps of vertices: x0 y0 z0 x1 ...
using Steps = std::vector<std::uint16_t>;

std::vector<Vec3f> presentable(const std::vector<Vec3f>& positions) {
  std::vector<Vec3f> clean(positions.size());
  for (std::size_t v = 0; v < clean.size(); ++v)
    for (int a = 0; a < 3; ++a) clean[v][a] = crumple::presentable(positions[v][a]);
  return clean;
}

Box box_around(const std::vector<Vec3f>& positions) {
  Vec3f low = positions[0], high = positions[0];
  for (const Vec3f& p : positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return {low, high - low};
}

Steps steps_of(const std::vector<Vec3f>& positions, const Box& box) {
  Steps steps;
  steps.reserve(3 * positions.size());
  for (const Vec3f& p : positions)
    for (int a = 0; a < 3; ++a) steps.push_back(box.step(p[a], a));
  return steps;
}

std::vector<Vec3f> positions_of(const Steps& steps, const Box& box) {
  std::vector<Vec3f> positions(steps.size() / 3);
  for (std::size_t v = 0; v < positions.size(); ++v)
    for (int a = 0; a < 3; ++a) positions[v][a] = box.coordinate(steps[3 * v + a], a);
  return positions;
}

Steps steps_if_rigid(const PositionReference& reference, const std::vector<PieceMotion>& motions, const Box& box) {
  Steps steps;
  steps.reserve(3 * reference.X.size());
  struct Affine {
    Mat3 R;
    Vec3 t;
  };
  std::vector<Affine> moved;
  for (const PieceMotion& motion : motions) moved.push_back({motion.rotation(), motion.t.cast<double>()});
  for (std::size_t v = 0; v < reference.X.size(); ++v) {
    const Affine& by = moved[reference.pieces.piece_of[v]];
    const Vec3 x = by.R * reference.X[v].cast<double>() + by.t;
    for (int a = 0; a < 3; ++a) steps.push_back(box.step(x[a], a));
  }
  return steps;
}

// Of one axis, from vertex to vertex: how far each is off `expected`, less how far the vertex before of its piece is. Without a
// reference 0 is expected and all are one piece. `Turn` makes differences of steps or steps of differences.
template <class Turn>
void along_pieces(const PositionReference* reference, const Steps& expected, std::size_t count, std::size_t axis, Turn turn) {
  std::vector<std::uint16_t> last(reference ? reference->pieces.count : 1, 0);
  for (std::size_t v = 0; v < count; ++v) {
    std::uint16_t& before = last[reference ? reference->pieces.piece_of[v] : 0];
    const std::uint16_t rigid = reference ? expected[3 * v + axis] : 0;
    before = static_cast<std::uint16_t>(turn(v, static_cast<std::uint16_t>(rigid + before)) - rigid);
  }
}

void put_differences(ByteWriter& out, const Steps& steps, const PositionReference* reference, const Steps& expected) {
  const std::size_t count = steps.size() / 3;
  std::string planes;
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<std::uint16_t> differences(count);
    along_pieces(reference, expected, count, a, [&](std::size_t v, std::uint16_t guess) {
      differences[v] = static_cast<std::uint16_t>(steps[3 * v + a] - guess);
      return steps[3 * v + a];
    });
    append_planes(planes, differences);
  }
  out.append(planes.data(), planes.size());
}

Steps steps_from_differences(const char* planes, std::size_t count, const PositionReference* reference, const Steps& expected) {
  Steps steps(3 * count);
  for (std::size_t a = 0; a < 3; ++a) {
    const auto differences = differences_of<std::uint16_t>(planes + 2 * a * count, count);
    along_pieces(reference, expected, count, a, [&](std::size_t v, std::uint16_t guess) {
      return steps[3 * v + a] = static_cast<std::uint16_t>(guess + differences[v]);
    });
  }
  return steps;
}

void put_motions(ByteWriter& out, const std::vector<PieceMotion>& motions) {
  for (const PieceMotion& motion : motions) {
    out.append(motion.R.coeffs().data(), 16);  // Eigen's order: x y z w
    out.append(motion.t.data(), 12);
  }
}

std::optional<std::vector<PieceMotion>> get_motions(ByteReader& in, int count) {
  std::vector<PieceMotion> motions(count);
  for (PieceMotion& motion : motions) {
    for (float& number : motion.R.coeffs()) number = in.get<float>();
    for (float& number : motion.t) number = in.get<float>();
    if (!motion.R.coeffs().allFinite() || !motion.t.allFinite()) return {};
  }
  return motions;
}

}  // namespace

float presentable(double number) {
  return std::abs(number) <= 1e30 ? static_cast<float>(number) : 0.0f;  // also false for NaN
}

std::vector<Vec3f> quantised(const std::vector<Vec3f>& positions) {
  if (positions.empty()) return {};
  const std::vector<Vec3f> clean = presentable(positions);
  const Box box = box_around(clean);
  return positions_of(steps_of(clean, box), box);
}

void put_positions(ByteWriter& out, const std::vector<Vec3f>& positions, const PositionReference* reference, MessageForm form) {
  if (positions.empty()) return;
  assert(!reference || reference->X.size() == positions.size());
  const std::vector<Vec3f> clean = presentable(positions);
  if (form.codec == Codec::float32) {
    static_assert(sizeof(Vec3f) == 12);
    return out.append(clean.data(), 12 * clean.size());
  }
  const Box box = box_around(clean);
  out.append(box.low.data(), 12);
  out.append(box.size.data(), 12);
  const Steps steps = steps_of(clean, box);
  if (!form.compress) {
    out.append(steps.data(), 2 * steps.size());
  } else if (reference) {
    const std::vector<PieceMotion> motions = nearest_motions(reference->pieces, reference->X, clean);
    put_motions(out, motions);
    put_differences(out, steps, reference, steps_if_rigid(*reference, motions, box));
  } else {
    put_differences(out, steps, nullptr, {});
  }
  out.pad_to_4();
}

bool get_positions(ByteReader& in, std::uint32_t count, const PositionReference* reference, MessageForm form,
                   std::vector<Vec3f>& positions) {
  if (count == 0) return true;
  if (form.codec == Codec::float32) {
    const char* data = in.skip(std::uint64_t{12} * count);
    if (!data) return false;
    positions.resize(count);
    for (std::size_t v = 0; v < count; ++v) std::memcpy(positions[v].data(), data + 12 * v, 12);
    return std::all_of(positions.begin(), positions.end(), [](const Vec3f& p) { return p.allFinite(); });
  }
  if (form.version < 2 || !form.compress) reference = nullptr;
  Vec3f low, size;
  for (float& number : low) number = in.get<float>();
  for (float& number : size) number = in.get<float>();
  if (!low.allFinite() || !size.allFinite() || !(low + size).allFinite() || (size.array() < 0).any()) return false;
  const Box box(low, size);
  Steps expected;
  if (reference) {
    const auto motions = get_motions(in, reference->pieces.count);
    if (!motions) return false;
    expected = steps_if_rigid(*reference, *motions, box);
  }
  const char* data = in.skip(std::uint64_t{6} * count);
  if (!data) return false;
  Steps steps;
  if (form.compress) {
    steps = steps_from_differences(data, count, reference, expected);
  } else {
    steps.resize(3 * std::size_t{count});
    std::memcpy(steps.data(), data, 2 * steps.size());
  }
  positions = positions_of(steps, box);
  in.skip_padding();
  return in.ok();
}

}  // namespace crumple
