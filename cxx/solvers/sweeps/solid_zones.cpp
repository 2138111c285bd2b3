// Newton's method over bodies that cohesive zones join. Zones are elements with the stiffness of their springs. Factors
// of all bodies carry the load of one through the others at once; sweeps carry it from one body to the next. A step
// begins with the damage of the last one and the contacts that pressed in it. Each pass solves with the tangent
// stiffness, that of softening zones included as long as the factors exist, and goes as far as the energy of bodies and
// zones falls. Contacts beside zones have multipliers (augmented Lagrangian; Alart & Curnier 1991).
#include <algorithm>
#include <cmath>
#include <span>

#include "../../laws/zone_laws.hpp"
#include "batch.hpp"
#include "contact_rows.hpp"
#include "solid_zones.hpp"

namespace cairn {

namespace {

// Penalty of contacts beside the springs [kg]. Multipliers converge the faster the larger it is, but each contact that
// closes or opens along a step cuts it short, as many do on meshes, and on rigid bricks whose zones soften. Sheared
// walls of rigid bricks: 60 of 60 steps converge with the larger penalty, 12 with one of 2^9. Of meshes one of 2^15
// fails in 2 of 8 steps.
double penalty(const cairn_batch& b, int lane) {
  constexpr double rigid = 0x1p20, yielding = 0x1p12; // over the mass of the contact's own bodies
  return (b.mapped_a || b.mapped_b ? yielding : rigid) * b.rho[lane];
}

// Impulses of all contacts, batch by batch.
void read_impulses(const ContactSystem& system, std::vector<double>& out) {
  out.clear();
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int k = 0; k < b.components; ++k) out.push_back(at(b, b.r, lane, k));
}

void write_impulses(ContactSystem& system, const std::vector<double>& impulses) {
  auto from = impulses.begin();
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int k = 0; k < b.components; ++k) at(b, b.r, lane, k) = *from++;
}

bool is_zone(const cairn_batch& b) { return zone_of(b.law) != nullptr; }

} // namespace

SolidZones::Kinds SolidZones::kinds(const ContactSystem& system) {
  Kinds found;
  for (const cairn_batch& b : system.batches) {
    const bool zone = is_zone(b);
    found.zones |= zone;
    found.others |= (!zone && !b.relaxes) || b.compliance || b.rope;
  }
  return found;
}

void SolidZones::keep_start(ContactSystem& system) { read_impulses(system, SolidMemory::of(system).start); }

// Springs and friction of a batch at these velocities, with their changes if `slopes`; at the begin with the damage at
// hand.
void SolidZones::read(const cairn_batch& b, const double* u, bool slopes) {
  const int n = b.count, c = b.components;
  if (is_zone(b)) {
    zone_of(b.law)(n, c, u, b.params, b.state, spring_, pull_, slopes ? fall_ : nullptr, mu_, slopes ? rise_ : nullptr,
                   beta_);
    return;
  }
  for (double* column : {spring_, pull_, fall_, rise_}) std::fill_n(column, c * n, 0.0);
  for (int lane = 0; lane < b.contacts; ++lane) mu_[lane] = at(b, b.params, lane, 0);
}

void SolidZones::begin() {
  meshes_ = !solid_.system.condensed.empty();
  place_.assign(1, 0);
  for (const cairn_batch& b : solid_.system.batches)
    place_.push_back(place_.back() + std::size_t(b.count * b.components));
  for (std::vector<double>* columns :
       {&velocity_, &moving_, &bears_, &change_, &multiplier_, &presses_, &pressed_, &shift_, &last_change_})
    columns->assign(place_.back(), 0.0);
  stiffness_.resize(solid_.answer.size());
  moves_.clear();
  for (const SolidSystem::Contact& contact : solid_.contacts()) moves_.push_back(solid_.moves(contact));
  for (std::vector<double>* columns : {&u_, &target_, &none_})
    columns->assign(std::size_t(SolidSystem::most_components) * 128, 0.0);
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    const int n = b.count;
    read(b, none_.data(), false);
    double* multiplier = &multiplier_[place_[k]];
    for (int lane = 0; lane < b.contacts; ++lane) {
      multiplier[lane] = std::max(0.0, at(b, b.r, lane, 0));
      for (int c = 1; c < b.components; ++c)
        multiplier[c * n + lane] = multiplier[lane] > 0 ? at(b, b.r, lane, c) + pull_[c * n + lane] : 0;
    }
  }
  last_multiplier_ = multiplier_;
  renewals_ = 0;
}

void SolidZones::find_velocities() {
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    double* u = &velocity_[place_[k]];
    cairn_relative_velocities(&solid_.schedule, std::int32_t(k), 0, u);
    for (int c = 0; c < (b.pack ? 1 : b.components); ++c)
      for (int lane = 0; lane < b.contacts; ++lane) u[c * b.count + lane] += at(b, b.bias, lane, c);
    repeat_last(b, u, b.components);
  }
}

// Adds the impulse of a contact beside its zone to `bears` [N s], and its stiffness (c, c) [kg] to `answer` unless
// null.
void SolidZones::bear_contact(const double* u, const double* multiplier, int n, int c, double rho, double shift,
                              double mu, Stiffness by, double* bears, double* answer) const {
  const double normal = multiplier[0] - rho * (u[0] - shift);
  const bool begins = by == Stiffness::start;
  // The limit of friction follows the pressure of the pass at hand on meshes, whose nodes pass loads on to each other.
  const double limit = mu * (meshes_ && !begins ? normal : multiplier[0]);
  const bool presses = begins ? multiplier[0] > 0 : normal > 0;
  if (!presses) return;
  bears[0] += normal;
  if (answer) answer[0] += rho;
  double z[6] = {}, square = 0;
  for (int k = 1; k < c; ++k) {
    z[k] = begins ? multiplier[k * n] : multiplier[k * n] - rho * u[k * n];
    square += z[k] * z[k];
  }
  const double size = std::sqrt(square);
  constexpr double edge = 1 - 0x1p-10;
  if (begins ? size < edge * limit : size <= limit) {
    for (int k = 1; k < c; ++k) {
      bears[k * n] += multiplier[k * n] - rho * u[k * n];
      if (answer) answer[(c + 1) * k] += rho;
    }
    return;
  }
  if (!(limit > 0)) return;
  for (int k = 1; k < c; ++k) {
    bears[k * n] += z[k] * (limit / size);
    for (int l = 1; l < c && answer; ++l)
      answer[c * l + k] += rho * (limit / size) * ((k == l ? 1 : 0) - (z[k] / size) * (z[l] / size));
  }
}

// Impulses of the springs of a batch at these velocities [N s], and their stiffness in `answer` unless null: the
// tangent, or that of the springs as they are.
void SolidZones::bear_springs(std::size_t k, const double* u, Stiffness by, double* bears, double* answer) {
  const cairn_batch& b = solid_.system.batches[k];
  const int n = b.count, c = b.components;
  const bool begins = by == Stiffness::start;
  if (begins) std::fill_n(still_, c * n, 0.0);
  read(b, begins ? still_ : u, answer != nullptr);
  for (int lane = 0; lane < b.contacts; ++lane) {
    for (int i = 0; i < c; ++i) bears[i * n + lane] = -(spring_[i * n + lane] * u[i * n + lane] + pull_[i * n + lane]);
    if (!answer) continue;
    double* own = answer + std::size_t(c) * std::size_t(c * lane);
    std::fill_n(own, c * c, 0.0);
    for (int l = 0; l < c; ++l) {
      own[(c + 1) * l] += spring_[l * n + lane];
      for (int i = 0; i < c && by == Stiffness::tangent; ++i) {
        const double slope = -0.5 * (bears[i * n + lane] * fall_[l * n + lane]);
        own[c * l + i] += slope;
        own[c * i + l] += slope;
      }
    }
  }
}

// Answers and impulses of all contacts at the velocities at hand.
void SolidZones::linearise(Stiffness by) {
  std::size_t contact = 0;
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    if (b.contacts == 0) continue;
    const int n = b.count, c = b.components;
    const std::size_t begin = place_[k];
    const double *u = &velocity_[begin], *multiplier = &multiplier_[begin];
    double *bears = &bears_[begin], *presses = &presses_[begin];
    bear_springs(k, u, by, bears, &solid_.answer[solid_.contacts()[contact].answer]);
    for (int lane = 0; lane < b.contacts; ++lane, ++contact) {
      double *answer = &solid_.answer[solid_.contacts()[contact].answer],
             *known = &solid_.known[solid_.contacts()[contact].known];
      for (int i = 0; i < c; ++i) presses[i * n + lane] = 0;
      std::fill_n(stays_, 36, 0.0);
      if (!(at(b, b.bias, lane, 0) < never())) {
        std::fill_n(answer, c * c, 0.0);
        for (int i = 0; i < c; ++i) known[i] = -at(b, b.r, lane, i), bears[i * n + lane] = 0;
      } else {
        bear_contact(u + lane, multiplier + lane, n, c, softer_ * penalty(b, lane), shift_[begin + std::size_t(lane)],
                     mu_[lane], by, presses + lane, stays_);
        // friction that grows as the zone is damaged
        const double size = mu_[lane] * multiplier[lane];
        for (int i = 1; i < c && size > 0 && !(stays_[c + 1] >= softer_ * penalty(b, lane)); ++i)
          for (int l = 0; l < c; ++l) {
            const double slope = -0.5 * presses[i * n + lane] / mu_[lane] * rise_[l * n + lane];
            stays_[c * l + i] += slope;
            stays_[c * i + l] += slope;
          }
        for (int i = 0; i < c; ++i) known[i] = bears[i * n + lane] + presses[i * n + lane] - at(b, b.r, lane, i);
      }
      std::copy_n(stays_, c * c, &stiffness_[solid_.contacts()[contact].answer]);
      for (int i = 0; i < c * c; ++i) answer[i] += stays_[i];
    }
  }
}

// How the impulses change by the step at hand, and the velocities of contacts.
void SolidZones::follow_step() {
  for (const SolidSystem::Contact& contact : solid_.contacts()) {
    const std::size_t c = std::size_t(contact.components), n = std::size_t(solid_.system.batches[contact.batch].count);
    const std::size_t begin = place_[std::size_t(contact.batch)] + std::size_t(contact.lane);
    double du[SolidSystem::most_components];
    solid_.relative_velocity(contact, du);
    for (std::size_t k = 0; k < c; ++k) {
      double change = solid_.known[contact.known + k], pressed = 0;
      for (std::size_t l = 0; l < c; ++l) {
        change -= solid_.answer[contact.answer + c * l + k] * du[l];
        pressed -= stiffness_[contact.answer + c * l + k] * du[l];
      }
      moving_[begin + k * n] = du[k];
      change_[begin + k * n] = change;
      pressed_[begin + k * n] = pressed;
    }
  }
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k)
    repeat_last(solid_.system.batches[k], &moving_[place_[k]], solid_.system.batches[k].components);
}

// Slope of the energy at a share of the step at hand, with contacts that stay pressed, open or sliding.
double SolidZones::slope(double step) {
  double sum = 0;
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    const std::size_t begin = place_[k], n = std::size_t(b.count);
    for (std::size_t i = 0; i < n * std::size_t(b.components); ++i)
      u_[i] = velocity_[begin + i] + step * moving_[begin + i];
    bear_springs(k, u_.data(), Stiffness::secant, target_.data(), nullptr);
    for (int lane = 0; lane < b.contacts; ++lane) {
      if (!(at(b, b.bias, lane, 0) < never())) continue;
      bear_contact(u_.data() + lane, &multiplier_[begin] + lane, b.count, b.components, softer_ * penalty(b, lane),
                   shift_[begin + std::size_t(lane)], mu_[lane], Stiffness::secant, target_.data() + lane, nullptr);
      for (std::size_t c = 0; c < std::size_t(b.components); ++c) {
        const std::size_t i = c * n + std::size_t(lane);
        sum += moving_[begin + i] * (step * change_[begin + i] + at(b, b.r, lane, int(c)) - target_[i]);
      }
    }
  }
  return sum;
}

// The same at its begin, from the impulses that it was found from.
double SolidZones::slope_at_begin() const {
  double sum = 0;
  for (const SolidSystem::Contact& contact : solid_.contacts()) {
    const cairn_batch& b = solid_.system.batches[std::size_t(contact.batch)];
    if (!(at(b, b.bias, contact.lane, 0) < never())) continue;
    const std::size_t n = std::size_t(b.count), c = std::size_t(contact.components);
    const double* moving = &moving_[place_[std::size_t(contact.batch)] + std::size_t(contact.lane)];
    for (std::size_t k = 0; k < c; ++k) sum -= moving[k * n] * solid_.known[contact.known + k];
  }
  return sum;
}

double SolidZones::step_length(double begin) {
  constexpr int most = 16;
  constexpr double level = 0.25;
  const double least = level * std::abs(begin);
  double low = 0, high = 1, at_low = begin, at_high = slope(1);
  if (!(at_high > least)) return 1;
  double step = 1;
  for (int look = 0; look < most; ++look) {
    step = look % 3 == 2 ? 0.5 * (low + high) : low - at_low * (high - low) / (at_high - at_low);
    const double now = slope(step);
    if (std::abs(now) <= least) break;
    (now > 0 ? high : low) = step;
    (now > 0 ? at_high : at_low) = now;
  }
  return step;
}

void SolidZones::move(double step) {
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    const std::size_t n = std::size_t(b.count);
    for (int lane = 0; lane < b.contacts; ++lane)
      for (std::size_t i = 0; i < std::size_t(b.components); ++i)
        at(b, b.r, lane, int(i)) += step * change_[place_[k] + i * n + std::size_t(lane)];
  }
}

// Multipliers from the step at hand, as its contacts stay pressed, open or sliding.
void SolidZones::multiply() {
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    const std::size_t n = std::size_t(b.count);
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::size_t first = place_[k] + std::size_t(lane);
      const bool presses = presses_[first] + pressed_[first] > 0;
      for (std::size_t i = first; i < first + n * std::size_t(b.components); i += n)
        multiplier_[i] = presses ? presses_[i] + pressed_[i] : 0;
      const double slack = slack_ / std::sqrt(b.rho[lane]);
      shift_[first] = presses ? std::clamp(velocity_[first] + moving_[first], -slack, slack) : 0;
    }
  }
}

// Multipliers of contacts that stay as they are converge linearly, slowly where bricks jam: friction follows the
// pressure of the pass before. Aitken's extrapolation along their last change, where the two last agree in direction.
void SolidZones::extrapolate_multipliers() {
  constexpr int first = 12, again = 4;
  constexpr double aligned = 0.875, slow = 0.5, farthest = 32;
  double both = 0, now = 0, before = 0;
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    for (int i = 0; i < b.components; ++i)
      for (int lane = 0; lane < b.contacts; ++lane) {
        const std::size_t place = place_[k] + std::size_t(i * b.count + lane);
        const double change = multiplier_[place] - last_multiplier_[place];
        both += change * last_change_[place] / b.rho[lane];
        now += change * change / b.rho[lane];
        before += last_change_[place] * last_change_[place] / b.rho[lane];
        last_change_[place] = change;
      }
  }
  ++renewals_;
  if (renewals_ >= first && renewals_ % again == 0 && both > aligned * std::sqrt(now * before) && both < before &&
      both > slow * before) {
    const double share = std::min(farthest, both / (before - both));
    for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
      const cairn_batch& b = solid_.system.batches[k];
      const std::size_t n = std::size_t(b.count);
      for (int lane = 0; lane < b.contacts; ++lane) {
        const std::size_t at = place_[k] + std::size_t(lane);
        if (!(multiplier_[at] + share * last_change_[at] > 0)) continue; // would open
        for (std::size_t i = at; i < at + n * std::size_t(b.components); i += n)
          multiplier_[i] += share * last_change_[i];
      }
    }
  }
  last_multiplier_ = multiplier_;
}

// Multipliers from the impulses at hand less those of springs: where a step is cut short at contacts that close, open,
// stick and slide in turns.
void SolidZones::renew_multipliers() {
  find_velocities();
  for (std::size_t k = 0; k < solid_.system.batches.size(); ++k) {
    const cairn_batch& b = solid_.system.batches[k];
    const std::size_t n = std::size_t(b.count), begin = place_[k];
    bear_springs(k, &velocity_[begin], Stiffness::secant, &bears_[begin], nullptr);
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::size_t first = begin + std::size_t(lane);
      const bool presses = at(b, b.r, lane, 0) - bears_[first] > 0;
      for (int i = 0; i < b.components; ++i) {
        const std::size_t place = first + std::size_t(i) * n;
        multiplier_[place] = presses ? at(b, b.r, lane, i) - bears_[place] : 0;
      }
      const double slack = slack_ / std::sqrt(b.rho[lane]);
      shift_[first] = presses ? std::clamp(velocity_[first], -slack, slack) : 0;
    }
  }
}

// Impulses from before the sweeps of this step.
void SolidZones::go_to_start() {
  write_impulses(solid_.system, SolidMemory::of(solid_.system).start);
  solid_.refresh();
  begin();
  slack_ = 0;
}

namespace {

// Solution methods of a step, tried one after the other from its start. Each may stall at contacts that close and open
// in turns while zones soften. With a single one, rounding would decide whether a step converges. Of 840 steps of
// sheared walls of rigid bricks past their peaks 159 fail with the first alone, 7 with all. A panel of meshes takes
// 29.1 passes a step with half of the penalty, 30.7 with the whole, which one step in 25 of 2 ms needs.
struct Attempt {
  bool inside;   // begins with interior points
  double softer; // factor of the penalty
};
constexpr Attempt attempts_of_rigid_bodies[] = {{false, 1}, {false, 0x1p-6}, {true, 1}, {true, 0x1p-6}};
constexpr Attempt attempts_of_meshes[] = {{true, 0.5}, {true, 1}, {false, 1}};

std::span<const Attempt> attempts(bool meshes) {
  if (meshes) return attempts_of_meshes;
  return attempts_of_rigid_bodies;
}

} // namespace

int SolidZones::solve(double error_square, double wanted_square, const std::function<double()>& measure) {
  solid_.keep_impulses();
  std::vector<double> first; // impulses that the first method ended with
  bool reached = false;
  int passes = 0;
  for (const Attempt& attempt : attempts(!solid_.system.condensed.empty())) {
    const int before = passes;
    softer_ = attempt.softer;
    go_to_start();
    if (attempt.inside) passes += go_inside(error_square, wanted_square, measure, reached);
    if (!reached) passes += go_by_multipliers(passes > before, error_square, wanted_square, measure, reached);
    if (reached) return passes;
    if (first.empty()) { // sweeps go on from its end: another may have a smaller error, and longer sweeps
      solid_.restore_impulses();
      read_impulses(solid_.system, first);
    }
  }
  write_impulses(solid_.system, first);
  solid_.refresh();
  measure();
  return passes;
}

int SolidZones::go_by_multipliers(bool follows, double& error_square, double wanted_square,
                                  const std::function<double()>& measure, bool& reached) {
  constexpr int most = 60, most_short = 12;
  constexpr double little = 0x1p-8, share = 0x1p-6, short_of = 0x1p-7;
  int pass = 0, cut = 0;
  double last = 0; // square of the error after the last pass
  while (pass < most && cut < most_short) {
    const bool begins = pass == 0 && !follows;
    find_velocities();
    linearise(begins ? Stiffness::start : Stiffness::tangent);
    std::fill(solid_.velocity.begin(), solid_.velocity.end(), 0.0);
    if (!solid_.factor()) { // the solid gives way by what softens
      linearise(begins ? Stiffness::start : Stiffness::secant);
      std::fill(solid_.velocity.begin(), solid_.velocity.end(), 0.0);
      if (!solid_.factor()) break;
    }
    ++pass;
    follow_step();
    const double rise = begins ? 0 : slope_at_begin(), speed = solid_.system.speed();
    const bool settled = begins || !(-rise > little * std::max(wanted_square, last) * speed * speed);
    const double step = settled ? 1 : step_length(rise);
    if (settled) {
      multiply();
      extrapolate_multipliers();
    }
    move(step);
    solid_.refresh();
    const double now = measure();
    if (!std::isfinite(now)) break;
    cut = step < short_of ? cut + 1 : 0;
    if (cut) renew_multipliers();
    last = now;
    const double slack = share * std::sqrt(wanted_square / double(solid_.contacts().size())) * solid_.system.speed();
    slack_ = begins ? slack : std::min(slack_, slack);
    if (now < error_square) {
      error_square = now;
      solid_.keep_impulses();
    }
    if ((reached = now <= wanted_square)) break;
  }
  return pass;
}

} // namespace cairn
