#pragma once

#include "common/types.h"

#include <vector>

namespace crumple {

// A grain of dust that leaves a fracture surface, for clients to draw (Parker & O'Brien 2009, section 5).
struct DustParticle {
  Vec3f position;  // in W [m]
  Vec3f velocity;  // of the surface there [m/s]
};

// Six numbers a grain, as they travel: position, then velocity. What is left over of numbers that are no multiple of six is not read.
inline std::vector<float> numbers_of(const std::vector<DustParticle>& grains) {
  std::vector<float> numbers;
  for (const DustParticle& grain : grains)
    for (const Vec3f& v : {grain.position, grain.velocity}) numbers.insert(numbers.end(), v.begin(), v.end());
  return numbers;
}

template <class Numbers>
std::vector<DustParticle> grains_of(const Numbers& n) {
  std::vector<DustParticle> grains;
  for (int i = 0; i + 6 <= static_cast<int>(n.size()); i += 6) grains.push_back({{n[i], n[i + 1], n[i + 2]}, {n[i + 3], n[i + 4], n[i + 5]}});
  return grains;
}

}  // namespace crumple
