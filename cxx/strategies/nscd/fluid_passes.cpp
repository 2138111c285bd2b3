// An incompressible liquid in the step of the bodies: its pressure and the impulses of contacts, each found with the
// other as last known, until both see the same velocities. In the solution of contacts a body has the mass of the
// liquid about it beside its own, so that light bodies converge as heavy ones do.
#include <cmath>
#include <string>
#include <vector>

#include "../../base/number_text.hpp"
#include "../../fluid/fluid.hpp"
#include "../../solvers/sweeps/contact_system.hpp"
#include "contacts_beside_fluid.hpp"
#include "nscd.hpp"

namespace cairn {
namespace {

constexpr int most_passes = 50;
constexpr double enough = 1e-3; // difference of velocities over their scale

class OwnContacts final : public ContactsBesideFluid {
public:
  OwnContacts(Nscd& nscd, Simulation& s) : nscd_(nscd), s_(s) {}
  const Array<double>& velocities() override {
    if (s_.fluid->meets_meshes() && !s_.meshes.empty()) s_.interactions.give_meshes(); // the last one may be gone
    const Bodies& b = s_.scene.bodies;
    const ContactSystem& system = s_.interactions.system();
    if (system.batches.empty()) return b.velocity_free.values;
    velocity_.resize(b.velocity_free.values.size());
    const int n = b.dofs();
    for (std::int64_t i = 0; i < b.count; ++i)
      for (int c = 0; c < n; ++c) velocity_[std::size_t(n * i + c)] = system.record[std::size_t(i)].x[c];
    return velocity_;
  }
  void keep() override { at_begin_ = s_.interactions.memory(); }
  void again() override {
    s_.interactions.keep_impulses();
    nscd_.prepare_contacts(s_);
    nscd_.solve_contacts(s_);
  }
  void restore() override { s_.interactions.restore(at_begin_); }

private:
  Nscd& nscd_;
  Simulation& s_;
  Array<double> velocity_;
  ContactMemory at_begin_;
};

} // namespace

void Nscd::press_fluid(Simulation& s) {
  s.fluid->predict(s.scene, step_.h, step_.ahead, s.meshes);
  s.fluid->press(s.scene);
}

void Nscd::fluid_passes(Simulation& s) {
  OwnContacts contacts(*this, s);
  fluid_passes(s, contacts);
}

void Nscd::fluid_passes(Simulation& s, ContactsBesideFluid& contacts) {
  double misfit = s.fluid->misfit(s.scene, contacts.velocities());
  if (misfit > enough) {
    contacts.keep();
    try {
      for (int pass = 1; misfit > enough && pass < most_passes; ++pass) {
        s.fluid->press(s.scene);
        contacts.again();
        misfit = s.fluid->misfit(s.scene, contacts.velocities());
      }
    } catch (...) {
      contacts.restore();
      throw;
    }
    contacts.restore();
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
