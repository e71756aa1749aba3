#pragma once

#include "server/sim/mesh/embedding.h"
#include "server/sim/mesh/shared_faces.h"
#include "server/sim/mesh/splinters.h"
#include "server/sim/mesh/tet_tree.h"

#include <Eigen/Geometry>

namespace crumple::sim {

// Splinters carried by a tet mesh that breaks [Parker & O'Brien 2009, section 5]. Each is at home in the tet that holds its
// centroid. Its vertices belong to the tets that hold them, until such a tet is no longer connected to the home; then to
// the nearest one that is. Nearest: at rest. Connected: through shared faces of tets near the splinter, those that its hull
// meets, so that a crack that runs past a splinter parts it from what is beyond even if the body is still in one
// piece around the end of the crack (the paper does not say which connection it means).
// What belongs where follows from the faces that are whole, not from the order in which others parted.
class SplinterEmbedding {
 public:
  // `mesh` must be that of `faces`; copies what it needs of both. INVALID if splinters lie in too many tets, kMaxNear in all.
  static Result<SplinterEmbedding> make(const SplinterMesh& splinters, const TetMesh& mesh, const SharedFaces& faces);
  static constexpr std::size_t kMaxNear = 10'000'000;

  // parted: faces that have come apart since the last call.
  void follow(const SharedFaces& faces, std::span<const int> parted);

  const Embedding& vertices() const { return vertices_; }
  // The lowest vertex at the same place at rest, to a thousandth of a millionth of the whole.
  int twin(int vertex) const { return twin_[vertex]; }
  // Nobody sees the patch: its corners, and those of what lies against it, are where they were at rest, in tets that are
  // connected to the homes of both.
  bool is_hidden(int patch) const;

 private:
  SplinterEmbedding(const SplinterMesh& splinters, const TetMesh& mesh, const TetTree& tree);
  Result<void> find_near(const TetMesh& mesh, const TetTree& tree, const SharedFaces& faces);
  void add_near(int splinter, std::vector<int> near, std::span<const int> known,
                const std::vector<std::vector<std::pair<int, int>>>& beyond, const SharedFaces& faces);
  void drop_last_near(int splinter);
  std::span<const int> vertices_of(int splinter) const;
  std::span<const int> near_of(int splinter) const;
  void find_connected(int splinter, const SharedFaces& faces);
  void move_vertices(int splinter);  // from tets that are not connected to the home
  void look_at_patches_of(int splinter);
  bool is_closed(int patch) const;

  std::vector<Vec3> rest_;                      // of vertices [m]
  std::vector<int> twin_;
  Embedding vertices_;
  std::vector<int> tet_at_rest_;
  std::vector<int> home_;
  std::vector<int> vertex_begin_, vertex_id_;   // the vertices of each splinter
  std::vector<int> near_begin_, near_;          // the tets near each splinter, ascending
  std::vector<char> connected_;                 // of these: to the home
  std::vector<Mat34> corners_of_tet_;           // at rest [m]
  std::vector<int> link_begin_;                 // of each splinter, into links_
  struct Link { int face, a, b; };              // a, b: of the splinter's near tets
  std::vector<Link> links_;
  std::vector<int> user_begin_, user_;          // the splinters near each shared face
  std::vector<SplinterMesh::Patch> patches_;
  std::vector<std::vector<int>> corners_;       // vertices of each patch
  std::vector<std::vector<int>> own_, against_; // patches of each splinter, and those that lie against it
  std::vector<char> closed_;                    // of patches: as far as their own corners go
  std::vector<int> group_;                      // scratch of find_connected: one a near tet
  std::vector<char> touched_;                   // scratch of follow
};

}  // namespace crumple::sim
