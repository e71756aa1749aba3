#include "server/sim/contact/tet_overlap.h"

#include "server/sim/quad.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

namespace crumple::sim::contact {
namespace {

constexpr std::array<std::array<int, 3>, 4> kFace{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

// Of the overlap's widest face: a share of the surface below this is its rim, above twice this it counts in full. Between the two a
// row grows: one that comes and goes in full, with a depth and a direction of its own, shakes the corner it stands at.
constexpr double kRim = 0.3;

// A corner of a polygon, and how far it lies above the planes that the polygon is clipped by: four, or one. In between both are linear.
struct alignas(32) Corner {
  std::array<double, 4> p;      // [m], from where moments are taken; the last is 0
  std::array<double, 4> above;  // [m]
};

// A planar convex polygon; a triangle clipped by four planes has at most seven corners.
using Corners = std::array<Corner, 8>;
struct Polygon {
  const Corner* corner = nullptr;
  int count = 0;
};

Corner between(const Corner& a, const Corner& b, double t) {
  Corner c;
  const Quad part = quad(t), p = load_four(a.p.data()), above = load_four(a.above.data());
  const Quad p_c = multiply_add(part, load_four(b.p.data()) - p, p);
  const Quad above_c = multiply_add(part, load_four(b.above.data()) - above, above);
  std::memcpy(c.p.data(), &p_c, sizeof p_c);
  std::memcpy(c.above.data(), &above_c, sizeof above_c);
  return c;
}

// Keeps the part that is not above plane k, in `kept`. Points within eps of the plane count as inside. If the whole polygon lies in the
// plane it stays, or goes if `drop_coplanar`: of two coincident faces the overlap has one.
Polygon clip(const Polygon& polygon, int k, double eps, bool drop_coplanar, Corners& kept) {
  std::array<double, 8> d;
  double lowest = 0, highest = 0;
  for (int i = 0; i < polygon.count; ++i) {
    d[i] = polygon.corner[i].above[k];
    lowest = std::min(lowest, d[i]);
    highest = std::max(highest, d[i]);
  }
  if (highest <= eps) return drop_coplanar && lowest >= -eps ? Polygon{} : polygon;
  int count = 0;
  for (int i = 0; i < polygon.count; ++i) {
    const int j = i + 1 == polygon.count ? 0 : i + 1;
    if (d[i] <= eps) kept[count++] = polygon.corner[i];
    if (count == 8) break;  // only rounding can get here: a convex polygon crosses a plane twice
    const bool crosses = (d[i] > eps && d[j] < -eps) || (d[i] < -eps && d[j] > eps);
    if (crosses) kept[count++] = between(polygon.corner[i], polygon.corner[j], d[i] / (d[i] - d[j]));
    if (count == 8) break;
  }
  return {kept.data(), count};
}

Vec3 point(const Corner& corner) { return {corner.p[0], corner.p[1], corner.p[2]}; }

// Volume and first moment by the divergence theorem, as signed tets between the corners' origin and the faces' triangles.
struct Moments {
  double six_volume = 0;
  Vec3 moment = Vec3::Zero();  // of 24 V centroid

  Vec3 add(const Polygon& polygon) {  // the polygon's area vector
    Vec3 twice = Vec3::Zero();
    const Vec3 a = point(polygon.corner[0]);
    Vec3 b = point(polygon.corner[1]);
    for (int i = 2; i < polygon.count; ++i) {
      const Vec3 c = point(polygon.corner[i]);
      const Vec3 n = (b - a).cross(c - a);
      const double v = a.dot(n);
      twice += n;
      six_volume += v;
      moment += v * (a + b + c);
      b = c;
    }
    return 0.5 * twice;
  }
  double volume() const { return six_volume / 6; }
  Vec3 centroid() const { return moment / (4 * six_volume); }
};

// Rounding of a distance between points and planes at these coordinates, with two orders to spare.
double tolerance(const Mat34& x) { return 1e-14 * (1 + x.cwiseAbs().maxCoeff()); }

// Of each node of `b` (column) above each face of `a` (row) [m].
Eigen::Matrix4d heights(const OrientedTet& a, const OrientedTet& b) { return (a.n * b.x).colwise() - a.offset; }

bool separated_by_faces(const Eigen::Matrix4d& heights, double eps) {
  const Eigen::Vector4d lowest =
      heights.col(0).cwiseMin(heights.col(1)).cwiseMin(heights.col(2).cwiseMin(heights.col(3)));
  return lowest.maxCoeff() >= -eps;
}

// A tet's nodes as corners.
std::array<Corner, 4> corners_of(const OrientedTet& tet, const Vec3& origin, const Eigen::Matrix4d& heights) {
  std::array<Corner, 4> corners;
  for (int i = 0; i < 4; ++i) {
    const Vec3 p = tet.x.col(i) - origin;
    corners[i].p = {p.x(), p.y(), p.z(), 0};
    std::copy_n(heights.col(i).data(), 4, corners[i].above.begin());
  }
  return corners;
}

// Turned outwards: kFace is for positive volume, an inverted tet's faces turn the other way round.
Polygon face_of(const OrientedTet& tet, int f, const std::array<Corner, 4>& corners, Corners& face) {
  const auto& [i, j, l] = kFace[f];
  face[0] = corners[i];
  face[1] = corners[tet.inverted ? l : j];
  face[2] = corners[tet.inverted ? j : l];
  return {face.data(), 3};
}

// Face f of `own`, whose corners are above the other's faces by `heights`, clipped by these.
Polygon clipped_face(const OrientedTet& own, int f, const std::array<Corner, 4>& corners, const Eigen::Matrix4d& heights, double eps,
                     bool drop_coplanar, std::array<Corners, 2>& scratch) {
  const auto& [i, j, l] = kFace[f];
  const Eigen::Vector4d lowest = heights.col(i).cwiseMin(heights.col(j)).cwiseMin(heights.col(l));
  if (lowest.maxCoeff() > eps) return {};
  const Eigen::Vector4d highest = heights.col(i).cwiseMax(heights.col(j)).cwiseMax(heights.col(l));
  Polygon face = face_of(own, f, corners, scratch[0]);
  for (int k = 0; k < 4 && face.count > 0; ++k) {
    if (highest[k] > eps || (drop_coplanar && lowest[k] >= -eps))
      face = clip(face, k, eps, drop_coplanar, scratch[face.corner == scratch[0].data() ? 1 : 0]);
  }
  return face;
}

// The exterior face of `tet` nearest to p, as its outward normal; zero if there is none. `distance` is improved.
Vec3 nearest_exterior_normal(const OrientedTet& tet, std::uint8_t exterior, const Vec3& p, double& distance) {
  Vec3 normal = Vec3::Zero();
  for (int k = 0; k < 4; ++k) {
    const double d = tet.offset[k] - tet.n.row(k).dot(p);
    if ((exterior >> k & 1) == 0 || d >= distance) continue;
    distance = d;
    normal = tet.normal(k);
  }
  return normal;
}

}  // namespace

OrientedTet orient(const Mat34& x) {
  OrientedTet tet;
  tet.x = x;
  const Vec3 e1 = x.col(1) - x.col(0), e2 = x.col(2) - x.col(0), e3 = x.col(3) - x.col(0);
  const double six_volume = e1.cross(e2).dot(e3);
  const double longest = std::sqrt(std::max({e1.squaredNorm(), e2.squaredNorm(), e3.squaredNorm()}));
  if (!(std::abs(six_volume) > 1e-9 * longest * longest * longest)) return tet;  // flat: no usable planes
  tet.inverted = six_volume < 0;
  const double sign = tet.inverted ? -1 : 1;
  for (int k = 0; k < 4; ++k) {
    const Vec3 o = x.col(kFace[k][0]);
    const Vec3 n = sign * (x.col(kFace[k][1]) - o).cross(x.col(kFace[k][2]) - o).normalized();
    tet.n.row(k) = n.transpose();
    tet.offset[k] = n.dot(o);
    tet.height[k] = n.dot(o - x.col(k));
  }
  tet.volume = std::abs(six_volume) / 6;
  return tet;
}

Eigen::Vector4d barycentric(const OrientedTet& tet, const Vec3& p) {
  Eigen::Vector4d b = (tet.offset - tet.n * p).cwiseQuotient(tet.height);
  return b / b.sum();
}

TetOverlap overlap(const OrientedTet& a, const OrientedTet& b) {
  assert(a.volume > 0 && b.volume > 0);
  TetOverlap result;
  const double eps = std::max(tolerance(a.x), tolerance(b.x));
  const Eigen::Matrix4d b_above_a = heights(a, b);
  if (separated_by_faces(b_above_a, eps)) return result;
  const Eigen::Matrix4d a_above_b = heights(b, a);
  if (separated_by_faces(a_above_b, eps)) return result;

  // The boundary of a convex overlap is: each face of one, clipped by all planes of the other.
  const Vec3 origin = a.x.rowwise().mean();
  const std::array<Corner, 4> corners_a = corners_of(a, origin, a_above_b), corners_b = corners_of(b, origin, b_above_a);
  const Eigen::Vector4d reach_a = b_above_a.rowwise().maxCoeff(), reach_b = a_above_b.rowwise().maxCoeff();
  std::array<Corners, 2> scratch;
  Moments moments;
  for (int f = 0; f < 8; ++f) {
    result.face_area[f].setZero();
    if ((f < 4 ? reach_a[f] : reach_b[f - 4]) < -eps) continue;  // all of the other tet lies below the face
    // Faces that coincide and look the same way: the first tet's stays. Looking opposite ways, the tets only touch,
    // which separated_by_faces has excluded.
    const Polygon face = f < 4 ? clipped_face(a, f, corners_a, a_above_b, eps, false, scratch)
                               : clipped_face(b, f - 4, corners_b, b_above_a, eps, true, scratch);
    if (face.count < 3) continue;
    result.face_area[f] = moments.add(face);
    for (int i = 0; i < face.count; ++i) result.corners[result.corner_count++] = origin + point(face.corner[i]);
  }
  if (!(moments.volume() > 1e-12 * std::min(a.volume, b.volume))) return result;
  result.volume = moments.volume();
  result.centroid = origin + moments.centroid();
  return result;
}

ContactNormal contact_normal(const TetOverlap& overlap, const OrientedTet& a, const OrientedTet& b,
                             std::uint8_t exterior_a, std::uint8_t exterior_b) {
  // Why exterior faces only: the faces between the tets of one body are cuts that the mesher chose. They bound the
  // overlap of two *tets* but not that of the two *bodies*; their normals point along the surface and would let a flat
  // contact push sideways. Summed over all pairs they cancel, pair by pair they do not.
  Vec3 r_a = Vec3::Zero(), r_b = Vec3::Zero();
  for (int k = 0; k < 4; ++k) {
    if (exterior_a >> k & 1) r_a -= overlap.face_area[k];
    if (exterior_b >> k & 1) r_b += overlap.face_area[4 + k];
  }
  // "Either one of the tetrahedra": both, weighted by their areas, so that r changes continuously when a face enters
  // the overlap, and swapping the two bodies gives exactly the opposite force.
  const double area_a = r_a.norm(), area_b = r_b.norm();
  const double face = std::cbrt(overlap.volume * overlap.volume);
  double widest = 0;
  for (const Vec3& area : overlap.face_area) widest = std::max(widest, area.norm());
  Vec3 r = (area_a * r_a + area_b * r_b) / std::max(area_a + area_b, 1e-300);
  // A thin overlap parts across its width. Where the surface has a share of its rim only, as under the side faces of a
  // block that rests on another, r would push along it: V/|r| then is a length of the overlap, not its depth.
  if (r.norm() > kRim * widest) return {r, true, std::min(r.norm() / (kRim * widest) - 1, 1.0)};
  if (area_a + area_b > 1e-3 * face) return {r, false};

  // No surface takes part: deep overlap. All faces of the first, as printed in the paper ...
  r.setZero();
  for (int k = 0; k < 4; ++k) r -= overlap.face_area[k];
  if (r.norm() > 1e-3 * face) return {r, false};
  // ... and if one tet lies wholly inside the other these cancel too: out through the nearest face of the surface.
  double distance = std::numeric_limits<double>::infinity();
  const Vec3 from_a = nearest_exterior_normal(a, exterior_a, overlap.centroid, distance);
  const double distance_a = distance;
  const Vec3 from_b = nearest_exterior_normal(b, exterior_b, overlap.centroid, distance);
  return {face * (distance < distance_a ? from_b : Vec3(-from_a)), false};
}

HalfSpaceOverlap overlap(const OrientedTet& tet, const Vec3& normal, double offset) {
  assert(tet.volume > 0);
  HalfSpaceOverlap result;
  const Eigen::RowVector4d d = (normal.transpose() * tet.x).array() - offset;
  const double eps = tolerance(tet.x);
  if (d.minCoeff() >= -eps) return result;
  // With its origin in the plane the cut itself adds nothing to volume or moment: it need not be built.
  const Vec3 middle = tet.x.rowwise().mean();
  const Vec3 origin = middle - (normal.dot(middle) - offset) * normal;
  Eigen::Matrix4d above = Eigen::Matrix4d::Zero();
  above.row(0) = d;
  const std::array<Corner, 4> corners = corners_of(tet, origin, above);
  std::array<Corners, 2> scratch;
  Moments moments;
  Vec3 area = Vec3::Zero();
  for (int f = 0; f < 4; ++f) {
    const Polygon face = clip(face_of(tet, f, corners, scratch[0]), 0, eps, true, scratch[1]);
    if (face.count >= 3) area += moments.add(face);
  }
  if (!(moments.volume() > 1e-12 * tet.volume)) return result;
  result.volume = moments.volume();
  result.centroid = origin + moments.centroid();
  result.area = d.maxCoeff() <= eps ? 0 : std::max(0.0, -area.dot(normal));
  return result;
}

double overlap_depth(double volume, double area) {
  const double cube_root = std::cbrt(volume);
  return area * cube_root > volume ? volume / area : cube_root;
}

}  // namespace crumple::sim::contact
