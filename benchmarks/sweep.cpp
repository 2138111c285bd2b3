// Contact-iterations a second: of the bare kernel, of the solver through the public interface with its error checks,
// and of the textbook's sweep (layer plain) by which figures of different machines compare. CSV on standard output,
// best of the repetitions.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <random>

#include "contactors/shapes.hpp"
#include "contacts/interaction.hpp"
#include "laws/law_names.hpp"
#include "solvers/sweeps/contact_system.hpp"

namespace {

using namespace cairn;

struct Lattice {
  Lattice(int dim, int side, bool lid) : bodies(dim), contactors(dim), interactions(dim), laws({"rock"}) {
    const double mu = 0.4;
    laws.set(0, 0, Law::signorini_coulomb, {&mu, 1});
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const int n = side * side * (dim == 3 ? side : 1);
    bodies.count = n + 1 + lid;
    contactors.count = bodies.count;
    bodies.for_each_field([&](auto& field) { field.resize(bodies.count); });
    contactors.for_each_field([&](auto& field) { field.resize(bodies.count); });
    for (int b = 0; b < n + 1 + lid; ++b) {
      const int cell[3] = {b % side, b / side % side, b / side / side};
      bodies.id.values[b] = contactors.id.values[b] = b;
      contactors.body.values[b] = b;
      contactors.shape.values[b] = std::int16_t(dim == 2 ? Shape::disk : Shape::sphere);
      contactors.radius.values[b] = 0.5;
      for (int k = 0; k < dim; ++k) bodies.position[b][k] = cell[k];
      for (int k = 0; k < bodies.dofs() && b < n; ++k) {
        bodies.inverse_mass[b][k] = k < dim ? 1 : (dim == 2 ? 8 : 10);
        bodies.velocity_free[b][k] = 0.1 * normal(random) - (k == dim - 1);
      }
    }
    // the floor, and a lid that only moves down, both flat
    for (int b = n; b < n + 1 + lid; ++b) {
      contactors.shape.values[b] = std::int16_t(dim == 2 ? Shape::half_plane : Shape::plane);
      contactors.radius.values[b] = 0;
      for (int k = 0; k < dim; ++k) bodies.position[b][k] = 0;
      bodies.position[b][dim - 1] = b == n ? -0.5 : side - 0.5;
    }
    if (lid) bodies.inverse_mass[n + 1][dim - 1] = 1e-3, bodies.velocity_free[n + 1][dim - 1] = -1;
    for (int b = 0; b < n; ++b) {
      const int cell[3] = {b % side, b / side % side, b / side / side};
      int stride = 1;
      for (int k = 0; k < dim; ++k, stride *= side)
        if (cell[k] + 1 < side) touch(b + stride, b, k, [&] { return 0.1 * normal(random); });
      if (cell[dim - 1] == 0) touch(b, n, dim - 1, [] { return 0.0; });
      if (lid && cell[dim - 1] == side - 1) touch(n + 1, b, dim - 1, [] { return 0.0; });
    }
  }

  template <class F>
  void touch(int a, int b, int axis, F&& jitter) {
    const int dim = bodies.dim;
    double n[3] = {0, 0, 0}, size = 0;
    for (int k = 0; k < dim; ++k) n[k] = (k == axis) + jitter(), size += n[k] * n[k];
    ++candidates.count;
    candidates.contactor_a.push_back(a);
    candidates.contactor_b.push_back(b);
    candidates.feature.push_back(0);
    candidates.image.push_back(own_image);
    candidates.gap.push_back(0);
    const int round = *contactors.radius[b] > 0 ? b : a;
    for (int k = 0; k < dim; ++k) {
      candidates.normal.push_back(n[k] / std::sqrt(size));
      candidates.point.push_back(bodies.position[round][k] + (round == b ? 0.5 : -0.5) * n[k] / std::sqrt(size));
    }
  }

  void assemble() { interactions.assemble(bodies, contactors, candidates, laws, cell, 0.01, 0.5); }

  Bodies bodies;
  Contactors contactors;
  Candidates candidates;
  Interactions interactions;
  LawTable laws;
  Cell cell;
};

Lattice& scene(const std::string& name) {
  static std::map<std::string, Lattice> scenes;
  auto found = scenes.find(name);
  if (found == scenes.end()) {
    const bool spheres = name == "spheres", lid = name == "disks_lid";
    // with and without a lid: 20,000 disks
    const int side = spheres ? 40 : name == "disks" ? 250 : 142;
    found = scenes.try_emplace(name, spheres ? 3 : 2, side, lid).first;
    found->second.assemble();
  }
  return found->second;
}

void report(benchmark::State& state, const Lattice& lattice, double sweeps) {
  state.counters["contacts"] = double(lattice.candidates.count);
  state.counters["rate"] =
      benchmark::Counter(sweeps * double(lattice.candidates.count), benchmark::Counter::kIsIterationInvariantRate);
}

void kernel(benchmark::State& state, const std::string& name, int threads) {
  Lattice& l = scene(name);
  ContactSystem& system = l.interactions.system();
  system.load(l.bodies.velocity_free);
  const cairn_schedule schedule = system.schedule(threads);
  cairn_add_impulses(&schedule);
  const int sweeps = 5;
  for (auto _ : state) cairn_nlgs_sweep(sweeps, &schedule, system.change.data());
  report(state, l, sweeps);
}

void api(benchmark::State& state, const std::string& name, int threads) {
  Lattice& l = scene(name);
  const int sweeps = 100;
  for (auto _ : state) benchmark::DoNotOptimize(l.interactions.solve(l.bodies, {0, sweeps / 10, sweeps, threads}));
  report(state, l, sweeps);
}

void each_plain(benchmark::State& state, const std::string& name, int threads) {
  Lattice& l = scene(name);
  const int sweeps = 100;
  SolverOptions options{0, sweeps / 10, sweeps, threads};
  options.extrapolates = false;
  for (auto _ : state) benchmark::DoNotOptimize(l.interactions.solve(l.bodies, options));
  report(state, l, sweeps);
}

void plain(benchmark::State& state, const std::string& name, int) {
  Lattice& l = scene(name);
  const int dim = l.bodies.dim, nd = l.bodies.dofs();
  const std::int64_t n = l.candidates.count;
  std::vector<std::int32_t> body;
  std::vector<double> frame, lever, mu(n, 0.4), bias(n, 0.0), m, j, r(dim * n, 0.0);
  std::vector<double> v(l.bodies.velocity_free.values.begin(), l.bodies.velocity_free.values.end());
  for (std::int64_t b = 0; b < l.bodies.count; ++b) {
    m.push_back(l.bodies.inverse_mass[b][dim - 1]);
    j.push_back(l.bodies.inverse_mass[b][nd - 1]);
  }
  for (std::int64_t i = 0; i < n; ++i) {
    body.push_back(l.candidates.contactor_a[i]);
    body.push_back(l.candidates.contactor_b[i]);
    const double* f = &l.candidates.normal[dim * i];
    frame.insert(frame.end(), f, f + dim);
    if (dim == 3) {
      const double sign = std::copysign(1.0, f[2]), a = -1 / (sign + f[2]), b = f[0] * f[1] * a;
      frame.insert(frame.end(), {1 + sign * f[0] * f[0] * a, sign * b, -sign * f[0]});
    }
    lever.insert(lever.end(), {-0.5, 0.5});
  }
  const auto sweep = dim == 2 ? cairn_plain_sweep2 : cairn_plain_sweep3;
  const int sweeps = 2;
  for (auto _ : state)
    for (int k = 0; k < sweeps; ++k)
      sweep(n, body.data(), frame.data(), lever.data(), mu.data(), bias.data(), m.data(), j.data(), v.data(), r.data());
  report(state, l, sweeps);
}

// Best of the repetitions: other programs of the machine only ever slow one down.
class Table : public benchmark::BenchmarkReporter {
public:
  bool ReportContext(const Context&) override {
    std::cout << "layer,case,threads,contacts,contact_iterations_per_second\n";
    return true;
  }
  void ReportRuns(const std::vector<Run>& runs) override {
    double rate = 0, contacts = 0;
    std::string name;
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration) continue;
      name = run.run_name.function_name;
      rate = std::max(rate, double(run.counters.at("rate")));
      contacts = run.counters.at("contacts");
    }
    if (!name.empty()) std::cout << name << ',' << std::int64_t(contacts) << ',' << std::int64_t(rate) << std::endl;
  }
};

} // namespace

int main(int argc, char** argv) {
  // A thread that waits at the end of a stage spins for a moment, not for as long as a busy machine keeps its partner
  // away. The OpenMP library reads this when it is loaded, so the program starts again with it.
  if (!std::getenv("GOMP_SPINCOUNT") && !std::getenv("OMP_WAIT_POLICY")) {
    setenv("GOMP_SPINCOUNT", "20000", 1);
    execv("/proc/self/exe", argv);
  }
  struct Row {
    const char* layer;
    void (*run)(benchmark::State&, const std::string&, int);
    std::vector<int> threads;
    std::vector<std::string> cases;
  };
  const Row rows[] = {{"plain", plain, {1}, {"spheres", "disks"}},
                      {"kernel", kernel, {1, 2}, {"spheres", "disks", "disks_20k", "disks_lid"}},
                      {"api", api, {1, 2}, {"spheres", "disks", "disks_20k", "disks_lid"}},
                      {"api_unextrapolated", each_plain, {1, 2}, {"spheres", "disks", "disks_20k", "disks_lid"}}};
  for (const Row& row : rows)
    for (const std::string& name : row.cases)
      for (int threads : row.threads) {
        const std::string label = std::string(row.layer) + "," + name + "," + std::to_string(threads);
        benchmark::RegisterBenchmark(label.c_str(), row.run, name, threads)
            ->UseRealTime()
            ->Unit(benchmark::kMillisecond)
            ->Iterations(1)
            ->Repetitions(row.run == api || row.run == each_plain ? 10 : 40);
      }
  benchmark::Initialize(&argc, argv);
  Table table;
  benchmark::RunSpecifiedBenchmarks(&table);
  return 0;
}
