#include "server/lab/chart/point.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <limits>
#include <optional>
#include <sstream>

namespace crumple::lab::chart {
namespace {

constexpr int kColumns = 16;

// A field in quotes, inner quotes doubled, line breaks as blanks.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (char c : text) {
    if (c == '"') out += '"';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out + '"';
}

std::vector<std::string> split_csv(const std::string& line) {
  std::vector<std::string> fields(1);
  bool inside = false;
  for (std::size_t k = 0; k < line.size(); ++k) {
    if (line[k] == '"') {
      if (inside && k + 1 < line.size() && line[k + 1] == '"') fields.back() += line[k++];
      else inside = !inside;
    } else if (line[k] == ',' && !inside) {
      fields.emplace_back();
    } else {
      fields.back() += line[k];
    }
  }
  return fields;
}

std::optional<double> number(std::string_view word) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::optional<std::map<std::string, Spread>> parse_spreads(const std::string& field) {
  std::map<std::string, Spread> measured;
  std::istringstream words(field);
  std::string word;
  while (words >> word) {
    const auto equals = word.find('=');
    if (equals == std::string::npos) return std::nullopt;
    std::istringstream parts(word.substr(equals + 1));
    std::vector<double> four;
    for (std::string part; std::getline(parts, part, '|');) {
      const auto value = number(part);
      if (!value) return std::nullopt;
      four.push_back(*value);
    }
    if (four.size() != 4) return std::nullopt;
    measured[word.substr(0, equals)] = {four[0], four[1], four[2], four[3]};
  }
  return measured;
}

std::optional<Point> parse(const std::string& line) {
  const std::vector<std::string> f = split_csv(line);
  if (f.size() != kColumns) return std::nullopt;
  const auto value = number(f[3]), runs = number(f[4]);
  const auto measured = parse_spreads(f[15]);
  if (!value || !runs || !measured) return std::nullopt;
  return Point{f[0], f[1], f[2], *value, static_cast<int>(*runs), f[5], *measured, f[11], f[12], f[13], f[14]};
}

}  // namespace

double Point::median(const std::string& name) const {
  const auto at = measured.find(name);
  return at == measured.end() ? std::numeric_limits<double>::quiet_NaN() : at->second.median;
}

std::string csv_header() {
  return "study,curve,setting,value,runs,failure,error,seconds_min,seconds_q1,seconds_median,seconds_q3,scene,commit,"
         "machine,compiler,quantities";
}

std::string csv_line(const Point& p) {
  std::ostringstream out;
  out << std::setprecision(10);
  const auto at = p.measured.find("seconds");
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const Spread seconds = at == p.measured.end() ? Spread{nan, nan, nan, nan} : at->second;
  out << quoted(p.study) << ',' << quoted(p.curve) << ',' << quoted(p.label) << ',' << p.value << ',' << p.runs << ','
      << quoted(p.failure) << ',' << p.median("error") << ',' << seconds.low << ',' << seconds.q1 << ',' << seconds.median
      << ',' << seconds.q3 << ',' << quoted(p.scene_hash) << ',' << quoted(p.commit) << ',' << quoted(p.machine) << ','
      << quoted(p.compiler) << ",\"";
  const char* gap = "";
  for (const auto& [name, s] : p.measured) {
    out << gap << name << '=' << s.low << '|' << s.q1 << '|' << s.median << '|' << s.q3;
    gap = " ";
  }
  out << '"';
  return out.str();
}

std::vector<Point> read_points(const std::filesystem::path& file) {
  std::vector<Point> points;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (auto point = parse(line)) points.push_back(std::move(*point));
  }
  return points;
}

bool is_quick(const Point& point) { return point.commit.ends_with(kQuickMark); }

const Point* find_point(const std::vector<Point>& points, const Point& wanted) {
  const Point* found = nullptr;
  for (const Point& p : points) {
    const bool same = p.study == wanted.study && p.curve == wanted.curve && p.label == wanted.label &&
                      p.scene_hash == wanted.scene_hash && p.commit == wanted.commit;
    // One run is enough to know that a setting fails.
    if (same && (p.runs >= wanted.runs || !p.failure.empty())) found = &p;
  }
  return found;
}

}  // namespace crumple::lab::chart
