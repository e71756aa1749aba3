// crumple-rig: from an artist's mesh to an example-based asset (Jones et al. 2016, sections 4 and 5).
// Exit: 0 done; 2 bad input; 1 anything else.
#include "server/rig/break_command.h"
#include "server/rig/crush_command.h"
#include "server/rig/make_command.h"
#include "server/rig/pose_command.h"
#include "server/rig/show_command.h"

using namespace crumple;
using namespace crumple::rig;

int main(int argc, char** argv) {
  CLI::App app{
      "Makes an example-based asset of a mesh (OBJ, glTF, PLY, STL, OFF, FBX): encloses it in tets, places handles, "
      "weighs\n"
      "them, takes example poses from animations, morph targets, files or sides pressed in. Prints one JSON object.\n"
      "crumple-rig MESH --out ASSET; the commands below go on from there. Exit 0: done, 2: bad input, 1: anything "
      "else."};
  app.require_subcommand(0, 1);
  MakeCommand make;
  RigOutputs outputs, pose_outputs, crush_outputs;
  app.add_option("mesh", make.mesh, "the artist's mesh");
  make.add_to(app);
  add_outputs(app, outputs, "the asset file, required: .crumple-asset, or JSON if it ends in .json");

  PoseCommand pose;
  auto* p = app.add_subcommand("pose", "adds an example by moving handles of an asset");
  pose.add_to(*p);
  add_outputs(*p, pose_outputs, "another asset file; default: the same");

  CrushCommand crush;
  auto* c = app.add_subcommand("crush", "adds examples by pressing sides in, simulated");
  crush.add_to(*c);
  add_outputs(*c, crush_outputs, "the asset file; default: the same, where an asset is given");

  BreakCommand breaking;
  auto* b = app.add_subcommand("break", "breaks an asset into parts that hold together until they are struck");
  breaking.add_to(*b);

  ShowCommand show;
  auto* s = app.add_subcommand("show", "prints an asset's handles and examples");
  show.add_to(*s);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (p->parsed()) return pose.run(pose_outputs);
  if (c->parsed()) return crush.run(crush_outputs);
  if (b->parsed()) return breaking.run();
  if (s->parsed()) return show.run();
  if (outputs.asset.empty()) return fail(invalid("--out", "is missing, must name the asset file").error());
  return make.run(outputs);
}
