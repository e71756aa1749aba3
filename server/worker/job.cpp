#include "server/worker/job.h"

#include "common/channel_values.h"
#include "common/text.h"
#include "server/io/ply_writer.h"
#include "server/io/recording.h"
#include "server/io/vtu_writer.h"
#include "server/io/write_file.h"

#include <chrono>
#include <iomanip>
#include <map>
#include <optional>
#include <sstream>

namespace crumple::worker {
namespace {

namespace fs = std::filesystem;

double now_ms() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// A body's name as a file name: letters, digits, - and _ stay, the id makes it unique.
std::string file_stem(BodyId id, const std::string& name) {
  std::string stem = text(id, "_");
  for (const char c : name) stem += std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' ? c : '_';
  return stem;
}

std::string record_name(int step) {
  std::ostringstream name;
  name << std::setw(6) << std::setfill('0') << step;
  return name.str();
}

// A field of a CSV file: quoted, quotes doubled.
std::string quoted(const std::string& value) {
  std::string result = "\"";
  for (const char c : value) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

// What is written along the way.
class Output {
 public:
  Output(const Job& job, fs::path folder) : job_(job), folder_(std::move(folder)) {
    energies_ << std::setprecision(17) << "step,time,kinetic,elastic,gravitational,px,py,pz,Lx,Ly,Lz\n";
    events_ << std::setprecision(17) << "sequence,step,time,kind,body,x,y,z,magnitude,count,fragments,message\n";
    timings_ << "step,ms,contacts,solver_iterations,worst_residual,capped_solves,splits,plastic_impulses,worst_penetration_m,"
                "live_tets,asleep_tets,live_nodes,live_bodies,asleep_bodies,rigid_fragments\n";
  }

  Result<void> open() {
    if (!job_.recording.frames) return {};
    auto recording = io::Recording::create(folder_ / "recording.crumple");
    if (!recording) return std::unexpected(recording.error());
    recording_ = std::move(*recording);
    return {};
  }

  Result<void> record(const sim::World& world, int step) {
    if (step % job_.recording.every != 0) return {};
    if (recording_) {
      if (auto written = recording_->write_frame(world); !written) return written;
    }
    if (job_.recording.csv) add_energies(world);
    return write_meshes(world, step);
  }

  Result<void> events(const std::vector<sim::Event>& events) {
    for (const sim::Event& event : events) {
      if (recording_) {
        if (auto written = recording_->write_event(event); !written) return written;
      }
      events_ << event.sequence << ',' << event.step << ',' << event.time << ',' << sim::name(event.kind) << ',' << event.body << ','
              << event.point.x() << ',' << event.point.y() << ',' << event.point.z() << ',' << event.magnitude << ','
              << event.count << ',' << event.fragments << ',' << quoted(event.message) << '\n';
    }
    return {};
  }

  void timing(const sim::StepReport& r, double ms) {
    timings_ << r.step << ',' << ms << ',' << r.contacts << ',' << r.solver_iterations << ',' << r.worst_residual << ','
             << r.capped_solves << ',' << r.splits << ',' << r.plastic_impulses << ',' << r.worst_penetration << ','
             << r.workload.live_tets << ',' << r.workload.asleep_tets << ',' << r.workload.live_nodes << ','
             << r.workload.live_bodies << ',' << r.workload.asleep_bodies << ','
             << r.workload.rigid_fragments << '\n';
  }

  Result<void> finish(const std::string& result) {
    if (recording_) {
      if (auto done = recording_->finish(); !done) return done;
    }
    for (const auto& [stem, series] : series_) {
      if (auto done = io::write_pvd(folder_ / (stem + ".pvd"), series); !done) return done;
    }
    if (job_.recording.csv) {
      for (const auto& [name, content] : {std::pair{"energies.csv", &energies_}, {"events.csv", &events_}, {"timings.csv", &timings_}}) {
        if (auto done = io::write_file(folder_ / name, content->str()); !done) return done;
      }
    }
    return io::write_file(folder_ / "result.json", result);
  }

 private:
  void add_energies(const sim::World& world) {
    const sim::Energies e = world.energies();
    energies_ << world.step_count() << ',' << world.time() << ',' << e.kinetic << ',' << e.elastic << ',' << e.gravitational;
    for (const Vec3& v : {e.momentum, e.angular_momentum}) energies_ << ',' << v.x() << ',' << v.y() << ',' << v.z();
    energies_ << '\n';
  }

  Result<void> write_meshes(const sim::World& world, int step) {
    if (!job_.recording.vtu && !job_.recording.ply) return {};
    const Frame frame = world.capture(true);
    for (const BodyTopology& body : world.topology().bodies) {
      const bool soft = body.model == BodyModel::fem;
      if (soft ? !job_.recording.vtu : !job_.recording.ply || body.model == BodyModel::fixed) continue;
      const std::string stem = file_stem(body.id, body.name);
      std::error_code failure;
      fs::create_directories(folder_ / stem, failure);
      if (soft) {
        const std::string file = stem + "/" + record_name(step) + ".vtu";
        series_[stem].times.push_back(world.time());
        series_[stem].files.push_back(file);
        if (auto written = io::write_vtu(folder_ / file, world.fem(body.id)); !written) return written;
        continue;
      }
      std::vector<Vec3f> x = frame.bodies[body.id].positions;
      if (!body.deformable) {
        for (const Vec3f& v : body.vertices) x.push_back((frame.bodies[body.id].pose * v.cast<double>()).cast<float>());
      }
      auto written = io::write_ply(folder_ / stem / (record_name(step) + ".ply"), x, body.triangles, sum_of_channels(frame.bodies[body.id].values, x.size()));
      if (!written) return written;
    }
    return {};
  }

  const Job& job_;
  fs::path folder_;
  std::optional<io::Recording> recording_;
  std::map<std::string, io::VtuSeries> series_;
  std::ostringstream energies_, events_, timings_;
};

std::string result_json(const Job& job, const JobReport& report) {
  std::ostringstream out;
  out << "{\"state_hash\": \"" << std::hex << std::setw(16) << std::setfill('0') << report.state_hash << std::dec
      << "\", \"steps\": " << job.steps << ", \"dt\": " << std::setprecision(17) << job.scene.dt << ", \"splits\": " << report.splits
      << ", \"plastic_impulses\": " << report.plastic_impulses << ", \"capped_solves\": " << report.capped_solves
      << ", \"wall_ms\": " << report.wall_ms << "}\n";
  return out.str();
}

}  // namespace

Result<JobReport> run_job(const Job& job, const std::function<void(int)>& on_step) {
  auto made = sim::World::create(job.scene, {.threads = job.threads});
  if (!made) return std::unexpected(made.error());
  sim::World& world = **made;

  const auto unwritable = [&](const std::error_code& failure) {
    return std::unexpected(Error{ErrorCode::unavailable, job.out.string(), "cannot be written: " + failure.message()});
  };
  fs::path part = job.out;
  part += ".part";
  std::error_code failure;
  fs::remove_all(part, failure);
  if (!fs::create_directories(part, failure)) return unwritable(failure);

  Output output(job, part);
  if (auto opened = output.open(); !opened) return std::unexpected(opened.error());
  if (auto recorded = output.record(world, 0); !recorded) return std::unexpected(recorded.error());
  JobReport report;
  for (int k = 1; k <= job.steps; ++k) {
    const double start = now_ms();
    const sim::StepReport step = world.step();
    const double ms = now_ms() - start;
    report.wall_ms += ms;
    report.splits += step.splits;
    report.plastic_impulses += step.plastic_impulses;
    report.capped_solves += step.capped_solves;
    output.timing(step, ms);
    if (auto written = output.events(world.take_events()); !written) return std::unexpected(written.error());
    if (auto recorded = output.record(world, k); !recorded) return std::unexpected(recorded.error());
    on_step(k);
  }
  report.state_hash = world.state_hash();
  if (auto finished = output.finish(result_json(job, report)); !finished) return std::unexpected(finished.error());

  fs::remove_all(job.out, failure);
  fs::rename(part, job.out, failure);
  if (failure) return unwritable(failure);
  return report;
}

}  // namespace crumple::worker
