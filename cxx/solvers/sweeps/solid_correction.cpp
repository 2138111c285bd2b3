#include "solid_correction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../../laws/law_info.hpp"
#include "batch.hpp"
#include "light_error.hpp"

namespace cairn {

namespace {

// Yielding of bonds that hold fast, as a share of their own block. Under heavy bodies their stiffness must exceed the
// effect of that mass, which costs digits.
double yielding(double mass_ratio) { return std::clamp(0x1p-10 / mass_ratio, 0x1p-30, 0x1p-20); }

} // namespace

std::string SolidCorrection::obstacle(const ContactSystem& system) {
  bool own = false;
  for (const cairn_batch& b : system.batches) {
    const LawInfo& law = law_infos()[b.law];
    if (law.has_solve && law.plugged()) return "law " + law.python_name + " is a library's, which may count its calls";
    own |= law.has_solve;
  }
  if (!own) return "no law has a local solution of its own";
  for (const CondensedBody& body : system.condensed)
    if (body.dofs.dofs > SolidSystem::most_dofs) return "a body that deforms has many nodes that contacts rest on";
  return {};
}

SolidCorrection::SolidCorrection(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free)
    : system_(system), solid_(system, schedule, velocity_free), yielding_(yielding(mass_ratio(system))) {}

// Factors by nested dissection, in the plane and in space.
double SolidCorrection::operations(int dim, double dofs, double contacts) {
  return (dim == 2 ? 30 * dofs * std::sqrt(dofs) : 15 * dofs * dofs) + 4000.0 * contacts;
}

double SolidCorrection::operations(const ContactSystem& system) {
  double contacts = 0;
  for (const cairn_batch& b : system.batches) contacts += b.contacts;
  double n = double(system.velocities()) * double(system.bodies);
  for (const CondensedBody& body : system.condensed) n += double(body.dofs.dofs);
  return operations(system.dim, n, contacts);
}

bool SolidCorrection::has_bonds(const ContactSystem& system) {
  return system.condensed.empty() && std::any_of(system.batches.begin(), system.batches.end(),
                                                 [](const cairn_batch& b) { return b.bonds && b.contacts > 0; });
}

// A whole step of Newton's method; false: there is none.
bool SolidCorrection::take_pass() {
  tangent_.linearise(yielding_);
  std::fill(solid_.velocity.begin(), solid_.velocity.end(), 0.0);
  if (!solid_.factor()) return false;
  solid_.change_impulses();
  solid_.refresh();
  self_stress_.drop();
  return true;
}

void SolidCorrection::go_back(const std::function<double()>& measure) {
  solid_.restore_impulses();
  solid_.refresh();
  measure(); // for the report
}

int SolidCorrection::improve(double error_square, double wanted_square, const std::function<double()>& measure) {
  constexpr int most = 12, patient = 3; // passes; those that may follow each other without a smaller error
  solid_.keep_impulses();
  int best = 0, pass = 0;
  double now = error_square;
  // whole steps: which springs are drawn and which contacts pressed may take some of them to find, with larger errors
  while (pass < most && pass < best + patient && now > wanted_square && take_pass()) {
    ++pass;
    now = measure();
    if (!std::isfinite(now)) break;
    if (!(now < error_square)) continue;
    error_square = now;
    best = pass;
    solid_.keep_impulses();
  }
  if (best < pass) go_back(measure);
  if (error_square > wanted_square) {
    if (const int more = proximal_points_.improve(error_square, wanted_square, measure)) best = pass + more;
    go_back(measure);
  }
  return best;
}

} // namespace cairn
