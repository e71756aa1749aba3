#pragma once

#include "server/sim/mesh/embedding.h"
#include "server/sim/mesh/shared_faces.h"
#include "server/sim/mesh/splinters.h"

#include <Eigen/Geometry>

namespace crumple::sim {

// Splinters carried by a tet mesh that breaks [Parker & O'Brien 2009, section 5]. Each is at home in the tet that holds its
// centroid. Its vertices belong to the tets that hold them, until such a tet is no longer connected to the home; then to
// the nearest one that is. Nearest: at rest. Connected: through shared faces of tets near the splinter, those whose boxes
// meet its own, so that a crack that runs past a splinter parts it from what is beyond even if the body is still in one
// piece around the end of the crack (the paper does not say which connection it means).
// What belongs where follows from the faces that are whole, not from the order in which others parted.
class SplinterEmbedding {
 public:
  // `mesh` must be that of `faces`; copies what it needs of both.
  SplinterEmbedding(const SplinterMesh& splinters, const TetMesh& mesh, const SharedFaces& faces);

  // parted: faces that have come apart since the last call.
  void follow(const SharedFaces& faces, std::span<const int> parted);

  const Embedding& vertices() const { return vertices_; }
  int home(int splinter) const { return home_[splinter]; }
  // The lowest vertex at the same place at rest, to a thousandth of a millionth of the whole. They belong to the same tet to
  // begin with.
  int twin(int vertex) const { return twin_[vertex]; }
  // All tets near it are still connected to its home: what lies against it cannot be seen.
  bool is_whole(int splinter) const { return whole_[splinter] != 0; }

 private:
  void settle(int splinter, const SharedFaces& faces);
  int reach(int splinter, const SharedFaces& faces);

  std::vector<Vec3> rest_;                      // of vertices [m]
  std::vector<int> twin_;
  Embedding vertices_;
  std::vector<int> home_;
  std::vector<char> whole_;
  std::vector<int> near_at_rest_;               // how many near tets are connected to the home at rest
  std::vector<int> vertex_begin_, vertex_id_;   // the vertices of each splinter
  std::vector<int> near_begin_, near_;          // the tets near each splinter, ascending
  std::vector<Mat34> near_corners_;             // of these at rest [m]
  std::vector<int> link_begin_;                 // of each splinter, into links_
  struct Link { int face, a, b; };              // a, b: of the splinter's near tets
  std::vector<Link> links_;
  std::vector<int> user_begin_, user_;          // the splinters near each shared face
  std::vector<int> group_;                      // scratch of reach: one a near tet
  std::vector<char> touched_;                   // scratch of follow
};

}  // namespace crumple::sim
