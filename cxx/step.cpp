// The step of Non-Smooth Contact Dynamics on one page (Moreau 1988, Jean 1999).
#include <omp.h>

#include <algorithm>
#include <chrono>

#include "call.hpp"
#include "simulation.hpp"

namespace cairn {
namespace {

// Threads of a step, put back afterwards. A thread is worth its waiting from some thousand contacts on; results do not
// depend on their number.
class Threads {
public:
  Threads(int wanted, std::int64_t contacts) : before_(omp_get_max_threads()) {
    const std::int64_t useful = 1 + contacts / 4096;
    omp_set_num_threads(wanted > 0 ? wanted : int(std::min<std::int64_t>(before_, useful)));
  }
  ~Threads() { omp_set_num_threads(before_); }
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

private:
  int before_;
};

} // namespace

template <class Stage>
void Simulation::timed(const char* name, Stage&& stage) {
  const auto start = std::chrono::steady_clock::now();
  stage();
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  for (auto& [known, seconds] : stage_seconds_)
    if (known == name) {
      seconds += spent.count();
      return;
    }
  stage_seconds_.emplace_back(name, spent.count());
}

const StepReport& Simulation::step(double h) {
  begin_step(h);
  const Threads threads(strategy.solver.threads, std::max(candidates.count, scene.bodies.count));
  try {
    // The configuration is predicted first: the free spin of a body depends on how it then stands.
    timed("predict_configuration", [&] { predict_configuration(); });
    timed("compute_free_velocity", [&] { compute_free_velocity(); });
    timed("detect_contacts", [&] { detect_contacts(); });
    timed("prepare_contacts", [&] { prepare_contacts(); });
    timed("solve_contacts", [&] { solve_contacts(); });
    timed("update_velocity", [&] { update_velocity(); });
    timed("commit_contacts", [&] { commit_contacts(); }); // refuses what a user's law gives back that is no number
  } catch (...) {
    undo_step();
    throw;
  }
  timed("update_configuration", [&] { update_configuration(); });
  if (strategy.project_positions) timed("project_positions", [&] { project_positions(); });
  return report;
}

} // namespace cairn
