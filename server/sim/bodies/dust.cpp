#include "server/sim/bodies/dust.h"

#include "server/sim/scatter.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace crumple::sim {

std::vector<DustParticle> dust(const std::vector<TornFace>& faces, std::uint64_t seed) {
  std::vector<double> wanted;
  double sum = 0;
  for (const TornFace& face : faces) {
    const double area = 0.5 * (face.x[1] - face.x[0]).cross(face.x[2] - face.x[0]).norm();
    wanted.push_back(std::isfinite(area) ? area * face.density : 0);
    sum += wanted.back();
  }
  const double share = std::min(1.0, kMaxDust / std::max(sum, 1.0));
  std::uint64_t drawn = 0;
  const auto unit = [&] { return unit_interval(scatter(seed ^ scatter(++drawn))); };
  std::vector<DustParticle> grains;
  double owed = unit();  // the rest of one face goes to the next
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (owed += share * wanted[f]; owed >= 1 && grains.size() < kMaxDust; owed -= 1) {
      const double root = std::sqrt(unit()), u = unit();
      const std::array<double, 3> b{1 - root, root * (1 - u), root * u};
      Vec3 x = Vec3::Zero(), v = Vec3::Zero();
      for (int k = 0; k < 3; ++k) {
        x += b[k] * faces[f].x[k];
        v += b[k] * faces[f].v[k];
      }
      grains.push_back({x.cast<float>(), v.cast<float>()});
    }
  }
  return grains;
}

}  // namespace crumple::sim
