#pragma once

#include "common/error.h"
#include "common/types.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

namespace crumple::io {

using Json = nlohmann::json;

// A glTF 2 file (.gltf, .glb) that has passed check_gltf, with its buffers: the glTF 2.0 specification (Khronos, 2021),
// sections 3.6 (buffers, views, accessors, sparse ones too) and 3.5 (nodes). Assimp 5.2 is not used for rigs: it mixes
// the joints of all skins and the channels of all animations, and knows four weights a vertex.
// Nothing here throws, whatever the file holds.
class GltfDocument {
 public:
  // Errors name the file and the field: those of check_gltf; a buffer that is missing, outside of the file's folder,
  // too short, or no base64; compression (Draco, meshopt), which is not read.
  static Result<GltfDocument> read(const std::filesystem::path& file);

  const std::string& name() const { return name_; }
  std::unexpected<Error> fault(const std::string& message) const { return invalid(name_, message); }

  const Json& root() const { return json_; }
  // The document's own lists; empty where the file has none.
  const Json& list(const char* key) const { return list_of(json_, key); }
  // A list or an object of any object; empty where it has none, or something else.
  static const Json& list_of(const Json& object, const char* key);
  static const Json& object_of(const Json& object, const char* key);
  static std::string name_of(const Json& object, const std::string& otherwise);
  // object[key] where it is a whole number, `missing` where there is none; -1: anything else, or negative.
  static std::int64_t whole_number(const Json& object, const char* key, std::int64_t missing);
  static bool has(const Json& object, const char* key) { return object.is_object() && object.contains(key); }

  // An index into a list of `size` at object[key]; `where` is the object's path. Errors: none, or out of range.
  Result<int> index(const Json& object, const char* key, std::size_t size, const std::string& where) const;
  // The entry of a document's list that object[key] names.
  Result<const Json*> entry(const Json& object, const char* key, const char* list, const std::string& where) const;

  // The numbers of an accessor that object[key] names: one column an item; normalised integers as fractions.
  // components: the numbers an item may have (3: VEC3, 16: MAT4). Errors: those of the bounds of views and buffers, a
  // number that is not finite.
  Result<Eigen::MatrixXd> accessor(const Json& object, const char* key, std::initializer_list<int> components,
                                   const std::string& where) const;

 private:
  struct View {
    const unsigned char* data;
    std::size_t length;
    std::size_t stride;  // 0: packed
  };
  Result<View> view(const Json& object, const std::string& where) const;
  Result<void> read_items(const View& view, std::size_t offset, int component_type, bool normalised,
                          Eigen::MatrixXd& out, const std::string& where) const;
  Result<void> apply_sparse(const Json& sparse, int component_type, bool normalised, Eigen::MatrixXd& out,
                            const std::string& where) const;

  std::string name_;
  Json json_;
  std::vector<std::string> buffers_;
};

}  // namespace crumple::io
