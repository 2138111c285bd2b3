// Accuracy of the velocities of bonded solids. In a row of n bodies each contact has a small error, and the end of the
// row the sum of their sums: n^2 times as much. Errors of contacts do not show it, but a pass of Newton's method does:
// its change equals the error of velocities.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../../laws/law_info.hpp"
#include "../refinement_memory.hpp"
#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "batch.hpp"
#include "solid_correction.hpp"
#include "step_error.hpp"

namespace cairn {

namespace {

bool held(double state) { return state > 0; }

bool nothing_slides_or_opens(const ContactSystem& system) {
  return std::all_of(system.batches.begin(), system.batches.end(),
                     [](const cairn_batch& b) { return b.bonds && std::all_of(b.state, b.state + b.contacts, held); });
}

// True if springs of a bond are stiff enough beside the mass of the bodies to hold fast in a step: their sag under a
// weight is the fall of a step divided by this ratio, and beyond 1/tolerance a velocity error of `tolerance` has the
// same size.
bool holds_fast(const cairn_batch& b, const LawInfo& law, int lane, double fast) {
  if (!(b.state[lane] > 0)) return false;
  const std::size_t p = law.parameters.size(), n = std::size_t(b.count);
  const double *own = b.params + lane, *geometry = b.context->geometry + lane; // area, radius, mass
  const double h = own[p * n];
  return own[0] * h * h * geometry[0] > fast * geometry[2 * n];
}

constexpr double unknown = std::numeric_limits<double>::infinity();

} // namespace

// Rigid bodies, by bonds that hold fast, as stiff springs do; other springs beside a contact, which passes may have to
// find pressed or drawn first, where that is asked for. Of a mesh passes know the inverse of its compliance, in which
// its stiffness is most of all: digits of its velocities are lost in it, and passes do not come to an end.
bool SolidCorrection::makes_solid(const ContactSystem& system, bool springs, double tolerance) {
  constexpr double far = 0x1p20, share = 0.1;
  const double fast = std::min(far, share / std::max(tolerance, share / far));
  return system.condensed.empty() &&
         std::any_of(system.batches.begin(), system.batches.end(), [=](const cairn_batch& b) {
           const LawInfo& law = law_infos()[b.law];
           if (b.bonds || (springs && law.keeps && law.has_solve && !law.joins))
             return std::any_of(b.state, b.state + b.contacts, held);
           if (!law.keeps || !law.has_solve || law.plugged() || law.parameters[0].name != "normal_stiffness")
             return false;
           for (int lane = 0; lane < b.contacts; ++lane)
             if (holds_fast(b, law, lane, fast)) return true;
           return false;
         });
}

// Amplification of contact errors in velocities: from the last pass, with a margin, or from the impulses: a load at the
// end of a row is n times as large at its root, and moments n^2 times. Self-equilibrated impulses overestimate it.
double SolidCorrection::amplification(const ContactSystem& system) {
  constexpr double margin = 16;
  const double borne = std::sqrt(total(system.sums, system.batches.size(), 6, 1)), speed = system.speed();
  if (!(speed > 0)) return 0;
  const double found = system.refinement ? margin * system.refinement->amplification : 0;
  return found == unknown ? unknown : found > 0 ? std::min(borne / speed, found) : borne / speed;
}

// Refines velocities by passes in which bonds yield by a share of their stiffness; the share shrinks until changes
// decrease from pass to pass: only then do they tell the error. With self-equilibrated impulses, rounding leaves a last
// change that stays.
Refinement SolidCorrection::refine(double error, double wanted, double tolerance,
                                   const std::function<double()>& measure) {
  constexpr int most = 16;
  constexpr double fall = 16, slow = 2, less = 0x1p-10, least = 0x1p-44, growth = 0x1p20;
  constexpr double rounding = 16 * std::numeric_limits<double>::epsilon(), small = 0x1p-16;
  RefinementMemory none, &memory = system_.refinement ? *system_.refinement : none;
  if (memory.idle > 0) {
    --memory.idle;
    return {};
  }
  const auto borne = [&] { return std::sqrt(total(system_.sums, system_.batches.size(), 6, 1)); };
  solid_.keep_impulses();
  self_stress_.drop();
  const double share = yielding_, begun = borne();
  // A start near the solution, from the last step, hides the motions for which a share takes most passes.
  if (memory.share > 0) yielding_ = std::clamp(memory.share, least, share);
  double last = unknown, now = error, sum = 0, best = 1;
  bool contracts = false, known = false, broken = false;
  for (int pass = 0; pass < most && !known; ++pass) {
    if ((broken = !take_pass())) break;
    const double change = solid_.size_of_step() / system_.speed();
    now = std::sqrt(measure());
    if ((broken = !std::isfinite(now) || !std::isfinite(change) || !(borne() <= growth * begun))) break;
    sum += change;
    const bool shrinks = change * slow <= last && (pass > 0 || now * fall <= error);
    // rounding of impulses, which is as large in velocities, or in what contacts miss, and of velocities themselves
    const double rounded = rounding * std::max({borne() / system_.speed(), self_stress_.size() / system_.speed(), 1.0});
    const bool settled = change <= rounded || (now <= rounded && change <= std::max(wanted, small));
    contracts |= shrinks;
    known = settled || (contracts && change <= wanted);
    // with a share that is the least there may be slower motions, which the last of many passes changes most
    if (yielding_ <= least && !settled) known = known && pass + 1 == most && shrinks;
    if (!(change * fall <= last) && yielding_ > least && !settled)
      yielding_ = std::max(least, yielding_ * less), contracts = false;
    if (pass > 0 && last > 0) best = std::min(best, change / last);
    last = change;
  }
  memory.share = best < less ? yielding_ / less : yielding_;
  yielding_ = share;
  if (!broken && now <= tolerance) {
    memory.amplification = known ? sum / error : unknown;
    memory.failures = 0;
    return {last, known};
  }
  memory = {.failures = memory.failures};
  go_back(measure);
  // where nothing can slide or open the rest is rounding, and the error as large as the last change
  if (nothing_slides_or_opens(system_)) {
    memory.amplification = unknown;
    return {last, false};
  }
  memory.idle = 1 << std::min(++memory.failures, 6);
  return {};
}

// Errors of joints add up along a chain, as those of bonds do along a row. Joints neither open nor slide, so that one
// pass or two find the loads of a chain.
void SolidCorrection::settle_joints(double tolerance, const std::function<double()>& measure) {
  constexpr int most = 4;
  constexpr double little = 0x1p-7, fall = 0.5;
  solid_.keep_impulses();
  double last = unknown;
  bool kept = true;
  for (int pass = 0; pass < most; ++pass) {
    if (!(kept = take_pass())) break;
    const double change = solid_.size_of_step() / system_.speed(), now = std::sqrt(measure());
    if (!(kept = now <= tolerance && std::isfinite(change))) break;
    solid_.keep_impulses();
    if (change <= little * tolerance || !(change <= fall * last)) break;
    last = change;
  }
  if (kept) return;
  go_back(measure);
}

} // namespace cairn
