#include "common/text.h"
#include "server/lab/chart/pinning.h"
#include "server/lab/chart/setup.h"

#include <cmath>

// The knobs. Each has at least five values where the product has as many.
namespace crumple::lab::chart::knobs {
namespace {

std::string one_over(double dt) { return text("1/", std::lround(1 / dt)); }

std::string power_of_ten(double value) { return text("1e", std::lround(std::log10(value))); }

Knob numbers(const std::string& name, std::vector<double> values, std::function<void(Setup&, double)> turn) {
  Knob knob{name, {}, std::move(turn)};
  for (double v : values) knob.values.push_back({v, text(v)});
  return knob;
}

}  // namespace

Knob dt() {
  Knob knob{"dt [s]", {}, [](Setup& s, double v) { s.dt = v; }};
  for (double n : {15.0, 30.0, 60.0, 120.0, 240.0, 480.0, 960.0}) knob.values.push_back({1 / n, one_over(1 / n), n > 480});
  return knob;
}

Knob cg_tolerance() {
  Knob knob{"CG tolerance", {}, [](Setup& s, double v) { s.cg_tolerance = v; }};
  for (int k = 1; k <= 8; ++k) knob.values.push_back({std::pow(10, -k), text("1e-", k)});
  return knob;
}

Knob cg_cap(bool guarded) {
  return numbers("CG cap", {5, 10, 20, 40, 60, 100, 200, 500}, [guarded](Setup& s, double v) {
    s.cg_cap = static_cast<int>(v);
    s.cg_tolerance = 1e-12;
    s.guarded = guarded;
  });
}

Knob cells(std::vector<int> across, int heavy_from) {
  Knob knob{"cells across", {}, [](Setup& s, double v) { s.cells = static_cast<int>(std::lround(1 / v)); }};
  for (int n : across) knob.values.push_back({1.0 / n, text(n), n >= heavy_from});
  return knob;
}

Knob threads() {
  Knob knob{"threads", {}, [](Setup& s, double v) { s.threads = static_cast<int>(v); }};
  for (int n = 1; n <= allowed_processors(); n *= 2) knob.values.push_back({static_cast<double>(n), text(n)});
  return knob;
}

Knob alpha(std::vector<double> values) {
  return numbers("alpha [1/m]", std::move(values), [](Setup& s, double v) { s.alpha = v; });
}

Knob phi() {
  Knob knob{"phi [N s/m3]", {}, [](Setup& s, double v) { s.phi = v; }};
  for (double v : {1e5, 1e6, 1e7, 1e8, 1e9}) knob.values.push_back({v, power_of_ten(v)});
  return knob;
}

Knob kappa() {
  return numbers("kappa", {1, 3, 10, 30, 100, 300, 1000}, [](Setup& s, double v) { s.kappa = v; });
}

Knob strain() {
  return numbers("strain", {0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 0.5}, [](Setup& s, double v) { s.strain = v; });
}

Knob levels(std::vector<std::string> names, const std::string& heavy) {
  Knob knob{"level", {}, [names](Setup& s, double v) { s.level = names[static_cast<std::size_t>(std::lround(std::log2(1 / v)))]; }};
  for (std::size_t k = 0; k < names.size(); ++k) knob.values.push_back({std::pow(0.5, k), names[k], names[k] == heavy});
  return knob;
}

Knob enclosing(std::vector<double> cell_sizes, double heavy_below) {
  Knob knob{"cell", {}, [](Setup& s, double v) { s.enclosing = v; }};
  for (const double size : cell_sizes) knob.values.push_back({size, text(1000 * size, " mm"), size < heavy_below});
  return knob;
}

Knob grid(std::vector<double> dts, std::vector<double> tolerances, double heavy_below) {
  // A value is the pair's number: both go to zero along the list.
  Knob knob{"dt, tolerance", {}, [=](Setup& s, double v) {
              const auto k = static_cast<std::size_t>(v);
              s.dt = dts[k / tolerances.size()];
              s.cg_tolerance = tolerances[k % tolerances.size()];
            }};
  for (std::size_t k = 0; k < dts.size() * tolerances.size(); ++k) {
    const double h = dts[k / tolerances.size()];
    knob.values.push_back({static_cast<double>(k), text(one_over(h), ", ", power_of_ten(tolerances[k % tolerances.size()])), h < heavy_below});
  }
  return knob;
}

}  // namespace crumple::lab::chart::knobs
