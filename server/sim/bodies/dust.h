#pragma once

#include "common/dust_particle.h"

#include <array>
#include <cstdint>
#include <vector>

namespace crumple::sim {

// One side of a face that has come apart.
struct TornFace {
  std::array<Vec3, 3> x, v;  // of its corners [m], [m/s]
  double density = 0;        // grains to the square metre [1/m^2]
};

inline constexpr int kMaxDust = 400;  // grains of one body and step

// Grains spread evenly over torn faces, moving with them. The same for the same seed. If that would make more than
// kMaxDust, all faces get fewer alike.
std::vector<DustParticle> dust(const std::vector<TornFace>& faces, std::uint64_t seed);

}  // namespace crumple::sim
