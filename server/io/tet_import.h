#pragma once

#include "server/sim/mesh/tet_mesh.h"

#include <filesystem>
#include <string_view>

namespace crumple::io {

struct ImportedTets {
  sim::TetMesh mesh;
  int flipped = 0;         // tets of negative volume, turned round
  int unused_nodes = 0;    // nodes of no tet, dropped
  int other_elements = 0;  // points, lines, triangles ... of a gmsh file, left out
};

// Reads a tet mesh by the file's ending: TetGen (.node or .ele; the other one lies beside it), gmsh ASCII 2.x and
// 4.1 (.msh), Vega (.veg with TETS). What parts a file has become the mesh's tags; materials are not looked at. Units are
// the file's.
// Errors name file, line and value, or, for what validate(TetMesh) rejects, the file and the tet.
Result<ImportedTets> import_tets(const std::filesystem::path& file);

// The same from text. `name` stands in errors.
// TetGen: ids start at 0 or 1, as the first node says, and run on; the first four nodes of ten-node tets are used. Tags
// are the tets' first attributes if all of them are whole numbers.
Result<ImportedTets> read_tetgen(std::string_view node_text, std::string_view ele_text, const std::string& node_name,
                                 const std::string& ele_name);
// gmsh: node tags are arbitrary; the four-node tets (type 4) are read, second-order ones (type 11) are an error. Tags are
// the (first) physical groups of the tets or their volumes; 0: none.
Result<ImportedTets> read_gmsh(std::string_view text, const std::string& name);
// Vega: *VERTICES and *ELEMENTS TETS, ids from 0 or 1; *INCLUDE is an error. Tags number the *REGION sections from 1 on;
// a tet in the sets of several has the last one's, 0: none.
Result<ImportedTets> read_vega(std::string_view text, const std::string& name);

}  // namespace crumple::io
