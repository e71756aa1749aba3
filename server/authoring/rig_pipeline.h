#pragma once

#include "server/authoring/enclosing_mesh.h"
#include "server/authoring/artist_mesh.h"
#include "server/authoring/example_author.h"
#include "server/authoring/rig_from_shapes.h"
#include "server/authoring/rig_handles.h"

#include <functional>

// From what an artist made to an asset: algorithm 1 of Jones et al. 2016, section 4, in one call.
namespace crumple::authoring {

struct RigOptions {
  EnclosingOptions enclosing;  // cell size or tet budget
  bool keep_lattice = false;   // tets of the lattice; else drawn onto the surface and pushed out until they enclose its
                               // vertices (boundary_fit.h), so that the body touches where it is drawn; where that does
                               // not enclose all, those of the lattice, and a warning
  GivenHandles handles;        // beside those of the mesh
  enum class Joints {
    points,
    bones                      // from each joint to the middle of its children; a joint without any is a point
  } joints = Joints::points;   // what the mesh's joints are to weights that are computed
  int automatic_handles = -1;  // added; -1: kDefaultHandles where no handle is given, else none
  enum class Weights {
    by_mesh,             // painted where the mesh has joint weights, no other handles and no bones are asked for, else
                         // bounded biharmonic
    painted,             // the mesh's own joint weights, carried to the tets
    bounded_biharmonic,  // rig_weights.h
    gaussian
  } weights = Weights::by_mesh;
  double tolerance = 0;    // above 0: handles are added until the mesh's copies are met (rig_from_shapes.h), to this
                           // part of their displacement, (0, 1]; bounded biharmonic weights
  int most_handles = 128;  // of these and all others, [1, kMaxBones]
  bool painted_regions = false;  // the mesh's colours scale alpha and beta (painted_regions.h)
  std::vector<NamedPose> poses;  // beside the mesh's own poses and copies
  enum class Crushed {
    where_no_other,
    always,
    never
  } crushed = Crushed::where_no_other;  // a pose for each side of the box
  double crush_depth = 0.25;            // of the extent along the push, (0, 0.6]
  int convex_parts = 0;                 // slabs along the longest axis; 0: its ratio to the second longest, at most 6
};

inline constexpr int kDefaultHandles = 24;

struct RigReport {
  int vertices = 0, triangles = 0;  // of the surface
  int vertices_enclosed = 0;        // by the tets: all
  EnclosingReport enclosing;
  int nodes = 0, tets = 0;
  int given_handles = 0, automatic_handles = 0;
  int bones = 0, cage_edges = 0, cage_faces = 0;               // among those given
  RigOptions::Weights weights = RigOptions::Weights::by_mesh;  // that were made: never by_mesh
  std::vector<ShapeRigRound> rounds;                           // of adding handles; empty without a tolerance
  bool tolerance_met = true;
  std::vector<ExampleReport> examples;  // without the rest pose
  std::vector<std::string> warnings;
};

struct RiggedAsset {
  sim::example_based::ExampleSet set;  // passes validate
  RigReport report;
};

// Called at each stage with the part of the work that is done, in [0, 1], and what comes next.
using RigProgress = std::function<void(double done, const std::string& stage)>;

// Errors name option, value and rule: enclosing_mesh's, bounded_biharmonic_weights' and rig_from_shapes'; handles above
// 1024, none at all, two of one name, a given one farther outside of the tets than they are long, what
// validate(GivenHandles) rejects; Gaussian weights of bones or cages; a pose that names no handle; painted weights or
// colours where there are none, or painted weights with handles that the mesh has not; a tolerance with other weights
// than bounded biharmonic or without copies; more than 64 examples; a copy of another number of vertices; crush_depth
// or convex_parts out of range; a surface too thin for a convex part. Any other handle outside of the tets acts on what
// is nearest, with a warning.
Result<RiggedAsset> make_asset(const ArtistMesh& mesh, const RigOptions& options, const RigProgress& progress = {});

}  // namespace crumple::authoring
