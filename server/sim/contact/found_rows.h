#pragma once

#include "server/sim/contact/collision_mesh.h"
#include "server/sim/contact/contact_rows.h"

#include <array>
#include <vector>

namespace crumple::sim::contact {

bool share_a_node(const Tet& a, const Tet& b);

// What the tets of two pieces give where they overlap, by what is known of its direction, before it is rows of the pair.
struct FoundRows {
  using Tets = std::array<const CollisionTet*, 2>;  // of a row's sides
  struct OneKind {
    std::vector<ContactRow> rows;
    std::vector<Tets> tets;
    void leave_out_slivers();
  };
  OneKind surface;
  // Pairs of tets without a face of the surface in their overlap say nothing about the direction. They count only where
  // there is nothing better, when two bodies have gone deep into each other; beside a resting contact they would push
  // sideways.
  OneKind buried;
  bool certain = false;  // a row of `surface` counts in full: no other is needed

  void clear();
  void push(const ContactRow& row, const Tets& tets, bool from_surface);
  // Leaves out what is next to nothing beside a row that holds the same nodes: less than 0.03 of the area of the widest row of one of
  // its tets, where that row's other tet shares a node with its own. (A floor is one tet for all feet of a table, which are held by
  // none but their own rows.) Of two pieces, not of one with itself.
  void leave_out_slivers();
  void append_to(std::vector<ContactRow>& rows, bool surface_alone) const;
};

}  // namespace crumple::sim::contact
