#include "ranked_smooth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../base/threads.hpp"
#include "../networks/network.hpp"
#include "ranked_sweeps.hpp"

namespace cairn {

std::vector<std::string_view> RankedSmooth::stages(const Simulation&) const {
  return {"kick_and_drift", "find_neighbours", "compute_forces", "add_forces", "kick", "gather"};
}

void RankedSmooth::check_scene(const Simulation& s) const {
  if (settings().energy) refuse("the balance of energy is kept (give energy=False)");
  if (settings().integrator.name != "velocity_verlet") refuse("the integrator is " + settings().integrator.name);
  if (s.networks && s.networks->thermal && s.networks->thermal->friction != Network::Split::none)
    refuse("contacts of SmoothDEM heat bodies by friction (give friction=None to the network)");
  OverRanks::check_scene(s);
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
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + std::to_string(h) + "; give a positive, finite step [s]");
  begin(s, h, 0.5, settings().renumber_every);
  s.scene.activate(Need::smooth);
  const Threads threads(settings().threads, s.scene.bodies.count);
  double law = 0;
  for (int e = 0; e < s.laws.entries(); ++e) {
    const double overlap = 0, radius = 1;
    double k[3], reach = 0;
    const LawTable::Entry& entry = s.laws.entry(e);
    law_infos()[std::size_t(entry.law)].stiffness(1, &overlap, &radius, entry.params, k, &reach);
    law = std::max(law, reach);
  }
  const auto cut = [&] {
    s.timed("partition", [&] { partition(s, law); });
    forces_known_ = forces_known_ && s.steps > 0;
  };
  if (must_partition(s)) cut();
  for (int tries = 0; exchange_->ranks() > 1; ++tries) { // ghosts reach as far as bodies go in the step
    std::vector<std::vector<double>> ways;
    for (Part& part : parts_) {
      bring(s, part);
      auto& of_part = ways.emplace_back();
      for (std::size_t i = 0; i < part.bodies.size(); ++i)
        of_part.push_back(law / 2 + 1.01 * next_way(part, std::int64_t(i), h));
    }
    const double needed = farthest(ways);
    if (2 * needed <= reach_) break;
    if (tries == 20 || !std::isfinite(needed))
      throw Error("bodies move too far in a step of " + std::to_string(h) + " s for ghosts to be found: lower dt");
    if (tries > 0) reach_factor_ *= 2;
    cut();
  }
  on_ranks(s, "kick_and_drift", [&](Part& part) {
    bring(s, part);
    of(part).begin_step(*part.simulation, h);
  });
  if (!forces_known_) total_forces(s);
  forces_known_ = true;
  on_ranks(s, "kick_and_drift", [&](Part& part) { of(part).kick_and_drift(*part.simulation); });
  on_ranks(s, "find_neighbours", [&](Part& part) {
    Simulation& own = *part.simulation;
    of(part).find_neighbours(own);
    if (!(own.report.stable_step > 0)) own.report.stable_step = of(part).contact_limit(own); // of a new list
  });
  on_ranks(s, "compute_forces", [&](Part& part) { of(part).compute_forces(*part.simulation); });
  total_forces(s);
  on_ranks(s, "kick", [&](Part& part) { of(part).kick(*part.simulation); });
  double most[] = {0, -std::numeric_limits<double>::infinity()}; // overlap, least stable step
  for (const Part& part : parts_) {
    most[0] = std::max(most[0], part.simulation->report.solve.penetration);
    most[1] = std::max(most[1], -part.simulation->report.stable_step);
  }
  exchange_->largest(most);
  s.timed("gather", [&] { collect(s); });
  advance_networks(s, h);
  s.report.solve = {};
  s.report.solve.penetration = most[0];
  s.report.solve.contacts = s.report.contacts;
  s.report.stable_step = -most[1];
  s.report.neighbour_lists = parts_[0].simulation->report.neighbour_lists;
  return s.report;
}

// Adds forces and moments of pairs to own bodies, in the order of the other contactors' ids, and those of own pairs to
// the exact sums of bodies that all ranks have.
void RankedSmooth::add_forces(Part& part, std::vector<ExactSum>& on_all, const std::vector<std::int32_t>& place) {
  Simulation& s = *part.simulation;
  s.contacts_known = false; // bodies moved since they were seen
  part.strategy->view(s);
  const Candidates& c = s.candidates;
  const int dim = s.scene.dim, nd = s.scene.bodies.dofs();
  const auto& id = s.scene.contactors.id;
  std::vector<double> force(std::size_t(dim * c.count));
  of(part).force_space(force.data());
  std::vector<std::vector<Push>> pushes(part.bodies.size());
  const int turns = nd - dim;
  std::vector<double> moment(of(part).has_moments() ? std::size_t(turns * c.count) : 0);
  if (of(part).has_moments()) of(part).moment_space(moment.data());
  const auto push_of = [&](std::size_t pair, std::int32_t body, double sign, double out[6]) {
    const double *f = &force[pair * std::size_t(dim)], *point = &c.point[pair * std::size_t(dim)],
                 *x = s.scene.bodies.position[body];
    double arm[3] = {0, 0, 0}, shift[3] = {0, 0, 0};
    if (sign < 0 && s.scene.cell.any()) image_shift(s.scene.cell, c.image[pair], shift);
    for (int k = 0; k < dim; ++k) {
      arm[k] = point[k] - shift[k] - x[k];
      out[k] = sign * f[k];
    }
    if (dim == 2) out[2] = arm[0] * out[1] - arm[1] * out[0];
    for (int k = 0; k < 3 && dim == 3; ++k)
      out[3 + k] = arm[(k + 1) % 3] * out[(k + 2) % 3] - arm[(k + 2) % 3] * out[(k + 1) % 3];
    for (int k = 0; k < turns && !moment.empty(); ++k)
      out[dim + k] += sign * moment[pair * std::size_t(turns) + std::size_t(k)];
  };
  std::int64_t& own = contacts_[std::size_t(part.rank)];
  own = 0;
  for (std::size_t i = 0; i < std::size_t(c.count); ++i) {
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    own += owns_contact(part, a, b);
    for (const bool first : {true, false}) {
      const std::int32_t body = *s.scene.contactors.body[first ? a : b];
      const double sign = first ? 1 : -1;
      if (const std::int32_t to = place[std::size_t(part.bodies[std::size_t(body)])]; to >= 0) {
        if (!owns_contact(part, a, b)) continue;
        double push[6];
        push_of(i, body, sign, push);
        for (int k = 0; k < nd; ++k) on_all[std::size_t(to * nd + k)].add(push[k]);
      } else if (part.own[std::size_t(body)]) {
        pushes[std::size_t(body)].push_back(
            {*id[first ? b : a], *id[first ? a : b], c.image[i], std::int32_t(i), sign});
      }
    }
  }
  Field<double>& total = s.scene.bodies.contact_force;
  for (std::size_t body = 0; body < pushes.size(); ++body) {
    if (!part.own[body] || place[std::size_t(part.bodies[body])] >= 0) continue;
    std::sort(pushes[body].begin(), pushes[body].end(), [](const Push& p, const Push& q) {
      return p.other != q.other ? p.other < q.other : p.own != q.own ? p.own < q.own : p.image < q.image;
    });
    double sum[6] = {};
    for (const Push& p : pushes[body]) {
      double push[6];
      push_of(std::size_t(p.pair), std::int32_t(body), p.sign, push);
      for (int k = 0; k < nd; ++k) sum[k] += push[k];
    }
    std::copy_n(sum, nd, total[std::int64_t(body)]);
  }
}

void RankedSmooth::total_forces(Simulation& s) {
  const int nd = s.scene.bodies.dofs();
  std::vector<std::int32_t> place(std::size_t(s.scene.bodies.count), -1);
  std::int32_t all = 0;
  for (std::size_t i = 0; i < place.size(); ++i)
    if (everywhere_[i]) place[i] = all++;
  std::vector<ExactSum> sums(std::size_t(all * nd));
  contacts_.assign(std::size_t(exchange_->ranks()), 0);
  on_ranks(s, "add_forces", [&](Part& part) { add_forces(part, sums, place); });
  add_over_ranks(sums, *exchange_);
  for (Part& part : parts_) {
    Field<double>& total = part.simulation->scene.bodies.contact_force;
    for (std::size_t i = 0; i < part.bodies.size(); ++i)
      if (const std::int32_t from = place[std::size_t(part.bodies[i])]; from >= 0)
        for (int k = 0; k < nd; ++k) total[std::int64_t(i)][k] = sums[std::size_t(from * nd + k)].value();
  }
  follow_ghosts(&Bodies::contact_force);
}

} // namespace cairn
