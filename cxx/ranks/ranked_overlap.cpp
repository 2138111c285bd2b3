// Overlap beyond a limit over ranks, taken back after the step as without them (see contacts/overlap_limit.cpp): sweeps
// over normals go colour by colour, and end by an exact sum, so that no bit depends on which rank has which contact.
#include <algorithm>
#include <cmath>

#include "../contacts/overlap_limit.hpp"
#include "../strategies/nscd/joints.hpp"
#include "ranked_nscd.hpp"
#include "ranked_sweeps.hpp"

namespace cairn {
namespace {

// Twice the energy of the last sweep over the contacts of a part.
void add_change(const OverlapLimit& limit, const ContactSystem& system, std::span<ExactSum> sum) {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      const double change = limit.impulse(b.first + lane) - limit.impulse_before(b.first + lane);
      sum[0].add(change * change / b.rho[lane]);
    }
}

} // namespace

// Velocities that take back overlap in a step, in the records of bodies with contacts; false: none is needed.
bool RankedNscd::find_partings() {
  bool any = false;
  for (Part& part : parts_) {
    Interactions& contacts = part.simulation->interactions;
    any = contacts.overlap().ask(contacts.system().schedule(1), false) || any;
  }
  if (!any_rank(any)) return false;
  for (Part& part : parts_) part.simulation->interactions.overlap().begin();
  RankedSweeps sweeps(parts_, links_, colours_, *exchange_, settings().solver, nullptr);
  double largest = 0;
  for (int sweep = 0; sweep < OverlapLimit::most_sweeps; ++sweep) {
    for (Part& part : parts_) part.simulation->interactions.overlap().keep();
    sweeps.each_colour([&](const cairn_schedule& schedule, const ContactSystem& system) {
      for (Part& part : parts_)
        if (&part.simulation->interactions.system() == &system) part.simulation->interactions.overlap().sweep(schedule);
    });
    ExactSum sum[1];
    for (Part& part : parts_)
      add_change(part.simulation->interactions.overlap(), part.simulation->interactions.system(), sum);
    add_over_ranks(sum, *exchange_);
    largest = std::max(largest, sum[0].value());
    if (OverlapLimit::ends(sum[0].value(), largest)) break;
  }
  return true;
}

// After the configuration of the end: no velocity changes, and ghosts move as their owners do.
void RankedNscd::part_overlaps(Simulation& s, double h) {
  if (s.report.solve.status == SolveStatus::diverged || !find_partings()) return;
  std::vector<Array<double>> free;
  for (Part& part : parts_) {
    Bodies& b = part.simulation->scene.bodies;
    free.push_back(b.velocity_free.values); // its place serves to tell the ghosts
    part.simulation->interactions.system().unload(b.velocity_free);
  }
  follow_ghosts(&Bodies::velocity_free);
  ExactSum potential[1];
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    Simulation& of = *parts_[l].simulation;
    Bodies& b = of.scene.bodies;
    for (std::int64_t i = 0; i < b.count; ++i)
      for (int d = 0; d < s.scene.dim && parts_[l].own[std::size_t(i)] && std::isfinite(*b.mass[i]); ++d)
        potential[0].add(-*b.mass[i] * s.scene.gravity[d] * h * b.velocity_free[i][d]);
    b.velocity_free.values.swap(free[l]);
    move_bodies(of, free[l], h);
    of.interactions.system().load({b.velocity, &of.scene.nodes.velocity});
  }
  add_over_ranks(potential, *exchange_);
  const double work = potential[0].value();
  s.energy.potential += work;
  s.energy.work_projection += work;
  s.energy.turned_over += std::abs(work);
  s.energy.in_play = s.energy.largest_kinetic + s.energy.turned_over;
}

} // namespace cairn
