#pragma once

#include "common/frame.h"

#include <span>
#include <vector>

// Most of what is drawn moves rigidly, in pieces: all of an unbroken body, or each of its shards. A frame then says how each piece
// has moved since the body's topology, and its vertices by what they are off that.
namespace crumple {

// Vertices of one body by the piece they belong to. Two are of one piece if a chain of triangles joins them. A chain of fewer than
// kSmallestPiece vertices would save less than its motion takes: what is left so makes one last piece, whatever it is.
struct DrawnPieces {
  static constexpr int kSmallestPiece = 8;

  std::vector<int> piece_of;  // vertex -> piece; pieces are numbered by their lowest vertex
  int count = 0;
};

DrawnPieces drawn_pieces(const BodyTopology& body);

// x = R X + t, from where a piece's vertices were at the time of the topology to where they are.
struct PieceMotion {
  Eigen::Quaternionf R = Eigen::Quaternionf::Identity();
  Vec3f t = Vec3f::Zero();  // [m]

  Mat3 rotation() const { return R.cast<double>().toRotationMatrix(); }
};

// The rigid motion of each piece that is nearest to its vertices in least squares. X, x: positions then and now, one a vertex.
std::vector<PieceMotion> nearest_motions(const DrawnPieces& pieces, std::span<const Vec3f> X, std::span<const Vec3f> x);

}  // namespace crumple
