#include "server/lab/roofline.h"

#include "common/text.h"
#include "server/lab/benchmark_scenes.h"
#include "server/lab/clock.h"
#include "server/lab/median.h"
#include "server/sim/fem/assembly.h"
#include "server/sim/linear_solver/block_jacobi.h"
#include "server/sim/linear_solver/conjugate_gradient.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

namespace crumple::lab {
namespace {

namespace fem = sim::fem;
namespace ls = sim::linear_solver;

constexpr int kTriadChunk = 1 << 15;  // entries
constexpr int kVectorChunk = 4096;
constexpr int kCgIterations = 20;

// Median time of a call [us], after one that is not counted.
double median_us(int repeats, const std::function<void()>& call) {
  call();
  std::vector<double> us;
  for (int k = 0; k < repeats; ++k) {
    const double start = now_ms();
    call();
    us.push_back(1000 * (now_ms() - start));
  }
  return median(std::move(us));
}

template <class T>
double bytes_of(const std::vector<T>& array) {
  return static_cast<double>(sizeof(T) * array.size());
}

// A loop's traffic: bytes of a call, and of all different arrays together.
struct Traffic {
  double call = 0, arrays = 0;
};

double triad_us(std::vector<double>& a, const std::vector<double>& b, const std::vector<double>& c, int repeats,
                const sim::ThreadPool& pool) {
  const auto body = [&](int begin, int end) {
    for (int i = begin; i < end; ++i) a[i] = b[i] + 3.0 * c[i];
  };
  return median_us(repeats, [&] { pool.for_chunks(static_cast<int>(a.size()), kTriadChunk, std::cref(body)); });
}

// The step's system of a beam that is bent a little and moves, in one precision or the other.
struct BeamSystem {
  std::vector<Tet> tets;
  fem::RestBody rest;
  fem::FemState state;
  Eigen::VectorXd f_ext;
  std::vector<fem::PrescribedNode> held;
  fem::StepSystem in_double{false}, in_float{true};

  void assemble(fem::StepSystem& system, const sim::ThreadPool& pool) {
    fem::assemble(rest, tets, state, f_ext, 1.0 / 60, held, pool, system);
  }
};

Result<BeamSystem> make_system(const RooflineOptions& options) {
  auto scene = beam_scene({.cells = options.cells});
  if (!scene) return std::unexpected(scene.error());
  const sim::FemModel& model = std::get<sim::FemModel>(scene->bodies.front().model);
  auto rest = fem::make_rest_body(*model.mesh, model.material);
  if (!rest) return std::unexpected(rest.error());
  BeamSystem beam{.tets = model.mesh->tets, .rest = std::move(*rest), .state = {}, .f_ext = {}, .held = {}};
  const std::vector<Vec3>& X = model.mesh->X;
  beam.state.x = X;
  for (Vec3& x : beam.state.x) x.y() -= 0.02 * x.x() * x.x();
  beam.state.v.assign(X.size(), Vec3(0, -0.1, 0));
  beam.f_ext = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(X.size()));
  for (const int node : model.motions.front().nodes) beam.held.push_back({node, Vec3::Zero()});
  const sim::ThreadPool pool(1);
  beam.assemble(beam.in_double, pool);
  beam.assemble(beam.in_float, pool);
  return beam;
}

Traffic matvec_traffic(const fem::StepSystem& system) {
  return std::visit(
      [](const auto& A) {
        const double scalar = sizeof(*A.values()), blocks = A.block_count(), rows = A.rows();
        const double bytes = blocks * (9 * scalar + sizeof(int)) + rows * (sizeof(int) + sizeof(Mat3) + 2 * sizeof(Vec3));
        return Traffic{bytes, bytes};
      },
      system.A);
}

Traffic assembly_traffic(const BeamSystem& beam) {
  const fem::StepSystem& s = beam.in_double;
  const fem::RestBody& rest = beam.rest;
  const double blocks = sizeof(Mat3) * 2.0 * s.connectivity.edge_count();
  const double vectors = sizeof(Vec3) * static_cast<double>(s.node_count());
  const double element_in = bytes_of(beam.tets) + bytes_of(rest.beta) + bytes_of(rest.volume) + bytes_of(rest.fill) + bytes_of(beam.state.plastic_strain);
  const double element_out = bytes_of(s.elements.Q) + bytes_of(s.elements.sigma) + bytes_of(s.elements.force) + bytes_of(s.elements.core);
  const double read_again = bytes_of(s.elements.force) + bytes_of(s.elements.core) + blocks;
  const double lists = bytes_of(s.connectivity.edge_corners) + bytes_of(s.connectivity.edge_start) + bytes_of(s.edge_blocks) +
                       bytes_of(s.connectivity.node_corners) + bytes_of(s.connectivity.node_start);
  // x, v twice (into the guess and the right-hand side), f_ext, guess, b; the diagonal is three vectors.
  const double nodes = 9 * vectors + bytes_of(rest.node_mass) + bytes_of(s.row_mass);
  const double arrays = element_in + element_out + blocks + lists + nodes - vectors;
  return {arrays + vectors + read_again, arrays};
}

// Conjugate gradients around a diagonal matrix: what else an iteration does. The preconditioner is the identity.
double cg_us(const Eigen::VectorXd& diagonal, int repeats, const sim::ThreadPool& pool) {
  const Eigen::VectorXd b = Eigen::VectorXd::Ones(diagonal.size());
  Eigen::VectorXd x = b;
  ls::CgWorkspace workspace;
  const auto apply = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    const auto body = [&](int begin, int end) {
      const int n = end - begin;
      out.segment(begin, n) = diagonal.segment(begin, n).cwiseProduct(in.segment(begin, n));
    };
    pool.for_chunks(static_cast<int>(in.size()), kVectorChunk, std::cref(body));
  };
  const auto copy = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    const auto body = [&](int begin, int end) { out.segment(begin, end - begin) = in.segment(begin, end - begin); };
    pool.for_chunks(static_cast<int>(in.size()), kVectorChunk, std::cref(body));
  };
  const auto solve_us = [&](int iterations) {
    int done = 0;
    const double us = median_us(repeats, [&] {
      x.setZero();
      done = ls::conjugate_gradient(std::cref(apply), std::cref(copy), b, x, {0, iterations}, workspace, pool).iterations;
    });
    return std::pair(us, done);
  };
  // What a solve does before its first iteration is taken off.
  const auto [few_us, few] = solve_us(1);
  const auto [many_us, many] = solve_us(kCgIterations);
  return (many_us - few_us) / (many - few);
}

// As many different numbers as there are iterations at least, well apart: the solve does not end before them.
Eigen::VectorXd spread(Eigen::Index size) {
  Eigen::VectorXd d(size);
  for (Eigen::Index i = 0; i < size; ++i) d[i] = std::pow(10.0, 3.0 * static_cast<double>(i % 997) / 996);
  return d;
}

Result<void> check(const RooflineOptions& o) {
  for (const int cells : o.cells)
    if (cells < 1 || cells > 200) return invalid("cells", text("is ", cells, ", must be in [1, 200]"));
  if (o.threads.empty() || o.threads.size() > 16) return invalid("threads", text("is ", o.threads.size(), ", must be 1 to 16 numbers"));
  for (const int threads : o.threads)
    if (threads < 1 || threads > 256) return invalid("threads", text("is ", threads, ", must be in [1, 256]"));
  if (!(o.stream_mb >= 1 && o.stream_mb <= 4096)) return invalid("stream_mb", text("is ", o.stream_mb, ", must be in [1, 4096]"));
  if (o.repeats < 1 || o.repeats > 10'000) return invalid("repeats", text("is ", o.repeats, ", must be in [1, 10000]"));
  return {};
}

}  // namespace

Result<Json> measure_roofline(const RooflineOptions& options) {
  if (auto valid = check(options); !valid) return std::unexpected(valid.error());
  auto made = make_system(options);
  if (!made) return std::unexpected(made.error());
  BeamSystem& beam = *made;
  const auto n = static_cast<Eigen::Index>(3 * beam.state.x.size());
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(n, -1, 1), diagonal = spread(n);
  Eigen::VectorXd y(n);
  const double vector_bytes = 8.0 * static_cast<double>(n);

  Json loops = Json::array();
  for (const int threads : options.threads) {
    const sim::ThreadPool pool(threads);
    double roof = 0;
    const auto report = [&](const char* loop, const Traffic& traffic, double us) {
      const double gb_per_s = traffic.call / us * 1e-3;
      if (roof == 0) roof = gb_per_s;
      loops.push_back({{"loop", loop}, {"threads", threads}, {"bytes", traffic.call}, {"us", us}, {"gb_per_s", gb_per_s},
                       {"share", gb_per_s / roof}, {"fits", traffic.arrays * 1e-6}});
    };
    {
      const auto entries = static_cast<std::size_t>(options.stream_mb * 1e6 / 8);
      std::vector<double> a(entries, 0.0);
      const std::vector<double> b(entries, 1.0), c(entries, 2.0);
      report("triad", {3 * bytes_of(a), 3 * bytes_of(a)}, triad_us(a, b, c, options.repeats, pool));
    }
    report("matvec", matvec_traffic(beam.in_double), median_us(options.repeats, [&] { beam.in_double.multiply(x, y, pool); }));
    report("matvec_float", matvec_traffic(beam.in_float), median_us(options.repeats, [&] { beam.in_float.multiply(x, y, pool); }));
    report("assembly", assembly_traffic(beam), median_us(options.repeats, [&] { beam.assemble(beam.in_double, pool); }));
    ls::BlockJacobi jacobi;
    jacobi.assign(beam.in_double.diagonal());
    jacobi.invert(pool);
    const double jacobi_bytes = 5 * vector_bytes;  // three of them the blocks
    report("block_jacobi", {jacobi_bytes, jacobi_bytes}, median_us(options.repeats, [&] { jacobi.apply(x, y, pool); }));
    // p.Ap 2; x, r += alpha (p, Ap) 6; r.z 2; p = z + beta p 3; the diagonal matrix 3, the identity 2.
    report("cg_vectors", {18 * vector_bytes, 6 * vector_bytes}, cg_us(diagonal, options.repeats, pool));
  }
  return Json{{"tets", beam.tets.size()}, {"nodes", beam.state.x.size()}, {"stream_mb", options.stream_mb}, {"loops", loops}};
}

std::string roofline_table(const Json& result) {
  std::string table = text(result["tets"].get<int>(), " tets, ", result["nodes"].get<int>(), " nodes\n",
                           "loop           threads  MB a call  all of it MB         us     GB/s   share\n");
  for (const Json& loop : result["loops"]) {
    char line[160];
    std::snprintf(line, sizeof line, "%-14s %7d %10.3f %13.3f %10.1f %8.2f %6.1f%%\n", loop["loop"].get<std::string>().c_str(),
                  loop["threads"].get<int>(), loop["bytes"].get<double>() * 1e-6, loop["fits"].get<double>(),
                  loop["us"].get<double>(), loop["gb_per_s"].get<double>(), 100 * loop["share"].get<double>());
    table += line;
  }
  return table;
}

}  // namespace crumple::lab
