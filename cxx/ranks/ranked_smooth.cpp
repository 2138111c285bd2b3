#include "ranked_smooth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "../base/call.hpp"
#include "../base/threads.hpp"
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
  if (s.networks && s.networks->thermal && s.networks->thermal->friction != Network::Split::none)
    refuse("contacts of SmoothDEM heat bodies by friction (give friction=None to the network)");
  OverRanks::check_scene(s);
  if (has_parts_of(s)) return; // of which contactors were seen
  for (std::int64_t k = 0; k < s.scene.contactors.count; ++k)
    if (const ShapeInfo& shape = info(Shape(*s.scene.contactors.shape[k])); shape.bounded && !shape.ball())
      refuse(std::string("contactor ") + std::to_string(*s.scene.contactors.id[k]) + " is a " + shape.name +
             ", and SmoothDEM has disks, spheres and walls there");
}

void RankedSmooth::changed(Simulation& s, bool places) {
  OverRanks::changed(s, places);
  if (places) forces_known_ = false;
}

// Bodies have the forces of the step before; pairs remember theirs without moments.
void RankedSmooth::restore(Simulation& s, ContactMemory memory) {
  const bool known = s.scene.bodies.contact_force.active && !memory.keys.empty();
  OverRanks::restore(s, std::move(memory));
  forces_known_ = known;
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

const StepReport& RankedSmooth::step(Simulation& s, double h) {
  return exchange_->together([&]() -> const StepReport& { return step_of_all(s, h); });
}

const StepReport& RankedSmooth::step_of_all(Simulation& s, double h) {
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + std::to_string(h) + "; give a positive, finite step [s]");
  begin(s, h, 0.5, settings().renumber_every);
  s.scene.activate(Need::smooth);
  const Threads threads(settings().threads, s.scene.bodies.count);
  double law = 0;
  for (int e = 0; e < s.laws.entries(); ++e) {
    const double overlap = 0, radius = 1;
    double k[4], reach = 0;
    const LawTable::Entry& entry = s.laws.entry(e);
    const LawInfo& info = law_infos()[std::size_t(entry.law)];
    info.stiffness(1, info.components(s.scene.bodies.dim), &overlap, &radius, entry.params, k, &reach);
    law = std::max(law, reach);
  }
  const auto cut = [&] {
    s.timed("partition", [&] { partition(s, law); });
    forces_known_ = forces_known_ && s.steps > 0;
  };
  if (must_partition(s)) cut();
  s.timed("kick_and_drift", [&] { bring_parts(s); });
  for (int tries = 0; exchange_->ranks() > 1; ++tries) { // ghosts reach as far as bodies go in the step
    std::vector<std::vector<double>> ways;
    for (Part& part : parts_) {
      auto& of_part = ways.emplace_back();
      for (std::size_t i = 0; i < part.bodies.size(); ++i)
        of_part.push_back(law / 2 + 1.01 * next_way(part, std::int64_t(i), h));
    }
    add_growth(ways);
    const double needed = farthest(ways) + h * spread_of(parts_[0].simulation->scene.cell);
    if (2 * needed <= reach_) break;
    if (tries == 20 || !std::isfinite(needed))
      throw Error("bodies move too far in a step of " + std::to_string(h) + " s for ghosts to be found: lower dt");
    if (tries > 0) reach_factor_ *= 2;
    cut();
    bring_parts(s);
  }
  for (Part& part : parts_)
    if (state_is_left()) keep_state(part);
  kept_ = state_is_left();
  on_ranks(s, "kick_and_drift", [&](Part& part) { begin_step(part, h); });
  if (!forces_known_) total_forces(s, false);
  forces_known_ = true;
  on_ranks(s, "kick_and_drift", [&](Part& part) { of(part).kick_and_drift(*part.simulation); });
  on_ranks(s, "find_neighbours", [&](Part& part) {
    Simulation& own = *part.simulation;
    of(part).find_neighbours(own);
    if (!(own.report.stable_step > 0)) own.report.stable_step = of(part).contact_limit(own); // of a new list
  });
  on_ranks(s, "compute_forces", [&](Part& part) { of(part).compute_forces(*part.simulation); });
  total_forces(s, true);
  on_ranks(s, "kick", [&](Part& part) { of(part).kick(*part.simulation); });
  double most[] = {0, -std::numeric_limits<double>::infinity()}; // overlap, least stable step
  for (const Part& part : parts_) {
    most[0] = std::max(most[0], part.simulation->report.solve.penetration);
    most[1] = std::max(most[1], -part.simulation->report.stable_step);
  }
  exchange_->largest(most);
  kept_ = false;
  s.timed("gather", [&] { collect(s); });
  advance_networks(s, h);
  s.report.solve = {};
  s.report.solve.penetration = most[0];
  s.report.solve.contacts = s.report.contacts;
  s.report.stable_step = -most[1];
  s.report.neighbour_lists = parts_[0].simulation->report.neighbour_lists;
  return s.report;
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

void RankedSmooth::begin_step(Part& part, double h) {
  Simulation& own = *part.simulation;
  of(part).keeps_pushes = true;
  if (exchange_->ranks() > 1) of(part).keeps_pair = [this, &part](auto a, auto b) { return pushes_own(part, a, b); };
  if (!forces_known_) of(part).changed(own, true); // it computes the first forces then
  of(part).begin_step(own, h);
}

// Pairs of ghosts, or of a ghost and a body that is everywhere, are those of other ranks.
bool RankedSmooth::pushes_own(const Part& part, std::int32_t one, std::int32_t two) const {
  const auto roams_here = [&](std::int32_t contactor) {
    const auto body = std::size_t(*part.simulation->scene.contactors.body[contactor]);
    return part.own[body] && !everywhere_[std::size_t(part.bodies[body])];
  };
  return roams_here(one) || roams_here(two) || owns_contact(part, one, two);
}

// Pushes on own bodies, by the ids of the contactors that they meet, so that their sums depend on no list.
void RankedSmooth::put_in_order(const Part& part, const NeighbourList& list, Order& order) const {
  const auto& id = part.simulation->scene.contactors.id;
  std::vector<Push> all;
  order.on_all.clear();
  order.owned.clear();
  for (const NeighbourList::Batch& batch : list.batches)
    for (int i = 0; i < batch.count; ++i) {
      const std::int64_t p = batch.first + i;
      const std::int32_t a = list.a[p], b = list.b[p];
      const bool owned = owns_contact(part, a, b);
      if (owned && (order.owned.empty() || order.owned.back().last != p))
        order.owned.push_back({std::int32_t(p), std::int32_t(p)});
      if (owned) ++order.owned.back().last;
      for (const bool first : {true, false}) {
        const std::int32_t body = (first ? list.body_a : list.body_b)[p];
        const auto push = std::int32_t(2 * batch.first + (first ? 0 : batch.count) + i);
        if (everywhere_[std::size_t(part.bodies[std::size_t(body)])]) {
          if (owned) order.on_all.push_back({push, body});
        } else if (part.own[std::size_t(body)]) {
          all.push_back({*id[first ? b : a], *id[first ? a : b], list.image[p], push, body});
        }
      }
    }
  const std::size_t bodies = part.bodies.size();
  order.first.assign(bodies + 1, 0);
  for (const Push& p : all) ++order.first[std::size_t(p.body) + 1];
  std::partial_sum(order.first.begin(), order.first.end(), order.first.begin());
  std::vector<Push> sorted(all.size());
  std::vector<std::int64_t> next(order.first.begin(), order.first.end() - 1);
  for (const Push& p : all) sorted[std::size_t(next[std::size_t(p.body)]++)] = p;
  bool twins = false; // two bodies meet twice, by images whose numbers change
  for (std::size_t body = 0; body < bodies; ++body) {
    const auto begin = sorted.begin() + order.first[body], end = sorted.begin() + order.first[body + 1];
    std::sort(begin, end, [](const Push& p, const Push& q) {
      return p.other != q.other ? p.other < q.other : p.own != q.own ? p.own < q.own : p.image < q.image;
    });
    const auto same = [](const Push& p, const Push& q) { return p.other == q.other && p.own == q.own; };
    twins = twins || std::adjacent_find(begin, end, same) != end;
  }
  order.push.resize(sorted.size());
  std::ranges::transform(sorted, order.push.begin(), &Push::push);
  order.known = !twins;
}

// Most pairs of a list are apart: a byte tells it, and their pushes, far away in memory, are not set.
void RankedSmooth::find_acting(const NeighbourList& list, Order& order) {
  order.acts.resize(2 * std::size_t(list.pairs));
  for (const NeighbourList::Batch& batch : list.batches)
    for (const std::int64_t side : {0, 1})
      std::copy_n(list.active.begin() + batch.first, batch.count,
                  order.acts.begin() + 2 * batch.first + side * batch.count);
}

// Forces of own pairs with images times the shifts of these, for the stress of the cell: (9) sums [N m]; then their
// effective masses [kg].
void RankedSmooth::add_stress(const Simulation& s, const NeighbourList& list, const Order& order, ExactSum* sums) {
  const int dim = s.scene.dim;
  for (const Order::Pairs& of : order.owned)
    for (std::int32_t p = of.first; p < of.last; ++p) {
      if (!list.active[p] || list.image[p] == own_image) continue;
      double shift[3];
      image_shift(s.scene.cell, list.image[p], shift);
      for (int j = 0; j < dim; ++j)
        for (int k = 0; k < dim; ++k) sums[k + 3 * j].add(-list.force[std::int64_t(p) * dim + k] * shift[j]);
      sums[9].add(list.across[std::size_t(p)]);
    }
}

// Adds forces and moments of pairs to own bodies, and those of own pairs to the exact sums of bodies that are
// everywhere.
void RankedSmooth::add_forces(Part& part, std::array<Order, 2>& orders, std::vector<ExactSum>& on_all,
                              const std::vector<std::int32_t>& place) {
  Simulation& s = *part.simulation;
  const auto nd = std::size_t(s.scene.bodies.dofs());
  const NeighbourList* lists[] = {&of(part).list(), &of(part).contacts_of_shapes()};
  std::int64_t& own = contacts_[std::size_t(part.rank)];
  own = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const NeighbourList& list = *lists[k];
    Order& order = orders[k];
    if (!order.known || order.list != of(part).lists_made() || k > 0) put_in_order(part, list, order);
    order.list = of(part).lists_made();
    find_acting(list, order);
    for (const Order::Pairs& of : order.owned)
      own += of.last - of.first - std::count(list.active.begin() + of.first, list.active.begin() + of.last, 0);
    if (s.scene.cell.any()) add_stress(s, list, order, &on_all[on_all.size() - of_cell]);
    for (const Order::OnAll& one : order.on_all) {
      if (!order.acts[std::size_t(one.push)]) continue;
      ExactSum* sum = &on_all[std::size_t(place[std::size_t(part.bodies[std::size_t(one.body)])]) * nd];
      for (std::size_t c = 0; c < nd; ++c) sum[c].add(list.push[std::size_t(one.push) * nd + c]);
    }
    if (k > 0 && list.pairs == 0) continue;
    Field<double>& total = s.scene.bodies.contact_force;
#pragma omp parallel for schedule(static)
    for (std::int64_t body = 0; body < s.scene.bodies.count; ++body) {
      if (!part.own[std::size_t(body)]) continue;
      double sum[6] = {};
      for (std::size_t c = 0; k > 0 && c < nd; ++c) sum[c] = total[body][c];
      for (std::int64_t i = order.first[std::size_t(body)]; i < order.first[std::size_t(body) + 1]; ++i) {
        if (!order.acts[std::size_t(order.push[std::size_t(i)])]) continue;
        const double* push = &list.push[std::size_t(order.push[std::size_t(i)]) * nd];
        for (std::size_t c = 0; c < nd; ++c) sum[c] += push[c];
      }
      std::copy_n(sum, nd, total[body]);
    }
  }
}

// damped: as in a step, where the first forces are without.
void RankedSmooth::total_forces(Simulation& s, bool damped) {
  const int nd = s.scene.bodies.dofs();
  std::vector<std::int32_t> place(std::size_t(s.scene.bodies.count), -1);
  std::int32_t all = 0;
  for (std::size_t i = 0; i < place.size(); ++i)
    if (everywhere_[i]) place[i] = all++;
  std::vector<ExactSum> sums(std::size_t(all * nd) + of_cell);
  contacts_.assign(std::size_t(exchange_->ranks()), 0);
  if (orders_of_ != partitions_) orders_.assign(parts_.size(), {});
  orders_of_ = partitions_;
  on_ranks(s, "add_forces",
           [&](Part& part) { add_forces(part, orders_[std::size_t(&part - parts_.data())], sums, place); });
  add_over_ranks(sums, *exchange_);
  for (Part& part : parts_) {
    Field<double>& total = part.simulation->scene.bodies.contact_force;
    for (std::size_t i = 0; i < part.bodies.size(); ++i)
      if (const std::int32_t from = place[std::size_t(part.bodies[i])]; from >= 0)
        for (int k = 0; k < nd; ++k) total[std::int64_t(i)][k] = sums[std::size_t(from * nd + k)].value();
    if (damped) of(part).damp(*part.simulation);
    Cell& cell = part.simulation->scene.cell;
    double across[of_cell];
    for (std::size_t e = 0; e < of_cell; ++e) across[e] = sums[sums.size() - of_cell + e].value();
    for (std::size_t e = 0; e < 9 && cell.volume(s.scene.dim) > 0; ++e)
      cell.stress[e] = across[e] / cell.volume(s.scene.dim);
    if (damped && cell.any()) of(part).follow_stress(cell, across);
  }
  follow_ghosts(&Bodies::contact_force);
}

} // namespace cairn
