#include "server/lab/stability/stored_mesh.h"

#include <nlohmann/json.hpp>

#include <fstream>

namespace crumple::lab::stability {

std::optional<sim::TetMesh> stored_mesh(const std::filesystem::path& file) {
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object() || !json.contains("nodes") || !json.contains("tets")) return std::nullopt;
  sim::TetMesh mesh;
  for (const auto& node : json["nodes"]) mesh.X.emplace_back(node.at(0), node.at(1), node.at(2));
  for (const auto& tet : json["tets"]) mesh.tets.push_back({tet.at(0), tet.at(1), tet.at(2), tet.at(3)});
  return mesh;
}

}  // namespace crumple::lab::stability
