// The step of NSCD over ranks: the stages of each part one after the other, and what they tell each other between.
#include "ranked_nscd.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../base/threads.hpp"
#include "../contacts/assembly_input.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "ranked_sweeps.hpp"

namespace cairn {

RankedNscd::RankedNscd(std::unique_ptr<Nscd> model, std::shared_ptr<Exchange> exchange)
    : model_(std::move(model)), exchange_(std::move(exchange)) {
  name = model_->name;
}

const StepReport& RankedNscd::step(Simulation& s, double h) {
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + std::to_string(h) + "; give a positive, finite step [s]");
  check_scene(s);
  check_laws(s);
  before_ = exchange_->traffic;
  shown_.reset();
  s.contacts_known = false;
  s.candidates.count = 0;
  if (s.steps > 0 && s.steps % model_->settings.renumber_every == 0) s.scene.renumber();
  const Threads threads(model_->settings.solver.threads, s.scene.bodies.count);
  constexpr int most_tries = 20; // each doubles how far ghosts are sought
  for (int tries = 0; !attempt(s, h); ++tries) {
    if (tries == most_tries)
      throw Error("bodies move too far in a step of " + std::to_string(h) + " s for ghosts to be found: lower dt");
    if (tries > 0 || since_partition_ == 0) reach_factor_ *= 2;
    anew_ = true;
  }
  reach_factor_ = std::max(1.0, reach_factor_ / 2);
  return s.report;
}

// f(part) of each rank of this process. One that fails ends the step on all of them.
template <class F>
void RankedNscd::on_ranks(Simulation& s, const char* stage, F&& f) {
  std::vector<std::string> fault(parts_.size());
  s.timed(stage, [&] {
    for (std::size_t l = 0; l < parts_.size(); ++l) try {
        f(parts_[l]);
      } catch (const std::exception& e) { fault[l] = e.what(); }
  });
  const std::string told = exchange_->agree(fault);
  if (told.empty()) return;
  undo();
  throw Error(told);
}

void RankedNscd::undo() {
  for (Part& part : parts_) part.nscd->undo_step(*part.simulation);
}

// False: a body went farther than ghosts were sought, and nothing happened.
bool RankedNscd::attempt(Simulation& s, double h) {
  if (must_partition(s)) s.timed("partition", [&] { partition(s); });
  on_ranks(s, "predict_configuration", [&](Part& part) {
    bring(s, part);
    part.nscd->begin_step(*part.simulation, h);
    part.nscd->predict_configuration(*part.simulation);
  });
  on_ranks(s, "compute_free_velocity", [&](Part& part) { part.nscd->compute_free_velocity(*part.simulation); });
  on_ranks(s, "detect_contacts", [&](Part& part) {
    part.nscd->detect_contacts(*part.simulation);
    keep_own_contacts(part);
  });
  if (!reaches_far_enough()) {
    undo();
    return false;
  }
  s.timed("colour_contacts", [&] { choose_colours(); });
  on_ranks(s, "prepare_contacts", [&](Part& part) { part.nscd->prepare_contacts(*part.simulation); });
  s.timed("solve_contacts", [&] {
    RankedSweeps sweeps(parts_, links_, colours_, *exchange_, model_->settings.solver);
    s.report.solve = sweeps.solve();
  });
  s.timed("update_velocity", [&] { end_velocities(s); });
  on_ranks(s, "commit_contacts", [&](Part& part) {
    Interactions& contacts = part.simulation->interactions;
    contacts.system().load({part.simulation->scene.bodies.velocity});
    contacts.commit(s.report.solve.status == SolveStatus::converged);
  });
  s.timed("account", [&] { account(s, h); });
  on_ranks(s, "update_configuration", [&](Part& part) { part.nscd->update_configuration(*part.simulation); });
  s.timed("gather", [&] { collect(s); });
  return true;
}

// Ghosts were sought up to a gap that bodies use up by their ways and margins.
bool RankedNscd::reaches_far_enough() {
  double longest[] = {0};
  for (Part& part : parts_) {
    const Simulation& s = *part.simulation;
    const int dim = s.scene.dim;
    std::vector<double> used(part.bodies.size(), 0);
    const Array<double>& margins = part.nscd->margins();
    const double constant = part.nscd->settings.margin / 2;
    for (std::int64_t k = 0; k < s.scene.contactors.count; ++k) {
      double& of_body = used[std::size_t(*s.scene.contactors.body[k])];
      of_body = std::max(of_body, std::isnan(constant) ? margins[std::size_t(k)] : constant);
    }
    for (std::size_t i = 0; i < part.bodies.size(); ++i) {
      if (!part.own[i] || everywhere_[std::size_t(part.bodies[i])]) continue;
      double between[3] = {0, 0, 0}, square = 0;
      for (int k = 0; k < dim; ++k)
        between[k] = s.scene.bodies.position[std::int64_t(i)][k] - part.position_then[std::size_t(dim) * i + k];
      for (int k = dim - 1; k >= 0; --k) { // a body that left a periodic cell came back on its other side
        if (!s.scene.cell.periodic[k]) continue;
        const double turns = std::round(between[k] / s.scene.cell.vectors[4 * k]);
        for (int d = 0; d <= k; ++d) between[d] -= turns * s.scene.cell.vectors[d + 3 * k];
      }
      for (int k = 0; k < dim; ++k) square += between[k] * between[k];
      longest[0] = std::max(longest[0], used[i] + std::sqrt(square));
    }
  }
  if (exchange_->ranks() == 1) return true;
  exchange_->largest(longest);
  return 2 * longest[0] <= reach_;
}

// A contact is owned where the contactor with the smaller id is, or the one that is not everywhere.
bool RankedNscd::owns_contact(const Part& part, std::int32_t one, std::int32_t two) const {
  const Contactors& c = part.simulation->scene.contactors;
  const std::int32_t a = *c.body[one], b = *c.body[two];
  const auto roams = [&](std::int32_t body) { return !everywhere_[std::size_t(part.bodies[std::size_t(body)])]; };
  const auto fixed = [&](std::int32_t body) { return part.fixed[std::size_t(body)] != 0; };
  std::int32_t owner = *c.id[one] < *c.id[two] ? a : b;
  if (roams(a) != roams(b))
    owner = roams(a) ? a : b;
  else if (fixed(a) != fixed(b))
    owner = fixed(a) ? b : a;
  return part.own[std::size_t(owner)] != 0;
}

void RankedNscd::keep_own_contacts(Part& part) const {
  if (exchange_->ranks() == 1) return;
  Candidates& c = part.simulation->candidates;
  const auto dim = std::size_t(part.simulation->scene.dim);
  std::size_t to = 0;
  for (std::size_t i = 0; i < std::size_t(c.count); ++i) {
    if (!owns_contact(part, c.contactor_a[i], c.contactor_b[i])) continue;
    for (auto* array : {&c.contactor_a, &c.contactor_b, &c.feature, &c.image}) (*array)[to] = (*array)[i];
    c.gap[to] = c.gap[i];
    for (auto* array : {&c.normal, &c.point})
      std::copy_n(array->begin() + std::ptrdiff_t(dim * i), dim, array->begin() + std::ptrdiff_t(dim * to));
    ++to;
  }
  for (auto* array : {&c.contactor_a, &c.contactor_b, &c.feature, &c.image}) array->resize(to);
  c.gap.resize(to);
  c.normal.resize(dim * to);
  c.point.resize(dim * to);
  c.count = std::int64_t(to);
}

// Contacts that are those of the last step keep their colours: these follow from their keys.
void RankedNscd::choose_colours() {
  shares_.resize(parts_.size());
  double changed[] = {colours_of_ == partitions_ ? 0.0 : 1.0};
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    const Candidates& c = parts_[l].simulation->candidates;
    const Field<std::int64_t>& id = parts_[l].simulation->scene.contactors.id;
    std::vector<ContactKey> key;
    key.reserve(std::size_t(c.count));
    for (std::size_t k = 0; k < std::size_t(c.count); ++k)
      key.push_back({*id[c.contactor_a[k]], *id[c.contactor_b[k]], c.feature[k], c.image[k]});
    if (key != shares_[l].key) changed[0] = 1;
    shares_[l].key = std::move(key);
  }
  exchange_->largest(changed);
  if (changed[0] > 0) colour_anew();
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    ContactSystem& system = parts_[l].simulation->interactions.system();
    system.colours = std::max(colours_, 1);
    system.colour = shares_[l].colour;
  }
}

void RankedNscd::colour_anew() {
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    const Part& part = parts_[l];
    const Candidates& c = part.simulation->candidates;
    const Contactors& contactors = part.simulation->scene.contactors;
    const Array<std::int64_t>& id = part.simulation->scene.bodies.id.values;
    ColourShare& share = shares_[l];
    share.id.assign(id.begin(), id.end());
    share.owner = part.owner;
    share.body.clear();
    for (std::size_t k = 0; k < std::size_t(c.count); ++k) {
      std::array<std::int32_t, 2> bodies = {*contactors.body[c.contactor_a[k]], *contactors.body[c.contactor_b[k]]};
      for (std::int32_t& body : bodies)
        if (part.fixed[std::size_t(body)]) body = -1;
      share.body.push_back(bodies);
    }
  }
  colours_ = colour_contacts(shares_, *exchange_);
  const int numbers = parts_[0].simulation->interactions.system().velocities();
  links_ = link_colours(shares_, *exchange_, colours_, numbers);
  colours_of_ = partitions_;
}

// Velocities at the end of the step: of own bodies from the sweeps, of ghosts from their owners.
void RankedNscd::end_velocities(Simulation& s) {
  for (Part& part : parts_) {
    Bodies& b = part.simulation->scene.bodies;
    std::swap(b.velocity_begin.values, b.velocity.values); // with the spin that the contacts saw
    part.simulation->interactions.system().unload(b.velocity);
  }
  follow_ghosts();
  add_reactions(s);
  for (Part& part : parts_) {
    Bodies& b = part.simulation->scene.bodies;
    if (b.angular_momentum.active)
      cairn_momentum_update(b.count, 1, b.inertia.values.data(), b.rotation.values.data(),
                            b.velocity_begin.values.data(), b.velocity.values.data(),
                            b.angular_momentum.values.data(), bits(b.driven));
  }
}

void RankedNscd::follow_ghosts() {
  if (exchange_->ranks() == 1) return;
  const auto each = [&](const auto& bodies, auto&& f) {
    for (std::size_t l = 0; l < parts_.size(); ++l)
      for (std::size_t j = 0; j < ghost_links_[l].size(); ++j) {
        Field<double>& velocity = parts_[l].simulation->scene.bodies.velocity;
        std::size_t at = 0;
        for (const std::int32_t body : bodies[l][j]) {
          f(velocity[body], ghost_links_[l][j], at, velocity.components);
          at += std::size_t(velocity.components);
        }
      }
  };
  each(ghosts_out_, [](const double* v, Link& link, std::size_t at, int n) { std::copy_n(v, n, &link.out[at]); });
  exchange_->pass(ghost_links_, 0);
  each(ghosts_in_, [](double* v, const Link& link, std::size_t at, int n) { std::copy_n(&link.in[at], n, v); });
}

// Impulses of contacts on driven bodies, from all ranks.
void RankedNscd::add_reactions(Simulation& s) {
  if (!s.scene.bodies.reaction.active) return;
  const int nd = s.scene.bodies.dofs(), dim = s.scene.dim;
  std::vector<std::int32_t> place(std::size_t(s.scene.bodies.count), -1);
  std::size_t driven = 0;
  for (std::int64_t i = 0; i < s.scene.bodies.count; ++i)
    if (*s.scene.bodies.driven[i]) place[std::size_t(i)] = std::int32_t(driven++);
  std::vector<ExactSum> sums(driven * std::size_t(nd));
  for (const Part& part : parts_) {
    ContactSystem& system = part.simulation->interactions.system();
    for (const cairn_batch& b : system.batches)
      for (int lane = 0; lane < b.contacts; ++lane)
        for (const double sign : {1.0, -1.0}) {
          const std::int32_t body = (sign > 0 ? b.body_a : b.body_b)[lane];
          const std::int32_t to = place[std::size_t(part.bodies[std::size_t(body)])];
          if (to < 0) continue;
          double p[3], m[3], l[3] = {0, 0, 0};
          space_impulse(dim, b, lane, p, m);
          const std::int32_t side = sign > 0 ? b.side_a : b.side_b;
          double* lever = sign > 0 ? b.lever_a : b.lever_b;
          for (int k = 0; k < dim; ++k)
            l[k] = is_radial(side) ? at(b, lever, lane, 0) * at(b, b.frame, lane, k) : at(b, lever, lane, k);
          ExactSum* sum = &sums[std::size_t(to) * std::size_t(nd)];
          for (int k = 0; k < dim; ++k) sum[k].add(sign * p[k]);
          if (dim == 2) sum[2].add(sign * (l[0] * p[1] - l[1] * p[0] + m[2]));
          for (int k = 0; k < 3 && dim == 3; ++k)
            sum[3 + k].add(sign * (l[(k + 1) % 3] * p[(k + 2) % 3] - l[(k + 2) % 3] * p[(k + 1) % 3] + m[k]));
        }
  }
  add_over_ranks(sums, *exchange_);
  for (Part& part : parts_) {
    Field<double>& reaction = part.simulation->scene.bodies.reaction;
    std::fill(reaction.values.begin(), reaction.values.end(), 0.0);
    for (std::size_t i = 0; i < part.bodies.size(); ++i)
      if (const std::int32_t from = place[std::size_t(part.bodies[i])]; from >= 0)
        for (int k = 0; k < nd; ++k)
          reaction[std::int64_t(i)][k] = sums[std::size_t(from) * std::size_t(nd) + std::size_t(k)].value();
  }
}

// Work of contacts at the mean of the velocities at both ends of the step, by contact: normal, rest, given, size.
void RankedNscd::add_contact_sums(std::span<ExactSum> sums) {
  for (Part& part : parts_) {
    ContactSystem& system = part.simulation->interactions.system();
    const Bodies& b = part.simulation->scene.bodies;
    if (system.batches.empty()) continue;
    Field<double> spare = b.velocity;
    system.load({b.velocity});
    system.unload_and_add(spare, {b.velocity_begin});
    const cairn_schedule schedule = system.schedule(1);
    for (std::size_t k = 0; k < system.batches.size(); ++k) {
      const cairn_batch& batch = system.batches[k];
      double u[6 * 128];
      cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
      for (int lane = 0; lane < batch.contacts; ++lane) {
        double normal = at(batch, batch.r, lane, 0) * u[lane], rest = 0;
        for (int c = 1; c < batch.components; ++c) rest += at(batch, batch.r, lane, c) * u[c * batch.count + lane];
        const double work = normal + rest;
        batch.scale[lane] = work;
        sums[0].add(normal);
        sums[1].add(rest);
        sums[2].add(std::max(0.0, work));
        sums[3].add(std::abs(work));
      }
    }
    system.load({b.velocity});
  }
}

// The balance of energy, from exact sums over bodies and contacts.
void RankedNscd::account(Simulation& s, double h) {
  ExactSum sums[12]; // terms of bodies, then of contacts
  const cairn_scheme scheme = model_->settings.integrator.scheme(h);
  for (Part& part : parts_) {
    Bodies& b = part.simulation->scene.bodies;
    const auto row = [](auto& field, std::int64_t i) { return field.active ? field[i] : nullptr; };
    for (std::int64_t i = 0; i < b.count; ++i) {
      if (!part.own[std::size_t(i)]) continue;
      double terms[8];
      cairn_energy_terms(s.scene.dim, b.dofs(), 1, h, scheme.share, s.scene.gravity.data(), b.mass[i], b.inertia[i],
                         b.velocity_begin[i], b.velocity[i], terms, row(b.force, i), row(b.damping, i),
                         reinterpret_cast<const std::int8_t*>(row(b.driven, i)), row(b.reaction, i),
                         row(b.momentum_begin, i), row(b.angular_momentum, i), nullptr, nullptr, nullptr, nullptr,
                         nullptr, nullptr);
      for (int k = 0; k < 8; ++k) sums[k].add(terms[k]);
    }
  }
  add_contact_sums({sums + 8, 4});
  add_over_ranks(sums, *exchange_);
  double value[12];
  for (int k = 0; k < 12; ++k) value[k] = sums[k].value();
  const auto [kinetic, d_kinetic, d_potential, external, driven, bulk, by_theta, fall, w_normal, w_rest, given, size] =
      value;
  const double normal = -0.5 * w_normal, friction = -0.5 * w_rest;
  Energy& e = s.energy;
  e.kinetic = kinetic;
  e.potential += d_potential;
  e.work_external += external;
  e.work_driven += driven;
  e.dissipated_normal += normal;
  e.dissipated_friction += friction;
  e.dissipated_bulk += bulk;
  e.dissipated_integrator += by_theta;
  e.closure += d_kinetic + d_potential - external - driven + normal + friction + bulk + by_theta;
  e.turned_over += std::abs(d_potential) + std::abs(external) + std::abs(driven) + std::abs(normal) +
                   std::abs(friction) + std::abs(bulk);
  e.largest_kinetic = std::max({e.largest_kinetic, kinetic, kinetic - d_kinetic});
  e.in_play = e.largest_kinetic + e.turned_over;
  const double of_step = std::max(kinetic, kinetic - d_kinetic) + 0.5 * size + fall;
  const bool moves = of_step > std::numeric_limits<double>::epsilon() * e.in_play;
  s.report.solve.energy_created = moves ? 0.5 * given / of_step : 0;
}

// The state of all bodies to the whole, and the report of the step.
void RankedNscd::collect(Simulation& s) {
  if (exchange_->whole()) {
    for (const Part& part : parts_) take(part, s);
  } else {
    Packer mine;
    for (const Part& part : parts_) pack_own(part, mine);
    for (const Bytes& bytes : exchange_->gather(mine.bytes)) take_packed(bytes, s);
  }
  std::vector<std::int64_t> load(std::size_t(exchange_->ranks()) + 1, 0);
  double largest[] = {0, 0}; // way, bodies that turned too far
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    const Part& part = parts_[l];
    const StepReport& report = part.simulation->report;
    const auto own = std::int64_t(std::count(part.own.begin(), part.own.end(), 1));
    load[std::size_t(part.rank)] = cost_of_body * own + cost_of_contact * part.simulation->candidates.count;
    load.back() += part.simulation->candidates.count;
    largest[0] = std::max(largest[0], report.way);
    largest[1] = std::max(largest[1], double(report.unresolved_rotations));
  }
  exchange_->sum(load);
  exchange_->largest(largest);
  const std::int64_t contacts = load.back();
  load.pop_back();
  std::int64_t all = 0;
  for (const std::int64_t of_rank : load) all += of_rank;
  imbalance_ = all > 0 ? double(*std::max_element(load.begin(), load.end())) * double(load.size()) / double(all) : 1;
  s.report.sub_steps = 1;
  s.report.way = largest[0];
  s.report.unresolved_rotations = std::int64_t(largest[1]);
  s.report.step = ++s.steps;
  s.report.h = parts_[0].simulation->report.h;
  s.report.time_detection = parts_[0].simulation->report.time_detection;
  s.report.time = s.time = parts_[0].simulation->time;
  s.report.contacts = contacts;
  s.report.energy = s.energy;
  ++since_partition_;
  last_ = exchange_->traffic;
  last_.messages -= before_.messages;
  last_.bytes -= before_.bytes;
  last_.sums -= before_.sums;
}

} // namespace cairn
