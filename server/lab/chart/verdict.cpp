#include "server/lab/chart/verdict.h"

#include "common/text.h"

#include <cmath>
#include <iomanip>
#include <map>
#include <set>
#include <sstream>

namespace crumple::lab::chart {
namespace {

std::string digits(double value, int count) {
  std::ostringstream out;
  out << std::setprecision(count) << value;
  return out.str();
}

std::vector<const Point*> of_curve(const std::vector<Point>& points, const std::string& curve) {
  std::vector<const Point*> out;
  for (const Point& p : points) {
    if (p.curve == curve) out.push_back(&p);
  }
  return out;
}

std::string where(const Study& study, const Point& p) {
  return study.curves.size() > 1 ? text(p.curve, " at ", p.label) : p.label;
}

std::string failures(const Study& study, const std::vector<Point>& points) {
  int failed = 0;
  const Point* first = nullptr;
  for (const Point& p : points) {
    if (p.failure.empty()) continue;
    ++failed;
    if (!first) first = &p;
  }
  if (failed == 0) return "";
  return text(" ", failed, failed == 1 ? " setting" : " settings", " failed and ", failed == 1 ? "stands" : "stand",
              " on the top edge; the first: ", where(study, *first), " (", first->failure, ").");
}

std::string thresholds(const Study& study, const std::vector<Point>& points);

// Of a study whose curves are scenes of their own.
std::string thresholds_of_curves(const Study& study, const std::vector<Point>& points) {
  std::string out;
  for (const Curve& curve : study.curves) {
    Study alone = study;
    alone.curves = {curve};
    alone.scene_a_curve = false;
    std::vector<Point> mine;
    for (const Point* p : of_curve(points, curve.name)) mine.push_back(*p);
    if (!mine.empty()) out += text(" ", curve.name, ":", thresholds(alone, mine));
  }
  return out;
}

// Whether a model cheaper than finite elements is enough, in words: what of 10, 3 and 1 % it meets, in each quantity.
std::string cheaper_models(const Study& study, const std::vector<Point>& points) {
  std::string out;
  for (const Curve& curve : study.curves) {
    if (curve.base.body == BodyKind::finite_elements) continue;
    std::vector<Point> mine;
    for (const Point* p : of_curve(points, curve.name)) mine.push_back(*p);
    if (mine.empty()) continue;
    std::string met;
    for (const auto& [quantity, what] : {std::pair{"error", "the shape"}, {"error_motion", "where it goes"}}) {
      if (!mine.front().measured.contains(quantity)) continue;
      double tightest = 0;
      for (const double limit : {0.1, 0.03, 0.01}) {
        if (cheapest(mine, limit, quantity)) tightest = limit;
      }
      met += text(met.empty() ? " " : ", ", tightest > 0 ? text("meets ", as_error(tightest)) : std::string("does not meet 10 %"), " in ", what);
    }
    std::string name = curve.base.body == BodyKind::rigid ? "A rigid body" : curve.name;
    // "..., alpha": the knob is no part of the model's name.
    if (const auto comma = name.rfind(", "); comma != std::string::npos && curve.knob.name.starts_with(name.substr(comma + 2))) name.resize(comma);
    out += text(" ", name, met, ".");
  }
  return out;
}

std::string thresholds(const Study& study, const std::vector<Point>& points) {
  if (study.scene_a_curve) return thresholds_of_curves(study, points);
  std::string out;
  const Point* last = nullptr;
  for (const double limit : {0.1, 0.03, 0.01}) {
    const Point* p = cheapest(points, limit);
    if (!p) {
      const Point* best = nullptr;
      for (const Point& q : points) {
        if (q.failure.empty() && q.median("error") >= 0 && (!best || q.median("error") < best->median("error"))) best = &q;
      }
      out += text(" Nothing here meets ", as_error(limit), best ? text("; the best is ", as_error(best->median("error")), " (", where(study, *best), ")") : "", ".");
      break;
    }
    if (p != last) {
      out += text(" The cheapest within ", as_error(limit), " is ", where(study, *p), ": ", as_seconds(p->median("seconds")),
                  study.real_time ? " a simulated second" : "", ", error ", as_error(p->median("error")), ".");
      last = p;
    } else {
      out += text(" It meets ", as_error(limit), " too.");
    }
  }
  return out;
}

std::string order_sentences(const Study& study, const std::vector<Point>& points) {
  std::string out;
  for (const Order& o : orders(study, points)) {
    out += text(" ", o.curve, ": order ", digits(o.observed, 2), " observed, ", o.expected, " expected", o.met() ? "." : " - MISSED.");
  }
  return out;
}

std::string of_pareto(const Study& study, const std::vector<Point>& points) {
  std::vector<Offer> offers;
  for (const Point& p : points) {
    if (p.failure.empty()) offers.push_back({p.median("error"), p.median("seconds")});
    else offers.push_back({std::nan(""), std::nan("")});
  }
  std::map<std::string, std::pair<double, double>> range;
  std::map<std::string, int> count;
  for (std::size_t k : pareto_front(offers)) {
    const std::string part = dominating_part(points[k]);
    auto [at, added] = range.try_emplace(part, offers[k].error, offers[k].error);
    at->second = {std::min(at->second.first, offers[k].error), std::max(at->second.second, offers[k].error)};
    ++count[part];
  }
  std::string out;
  for (const auto& [part, r] : range) {
    out += text(" On the front the ", part, " error is the largest part at ", count[part], count[part] == 1 ? " point" : " points", ", total error ",
                as_error(r.first), r.first == r.second ? "" : " to " + as_error(r.second), ".");
  }
  return out + thresholds(study, points);
}

std::string of_values(const Study& study, const std::vector<Point>& points) {
  std::string out;
  for (const Curve& curve : study.curves) {
    const auto mine = of_curve(points, curve.name);
    if (mine.empty()) continue;
    const auto at = [](const Point& p) { return text(as_error(p.median("error")), " at ", p.label); };
    out += text(" ", curve.name, ": ", at(*mine.front()), mine.size() > 1 ? ", " + at(*mine.back()) : "", ".");
  }
  return out;
}

std::string of_costs(const Study& study, const std::vector<Point>& points) {
  std::string out;
  for (const Curve& curve : study.curves) {
    const auto mine = of_curve(points, curve.name);
    if (mine.size() < 2) continue;
    out += text(" ", curve.name, ": ", mine.back()->label, " ", study.value_axis, " run ",
                digits(mine.front()->median("seconds") / mine.back()->median("seconds"), 2), " times as fast as ", mine.front()->label, ".");
  }
  return out;
}

std::string of_ensemble(const Study& study, const std::vector<Point>& points) {
  std::string out;
  for (const std::string& name : study.statistics) {
    const Point *least = nullptr, *most = nullptr;
    for (const Point& p : points) {
      if (!p.measured.contains(name)) continue;
      if (!least || p.median(name) < least->median(name)) least = &p;
      if (!most || p.median(name) > most->median(name)) most = &p;
    }
    if (!least) continue;
    const Spread& a = least->measured.at(name);
    const Spread& b = most->measured.at(name);
    std::string plain = name;
    for (char& c : plain) c = c == '_' ? ' ' : c;
    if (least == most) out += text(" ", plain, ": median ", digits(a.median, 3), ".");
    else
      out += text(" ", plain, ": median ", digits(a.median, 3), " (", least->label, ") to ", digits(b.median, 3), " (", most->label, ")",
                  a.q3 < b.q1 ? ", beyond the scatter of the seeds." : ", within the scatter of the seeds.");
  }
  return out;
}

std::string peer_sentences(const Study& study) {
  std::string out;
  for (const PeerPoint& p : study.peers) {
    out += text(" ", p.name, ", measured by others on their machine: ", as_seconds(p.seconds), " a simulated second");
    out += study.kind == FigureKind::ensemble ? "." : text(", error ", as_error(p.error), ".");
  }
  return out;
}

}  // namespace

std::string as_error(double error) {
  if (std::isnan(error)) return "not measured";
  if (error == 0) return "0";
  if (error < 1e-5) return digits(error, 2);
  return digits(100 * error, 2) + " %";
}

std::string as_seconds(double seconds) {
  if (std::isnan(seconds)) return "not timed";
  if (seconds < 1e-3) return digits(1e6 * seconds, 3) + " us";
  if (seconds < 1) return digits(1e3 * seconds, 3) + " ms";
  return digits(seconds, 3) + " s";
}

std::vector<Order> orders(const Study& study, const std::vector<Point>& points) {
  std::vector<Order> out;
  for (const Curve& curve : study.curves) {
    if (curve.expected_order == 0) continue;
    std::vector<Observation> observations;
    for (const Point* p : of_curve(points, curve.name)) {
      if (p->failure.empty()) observations.push_back({p->value, p->median("error")});
    }
    // Near the floor the reference's own error mixes in.
    if (const auto order = observed_order(observations, 3 * floors_of(points).most)) out.push_back({curve.name, *order, curve.expected_order});
  }
  return out;
}

const Point* cheapest(const std::vector<Point>& points, double error, const std::string& quantity) {
  const Point* best = nullptr;
  for (const Point& p : points) {
    if (!p.failure.empty() || !(p.median(quantity) <= error) || std::isnan(p.median("seconds"))) continue;
    if (!best || p.median("seconds") < best->median("seconds")) best = &p;
  }
  return best;
}

Floors floors_of(const std::vector<Point>& points) {
  Floors floors{1e300, 0};
  for (const Point& p : points) {
    const double f = p.measured.contains("floor") ? p.median("floor") : 0;
    floors = {std::min(floors.least, f), std::max(floors.most, f)};
  }
  return points.empty() ? Floors{} : floors;
}

std::string dominating_part(const Point& point) {
  std::string largest;
  double most = -1;
  for (const char* part : {"solver", "time", "mesh"}) {
    if (const double e = point.median(std::string("error_") + part); e > most) {
      most = e;
      largest = part;
    }
  }
  return largest;
}

std::string conclusion(const Study& study, const std::vector<Point>& points) {
  if (points.empty()) return study.unmet.empty() ? "Nothing of this study has been run." : study.unmet;
  std::string out;
  switch (study.kind) {
    case FigureKind::work_precision: out = study.ranked ? thresholds(study, points) + cheaper_models(study, points) : of_values(study, points); break;
    case FigureKind::pareto: out = of_pareto(study, points); break;
    case FigureKind::against_value: out = of_values(study, points); break;
    case FigureKind::cost: out = of_costs(study, points); break;
    case FigureKind::ensemble: out = of_ensemble(study, points); break;
  }
  out += order_sentences(study, points) + failures(study, points) + peer_sentences(study);
  if (const Floors floors = floors_of(points); floors.most > 0) {
    out += text(" The reference itself is sure to ", as_error(floors.most), floors.common() > 0 ? "." : " or better, from curve to curve.");
  }
  return out.empty() ? out : out.substr(1);
}

}  // namespace crumple::lab::chart
