#include "server/rig/thin_shell.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace crumple::rig {
namespace {

struct Edge {
  double area = 0;            // of the triangles beside it [m^2]
  std::vector<int> opposite;  // their third corners
};

double area_of(const sim::SurfaceMesh& surface, const Triangle& t) {
  const auto& X = surface.vertices;
  return 0.5 * (X[t[1]] - X[t[0]]).cross(X[t[2]] - X[t[0]]).norm();
}

}  // namespace

ThinShell::ThinShell(const sim::SurfaceMesh& surface, const ShellMaterial& material)
    : material_(material), x_(surface.vertices), v_(x_.size(), Vec3::Zero()), before_(x_) {
  std::vector<double> mass(x_.size(), 0.0);
  std::map<std::pair<int, int>, Edge> edges;
  for (const Triangle& t : surface.triangles) {
    const double area = area_of(surface, t);
    for (int k = 0; k < 3; ++k) {
      mass[t[k]] += area / 3;
      Edge& edge = edges[std::minmax(t[k], t[(k + 1) % 3])];
      edge.area += area;
      edge.opposite.push_back(t[(k + 2) % 3]);
    }
  }
  for (const double m : mass) inverse_mass_.push_back(m > 0 ? 1 / m : 0);
  const double stiffness = material.wave_speed * material.wave_speed;  // E t at rho t = 1
  const auto add = [&](int a, int b, double area, double share, bool fold) {
    const double length = (x_[a] - x_[b]).norm();
    if (length > 0 && area > 0)
      springs_.push_back({a, b, length, length, length * length / (share * stiffness * area), fold});
  };
  for (const auto& [ends, edge] : edges) add(ends.first, ends.second, edge.area, 1, false);
  for (const auto& [ends, edge] : edges)
    if (edge.opposite.size() >= 2 && edge.opposite[0] != edge.opposite[1])
      add(edge.opposite[0], edge.opposite[1], edge.area, material.bending, true);
}

void ThinShell::substep(double h, const Vec3& gravity, double damping, const Obstacle& obstacle) {
  const double kept = std::exp(-damping * h);
  for (std::size_t i = 0; i < x_.size(); ++i) {
    before_[i] = x_[i];
    if (inverse_mass_[i] > 0) x_[i] += h * kept * (v_[i] + h * gravity);
  }
  for (const Spring& s : springs_) {
    const Vec3 d = x_[s.a] - x_[s.b];
    const double length = d.norm(), wa = inverse_mass_[s.a], wb = inverse_mass_[s.b];
    if (!(length > 1e-12 * s.first) || wa + wb == 0) continue;
    const Vec3 pull = (s.rest - length) / ((wa + wb + s.compliance / (h * h)) * length) * d;
    x_[s.a] += wa * pull;
    x_[s.b] -= wb * pull;
  }
  for (std::size_t i = 0; i < x_.size(); ++i) {
    if (obstacle && inverse_mass_[i] > 0) obstacle(before_[i], x_[i]);
    v_[i] = (x_[i] - before_[i]) / h;
  }
}

void ThinShell::flow() {
  for (Spring& s : springs_) {
    const double strain = (x_[s.a] - x_[s.b]).norm() / s.rest - 1,
                 yield = material_.yield_strain * (s.fold ? material_.fold_yield : 1),
                 beyond = std::abs(strain) - yield;
    if (!(beyond > 0)) continue;
    s.rest *= 1 + std::copysign(beyond, strain);
    if (s.fold)
      s.rest = std::max(s.rest, 0.01 * s.first);
    else
      s.rest = std::clamp(s.rest, (1 - material_.largest_stretch) * s.first, (1 + material_.largest_stretch) * s.first);
  }
}

double ThinShell::largest_fold() const {
  double out = 0;
  for (const Spring& s : springs_)
    if (s.fold) out = std::max(out, std::abs(s.rest / s.first - 1));
  return out;
}

}  // namespace crumple::rig
