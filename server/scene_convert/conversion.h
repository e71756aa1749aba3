#pragma once

#include "server/scene_convert/mesh_source.h"
#include "server/sim/limits.h"
#include "server/sim/mesh/splinters.h"

#include <map>
#include <memory>
#include <string>
#include <utility>

// What the conversion of one scene carries along. Converters return a value in any case; it counts only while
// `breach.ok()`, and nothing expensive happens after the first breach.
namespace crumple::scene_convert {

struct Conversion {
  const MeshSource& files;
  sim::FirstBreach breach;

  // Sources that are equal are made once and shared, by the bytes of their message.
  std::map<std::string, std::shared_ptr<const sim::SurfaceMesh>> surfaces;
  std::map<std::string, std::shared_ptr<const sim::SplinterMesh>> splinter_meshes;
  std::map<std::string, std::shared_ptr<const sim::TetMesh>> tet_meshes;
  std::map<std::string, std::shared_ptr<const sim::example_based::ExampleSet>> example_sets;

  // The value, or a default one and a breach whose path is `field` followed by the error's own.
  template <class T>
  T value(Result<T>&& result, const std::string& field) {
    if (result) return *std::move(result);
    const Error& error = result.error();
    breach.take(std::unexpected(Error{error.code, join(field, error.field), error.message}));
    return T();
  }

  static std::string join(const std::string& field, const std::string& rest) {
    if (rest.empty() || field.empty()) return field + rest;
    return rest.front() == '.' || rest.front() == '[' ? field + rest : field + "." + rest;
  }
};

inline std::string entry(const std::string& list, int i) { return list + "[" + std::to_string(i) + "]"; }

}  // namespace crumple::scene_convert
