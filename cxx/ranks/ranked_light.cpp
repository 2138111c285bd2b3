// Where masses differ, over ranks: the error of light bodies, which the true error, a sum of energies, does not see,
// and impulses of the last step that are a worse start than none.
#include <algorithm>
#include <cmath>

#include "../solvers/policy.hpp"
#include "../solvers/sweeps/light_error.hpp"
#include "../solvers/sweeps/start_work.hpp"
#include "../solvers/sweeps/step_error.hpp"
#include "ranked_sweeps.hpp"

namespace cairn {
namespace {

// Sums of the light error over the parts of all ranks: exact, so that its bits do not depend on the number of ranks.
struct RankedLight final : LightTerms {
  ExactSum bodies[2];   // mass, energy of own bodies' changes of velocity
  ExactSum contacts[3]; // power, squares of light errors, and of loads
  std::int64_t count = 0;
  double mean = 0, largest = 0;
  const std::vector<std::uint8_t>* own = nullptr; // of the part whose terms are given

  void add_body(std::int64_t body, double inverse, double change_square) override {
    if ((body >= 0 && !(*own)[std::size_t(body)]) || !(inverse > 0) || !(change_square > 0)) return;
    bodies[0].add(1 / inverse);
    bodies[1].add(change_square / inverse);
  }
  void add_contact(double speed, double impulse, const LightSide& lighter, std::int64_t) override {
    const double scale = std::max(lighter.change, mean), load = impulse > 0 ? impulse * lighter.inverse / scale : 0;
    const double ratio = speed > 0 ? speed / scale : 0;
    ++count;
    contacts[0].add(speed > 0 ? impulse * speed : 0);
    contacts[1].add(ratio * ratio);
    contacts[2].add(load * load);
    largest = std::max(largest, ratio);
  }
};

} // namespace

// Records hold the free velocity. See nlgs/stale_start.cpp.
void RankedSweeps::leave_stale_start() {
  if (cell_.driven() || !masses_differ(mass_ratio_, false)) return; // alike on all ranks
  double others[] = {0};
  ExactSum sum[1];
  for (const Share& share : shares_) {
    if (!all_cones(*share.system)) others[0] = 1;
    add_start_work(*share.system, share.schedule, [&](double work) { sum[0].add(work); });
  }
  exchange_.largest(others);
  add_over_ranks(sum, exchange_);
  if (others[0] > 0 || !(sum[0].value() > 0)) return;
  for (Share& share : shares_) give_none(*share.system, share.free());
}

// Light error of the impulses, as a run without ranks has it; the contact where it is largest is not known to all.
LightError RankedSweeps::light_error() {
  RankedLight terms;
  for (std::size_t l = 0; l < shares_.size(); ++l) {
    terms.own = &parts_[l].own;
    give_light_bodies(*shares_[l].system, shares_[l].free(), terms);
  }
  add_over_ranks(terms.bodies, exchange_);
  const double mass = terms.bodies[0].value(), energy = terms.bodies[1].value();
  terms.mean = mass > 0 ? std::sqrt(energy / mass) : 0;
  for (Share& share : shares_) give_light_contacts(*share.system, share.schedule, share.free(), terms);
  add_over_ranks(terms.contacts, exchange_);
  std::int64_t count[] = {terms.count};
  double largest[] = {terms.largest};
  exchange_.sum(count);
  exchange_.largest(largest);
  LightError light;
  light.contacts = count[0];
  light.largest = largest[0];
  const double wrong = terms.contacts[0].value(), many = double(count[0]);
  if (wrong > 0) light.power = wrong / energy;
  if (count[0] > 0) light.mean = std::sqrt(terms.contacts[1].value() / many);
  if (count[0] > 0 && !scale_.bends()) light.load = std::sqrt(terms.contacts[2].value() / many);
  return light;
}

// See step_error.hpp; a cell that follows a stress gives way.
bool RankedSweeps::grows_without_end(const Error& error) {
  const bool exact = std::isfinite(options_.accuracy);
  const double least = endless_growth(exact ? policy().accuracy_aim * options_.accuracy : options_.tolerance);
  if (cell_.follows() || scale_.bends() || !error.finite || !(error.growth > least * least)) return false;
  return light_error().power > least;
}

} // namespace cairn
