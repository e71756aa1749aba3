#pragma once

#include "common/error.h"
#include "common/types.h"
#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/scene.h"

#include <span>
#include <vector>

// Mass, centre and inertia of solids of uniform density, exact for each of these shapes: closed forms, and for meshes
// the integrals of 1, x and x x^T over tetrahedra (divergence theorem).
namespace crumple::sim {

struct MassProperties {
  double mass = 0;              // [kg]
  Vec3 com = Vec3::Zero();      // centre of mass [m]
  Mat3 inertia = Mat3::Zero();  // about the centre of mass, in the axes of `com` [kg m^2]
};

MassProperties box_mass(const Vec3& half_extents, double density);
MassProperties sphere_mass(double radius, double density);
MassProperties cylinder_mass(double radius, double half_length, double density);  // axis y

// What the triangles enclose. The mesh must be closed and outward; an inward one has negative mass, an open one a mass
// that depends on where its hole is.
MassProperties closed_mesh_mass(const SurfaceMesh& mesh, double density);

// Each tet t carries tet_masses[t] [kg], evenly spread over its present shape x (inverted tets, too): so the mass stays
// while the shape changes (Jones et al. 2016, section 3.3; FORMULAS F11).
MassProperties tet_mass(std::span<const Tet> tets, std::span<const Vec3> x, std::span<const double> tet_masses);
std::vector<double> tet_masses(const TetMesh& mesh, double density);  // density * fill * rest volume

MassProperties point_mass(std::span<const Vec3> x, std::span<const double> masses);

// Sum of parts; where parts overlap, mass counts twice.
MassProperties combined(std::span<const MassProperties> parts);
// The same solid after X_BS: from the axes S to the axes B.
MassProperties placed(const MassProperties& properties, const Pose& X_BS);
// The same solid of another mass > 0 (density scaled).
MassProperties with_mass(const MassProperties& properties, double mass);
// Inertia about a point p in the same axes (parallel axes).
Mat3 inertia_about(const MassProperties& properties, const Vec3& p);

// Of a moving body's shapes. Errors, prefixed by `field`: a plane, points that span no volume, triangles that enclose
// no volume, no shape, mass that is not a positive number.
Result<MassProperties> shapes_mass(const std::vector<PlacedShape>& shapes, double density, const std::string& field);

// inertia = R_BP diag(moments) R_BP^T. R_BP is the rotation (det +1) nearest to the identity among the 24 orders and
// signs of the axes, so it is a deterministic function of its argument and does not jump while the body deforms a
// little; exactly the identity where `inertia` is diagonal to 1e-12. Moments are at least 1e-6 of the largest
// (STABILITY row 38: a needle still has an inverse).
struct PrincipalAxes {
  Mat3 R_BP = Mat3::Identity();
  Vec3 moments = Vec3::Ones();
};
PrincipalAxes principal_axes(const Mat3& inertia);

}  // namespace crumple::sim
