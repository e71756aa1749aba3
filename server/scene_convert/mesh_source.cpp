#include "server/scene_convert/mesh_source.h"

namespace crumple::scene_convert {
namespace {

std::unexpected<Error> no_file(const std::string& name) {
  return invalid("", "is \"" + name + "\", must be given inline: a call brings no files");
}

}  // namespace

Result<sim::SurfaceMesh> NoFiles::surface(const std::string& name) const { return no_file(name); }
Result<sim::TetMesh> NoFiles::tets(const std::string& name) const { return no_file(name); }
Result<sim::example_based::ExampleSet> NoFiles::examples(const std::string& name) const { return no_file(name); }

}  // namespace crumple::scene_convert
