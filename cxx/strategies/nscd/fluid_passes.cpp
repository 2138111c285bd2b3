// An incompressible liquid in the step of the bodies: its pressure and the impulses of contacts, each found with the
// other as last known, until both see the same velocities. In the solution of contacts a body has the mass of the
// liquid about it beside its own, so that light bodies converge as heavy ones do.
#include <cmath>
#include <string>
#include <vector>

#include "../../base/number_text.hpp"
#include "../../fluid/fluid.hpp"
#include "../../solvers/sweeps/contact_system.hpp"
#include "nscd.hpp"

namespace cairn {
namespace {

constexpr int most_passes = 50;
constexpr double enough = 1e-3; // difference of velocities over their scale

// Velocities that the solution at hand gives to bodies.
Array<double> velocities_now(Simulation& s) {
  const Bodies& b = s.scene.bodies;
  const ContactSystem& system = s.interactions.system();
  if (system.batches.empty()) return b.velocity_free.values;
  Array<double> out(b.velocity_free.values.size());
  const int n = b.dofs();
  for (std::int64_t i = 0; i < b.count; ++i)
    for (int c = 0; c < n; ++c) out[std::size_t(n * i + c)] = system.record[std::size_t(i)].x[c];
  return out;
}

} // namespace

void Nscd::press_fluid(Simulation& s) {
  s.fluid->predict(s.scene, step_.h, step_.ahead, s.meshes);
  s.fluid->press(s.scene);
}

void Nscd::fluid_passes(Simulation& s) {
  const auto measure = [&s] {
    if (s.fluid->meets_meshes()) s.interactions.give_meshes();
    return s.fluid->misfit(s.scene, velocities_now(s));
  };
  double misfit = measure();
  if (misfit > enough) {
    const ContactMemory at_begin = s.interactions.memory();
    try {
      for (int pass = 1; misfit > enough && pass < most_passes; ++pass) {
        s.fluid->press(s.scene);
        s.interactions.keep_impulses();
        prepare_contacts(s);
        solve_contacts(s);
        misfit = measure();
      }
    } catch (...) {
      s.interactions.restore(at_begin);
      throw;
    }
    s.interactions.restore(at_begin);
  }
  const bool solved = s.fluid->report.residual <= s.fluid->settings.tolerance;
  if (misfit <= enough && solved) return;
  if (s.report.solve.status == SolveStatus::converged) s.report.solve.status = SolveStatus::iteration_limit;
  if (!s.report.solve.hint.empty()) return;
  s.report.solve.hint =
      solved ? "pressure of the fluid and contacts differ by " + number_text(misfit) + " of the velocity after " +
                   std::to_string(s.fluid->report.passes) + " passes: give a smaller dt" +
                   (s.fluid->meets_meshes()
                        ? ", or where a deformable body far lighter than the liquid bears on others, a "
                          "heavier or a rigid one"
                        : "")
             : "the pressure of the fluid leaves " + number_text(s.fluid->report.residual) +
                   " of the divergence: give a smaller dt";
}

} // namespace cairn
