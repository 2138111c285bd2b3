#include "ranked_smooth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../base/threads.hpp"
#include "../contactors/shapes.hpp"
#include "../networks/network.hpp"
#include "ranked_sweeps.hpp"

namespace cairn {

namespace {

constexpr std::size_t of_cell = 10; // sums over the contacts across its sides

// How fast images come nearer to each other where the cell changes its shape, half of it for each side [m/s].
double spread_of(const Cell& cell) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    double square = 0;
    for (int i = 0; i < 3; ++i) {
      double rate = 0;
      for (int j = 0; j < 3; ++j) rate += cell.velocity_gradient[i + 3 * j] * cell.vectors[j + 3 * k];
      square += rate * rate;
    }
    sum += std::sqrt(square);
  }
  return sum / 2;
}

} // namespace

std::vector<std::string_view> RankedSmooth::stages(const Simulation&) const {
  return {"kick_and_drift", "find_neighbours", "compute_forces", "add_forces", "kick", "gather"};
}

void RankedSmooth::check_scene(const Simulation& s) const {
  if (!s.meshes.empty()) refuse("SmoothDEM moves the mesh '" + s.meshes.meshes[0].model.name + "'");
  if (settings().energy) refuse("the balance of energy is kept (give energy=False)");
  if (settings().integrator.name != "velocity_verlet") refuse("the integrator is " + settings().integrator.name);
  OverRanks::check_scene(s);
}

void RankedSmooth::changed(Simulation& s, bool places) {
  if (fixed_forces_ == Fixed::of_pairs) add_fixed(); // lists are made anew, maybe before anyone reads them
  OverRanks::changed(s, places);
  motion_.known = false;
  if (places) forces_known_ = false;
}

// Bodies have the forces of the step before; pairs remember theirs without moments.
void RankedSmooth::restore(Simulation& s, ContactMemory memory) {
  const bool known = s.scene.bodies.contact_force.active && !memory.keys.empty();
  OverRanks::restore(s, std::move(memory));
  fixed_forces_ = Fixed::known;
  forces_known_ = known;
  motion_.known = false;
}

const StepReport& RankedSmooth::step(Simulation& s, double h) {
  return exchange_->together([&]() -> const StepReport& { return step_of_all(s, h); });
}

const StepReport& RankedSmooth::step_of_all(Simulation& s, double h) {
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + std::to_string(h) + "; give a positive, finite step [s]");
  begin(s, h, settings().renumber_every);
  s.scene.activate(Need::smooth);
  const Threads threads(settings().threads, s.scene.bodies.count);
  const bool heats = s.networks && s.networks->thermal && s.networks->thermal->friction != Network::Split::none;
  if (must_partition(s)) cut(s);
  s.timed("kick_and_drift", [&] { bring_parts(s); });
  if (exchange_->ranks() > 1) reach_ghosts(s, h);
  motion_.known = false;
  kept_ = state_is_left() && may_fail_;
  for (Part& part : parts_)
    if (kept_) keep_state(part);
  on_ranks(s, "kick_and_drift", [&](Part& part) { begin_step(part, heats, h); });
  if (!forces_known_) total_forces(s, false);
  forces_known_ = true;
  on_ranks(s, "kick_and_drift", [&](Part& part) { of(part).kick_and_drift(*part.simulation); });
  on_ranks(s, "find_neighbours", [&](Part& part) { of(part).find_neighbours(*part.simulation); });
  on_ranks(s, "compute_forces", [&](Part& part) { of(part).compute_forces(*part.simulation); });
  total_forces(s, true);
  on_ranks(s, "kick", [&](Part& part) { of(part).kick(*part.simulation); });
  constexpr double none = std::numeric_limits<double>::infinity();
  double most[] = {0, -none, 0, -none, 0}; // overlap; least stable step; way; smallest body; lists made
  double way = 0;
  for (Part& part : parts_) {
    most[0] = std::max(most[0], part.simulation->report.solve.penetration);
    most[1] = std::max(most[1], -part.simulation->report.stable_step);
    way = std::max(way, of(part).way());
    most[3] = std::max(most[3], -of(part).smallest());
    most[4] = std::max(most[4], double(part.simulation->report.neighbour_lists));
  }
  most[2] = way;
  if (!way_has_step_) way_ += way;
  way_has_step_ = false;
  motion_ = {true, h, s.scene.gravity};
  exchange_->largest(most);
  kept_ = false;
  s.timed("gather", [&] { collect(s); });
  advance_networks(s, h);
  s.report.solve = {};
  s.report.solve.penetration = most[0];
  s.report.solve.contacts = s.report.contacts;
  s.report.stable_step = -most[1];
  s.report.way = most[2] / -most[3];
  s.report.neighbour_lists = std::int64_t(most[4]);
  return s.report;
}

void RankedSmooth::cut(Simulation& s) {
  if (!parts_.empty()) total_fixed(); // while their pairs are there
  find_reach_and_risk(s);             // a first cut may leave the whole without numbers
  s.timed("partition", [&] { partition(s, law_reach_); });
  forces_known_ = forces_known_ && s.steps > 0;
  way_ = 0;
  motion_.known = false;
  sum_of_.assign(std::size_t(s.scene.bodies.count), -1);
  std::int32_t moving = 0, fixed = 0;
  for (std::size_t i = 0; i < sum_of_.size(); ++i)
    if (everywhere_[i]) sum_of_[i] = fixed_[i] ? fixed++ : moving++;
  sums_.assign(std::size_t(moving * s.scene.bodies.dofs()) + of_cell, {});
  fixed_sums_.assign(std::size_t(fixed * s.scene.bodies.dofs()), {});
  counted_.assign(parts_.size(), {});
  on_all_.assign(parts_.size(), {});
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    share(parts_[l]);
    for (std::size_t i = 0; i < parts_[l].bodies.size(); ++i)
      if (const auto body = std::size_t(parts_[l].bodies[i]); everywhere_[body])
        on_all_[l].push_back({std::int32_t(i), sum_of_[body]});
  }
}

// Numbers of bodies are read from the parts where they alone have them; materials are with the whole.
void RankedSmooth::find_reach_and_risk(const Simulation& s) {
  double found[] = {0, 0}; // radius [m], 1: bodies have unequal moments
  const auto look = [&](const Scene& scene) {
    const Contactors& c = scene.contactors;
    for (std::int64_t k = 0; k < c.count; ++k)
      if (info(Shape(*c.shape[k])).bounded && std::isfinite(*c.radius[k])) found[0] = std::max(found[0], *c.radius[k]);
    for (std::int64_t i = 0; i < scene.bodies.count && scene.bodies.angular_momentum.active; ++i)
      if (SmoothDem::is_uneven(scene.bodies, i)) found[1] = 1;
  };
  if (numbers_are_apart(s))
    for (const Part& part : parts_) look(part.simulation->scene);
  else
    look(s.scene);
  exchange_->largest(found);
  law_reach_ = reach_of_laws(s, found[0]);
  may_fail_ = s.scene.cell.any() || found[1] > 0 || lacks_laws(s);
}

// Gap at which the first force of a law begins, between bodies of the largest radius [m].
double RankedSmooth::reach_of_laws(const Simulation& s, double radius) {
  double most = 0;
  for (int e = 0; e < s.laws.entries(); ++e) {
    const double overlap = 0;
    double k[4], reach = 0;
    const LawTable::Entry& entry = s.laws.entry(e);
    const LawInfo& law = law_infos()[std::size_t(entry.law)];
    law.stiffness(1, law.components(s.scene.bodies.dim), &overlap, &radius, entry.params, k, &reach);
    most = std::max(most, reach);
  }
  return most;
}

// True if two materials may meet without a law.
bool RankedSmooth::lacks_laws(const Simulation& s) {
  std::vector<std::int32_t> materials(s.scene.contactors.material.values.begin(),
                                      s.scene.contactors.material.values.end());
  std::sort(materials.begin(), materials.end());
  materials.erase(std::unique(materials.begin(), materials.end()), materials.end());
  for (const std::int32_t one : materials)
    for (const std::int32_t two : materials)
      if (s.laws.find(one, two) < 0) return true;
  return false;
}

// Bodies of a part by the tiles of the whole.
void RankedSmooth::share(Part& part) const {
  SharedBodies bodies;
  std::int64_t tile = -1;
  for (std::size_t i = 0; i < part.bodies.size(); ++i) {
    const std::int64_t of_whole = part.bodies[i] / BodyTiles::size;
    if (of_whole != tile) bodies.tile_first.push_back(std::int64_t(i));
    tile = of_whole;
    bodies.tile_of.push_back(std::int32_t(bodies.tile_first.size()) - 1);
    bodies.everywhere.push_back(everywhere_[std::size_t(part.bodies[i])]);
  }
  bodies.tile_first.push_back(std::int64_t(part.bodies.size()));
  bodies.alone = exchange_->ranks() == 1;
  bodies.keeps_pair = [this, &part](auto a, auto b) { return pushes_own(part, a, b); };
  of(part).shared = std::move(bodies);
}

void RankedSmooth::reach_ghosts(Simulation& s, double h) {
  if (ways_are_short(s, h)) return;
  for (int tries = 0;; ++tries) {
    std::vector<std::vector<double>> ways;
    for (Part& part : parts_) {
      auto& of_part = ways.emplace_back();
      for (std::size_t i = 0; i < part.bodies.size(); ++i)
        of_part.push_back(law_reach_ / 2 + 1.01 * next_way(part, std::int64_t(i), h));
    }
    add_growth(ways);
    const double needed = farthest(ways) + h * spread_of(parts_[0].simulation->scene.cell);
    way_ = needed - law_reach_ / 2;
    way_has_step_ = true;
    if (2 * needed <= reach_) return;
    if (tries == 20 || !std::isfinite(needed))
      throw Error("bodies move too far in a step of " + std::to_string(h) + " s for ghosts to be found: lower dt");
    if (tries > 0) reach_factor_ *= 2;
    cut(s);
    bring_parts(s);
  }
}

// Way of a body in the next step [m]: half a kick, then a drift.
double RankedSmooth::next_way(const Part& part, std::int64_t body, double h) const {
  const Scene& scene = part.simulation->scene;
  const Bodies& b = scene.bodies;
  double square = 0;
  for (int k = 0; k < scene.dim; ++k) {
    double push = b.contact_force.active ? b.contact_force[body][k] : 0;
    if (b.force.active) push += b.force[body][k];
    double v = b.velocity[body][k] + h / 2 * (scene.gravity[std::size_t(k)] + push / *b.mass[body]);
    if (b.driven.active && (*b.driven[body] >> k & 1)) v = b.driven_velocity[body][k];
    square += v * v;
  }
  return h * std::sqrt(square);
}

// True if a bound tells that ghosts reach: kicks are equal at the end of a step and at the begin of the next one, so
// that the next velocity is twice that of the end less that of the middle.
bool RankedSmooth::ways_are_short(const Simulation& s, double h) {
  double most[] = {std::numeric_limits<double>::infinity()};
  const auto same = [](double a, double b) { return !(a < b) && !(b < a); };
  bool bounded = motion_.known && same(motion_.h, h);
  for (std::size_t k = 0; k < 3; ++k) bounded = bounded && same(motion_.gravity[k], s.scene.gravity[k]);
  double next = 0;
  for (Part& part : parts_) {
    bounded = bounded && moves_plainly(part);
    next = std::max(next, 2 * h * of(part).speed() + of(part).way());
  }
  if (bounded) most[0] = law_reach_ / 2 + 1.01 * (way_ + next);
  exchange_->largest(most);
  return 2 * most[0] <= reach_;
}

// Contacts and gravity alone move the bodies that are not everywhere, in a space that stands.
bool RankedSmooth::moves_plainly(const Part& part) const {
  const Scene& scene = part.simulation->scene;
  const Bodies& b = scene.bodies;
  if (b.force.active || b.damping.active || b.stretch.active || scene.cell.any() || scene.has(Need::growing))
    return false;
  if (!b.driven.active) return true;
  const auto& everywhere = static_cast<const SmoothDem&>(*part.strategy).shared->everywhere;
  std::uint8_t driven = 0; // without a branch, for vectors
  for (std::size_t i = 0; i < everywhere.size(); ++i)
    driven |= std::uint8_t(b.driven.values[i] & (everywhere[i] ? 0 : 255));
  return driven == 0;
}

// The state at the begin of a step, where the whole does not have it: in arrays that steps of NSCD use.
void RankedSmooth::keep_state(Part& part) {
  Bodies& b = part.simulation->scene.bodies;
  b.position_begin.values = b.position.values;
  b.rotation_begin.values = b.rotation.values;
  b.velocity_begin.values = b.velocity.values;
  b.momentum_begin.values = b.angular_momentum.values;
  b.velocity_free.values = b.contact_force.values;
}

void RankedSmooth::undo() {
  if (!kept_) return;
  kept_ = false;
  for (Part& part : parts_) {
    Bodies& b = part.simulation->scene.bodies;
    b.position.values = b.position_begin.values;
    b.rotation.values = b.rotation_begin.values;
    b.velocity.values = b.velocity_begin.values;
    b.angular_momentum.values = b.momentum_begin.values;
    b.contact_force.values = b.velocity_free.values;
  }
}

void RankedSmooth::begin_step(Part& part, bool heats, double h) {
  Simulation& own = *part.simulation;
  if (of(part).keeps_loss != heats || !forces_known_) of(part).changed(own, !forces_known_);
  of(part).keeps_loss = heats;
  of(part).begin_step(own, h); // it computes the first forces
}

// Pairs of ghosts, or of a ghost and a body that is everywhere, are those of other ranks.
bool RankedSmooth::pushes_own(const Part& part, std::int32_t one, std::int32_t two) const {
  const auto roams_here = [&](std::int32_t contactor) {
    const auto body = std::size_t(*part.simulation->scene.contactors.body[contactor]);
    return part.own[body] && !everywhere_[std::size_t(part.bodies[body])];
  };
  return roams_here(one) || roams_here(two) || owns_contact(part, one, two);
}

void RankedSmooth::count_pairs(const Part& part, const NeighbourList& list, Counted& counted) const {
  counted.on_all.clear();
  counted.on_fixed.clear();
  counted.owned.clear();
  for (const NeighbourList::Batch& batch : list.batches)
    for (int i = 0; i < batch.count; ++i) {
      const auto p = std::int32_t(batch.first + i);
      if (!owns_contact(part, list.a[p], list.b[p])) continue;
      if (counted.owned.empty() || counted.owned.back().last != p) counted.owned.push_back({p, p});
      ++counted.owned.back().last;
      for (const std::int32_t side : {0, 1}) {
        const std::int32_t body = (side == 0 ? list.body_a : list.body_b)[p];
        const std::int32_t sum = sum_of_[std::size_t(part.bodies[std::size_t(body)])];
        if (sum < 0) continue;
        auto& pairs = part.fixed[std::size_t(body)] ? counted.on_fixed : counted.on_all;
        pairs.push_back({p, std::int32_t(2 * batch.kept + side * batch.count + i), sum});
      }
    }
}

// Forces of own pairs with images times the shifts of these, for the stress of the cell: (9) sums [N m]; then their
// effective masses [kg].
void RankedSmooth::add_stress(const Simulation& s, const NeighbourList& list, const Counted& counted, ExactSum* sums) {
  const int dim = s.scene.dim;
  for (const Counted::Pairs& of : counted.owned)
    for (std::int32_t p = of.first; p < of.last; ++p) {
      if (!list.active[p] || list.image[p] == own_image) continue;
      double shift[3];
      image_shift(s.scene.cell, list.image[p], shift);
      for (int j = 0; j < dim; ++j)
        for (int k = 0; k < dim; ++k) sums[k + 3 * j].add(-list.force[std::int64_t(p) * dim + k] * shift[j]);
      sums[9].add(list.across[std::size_t(p)]);
    }
}

// Adds forces and moments of own pairs to the exact sums of bodies that are everywhere, and counts these pairs.
void RankedSmooth::add_forces(Part& part) {
  Simulation& s = *part.simulation;
  const NeighbourList* lists[] = {&of(part).list(), &of(part).contacts_of_shapes()};
  std::int64_t& own = contacts_[std::size_t(part.rank)];
  own = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const NeighbourList& list = *lists[k];
    Counted& counted = counted_[std::size_t(&part - parts_.data())][k];
    if (counted.list != of(part).lists_made() || k > 0) count_pairs(part, list, counted);
    counted.list = of(part).lists_made();
    for (const Counted::Pairs& of : counted.owned)
      own += of.last - of.first - std::count(list.active.begin() + of.first, list.active.begin() + of.last, 0);
    if (s.scene.cell.any()) add_stress(s, list, counted, &sums_[sums_.size() - of_cell]);
    add_kept(list, counted.on_all, s.scene.bodies.dofs(), sums_);
  }
}

void RankedSmooth::add_kept(const NeighbourList& list, const std::vector<Counted::OnAll>& pairs, int dofs,
                            std::vector<ExactSum>& sums) {
  const auto nd = std::size_t(dofs);
  for (const Counted::OnAll& one : pairs) {
    if (!list.active[one.pair]) continue;
    ExactSum* sum = &sums[std::size_t(one.sum) * nd];
    for (std::size_t c = 0; c < nd; ++c) sum[c].add(list.kept[std::size_t(one.kept) * nd + c]);
  }
}

// Forces on bodies that are everywhere, fixed ones or others, as sums over ranks have them.
void RankedSmooth::write_sums(std::vector<ExactSum>& sums, bool fixed) {
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    Field<double>& total = parts_[l].simulation->scene.bodies.contact_force;
    for (const auto& [body, from] : on_all_[l]) {
      if ((parts_[l].fixed[std::size_t(body)] != 0) != fixed) continue;
      for (int k = 0; k < total.components; ++k)
        total[body][k] = sums[std::size_t(from * total.components + k)].value();
    }
  }
}

// Forces on fixed bodies move nothing: they wait for a reader, of whom there is none in most steps of a run.
void RankedSmooth::add_fixed() {
  std::fill(fixed_sums_.begin(), fixed_sums_.end(), ExactSum());
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    const SmoothDem& smooth = of(parts_[l]);
    const int dofs = parts_[l].simulation->scene.bodies.dofs();
    add_kept(smooth.list(), counted_[l][0].on_fixed, dofs, fixed_sums_);
    add_kept(smooth.contacts_of_shapes(), counted_[l][1].on_fixed, dofs, fixed_sums_);
  }
  fixed_forces_ = Fixed::added;
}

void RankedSmooth::total_fixed() {
  if (fixed_sums_.empty()) return;
  if (fixed_forces_ == Fixed::of_pairs) add_fixed();
  if (fixed_forces_ == Fixed::known) return;
  add_over_ranks(fixed_sums_, *exchange_);
  write_sums(fixed_sums_, true);
  fixed_forces_ = Fixed::known;
}

void RankedSmooth::complete_state(Simulation&) { total_fixed(); }

// Forces on bodies that are everywhere, from all ranks, and on ghosts from their owners. damped: as in a step, where
// the first forces are without.
void RankedSmooth::total_forces(Simulation& s, bool damped) {
  std::fill(sums_.begin(), sums_.end(), ExactSum());
  contacts_.assign(std::size_t(exchange_->ranks()), 0);
  on_ranks(s, "add_forces", [&](Part& part) { add_forces(part); });
  add_over_ranks(sums_, *exchange_);
  if (sums_.size() > of_cell) write_sums(sums_, false);
  fixed_forces_ = Fixed::of_pairs;
  // those of drives are taken from each step, and a step that fails leaves the forces of its begin
  if (!damped || may_fail_ || s.scene.bodies.reaction.active) total_fixed();
  for (Part& part : parts_) {
    if (damped) of(part).damp(*part.simulation);
    Cell& cell = part.simulation->scene.cell;
    double across[of_cell];
    for (std::size_t e = 0; e < of_cell; ++e) across[e] = sums_[sums_.size() - of_cell + e].value();
    for (std::size_t e = 0; e < 9 && cell.volume(s.scene.dim) > 0; ++e)
      cell.stress[e] = across[e] / cell.volume(s.scene.dim);
    if (damped && cell.any()) of(part).follow_stress(cell, across);
  }
  follow_ghosts(&Bodies::contact_force);
}

} // namespace cairn
