#include "server/rig/rig_summary.h"

namespace crumple::rig {
namespace {

const char* source_name(authoring::ExampleReport::Source source) {
  using Source = authoring::ExampleReport::Source;
  switch (source) {
    case Source::animation:
      return "animation";
    case Source::copy:
      return "copy";
    case Source::handles:
      return "handles";
    case Source::crushed:
      break;
  }
  return "crushed";
}

const char* weights_name(authoring::RigOptions::Weights weights) {
  using Weights = authoring::RigOptions::Weights;
  return weights == Weights::painted ? "painted" : weights == Weights::gaussian ? "gaussian" : "biharmonic";
}

}  // namespace

nlohmann::json summary(const authoring::ExampleReport& e) {
  using Source = authoring::ExampleReport::Source;
  nlohmann::json out{{"name", e.name}, {"source", source_name(e.source)}};
  if (e.source == Source::copy || e.source == Source::crushed) {
    out["residual_rms"] = e.residual_rms;
    out["residual_largest"] = e.residual_largest;
    out["residual_relative"] = e.residual_relative;
  } else if (e.strain > 0) {
    out["strain"] = e.strain;
  }
  return out;
}

nlohmann::json summary(const authoring::RigReport& r) {
  nlohmann::json examples = nlohmann::json::array();
  for (const auto& e : r.examples) examples.push_back(summary(e));
  nlohmann::json out{{"vertices", r.vertices},
                     {"triangles", r.triangles},
                     {"vertices_enclosed", r.vertices_enclosed},
                     {"vertices_enclosed_percent", r.vertices > 0 ? 100.0 * r.vertices_enclosed / r.vertices : 0.0},
                     {"cell_size", r.enclosing.cell_size},
                     {"parts", r.enclosing.bodies},
                     {"pinched_nodes", r.enclosing.pinched_nodes},
                     {"nodes", r.nodes},
                     {"tets", r.tets},
                     {"handles",
                      {{"given", r.given_handles},
                       {"automatic", r.automatic_handles},
                       {"bones", r.bones},
                       {"cage_edges", r.cage_edges},
                       {"cage_triangles", r.cage_faces}}},
                     {"examples", examples},
                     {"weights", weights_name(r.weights)},
                     {"warnings", r.warnings}};
  if (r.rounds.empty()) return out;
  out["tolerance_met"] = r.tolerance_met;
  for (const auto& round : r.rounds)
    out["rounds"].push_back({{"handles", round.handles}, {"residual_relative", round.relative}});
  return out;
}

nlohmann::json summary(const sim::example_based::ExampleSet& set) {
  nlohmann::json handles = nlohmann::json::array(), examples = nlohmann::json::array();
  for (const auto& h : set.handles)
    handles.push_back({{"name", h.name}, {"position", {h.position.x(), h.position.y(), h.position.z()}}});
  for (const auto& e : set.examples) examples.push_back(e.name);
  return {{"nodes", set.vertex_count()},
          {"tets", set.mesh.tet_count()},
          {"bones", set.bone_count()},
          {"handles", handles},
          {"examples", examples},
          {"convex_parts", set.convex_parts.size()},
          {"regions", !set.alpha_scale.empty() || !set.beta_scale.empty()}};
}

}  // namespace crumple::rig
