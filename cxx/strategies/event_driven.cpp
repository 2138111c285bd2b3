// Event-driven dynamics of disks and spheres: bodies fly on their parabolas, impacts are found in the order of time and
// solved in turn, simultaneous impacts as a single problem (Alder & Wainwright 1959; Lubachevsky 1991). A contact that
// stays, or impacts that accumulate, end the flight: the rest of the step is one of NSCD, and the report says so.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../base/threads.hpp"
#include "../networks/network.hpp"
#include "../simulation/contact_fields.hpp"
#include "event_driven/event_driven.hpp"
#include "options.hpp"

namespace cairn {
namespace events {
static double kinetic(const Bodies& b) {
  double sum = 0;
  for (std::int64_t i = 0; i < b.count; ++i)
    for (int k = 0; k < b.dofs(); ++k) {
      const double inertial = k < b.dim ? *b.mass[i] : b.inertia[i][k - b.dim];
      if (std::isfinite(inertial)) sum += 0.5 * inertial * b.velocity[i][k] * b.velocity[i][k];
    }
  return sum;
}

const StepReport& EventDriven::step(Simulation& s, double h) {
  begin(s, h);
  const Threads threads(1, 1);
  const double before = s.time;
  const Energy energy = s.energy;
  bool whole = false;
  std::int64_t impacts = 0;
  try {
    s.timed("fly", [&] { whole = fly(s); });
    finish(s);
    impacts = s.report.events;
    s.time += whole ? h : now_;
    persistent_.settings.solver.tolerance = settings_.tol;
    persistent_.settings.solver.max_iterations = settings_.max_iter;
    persists_ = false; // false: networks first read the impacts of the flight
    if (whole) {
      s.advance_networks(h);
    } else {
      if (s.networks) s.networks->keep_flight(s, now_);
      persists_ = true;
      s.timed("persist", [&] { persistent_.step(s, h - now_); });
    }
  } catch (...) {
    s.time = before;
    s.energy = energy;
    Bodies& b = s.scene.bodies;
    b.position.values = kept_position_;
    b.velocity.values = kept_velocity_;
    if (b.rotation.active) b.rotation.values = kept_rotation_;
    s.forget_contacts();
    if (s.networks) s.networks->forget_flight();
    throw;
  }
  if (whole) s.report.step = ++s.steps;
  s.report.events = impacts;
  s.report.persistent = whole ? 0 : h - now_;
  s.report.h = h;
  s.report.time = s.time;
  s.report.energy = s.energy;
  if (s.scene.cell.any()) s.wrap_into_cell();
  return s.report;
}

void EventDriven::begin(Simulation& s, double h) {
  if (!(h > 0) || !std::isfinite(h)) throw Error("dt is " + std::to_string(h) + "; give a positive, finite step [s]");
  check_scene(s);
  check_laws(s);
  check_bodies(s);
  s.apply_controls(h, 0.5, false);
  if (s.steps > 0 && s.steps % settings_.renumber_every == 0) s.scene.renumber();
  if (s.scene.cell.any()) s.wrap_into_cell();
  Bodies& b = s.scene.bodies;
  const int nd = b.dofs(), dim = b.dim;
  h_ = h;
  now_ = potential_ = external_ = 0;
  kept_position_ = b.position.values;
  kept_velocity_ = b.velocity.values;
  if (b.rotation.active) kept_rotation_ = b.rotation.values;
  cairn_inverse_masses(dim, nd, b.count, b.mass.values.data(), b.inertia.values.data(), b.inverse_mass.values.data());
  acceleration_.assign(b.count * nd, 0);
  at_.assign(b.count, 0);
  number_.assign(b.count, 0);
  begin_kinetic_ = kinetic(b);
  std::fill(b.reaction.values.begin(), b.reaction.values.end(), 0.0);
  for (std::int64_t i = 0; i < b.count; ++i)
    for (int k = 0; k < nd; ++k) {
      if (b.driven.active && (*b.driven[i] >> k & 1)) {
        b.inverse_mass[i][k] = 0;
        b.velocity[i][k] = b.driven_velocity[i][k];
      }
      if (!(b.inverse_mass[i][k] > 0)) continue;
      acceleration_[nd * i + k] =
          (k < dim ? s.scene.gravity[k] : 0) + (b.force.active ? b.inverse_mass[i][k] * b.force[i][k] : 0);
    }
  for (auto* array : {&found_.contactor_a, &found_.contactor_b, &found_.image, &found_.feature}) array->clear();
  for (auto* array : {&found_.gap, &found_.normal, &found_.point}) array->clear();
  for (auto* array : {&impulse_, &local_, &after_, &dissipated_}) array->clear();
  status_.clear();
  s.report.events = 0;
  s.report.solve = {};
}

// The events of a step, in the order of time.
bool EventDriven::fly(Simulation& s) {
  find_neighbours(s);
  while (!queue_.empty()) {
    std::pop_heap(queue_.begin(), queue_.end(), later);
    const Event e = queue_.back();
    queue_.pop_back();
    if (e.pair < 0) {
      if (number_[e.body] != e.number_a) continue;
      now_ = e.time;
      advance_all(s, now_);
      find_neighbours(s);
      continue;
    }
    const Pair& p = pairs_[std::size_t(e.pair)];
    if (number_[p.body_a] != e.number_a || number_[p.body_b] != e.number_b) continue;
    now_ = e.time;
    if (impact(s, e.pair, now_)) continue;
    advance_all(s, now_);
    settle(s);
    return false;
  }
  advance_all(s, h_);
  return true;
}

// The pairs that meet in the same instant, or touch one that does.
void EventDriven::gather(Simulation& s, std::int32_t pair, double time) {
  group_.assign(1, pair);
  bodies_.clear();
  const auto take = [&](std::int32_t body) {
    if (s.scene.bodies.inverse_mass[body][0] > 0 || s.scene.bodies.inverse_mass[body][1] > 0)
      if (std::find(bodies_.begin(), bodies_.end(), body) == bodies_.end()) bodies_.push_back(body);
  };
  take(pairs_[std::size_t(pair)].body_a);
  take(pairs_[std::size_t(pair)].body_b);
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    for (std::int32_t k = first_pair_[bodies_[i]]; k < first_pair_[bodies_[i] + 1]; ++k) {
      const std::int32_t other = pair_of_[k];
      if (std::find(group_.begin(), group_.end(), other) != group_.end()) continue;
      const Contact at = look(s, pairs_[std::size_t(other)], time);
      if (at.gap > 2 * at.blur) continue;
      group_.push_back(other);
      take(pairs_[std::size_t(other)].body_a);
      take(pairs_[std::size_t(other)].body_b);
    }
  std::sort(group_.begin(), group_.end());
}

// False: the pair rests against each other, or met too often for the step.
bool EventDriven::impact(Simulation& s, std::int32_t pair, double time) {
  Pair& first = pairs_[std::size_t(pair)];
  const Contact at = look(s, first, time);
  const bool strikes = at.speed < 0;
  group_.assign(1, pair);
  if (!strikes && at.push < 0 && at.gap <= 4 * at.blur) return false;
  if (strikes) { // else it only grazed
    if (++first.impacts > settings_.impacts) return false;
    gather(s, pair, time);
    for (const std::int32_t p : group_) {
      advance(s, pairs_[std::size_t(p)].body_a, time);
      advance(s, pairs_[std::size_t(p)].body_b, time);
    }
    solve_impacts(s, false);
  }
  bodies_.clear();
  for (const std::int32_t p : group_)
    for (const std::int32_t body : {pairs_[std::size_t(p)].body_a, pairs_[std::size_t(p)].body_b})
      if (std::find(bodies_.begin(), bodies_.end(), body) == bodies_.end()) bodies_.push_back(body);
  const double on = strikes ? time : std::nextafter(time, h_);
  for (const std::int32_t body : bodies_) ++number_[body];
  for (const std::int32_t body : bodies_) {
    expect_to_leave(s, body, at_[body]);
    for (std::int32_t k = first_pair_[body]; k < first_pair_[body + 1]; ++k) expect(s, pair_of_[k], on);
  }
  return true;
}

// Moves bodies so that pairs in contact at the end of the flight are in contact for NSCD as well. By rounding such a
// pair may have a gap when NSCD detects it, which laws of restitution take as open: the body would fall for the whole
// step.
void EventDriven::settle(Simulation& s) {
  Bodies& b = s.scene.bodies;
  group_.clear();
  for (std::size_t p = 0; p < pairs_.size(); ++p)
    if (const Contact at = look(s, pairs_[p], now_); at.gap <= 4 * at.blur) group_.push_back(std::int32_t(p));
  if (group_.empty()) return;
  solve_impacts(s, true);
  for (const std::int32_t k : group_) {
    const Pair& p = pairs_[std::size_t(k)];
    const Contact at = look(s, p, now_);
    const bool first = b.inverse_mass[p.body_a][0] > 0 || b.inverse_mass[p.body_a][1] > 0;
    const double parts = at.speed > 0 ? 0 : (h_ - now_) * at.still;
    const double way = std::max(0.0, at.gap + 4 * at.blur + parts);
    for (int d = 0; d < b.dim; ++d) b.position[first ? p.body_a : p.body_b][d] += (first ? -1 : 1) * way * at.normal[d];
  }
}

// The impacts of an instant as one contact problem, whose law is that of the pairs at a closed gap. plastic: as if
// nothing had moved before, so that nothing rebounds.
void EventDriven::solve_impacts(Simulation& s, bool plastic) {
  Bodies& b = s.scene.bodies;
  const int dim = b.dim;
  hit_.count = std::int64_t(group_.size());
  for (auto* array : {&hit_.contactor_a, &hit_.contactor_b, &hit_.image, &hit_.feature}) array->clear();
  for (auto* array : {&hit_.gap, &hit_.normal, &hit_.point}) array->clear();
  for (const std::int32_t k : group_) {
    const Pair& p = pairs_[std::size_t(k)];
    const Contact at = look(s, p, at_[p.body_a]);
    hit_.contactor_a.push_back(p.a);
    hit_.contactor_b.push_back(p.b);
    hit_.image.push_back(p.image);
    hit_.feature.push_back(0);
    hit_.gap.push_back(0);
    for (int d = 0; d < dim; ++d) {
      hit_.normal.push_back(at.normal[d]);
      hit_.point.push_back(b.position[p.body_a][d] + offset_[std::int64_t(p.a) * dim + d] + at.point[d]);
    }
  }
  Interactions& contacts = s.interactions;
  contacts.forget_impulses();
  contacts.options().impulse_point = ImpulsePoint::middle_of_gap;
  contacts.options().configuration = LawConfiguration::detection;
  contacts.pose({});
  b.velocity_free.values = b.velocity.values;
  b.velocity_begin.values = b.velocity.values;
  if (plastic) std::fill(b.velocity.values.begin(), b.velocity.values.end(), 0.0);
  contacts.assemble(b, s.scene.contactors, hit_, s.laws, s.scene.cell, h_, 1);
  SolverOptions solver{};
  solver.tolerance = settings_.tol;
  solver.min_iterations = 1;
  solver.max_iterations = settings_.max_iter;
  solver.threads = 1;
  const SolveReport solved = contacts.solve(b, solver);
  contacts.update_velocity(b);
  const std::size_t n = status_.size(), more = group_.size();
  status_.resize(n + more);
  dissipated_.resize(n + more);
  for (auto* array : {&impulse_, &local_, &after_}) array->resize(dim * (n + more));
  contacts.views().impulse_space(&impulse_[dim * n]);
  contacts.views().impulse_local(&local_[dim * n]);
  contacts.views().relative_velocity(&after_[dim * n]);
  contacts.views().dissipated(&dissipated_[n]);
  contacts.views().status(&status_[n]);
  const ContactEnergy energy = contacts.commit();
  s.energy.dissipated_normal += energy.normal;
  s.energy.dissipated_friction += energy.tangential;
  s.energy.turned_over += energy.turned_over;
  s.energy.closure += energy.normal + energy.tangential;
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  append(found_.contactor_a, hit_.contactor_a);
  append(found_.contactor_b, hit_.contactor_b);
  append(found_.image, hit_.image);
  append(found_.feature, hit_.feature);
  append(found_.gap, hit_.gap);
  append(found_.normal, hit_.normal);
  append(found_.point, hit_.point);
  if (!plastic) s.report.events += std::int64_t(more);
  SolveReport& report = s.report.solve;
  if (solved.status != SolveStatus::converged) report.status = solved.status;
  if (!solved.hint.empty()) report.hint = solved.hint;
  report.iterations = std::max(report.iterations, solved.iterations);
  report.error = std::max(report.error, solved.error);
}

// Energy balance of the flight; the contacts shown are the impacts of the step.
void EventDriven::finish(Simulation& s) {
  Energy& e = s.energy;
  const double now = kinetic(s.scene.bodies);
  double driven = 0; // work that bodies with infinite inertia did on moving ones in impacts [J]
  Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const int dim = b.dim;
  for (std::size_t i = 0; i < status_.size(); ++i)
    for (const int side : {1, -1}) {
      const std::int32_t k = side > 0 ? found_.contactor_a[i] : found_.contactor_b[i], body = *c.body[k];
      const double *v = b.velocity[body], *m = b.inverse_mass[body], *p = &impulse_[dim * i],
                   *n = &found_.normal[dim * i];
      for (int d = 0; d < dim; ++d)
        if (!(m[d] > 0)) driven -= side * p[d] * v[d];
      const double radius =
          *c.radius[k]; // of a ball, which alone may be driven to turn: the impulse acts at -side radius n
      for (int d = 0; d < b.dofs() - dim; ++d) {
        const int one = dim == 2 ? 0 : (d + 1) % 3, two = dim == 2 ? 1 : (d + 2) % 3;
        if (!(m[dim + d] > 0)) driven += radius * (n[one] * p[two] - n[two] * p[one]) * v[dim + d];
      }
    }
  if (b.reaction.active)
    for (std::int64_t j = 0; j < b.count * b.dofs(); ++j)
      b.reaction.values[j] = b.inverse_mass.values[j] > 0 ? 0 : -b.reaction.values[j];
  e.kinetic = now;
  e.potential += potential_;
  e.work_external += external_;
  e.work_driven += driven;
  e.closure += now - begin_kinetic_ + potential_ - external_ - driven;
  e.turned_over += std::abs(potential_) + std::abs(external_) + std::abs(driven);
  e.largest_kinetic = std::max({e.largest_kinetic, now, begin_kinetic_});
  e.in_play = e.largest_kinetic + e.turned_over;
  found_.count = std::int64_t(status_.size());
  s.candidates = found_;
  s.contacts_known = true;
  s.report.contacts = s.report.solve.contacts = found_.count;
  s.report.time_detection = s.time + now_;
}

void EventDriven::read(Simulation& s, std::string_view field, int components, double* out) {
  if (persists_) return persistent_.read(s, field, components, out);
  const std::size_t n = std::size_t(components * s.candidates.count);
  std::fill_n(out, n, 0.0);
  const Array<double>* kept = field == "impulse"             ? &impulse_
                              : field == "impulse_local"     ? &local_
                              : field == "relative_velocity" ? &after_
                              : field == "dissipated"        ? &dissipated_
                                                             : nullptr;
  if (s.contacts_known && kept && kept->size() == n) std::copy(kept->begin(), kept->end(), out);
}

void EventDriven::status(Simulation& s, std::int32_t* out) {
  if (persists_) return persistent_.status(s, out);
  if (s.contacts_known && std::int64_t(status_.size()) == s.candidates.count)
    std::copy(status_.begin(), status_.end(), out);
}

std::vector<Option> EventDriven::options() {
  constexpr double most = std::numeric_limits<int>::max();
  return {
      {{"tol", "number", "()", "on the true error of the problem of an impact, which has no units", 0, 1},
       &settings_.tol},
      {{"max_iter", "whole", "[]", "iterations of an impact at most", 1, most}, &settings_.max_iter},
      {{"impacts", "whole", "[]", "of one pair in a step; beyond, the rest of the step is one of NSCD", 1, most},
       &settings_.impacts},
      {{"skin", "number", "()", "gap up to which pairs are listed [m]; not given: half of the largest radius", 0,
        std::numeric_limits<double>::infinity()},
       &settings_.skin,
       true},
      {{"renumber_every", "whole", "[]", "steps between renumberings of the bodies along a space-filling curve", 1,
        most},
       &settings_.renumber_every},
  };
}

std::unique_ptr<Strategy> EventDriven::fresh() const {
  auto made = std::make_unique<EventDriven>();
  made->settings_ = settings_;
  made->name = name;
  return made;
}

bool EventDriven::take_settings(Simulation&, const Strategy& other) {
  const auto* same = dynamic_cast<const EventDriven*>(&other);
  if (same) settings_ = same->settings_;
  return same != nullptr;
}

void EventDriven::check_scene(const Simulation& s) const {
  if (!s.meshes.empty()) throw Error("EventDriven moves rigid bodies alone: keep NSCD for deformable ones");
  if (!s.forces.empty() || s.free_velocity)
    throw Error("EventDriven calls no plugged routines of bodies, and this simulation has some: keep NSCD");
  for (const double rate : s.scene.cell.velocity_gradient)
    if (rate < 0 || rate > 0) throw Error("EventDriven needs a cell that does not move: keep NSCD for shear");
}

void EventDriven::check_laws(const Simulation& s) const {
  for (int e = 0; e < s.laws.entries(); ++e)
    if (const LawInfo& law = law_infos()[std::size_t(s.laws.entry(e).law)]; !serves(law))
      throw Error(law.joins
                      ? "EventDriven knows no joints: keep NSCD, or leave them out"
                      : "law " + law.python_name +
                            (law.prepare && law.reach >= 0
                                 ? " acts across a gap, and EventDriven flies bodies freely; keep NSCD"
                                 : " is no law of impacts, which EventDriven needs; give Restitution or Coulomb"));
}

// Gaps of round bodies do not depend on how these turn.
void EventDriven::check_bodies(const Simulation& s) const {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const auto refuse = [&](std::int64_t i, const std::string& what) {
    throw Error("body " + std::to_string(*b.id[i]) + " " + what);
  };
  for (std::int64_t k = 0; k < c.count; ++k) {
    const ShapeInfo& shape = info(Shape(*c.shape[k]));
    const std::int32_t i = *c.body[k];
    double off = 0, spin = 0;
    for (int d = 0; d < b.dim && c.offset.active; ++d) off = std::max(off, std::abs(c.offset[k][d]));
    for (int d = b.dim; d < b.dofs(); ++d) {
      spin = std::max(spin, std::abs(b.velocity[i][d]));
      if (b.driven.active && (*b.driven[i] >> d & 1)) spin = std::max(spin, std::abs(b.driven_velocity[i][d]));
    }
    const bool turns = spin > 0 || (std::isfinite(b.inertia[i][0]) && !(b.driven.active && *b.driven[i]));
    if (shape.hollow() || shape.is_hull())
      refuse(i,
             std::string("is a ") + shape.name + ": EventDriven sees disks, spheres, planes and segments; keep NSCD");
    if (turns && (!shape.ball() || off > 0))
      refuse(i, "may turn about another point than the centre of its disk or sphere: EventDriven needs round bodies");
  }
  for (std::int64_t i = 0; i < b.count; ++i) {
    for (int k = 0; b.surface_velocity.active && k < b.dofs(); ++k)
      if (b.surface_velocity[i][k] < 0 || b.surface_velocity[i][k] > 0)
        refuse(i, "has a surface velocity, which EventDriven does not know; keep NSCD");
    if (b.damping.active && *b.damping[i] > 0) refuse(i, "is damped: EventDriven flies bodies on parabolas; keep NSCD");
    if (b.dim == 3 && std::isfinite(*b.mass[i]) &&
        (b.inertia[i][0] < b.inertia[i][1] || b.inertia[i][1] < b.inertia[i][0] || b.inertia[i][1] < b.inertia[i][2] ||
         b.inertia[i][2] < b.inertia[i][1]))
      refuse(i, "has moments of inertia that differ, which EventDriven does not turn; keep NSCD");
  }
}

} // namespace events

std::unique_ptr<Strategy> make_event_driven() { return std::make_unique<events::EventDriven>(); }

} // namespace cairn
