#pragma once

#include "common/types.h"

#include <cstdint>
#include <span>
#include <vector>

namespace crumple::sim::contact {

struct CollisionTet {
  int id;                  // of the tet in its mesh
  Tet nodes;
  std::uint8_t exterior;   // bit k: the face opposite node k belongs to the surface
  bool operator==(const CollisionTet&) const = default;
};

// A face-connected part: an unbroken body has one, a shattered one hundreds.
struct CollisionComponent {
  int begin, boundary_end, end;  // its tets in CollisionMesh::tets, those with an exterior face first
  double volume;                 // at rest [m^3]
  double mass;                   // [kg]
  double thickness;              // at rest, 2 V / A of its surface's area A: a plate's own, a third of a cube's edge [m]
  int first_node, end_node;      // its nodes in CollisionMesh::nodes
  bool operator==(const CollisionComponent&) const = default;
};

// What contact needs of a tet mesh besides positions, and its pieces and surface: made when a body loads and again when it splits, cut
// down when pieces leave.
struct CollisionMesh {
  std::vector<CollisionTet> tets;              // by component, ascending id within both parts of it
  std::vector<CollisionComponent> components;  // by their lowest tet
  std::vector<int> nodes;                      // by component, none twice in one

  bool operator==(const CollisionMesh&) const = default;
  std::span<const int> nodes_of(const CollisionComponent& component) const {
    return std::span(nodes).subspan(component.first_node, component.end_node - component.first_node);
  }
};

// tet_mass: mass of each tet [kg]; empty for rigid proxies, whose mass is their body's.
CollisionMesh make_collision_mesh(const std::vector<Tet>& tets, const std::vector<Vec3>& X,
                                  std::span<const double> tet_mass);

// The same of some of its components, ascending, tets and nodes under their new ids, which ascend as the old ones do. new_tet: one a
// tet, new_node: one a node; read of what is kept.
CollisionMesh kept_components(const CollisionMesh& mesh, std::span<const int> components, std::span<const int> new_tet,
                              std::span<const int> new_node);

// Triangles of the exterior faces, in the order of surface_faces.
void append_surface(const CollisionMesh& mesh, std::vector<Triangle>& triangles);

}  // namespace crumple::sim::contact
