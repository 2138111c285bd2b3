// Newton's method over bodies that cohesive zones join. Zones are elements with the stiffness of their springs. Factors
// of all bodies carry the load of one through the others at once; sweeps carry it from one body to the next. A step
// begins with the damage of the last one and the contacts that pressed in it. Each pass solves with the tangent
// stiffness, that of softening zones included as long as the factors exist, and goes as far as the energy of bodies and
// zones falls. Contacts beside zones have multipliers (augmented Lagrangian; Alart & Curnier 1991).
#include <algorithm>
#include <cmath>

#include "../../laws/zone_laws.hpp"
#include "batch.hpp"
#include "contact_rows.hpp"
#include "solid_correction.hpp"

namespace cairn {

namespace {

// Penalty of contacts beside the springs [kg]. Multipliers converge the faster the larger it is, but each contact that
// closes or opens along a step cuts it short, as many do on meshes. Sheared walls of meshes: 11 of 14 steps converge
// with the smaller penalty, 3 with the larger; of rigid bricks: 12 and 60 of 60.
double penalty(const cairn_batch& b, int lane) {
  constexpr double rigid = 0x1p20, yielding = 0x1p9; // over the mass of the contact's own bodies
  return (b.mapped_a || b.mapped_b ? yielding : rigid) * b.rho[lane];
}

bool is_zone(const cairn_batch& b) { return zone_of(b.law) != nullptr; }

} // namespace

bool SolidCorrection::zones_alone(const ContactSystem& system) {
  bool any = false;
  for (const cairn_batch& b : system.batches) {
    const bool zone = is_zone(b);
    any |= zone;
    if ((!zone && !b.relaxes) || b.compliance || b.rope) return false;
  }
  return any;
}

void SolidCorrection::keep_start(ContactSystem& system) {
  std::vector<double>& start = SolidMemory::of(system).start;
  start.clear();
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int k = 0; k < b.components; ++k) start.push_back(at(b, b.r, lane, k));
}

// Springs and friction of a batch at these velocities; at the begin with the damage at hand.
void SolidCorrection::read_zones(const cairn_batch& b, const double* u) {
  Zones& z = zones_;
  const int n = b.count, c = b.components;
  if (is_zone(b)) {
    zone_of(b.law)(n, c, u, b.params, b.state, z.spring, z.pull, z.fall, z.mu, z.rise, z.beta);
    return;
  }
  for (double* column : {z.spring, z.pull, z.fall, z.rise}) std::fill_n(column, c * n, 0.0);
  for (int lane = 0; lane < b.contacts; ++lane) z.mu[lane] = at(b, b.params, lane, 0);
}

void SolidCorrection::begin_zones() {
  Zones& z = zones_;
  z.place.assign(1, 0);
  for (const cairn_batch& b : system_.batches) z.place.push_back(z.place.back() + std::size_t(b.count * b.components));
  for (std::vector<double>* columns :
       {&z.velocity, &z.moving, &z.bears, &z.change, &z.multiplier, &z.presses, &z.pressed, &z.shift})
    columns->assign(z.place.back(), 0.0);
  z.stiffness.resize(answer_.size());
  size_columns();
  std::vector<double>& none = begun_;
  std::fill(none.begin(), none.end(), 0.0);
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const int n = b.count;
    read_zones(b, none.data());
    double* multiplier = &z.multiplier[z.place[k]];
    for (int lane = 0; lane < b.contacts; ++lane) {
      multiplier[lane] = std::max(0.0, at(b, b.r, lane, 0));
      for (int c = 1; c < b.components; ++c)
        multiplier[c * n + lane] = multiplier[lane] > 0 ? at(b, b.r, lane, c) + z.pull[c * n + lane] : 0;
    }
  }
}

void SolidCorrection::velocities_of_zones() {
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    double* u = &zones_.velocity[zones_.place[k]];
    cairn_relative_velocities(&schedule_, std::int32_t(k), 0, u);
    for (int c = 0; c < (b.pack ? 1 : b.components); ++c)
      for (int lane = 0; lane < b.contacts; ++lane) u[c * b.count + lane] += at(b, b.bias, lane, c);
    repeat_last(b, u, b.components);
  }
}

// Adds the impulse of a contact beside its zone to `bears` [N s], and its stiffness (c, c) [kg] to `answer` unless
// null.
void SolidCorrection::bear_contact(const double* u, const double* multiplier, int n, int c, double rho, double shift,
                                   double mu, bool begins, double* bears, double* answer) const {
  const double normal = multiplier[0] - rho * (u[0] - shift), limit = mu * multiplier[0];
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
// tangent if `softens`, else that of the springs as they are.
void SolidCorrection::bear_springs(std::size_t k, const double* u, bool begins, bool softens, double* bears,
                                   double* answer) {
  const cairn_batch& b = system_.batches[k];
  const int n = b.count, c = b.components;
  Zones& z = zones_;
  if (begins) std::fill_n(z.still, c * n, 0.0);
  read_zones(b, begins ? z.still : u);
  for (int lane = 0; lane < b.contacts; ++lane) {
    for (int i = 0; i < c; ++i)
      bears[i * n + lane] = -(z.spring[i * n + lane] * u[i * n + lane] + z.pull[i * n + lane]);
    if (!answer) continue;
    double* own = answer + std::size_t(c) * std::size_t(c * lane);
    std::fill_n(own, c * c, 0.0);
    for (int l = 0; l < c; ++l) {
      own[(c + 1) * l] += z.spring[l * n + lane];
      for (int i = 0; i < c && softens; ++i) {
        const double slope = -0.5 * (bears[i * n + lane] * z.fall[l * n + lane]);
        own[c * l + i] += slope;
        own[c * i + l] += slope;
      }
    }
  }
}

// Answers and impulses of all contacts at the velocities at hand.
void SolidCorrection::linearise_zones(bool begins, bool softens) {
  Zones& z = zones_;
  std::size_t contact = 0;
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    if (b.contacts == 0) continue;
    const int n = b.count, c = b.components;
    const std::size_t begin = z.place[k];
    const double *u = &z.velocity[begin], *multiplier = &z.multiplier[begin];
    double *bears = &z.bears[begin], *presses = &z.presses[begin];
    bear_springs(k, u, begins, softens, bears, &answer_[contacts_[contact].answer]);
    for (int lane = 0; lane < b.contacts; ++lane, ++contact) {
      double *answer = &answer_[contacts_[contact].answer], *known = &known_[contacts_[contact].known];
      for (int i = 0; i < c; ++i) presses[i * n + lane] = 0;
      std::fill_n(z.stays, 36, 0.0);
      if (!(at(b, b.bias, lane, 0) < never())) {
        std::fill_n(answer, c * c, 0.0);
        for (int i = 0; i < c; ++i) known[i] = -at(b, b.r, lane, i), bears[i * n + lane] = 0;
      } else {
        bear_contact(u + lane, multiplier + lane, n, c, penalty(b, lane), z.shift[begin + std::size_t(lane)],
                     z.mu[lane], begins, presses + lane, z.stays);
        // friction that grows as the zone is damaged
        const double size = z.mu[lane] * multiplier[lane];
        for (int i = 1; i < c && size > 0 && !(z.stays[c + 1] >= penalty(b, lane)); ++i)
          for (int l = 0; l < c; ++l) {
            const double slope = -0.5 * presses[i * n + lane] / z.mu[lane] * z.rise[l * n + lane];
            z.stays[c * l + i] += slope;
            z.stays[c * i + l] += slope;
          }
        for (int i = 0; i < c; ++i) known[i] = bears[i * n + lane] + presses[i * n + lane] - at(b, b.r, lane, i);
      }
      std::copy_n(z.stays, c * c, &z.stiffness[contacts_[contact].answer]);
      for (int i = 0; i < c * c; ++i) answer[i] += z.stays[i];
    }
  }
}

// How the impulses change by the step at hand, and the velocities of contacts.
void SolidCorrection::follow_zones() {
  Zones& z = zones_;
  std::int64_t clique = clique_start_[clique_start_.size() - 1 - contacts_.size()];
  for (const Contact& contact : contacts_) {
    const std::size_t c = std::size_t(contact.components), n = std::size_t(system_.batches[contact.batch].count);
    const std::size_t begin = z.place[std::size_t(contact.batch)] + std::size_t(contact.lane);
    double du[6] = {};
    for (std::size_t j = 0; j < std::size_t(contact.unknowns); ++j)
      for (std::size_t k = 0; k < c; ++k)
        du[k] += rows_[contact.rows + c * j + k] * velocity_[std::size_t(clique_[std::size_t(clique) + j])];
    clique += contact.unknowns;
    for (std::size_t k = 0; k < c; ++k) {
      double change = known_[contact.known + k], pressed = 0;
      for (std::size_t l = 0; l < c; ++l) {
        change -= answer_[contact.answer + c * l + k] * du[l];
        pressed -= z.stiffness[contact.answer + c * l + k] * du[l];
      }
      z.moving[begin + k * n] = du[k];
      z.change[begin + k * n] = change;
      z.pressed[begin + k * n] = pressed;
    }
  }
  for (std::size_t k = 0; k < system_.batches.size(); ++k)
    repeat_last(system_.batches[k], &z.moving[z.place[k]], system_.batches[k].components);
}

// Slope of the energy at a share of the step at hand, with contacts that stay pressed, open or sliding.
double SolidCorrection::slope_of_zones(double step) {
  Zones& z = zones_;
  double sum = 0;
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const std::size_t begin = z.place[k], n = std::size_t(b.count);
    for (std::size_t i = 0; i < n * std::size_t(b.components); ++i)
      u_[i] = z.velocity[begin + i] + step * z.moving[begin + i];
    bear_springs(k, u_.data(), false, false, target_.data(), nullptr);
    for (int lane = 0; lane < b.contacts; ++lane) {
      if (!(at(b, b.bias, lane, 0) < never())) continue;
      bear_contact(u_.data() + lane, &z.multiplier[begin] + lane, b.count, b.components, penalty(b, lane),
                   z.shift[begin + std::size_t(lane)], z.mu[lane], false, target_.data() + lane, nullptr);
      for (std::size_t c = 0; c < std::size_t(b.components); ++c) {
        const std::size_t i = c * n + std::size_t(lane);
        sum += z.moving[begin + i] * (step * z.change[begin + i] + at(b, b.r, lane, int(c)) - target_[i]);
      }
    }
  }
  return sum;
}

double SolidCorrection::length_of_zones(double begin) {
  constexpr int most = 16;
  constexpr double level = 0.25;
  const double least = level * std::abs(begin);
  double low = 0, high = 1, at_low = begin, at_high = slope_of_zones(1);
  if (!(at_high > least)) return 1;
  double step = 1;
  for (int look = 0; look < most; ++look) {
    step = look % 3 == 2 ? 0.5 * (low + high) : low - at_low * (high - low) / (at_high - at_low);
    const double now = slope_of_zones(step);
    if (std::abs(now) <= least) break;
    (now > 0 ? high : low) = step;
    (now > 0 ? at_high : at_low) = now;
  }
  return step;
}

void SolidCorrection::move_zones(double step) {
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const std::size_t n = std::size_t(b.count);
    for (int lane = 0; lane < b.contacts; ++lane)
      for (std::size_t i = 0; i < std::size_t(b.components); ++i)
        at(b, b.r, lane, int(i)) += step * zones_.change[zones_.place[k] + i * n + std::size_t(lane)];
  }
}

// Multipliers from the step at hand, as its contacts stay pressed, open or sliding.
void SolidCorrection::multiply_zones() {
  Zones& z = zones_;
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const std::size_t n = std::size_t(b.count);
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::size_t first = z.place[k] + std::size_t(lane);
      const bool presses = z.presses[first] + z.pressed[first] > 0;
      for (std::size_t i = first; i < first + n * std::size_t(b.components); i += n)
        z.multiplier[i] = presses ? z.presses[i] + z.pressed[i] : 0;
      const double slack = z.slack / std::sqrt(b.rho[lane]);
      z.shift[first] = presses ? std::clamp(z.velocity[first] + z.moving[first], -slack, slack) : 0;
    }
  }
}

// Multipliers from the impulses at hand less those of springs: where a step is cut short at contacts that close, open,
// stick and slide in turns.
void SolidCorrection::renew_multipliers() {
  Zones& z = zones_;
  velocities_of_zones();
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const std::size_t n = std::size_t(b.count), begin = z.place[k];
    bear_springs(k, &z.velocity[begin], false, false, &z.bears[begin], nullptr);
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::size_t first = begin + std::size_t(lane);
      const bool presses = at(b, b.r, lane, 0) - z.bears[first] > 0;
      for (int i = 0; i < b.components; ++i) {
        const std::size_t place = first + std::size_t(i) * n;
        z.multiplier[place] = presses ? at(b, b.r, lane, i) - z.bears[place] : 0;
      }
      const double slack = z.slack / std::sqrt(b.rho[lane]);
      z.shift[first] = presses ? std::clamp(z.velocity[first], -slack, slack) : 0;
    }
  }
}

int SolidCorrection::solve_zones(double error_square, double wanted_square, const std::function<double()>& measure) {
  constexpr int most = 60;
  constexpr double little = 0x1p-8, share = 0x1p-6, short_of = 0x1p-7;
  kept_.resize(known_.size());
  copy_impulses(false);
  const double* from = memory_.start.data();
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int k = 0; k < b.components; ++k) at(b, b.r, lane, k) = *from++;
  refresh();
  begin_zones();
  zones_.slack = 0;
  int pass = 0;
  double last = 0; // square of the error after the last pass
  while (pass < most) {
    const bool begins = pass == 0;
    velocities_of_zones();
    linearise_zones(begins, !begins);
    std::fill(velocity_.begin(), velocity_.end(), 0.0);
    if (!factor()) { // the solid gives way by what softens
      linearise_zones(begins, false);
      std::fill(velocity_.begin(), velocity_.end(), 0.0);
      if (!factor()) break;
    }
    ++pass;
    follow_zones();
    const double slope = begins ? 0 : slope_of_zones(0), speed = system_.speed();
    const bool settled = begins || !(-slope > little * std::max(wanted_square, last) * speed * speed);
    const double step = settled ? 1 : length_of_zones(slope);
    if (settled) multiply_zones();
    move_zones(step);
    refresh();
    const double now = measure();
    if (!std::isfinite(now)) break;
    if (step < short_of) renew_multipliers();
    last = now;
    const double slack = share * std::sqrt(wanted_square / double(contacts_.size())) * system_.speed();
    zones_.slack = begins ? slack : std::min(zones_.slack, slack);
    if (now < error_square) {
      error_square = now;
      copy_impulses(false);
    }
    if (now <= wanted_square) return pass;
  }
  copy_impulses(true);
  refresh();
  measure();
  return pass;
}

} // namespace cairn
