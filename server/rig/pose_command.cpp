#include "server/rig/pose_command.h"

#include "server/authoring/example_author.h"
#include "server/rig/rig_summary.h"

#include <algorithm>
#include <cmath>
#include <iostream>

namespace crumple::rig {

void PoseCommand::add_to(CLI::App& app) {
  app.add_option("asset", asset, "an asset of crumple-rig")->required();
  app.add_option("--name", name, "of the new example")->required();
  app.add_option("--handle", moves,
                 "NAME X Y Z: where a handle goes [m]; again for the next one. How it "
                 "turns, and what handles do that are not named, keeps the body as rigid as possible");
  app.add_option("--turn", turns, "NAME X Y Z: how it turns, axis times angle [degrees]; 0 0 0: not at all");
  app.add_flag("--hold", hold, "handles that are not named stay as they are at rest");
}

int PoseCommand::run(RigOutputs outputs) const {
  if (outputs.asset.empty()) outputs.asset = asset;
  if (auto valid = outputs.check({}); !valid) return fail(valid.error());
  auto set = read_set(asset);
  if (!set) return fail(set.error(), asset);
  authoring::NamedPose pose{name, {}};
  const auto move_of = [&](const std::string& handle) -> authoring::HandleMove& {
    const auto at = std::ranges::find(pose.moves, handle, &authoring::HandleMove::handle);
    if (at != pose.moves.end()) return *at;
    return pose.moves.emplace_back(authoring::HandleMove{.handle = handle, .position = {}, .rotation = {}});
  };
  for (const auto& [handle, x, y, z] : moves) {
    auto& move = move_of(handle);
    if (move.position) return fail(invalid("--handle", "\"" + handle + "\" is moved twice").error());
    move.position = Vec3(x, y, z);
  }
  for (const auto& [handle, x, y, z] : turns) {
    const Vec3 turn = Vec3(x, y, z) * (M_PI / 180);
    move_of(handle).rotation =
        turn.norm() > 0 ? Quat(Eigen::AngleAxisd(turn.norm(), turn.normalized())) : Quat::Identity();
  }
  if (pose.moves.empty()) return fail(invalid("--handle", "is missing, must name a handle and where it goes").error());
  using authoring::UnnamedHandles;
  const auto added = authoring::ExampleAuthor(*set).add_pose(pose, hold ? UnnamedHandles::held : UnnamedHandles::free);
  if (!added) return fail(added.error(), asset);
  nlohmann::json result = summary(*set);
  result["posed"] = summary(*added);
  if (auto written = outputs.write(*set, result); !written) return fail(written.error());
  std::cout << result.dump(2) << "\n";
  return 0;
}

}  // namespace crumple::rig
