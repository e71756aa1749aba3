#include "server/worker/job.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include "server/sim/world.h"
#include "tests/support/kuhn_lattice.h"
#include "tests/support/temporary_folder.h"

namespace crumple::worker {
namespace {

namespace fs = std::filesystem;

// A soft block that falls, a ball beside it, a ground below.
sim::SceneDescription small_scene() {
  sim::SceneDescription scene;
  sim::FemModel soft;
  soft.mesh = std::make_shared<sim::TetMesh>(test::kuhn_lattice({2, 1, 1}, 0.5));
  soft.material.cg_tolerance = 1e-8;
  scene.bodies.push_back({.name = "soft block", .pose = {Quat::Identity(), Vec3(0, 0.02, 0)}, .model = soft});
  sim::RigidModel ball;
  ball.shapes.push_back({Pose{}, sim::Sphere{0.2}});
  scene.bodies.push_back({.name = "ball", .pose = {Quat::Identity(), Vec3(3, 1, 0)}, .model = ball});
  sim::RigidModel ground{.kind = sim::RigidKind::fixed};
  ground.shapes.push_back({Pose{}, sim::Plane{}});
  scene.bodies.push_back({.name = "ground", .model = ground});
  scene.script.push_back({0.02, sim::ApplyImpulse{.body = 1, .impulse = Vec3(1, 0, 0), .point = Vec3(3, 1, 0)}});
  return scene;
}

Job small_job(const fs::path& out) {
  Job job{.scene = small_scene(), .steps = 12, .out = out};
  job.recording = {.every = 4, .frames = true, .vtu = true, .ply = true, .csv = true};
  return job;
}

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  EXPECT_TRUE(in) << file;
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> lines(const fs::path& file) {
  std::vector<std::string> all;
  std::istringstream in(content(file));
  for (std::string line; std::getline(in, line);) all.push_back(line);
  return all;
}

int count(const std::string& all, const std::string& part) {
  int n = 0;
  for (std::size_t at = all.find(part); at != std::string::npos; at = all.find(part, at + 1)) ++n;
  return n;
}

// The text between an array's tags.
std::string array(const std::string& xml, const std::string& name) {
  const std::size_t tag = xml.find("Name=\"" + name + "\"");
  EXPECT_NE(tag, std::string::npos) << name;
  const std::size_t from = xml.find('>', tag) + 1;
  return xml.substr(from, xml.find('<', from) - from);
}

std::string decoded(const std::string& base64) {
  const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned group = 0;
  int bits = 0;
  for (const char c : base64) {
    if (c == '=') break;
    group = group << 6 | static_cast<unsigned>(alphabet.find(c));
    if ((bits += 6) < 8) continue;
    bytes += static_cast<char>(group >> (bits -= 8) & 255);
  }
  return bytes;
}

// Tags close in the order in which they were opened.
bool well_formed(const std::string& xml) {
  std::vector<std::string> open;
  for (std::size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at + 1)) {
    const std::size_t end = xml.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = xml.substr(at + 1, end - at - 1);
    if (tag.starts_with("?") || tag.ends_with("/")) continue;
    if (!tag.starts_with("/")) {
      open.push_back(tag.substr(0, tag.find(' ')));
    } else if (open.empty() || open.back() != tag.substr(1)) {
      return false;
    } else {
      open.pop_back();
    }
  }
  return open.empty();
}

TEST(Job, StepsTheWorldAsIfItWereSteppedDirectly) {
  const test::TemporaryFolder folder;
  Job job = small_job(folder.path() / "out");
  auto world = *sim::World::create(job.scene);
  for (int k = 0; k < job.steps; ++k) world->step();
  std::vector<int> steps;
  const auto report = run_job(job, [&](int k) { steps.push_back(k); });
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_EQ(report->state_hash, world->state_hash());
  ASSERT_EQ(steps.size(), 12u);
  EXPECT_EQ(steps.back(), 12);
  std::ostringstream hash;
  hash << std::hex << report->state_hash;
  const std::string result = content(job.out / "result.json");
  EXPECT_NE(result.find(hash.str()), std::string::npos) << result;
  EXPECT_NE(result.find("\"steps\": 12"), std::string::npos) << result;
  job.threads = 2;
  EXPECT_EQ(run_job(job, [](int) {})->state_hash, report->state_hash);
}

TEST(Job, WritesASeriesOfVtuFilesThatItsPvdNames) {
  const test::TemporaryFolder folder;
  const Job job = small_job(folder.path() / "out");
  ASSERT_TRUE(run_job(job, [](int) {}));
  const std::string pvd = content(job.out / "0_soft_block.pvd");
  EXPECT_TRUE(well_formed(pvd)) << pvd;
  EXPECT_EQ(count(pvd, "<DataSet "), 4);
  for (const char* step : {"000000", "000004", "000008", "000012"}) {
    const std::string name = std::string("0_soft_block/") + step + ".vtu";
    EXPECT_EQ(count(pvd, "file=\"" + name + "\""), 1) << pvd;
    const std::string xml = content(job.out / name);
    EXPECT_TRUE(well_formed(xml));
    EXPECT_NE(xml.find("NumberOfPoints=\"12\" NumberOfCells=\"12\""), std::string::npos);
    for (const auto& [array_name, size] : std::map<std::string, std::size_t>{{"Points", 12 * 3 * 8}, {"connectivity", 12 * 4 * 4},
                                                                              {"offsets", 12 * 4}, {"types", 12}, {"velocity", 12 * 3 * 8},
                                                                              {"von_mises", 12 * 8}, {"plastic_strain", 12 * 8}}) {
      const std::string bytes = decoded(array(xml, array_name));
      ASSERT_EQ(bytes.size(), size + 4) << array_name;
      std::uint32_t stated = 0;
      std::memcpy(&stated, bytes.data(), 4);
      EXPECT_EQ(stated, size) << array_name;
    }
  }
  // The last points are those of the last step.
  auto world = *sim::World::create(job.scene);
  for (int k = 0; k < job.steps; ++k) world->step();
  const std::string points = decoded(array(content(job.out / "0_soft_block/000012.vtu"), "Points"));
  for (int n = 0; n < 12; ++n) {
    Vec3 x;
    std::memcpy(x.data(), points.data() + 4 + 24 * n, 24);
    EXPECT_EQ(x, world->fem(0).x[n]) << n;
  }
}

TEST(Job, WritesMovingBodiesAsPlyInTheWorld) {
  const test::TemporaryFolder folder;
  const Job job = small_job(folder.path() / "out");
  ASSERT_TRUE(run_job(job, [](int) {}));
  const auto world = *sim::World::create(job.scene);
  const BodyTopology& ball = world->topology().bodies[1];
  const std::string ply = content(job.out / "1_ball/000000.ply");
  const std::size_t header = ply.find("end_header\n") + 11;
  EXPECT_TRUE(ply.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(ball.vertices.size()) + "\n"));
  EXPECT_NE(ply.find("element face " + std::to_string(ball.triangles.size()) + "\n"), std::string::npos);
  EXPECT_EQ(ply.size() - header, ball.vertices.size() * 12 + ball.triangles.size() * 13);
  for (std::size_t v = 0; v < ball.vertices.size(); ++v) {
    Vec3f x;
    std::memcpy(x.data(), ply.data() + header + 12 * v, 12);
    EXPECT_NEAR((x - Vec3f(3, 1, 0)).norm(), 0.2, 1e-5);
  }
  EXPECT_FALSE(fs::exists(job.out / "2_ground"));  // does not move
  EXPECT_FALSE(fs::exists(job.out / "1_ball.pvd"));
}

TEST(Job, WritesOneRowARecordOrStepOrEvent) {
  const test::TemporaryFolder folder;
  const Job job = small_job(folder.path() / "out");
  ASSERT_TRUE(run_job(job, [](int) {}));
  const auto energies = lines(job.out / "energies.csv"), timings = lines(job.out / "timings.csv"), events = lines(job.out / "events.csv");
  ASSERT_EQ(energies.size(), 1u + 4);
  EXPECT_EQ(energies[0], "step,time,kinetic,elastic,gravitational,px,py,pz,Lx,Ly,Lz");
  for (const std::string& row : energies) EXPECT_EQ(std::count(row.begin(), row.end(), ','), 10) << row;
  EXPECT_TRUE(energies[4].starts_with("12,0.1")) << energies[4];
  ASSERT_EQ(timings.size(), 1u + 12);
  for (const std::string& row : timings) EXPECT_EQ(std::count(row.begin(), row.end(), ','), 14) << row;
  ASSERT_EQ(events.size(), 1u + 1);
  EXPECT_EQ(std::count(events[0].begin(), events[0].end(), ','), 11);
  EXPECT_TRUE(events[1].starts_with("1,3,") && events[1].find(",script,1,") != std::string::npos) << events[1];
}

TEST(Job, WritesOnlyWhatIsAskedFor) {
  const test::TemporaryFolder folder;
  Job job = small_job(folder.path() / "out");
  job.recording = {.every = 1, .frames = false, .vtu = false, .ply = false, .csv = false};
  ASSERT_TRUE(run_job(job, [](int) {}));
  const std::vector<fs::directory_entry> all(fs::directory_iterator(job.out), {});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].path().filename(), "result.json");
}

TEST(Job, ARepeatReplacesTheFolderAndGivesTheSameFiles) {
  const test::TemporaryFolder folder;
  const Job job = small_job(folder.path() / "out");
  ASSERT_TRUE(run_job(job, [](int) {}));
  const std::string before = content(job.out / "0_soft_block/000012.vtu"), recording = content(job.out / "recording.crumple"),
                    energies = content(job.out / "energies.csv");
  folder.write("out/left_over.txt", "of an older run");
  folder.write("out.part/half.txt", "of a run that was stopped");
  ASSERT_TRUE(run_job(job, [](int) {}));
  EXPECT_FALSE(fs::exists(job.out / "left_over.txt"));
  EXPECT_FALSE(fs::exists(job.out / "half.txt"));
  EXPECT_FALSE(fs::exists(folder.path() / "out.part"));
  EXPECT_EQ(content(job.out / "0_soft_block/000012.vtu"), before);
  EXPECT_EQ(content(job.out / "recording.crumple"), recording);
  EXPECT_EQ(content(job.out / "energies.csv"), energies);
}

TEST(Job, AFolderThatCannotBeWrittenIsAnErrorBeforeAnyStep) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.write("file", "not a folder");
  int steps = 0;
  const auto report = run_job(small_job(file / "out"), [&](int) { ++steps; });
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::unavailable);
  EXPECT_NE(report.error().text().find("cannot be written"), std::string::npos) << report.error().text();
  EXPECT_EQ(steps, 0);
}

TEST(Job, ABadSceneIsItsOwnErrorAndWritesNothing) {
  const test::TemporaryFolder folder;
  Job job = small_job(folder.path() / "out");
  job.scene.dt = 0;
  const auto report = run_job(job, [](int) {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().field, "dt");
  EXPECT_FALSE(fs::exists(job.out));
}

}  // namespace
}  // namespace crumple::worker
