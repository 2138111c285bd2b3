// The step of smooth DEM on one page (Cundall & Strack 1979): velocity Verlet around the forces of the new
// configuration, or Gear's prediction before them and its correction after.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../base/threads.hpp"
#include "cairn/smooth_bodies.h"
#include "options.hpp"
#include "smooth/lanes.hpp"

namespace cairn {
const StepReport& SmoothDem::step(Simulation& s, double h) {
  const Threads threads(settings.threads, s.scene.bodies.count);
  begin_step(s, h);
  s.timed("kick_and_drift", [&] { kick_and_drift(s); });
  s.timed("find_neighbours", [&] { find_neighbours(s); });
  s.timed("compute_forces", [&] { compute_forces(s); });
  s.timed("kick", [&] { kick(s); });
  s.advance_networks(h);
  return s.report;
}

std::vector<std::string_view> SmoothDem::stages(const Simulation&) const {
  return {"kick_and_drift", "find_neighbours", "compute_forces", "kick"};
}

std::unique_ptr<Strategy> make_smooth_dem() {
  return std::make_unique<SmoothDem>(standard_options<SmoothDemOptions>());
}

std::vector<Option> SmoothDem::options() {
  std::vector<Option> rows;
  settings.integrator.add_options(rows);
  for (const Option& row : rows_of(settings)) rows.push_back(row);
  return rows;
}

std::unique_ptr<Strategy> SmoothDem::fresh() const { return std::make_unique<SmoothDem>(settings); }

bool SmoothDem::take_settings(Simulation& s, const Strategy& other) {
  const auto* same = dynamic_cast<const SmoothDem*>(&other);
  if (!same) return false;
  const bool other_history = settings.integrator != same->settings.integrator;
  if (same->settings.energy && !settings.energy) forces_known_ = false; // the balance begins with the next forces
  settings = same->settings;
  changed(s, false);
  if (other_history) forget_histories(s);
  return true;
}

void SmoothDem::check_scene(const Simulation& s) const {
  if (!s.meshes.empty()) throw Error("SmoothDEM moves rigid bodies alone: keep NSCD for deformable ones");
  if (!s.forces.empty() || s.free_velocity)
    throw Error("SmoothDEM calls no plugged routines of bodies, and this simulation has some: keep NSCD");
}

void SmoothDem::check_laws(const Simulation& s) const {
  if (!s.laws.curves().empty())
    throw Error("SmoothDEM knows no parameters of laws that depend on temperature: give numbers, or keep NSCD");
  for (int e = 0; e < s.laws.entries(); ++e)
    if (const LawInfo& law = law_infos()[std::size_t(s.laws.entry(e).law)]; !serves(law))
      throw Error(law.joins ? "SmoothDEM knows no joints: keep NSCD, or leave them out"
                            : "law " + law.python_name +
                                  " has no force that a gap and a velocity give, which SmoothDEM needs; give "
                                  "LinearSpring, HertzMindlin "
                                  "or JKR, or use NSCD");
}

double SmoothDem::stable_step(Simulation& s) {
  view(s);
  follow_drives(s);
  return contact_limit(s);
}

std::vector<std::pair<std::string_view, double>> SmoothDem::figures(Simulation& s) {
  view(s);
  return {{"skin", skin()}};
}

// Order is state, and changes with the number of the step alone. The first forces are those of the places at the start.
void SmoothDem::begin_step(Simulation& s, double h) {
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + std::to_string(h) + "; give a positive, finite step [s]");
  dim_ = s.scene.dim;
  driven_before_ = s.energy.work_driven;
  for (std::size_t k = 0; k < 3; ++k) weight_[k] = s.scene.gravity[k] / settings.mass_scale;
  check_scene(s);
  check_bodies(s);
  const bool verlet = settings.integrator.name == "velocity_verlet";
  s.apply_controls(h, end_share(h), verlet);
  if (s.steps > 0 && s.steps % settings.renumber_every == 0) {
    remember(s);
    s.scene.renumber();
  }
  if (s.scene.cell.any()) s.wrap_into_cell();
  follow_growth(s);
  if (list_is_old(s)) make_list(s);
  follow_drives(s);
  if (settings.refuse_unstable && h > pair_limit_) refuse_step(h);
  if (!forces_known_) {
    h_ = 0;
    compute_forces(s);
    s.report.stable_step = contact_limit(s);
    begin_balance(s);
  } else {
    count_growth(s);
  }
  h_ = h;
  take_scheme(s, h);
}

void SmoothDem::kick_and_drift(Simulation& s) {
  Bodies& b = s.scene.bodies;
  const BodyTiles all = tiles(s);
  const std::int64_t n = all.count();
  std::int64_t unsolved = -1;
  sums_.resize(std::max<std::size_t>(sums_.size(), sums_of_tile * n));
  works_.assign(4 * n, 0);
#pragma omp parallel for schedule(static) reduction(max : unsolved)
  for (std::int64_t t = 0; t < n; ++t) {
    const std::int64_t first = all.first(t), last = all.last(t);
    double* fastest = &sums_[sums_of_tile * t];
    half_step_works(s, t, false);
    if (predicts())
      predict(s, first, last, fastest);
    else
      begin_tile(s, first, last, fastest);
    begin_uneven(s, t, fastest + 1, unsolved);
    for (const std::int64_t i : uneven_of(t))
      if (spheres_alone_) fill_records(s, i, i + 1); // their spins have changed
    if (dim_ == 3 && b.rotation.active)
      cairn_verlet_turn(first, last, h_, b.velocity.values.data(), b.rotation.values.data());
    turn_uneven(s, t);
    if (spheres_alone_ && predicts()) fill_records(s, first, last);
  }
  if (unsolved >= 0)
    throw Error("body " + std::to_string(*b.id[unsolved]) +
                " turns too fast for its step, and was not turned; give a smaller dt, and go back to a checkpoint");
  double linear = 0, spin = 0;
  for (std::int64_t t = 0; t < n; ++t) {
    linear = std::max(linear, sums_[sums_of_tile * t]);
    spin = std::max(spin, sums_[sums_of_tile * t + 1]);
  }
  way_ = h_ * std::sqrt(linear);
  s.report.way = way_ / smallest_;
  s.advance_cell(h_);
  if (s.scene.cell.any()) s.wrap_into_cell();
  moved_ += (has_shaped_ ? farthest_way(s) : h_ * (std::sqrt(linear) + arm_ * std::sqrt(spin))) + walls_move(s);
}

void SmoothDem::find_neighbours(Simulation& s) {
  const bool old = list_is_old(s);
  if (old) make_list(s);
  // a restored run, or the part of a rank, has forces and a list, but no limit yet
  if (old || !(s.report.stable_step > 0)) s.report.stable_step = contact_limit(s);
  place_contactors(s, false);
}

void SmoothDem::compute_forces(Simulation& s) {
  Bodies& b = s.scene.bodies;
  const BodyTiles all = tiles(s);
  const std::int64_t n = all.count();
  if (!forces_known_) place_contactors(s);
  find_shaped(s);
  sums_.resize(std::max<std::size_t>(sums_.size(), sums_of_tile * n));
  while (int(lanes_.size()) < omp_get_max_threads()) lanes_.push_back(std::make_unique<Lanes>());
#pragma omp parallel for schedule(dynamic)
  for (std::int64_t t = 0; t < n; ++t) tile_forces(s, t, *lanes_[omp_get_thread_num()], h_, &sums_[sums_of_tile * t]);
#pragma omp parallel for schedule(static) if (list_.others + shaped_.others > 0)
  for (std::int64_t t = 0; t < n; ++t)
    each_list([&](NeighbourList& list) {
      const std::int64_t first = list.tile_incoming[t], last = list.tile_incoming[t + 1];
      cairn_smooth_add(b.dofs(), last - first, list.incoming_body.data() + first, list.incoming_place.data() + first,
                       list.other.data(), b.contact_force.values.data());
    });
  if (!shared) damp(s);
  if (h_ > 0 && s.scene.cell.any() && !shared) {
    double sum[10] = {};
    for (std::int64_t t = 0; t < n; ++t)
      for (int k = 0; k < 10; ++k) sum[k] += sums_[std::size_t(sums_of_tile * t + 24 + k)];
    follow_stress(s.scene.cell, sum);
  }
  contactors_seen_ = s.scene.next_contactor_id;
  forces_known_ = true;
}

void SmoothDem::damp(Simulation& s) {
  const BodyTiles all = tiles(s);
  const std::int64_t n = all.count();
  for (std::int64_t t = 0; t < n && settings.local_damping > 0 && h_ > 0; ++t)
    damp_locally(s, all.first(t), all.last(t), &sums_[sums_of_tile * t + 9]);
}

void SmoothDem::damp_locally(Simulation& s, std::int64_t first, std::int64_t last, double* spent) const {
  Bodies& b = s.scene.bodies;
  cairn_local_damping(dim_, b.dofs(), first, last, h_, settings.local_damping, s.scene.gravity.data(),
                      b.mass.values.data(), b.velocity.values.data(), b.contact_force.values.data(), spent,
                      pointer(b.force), bits(b.driven));
}

void SmoothDem::kick(Simulation& s) {
  Bodies& b = s.scene.bodies;
  const BodyTiles all = tiles(s);
  const std::int64_t n = all.count();
  std::int64_t wrong = -1;
#pragma omp parallel for schedule(static) reduction(max : wrong)
  for (std::int64_t t = 0; t < n; ++t) {
    const std::int64_t first = all.first(t), last = all.last(t);
    double* terms = settings.energy ? &sums_[sums_of_tile * t + 4] : nullptr;
    half_step_works(s, t, true);
    if (predicts())
      correct(s, first, last, wrong, &sums_[sums_of_tile * t]);
    else
      end_tile(s, first, last, wrong, terms);
    end_uneven(s, t, wrong, terms);
    if (shared && !shared->alone)
      sums_[sums_of_tile * t + 15] = cairn_verlet_speed(dim_, b.dofs(), first, last, b.velocity.values.data());
  }
  double corrected = 0;
  for (std::int64_t t = 0; t < n && predicts(); ++t) corrected = std::max(corrected, sums_[sums_of_tile * t + 12]);
  moved_ += std::sqrt(corrected);
  speed_ = 0;
  for (std::int64_t t = 0; t < n && shared && !shared->alone; ++t)
    speed_ = std::max(speed_, sums_[sums_of_tile * t + 15]);
  account(s, n);
  s.candidates.count = 0;
  s.contacts_known = false;
  s.report.step = ++s.steps;
  s.report.h = h_;
  s.report.time = s.report.time_detection = s.time += h_;
  s.report.energy = s.energy;
  s.report.neighbour_lists = lists_made_;
  if (wrong >= 0)
    throw Error("velocity of body " + std::to_string(*b.id[wrong]) + " is no finite number after step " +
                std::to_string(s.steps) +
                "; give a smaller dt (explain() names the stable one) or softer laws, and go " +
                "back to a checkpoint");
}

// First half of a step of velocity Verlet, and the records of spheres where they then are. fastest: squares of the
// greatest velocity and spin.
void SmoothDem::begin_tile(Simulation& s, std::int64_t first, std::int64_t last, double* fastest) {
  Bodies& b = s.scene.bodies;
  fastest[0] = fastest[1] = 0;
  each_run(s, first, last, [&](std::int64_t from, std::int64_t to, bool plain) {
    double own[2];
    if (plain)
      cairn_verlet_begin_spheres(from, to, h_, weight_.data(), b.inverse_mass.values.data(),
                                 b.contact_force.values.data(), body_radius_.data(), b.velocity.values.data(),
                                 b.position.values.data(), record_.data(), own);
    else
      cairn_verlet_begin(dim_, b.dofs(), from, to, h_, weight_.data(), b.inverse_mass.values.data(),
                         b.contact_force.values.data(), b.velocity.values.data(), b.position.values.data(), own,
                         dim_ == 2 ? pointer(b.rotation) : nullptr, pointer(b.force), pointer(b.damping),
                         bits(b.driven), pointer(b.driven_velocity), pointer(b.reaction));
    if (spheres_alone_ && !plain) fill_records(s, from, to);
    for (int k = 0; k < 2; ++k) fastest[k] = std::max(fastest[k], own[k]);
  });
}

// The other half.
void SmoothDem::end_tile(Simulation& s, std::int64_t first, std::int64_t last, std::int64_t& wrong, double* terms) {
  Bodies& b = s.scene.bodies;
  each_run(s, first, last, [&](std::int64_t from, std::int64_t to, bool plain) {
    if (plain)
      cairn_verlet_end_spheres(from, to, h_, weight_.data(), b.inverse_mass.values.data(),
                               b.contact_force.values.data(), b.velocity.values.data(), &wrong, terms);
    else
      cairn_verlet_end(dim_, b.dofs(), from, to, h_, weight_.data(), b.inverse_mass.values.data(),
                       b.contact_force.values.data(), b.velocity.values.data(), &wrong, pointer(b.force),
                       pointer(b.damping), bits(b.driven), pointer(b.driven_velocity), pointer(b.reaction), terms);
  });
}

} // namespace cairn
