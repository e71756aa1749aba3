#include "server/authoring/glass_shards.h"

#include "server/sim/scatter.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

namespace crumple::authoring {
namespace {

using Vec2 = Eigen::Vector2d;

constexpr double kTurn = 0.7;   // a cut is that far from square to a piece's length, at most [rad]
constexpr double kShift = 0.2;  // and misses its middle by that part of its width, at most
constexpr int kRim = -1;

struct Piece {
  std::vector<Vec2> corners;
  std::vector<int> line;  // one an edge: the cut that it lies on, or the rim
};

struct Line {
  Vec2 at, along;
};

double area(const std::vector<Vec2>& p) {
  double twice = 0;
  for (std::size_t k = 1; k + 1 < p.size(); ++k) {
    const Vec2 a = p[k] - p[0], b = p[k + 1] - p[0];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

// The part on the left of a line, or on its right.
Piece part(const Piece& piece, const Line& line, int id, int side) {
  const auto height = [&](const Vec2& p) {
    const Vec2 d = p - line.at;
    return side * (line.along.x() * d.y() - line.along.y() * d.x());
  };
  Piece out;
  const std::size_t n = piece.corners.size();
  for (std::size_t k = 0; k < n; ++k) {
    const Vec2 &a = piece.corners[k], &b = piece.corners[(k + 1) % n];
    const double ha = height(a), hb = height(b);
    if (ha > 0) {
      out.corners.push_back(a);
      out.line.push_back(piece.line[k]);
    }
    if ((ha > 0) == (hb > 0)) continue;
    out.corners.push_back(a + ha / (ha - hb) * (b - a));
    out.line.push_back(ha > 0 ? id : piece.line[k]);
  }
  return out;
}

class Breaker {
 public:
  Breaker(double size, std::uint64_t seed) : largest_(size * size), random_(seed) {}

  void cut(Piece piece) {
    if (area(piece.corners) <= largest_) {
      pieces_.push_back(std::move(piece));
      return;
    }
    const int id = static_cast<int>(lines_.size());
    lines_.push_back(across(piece.corners));
    const Line line = lines_.back();
    cut(part(piece, line, id, 1));
    cut(part(piece, line, id, -1));
  }

  std::vector<Shard> finish() const {
    std::vector<Shard> shards;
    std::map<int, std::vector<Reach>> on;  // by line
    for (const Piece& piece : pieces_) {
      const int id = static_cast<int>(shards.size());
      Shard& shard = shards.emplace_back();
      shard.corners = piece.corners;
      for (std::size_t k = 0; k < piece.corners.size(); ++k) {
        const Vec2 &a = piece.corners[k], &b = piece.corners[(k + 1) % piece.corners.size()];
        const Vec2 way = (b - a).normalized();
        const Vec2 normal(way.y(), -way.x());
        shard.edges.push_back({normal, normal.dot(a), {}});
        if (piece.line[k] == kRim) continue;
        const Line& line = lines_[piece.line[k]];
        const double from = line.along.dot(a - line.at), to = line.along.dot(b - line.at);
        on[piece.line[k]].push_back({id, static_cast<int>(k), from < to, std::min(from, to), std::max(from, to)});
      }
    }
    for (const auto& [line, reaches] : on) {
      for (const Reach& own : reaches)
        for (const Reach& other : reaches)
          if (own.left != other.left && std::min(own.to, other.to) - std::max(own.from, other.from) > 1e-9 * (own.to - own.from))
            shards[own.shard].edges[own.edge].neighbours.push_back(other.shard);
    }
    return shards;
  }

 private:
  struct Reach {
    int shard, edge;
    bool left;
    double from, to;  // along the line
  };

  // Roughly square to the piece's longest way, roughly through its middle.
  Line across(const std::vector<Vec2>& corners) {
    Vec2 middle = Vec2::Zero(), length = Vec2::Zero();
    for (const Vec2& p : corners) {
      middle += p / static_cast<double>(corners.size());
      for (const Vec2& q : corners)
        if ((q - p).norm() > length.norm()) length = q - p;
    }
    const double turn = std::atan2(length.y(), length.x()) + M_PI / 2 + kTurn * number();
    return {middle + kShift * number() * length, Vec2(std::cos(turn), std::sin(turn))};
  }

  double number() { return 2 * sim::unit_interval(random_()) - 1; }  // [-1, 1)

  double largest_;
  std::mt19937_64 random_;
  std::vector<Line> lines_;
  std::vector<Piece> pieces_;
};

}  // namespace

std::vector<Shard> glass_shards(const Vec2& low, const Vec2& high, double size, std::uint64_t seed) {
  Breaker breaker(size, seed);
  breaker.cut({{low, Vec2(high.x(), low.y()), high, Vec2(low.x(), high.y())}, {kRim, kRim, kRim, kRim}});
  return breaker.finish();
}

}  // namespace crumple::authoring
