// The step of Non-Smooth Contact Dynamics on one page (Moreau 1988, Jean 1999).

#include "../base/call.hpp"
#include "../base/threads.hpp"
#include "simulation.hpp"
#include "smooth/smooth_dynamics.hpp"

namespace cairn {
const StepReport& Simulation::step(double h) {
  if (smooth_) return smooth_->step(*this, h);
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
