#include "light_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../../laws/law_info.hpp"
#include "../solve_report.hpp"
#include "batch.hpp"
#include "cairn/core.h"

namespace cairn {

namespace {

struct MassRange {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  void add(double x) {
    least = std::min(least, x);
    most = std::max(most, x);
  }
  double ratio() const { return most > 0 ? std::max(most / least, 1.0) : 1; }
};

// Adds up contacts; their scale of velocity is that of the lighter body.
struct LightSum final : LightTerms {
  double mass = 0, energy = 0, mean = 0; // of bodies that impulses move
  double wrong = 0, squares = 0, loads = 0;
  LightError error;

  void add_body(std::int64_t, double inverse, double change_square) override {
    if (!(inverse > 0) || !(change_square > 0)) return;
    mass += 1 / inverse;
    energy += change_square / inverse;
  }
  void close_bodies() { mean = mass > 0 ? std::sqrt(energy / mass) : 0; }
  void add_contact(double speed, double impulse, const LightSide& lighter, std::int64_t place) override {
    if (!(speed > 0) && !(impulse > 0)) return;
    ++error.contacts;
    const double scale = std::max(lighter.change, mean), load = impulse > 0 ? impulse * lighter.inverse / scale : 0;
    loads += load * load;
    if (!(speed > 0)) return;
    const double ratio = speed / scale;
    wrong += impulse * speed;
    squares += ratio * ratio;
    if (!(ratio <= error.largest)) error.largest = ratio, error.worst_contact = place;
  }
  LightError finish() {
    if (wrong > 0) error.power = wrong / energy;
    if (error.contacts > 0) error.mean = std::sqrt(squares / double(error.contacts));
    if (error.contacts > 0) error.load = std::sqrt(loads / double(error.contacts));
    return error;
  }
};

// Inverse mass of a body along its lightest axis [1/kg]: held axes do not move, and the loads on the others determine
// its weight.
double inverse_mass(const ContactSystem& system, std::int64_t body) {
  const double* x = system.record[body].x;
  if (system.dim == 2) return std::max(x[3], x[4]);
  if (system.general.empty()) return x[6];
  const double* y = system.general[body].x; // mass along y and z
  return std::max({x[6], y[0], y[1]});
}

double inverse_mass(const ContactBodies& bodies, std::int64_t body) {
  const int n = bodies.dofs, d = n == 3 ? 2 : 3;
  const double* inverse = &bodies.inverse[std::size_t(n) * n * body];
  double largest = 0;
  for (int k = 0; k < d; ++k) largest = std::max(largest, inverse[(n + 1) * k]);
  return largest;
}

double size(const double* x, int n) {
  double square = 0;
  for (int k = 0; k < n; ++k) square += x[k] * x[k];
  return std::sqrt(square);
}

} // namespace

// Ratio of the heaviest to the lightest moving body. A condensed body is as light as its whole, but a node does not
// carry the whole, since the body bends.
double mass_ratio(const ContactSystem& system) {
  MassRange range;
  for (const CondensedBody& c : system.condensed)
    if (c.inverse_mass > 0) {
      range.most = std::max(range.most, c.inverse_mass);
      range.least = std::min(range.least, c.inverse_mass * double(c.touching));
    }
  for (std::int64_t b = 0; b < system.bodies; ++b)
    if (const double inverse = inverse_mass(system, b); inverse > 0) range.add(inverse);
  return range.ratio();
}

double mass_ratio(const ContactBodies& bodies) {
  MassRange range;
  for (std::int64_t b = 0; b < bodies.count; ++b)
    if (const double inverse = inverse_mass(bodies, b); inverse > 0) range.add(inverse);
  return range.ratio();
}

namespace {

// By how fast each contact of a batch breaks Coulomb's law, and the size of its impulse.
void cone_breaks(int d, const cairn_schedule& schedule, std::size_t batch, const cairn_batch& b, double* speed,
                 double* impulse) {
  double u[6 * 128], flat_u[3 * 128], flat_r[3 * 128], mu[128], w_nn[128], broken[3 * 128];
  cairn_relative_velocities(&schedule, std::int32_t(batch), 0, u);
  for (int lane = 0; lane < b.contacts; ++lane) {
    mu[lane] = at(b, b.params, lane, 0);
    w_nn[lane] = 1 / b.rho[lane];
    for (int c = 0; c < d; ++c) {
      flat_u[d * lane + c] = u[c * b.count + lane] + (b.pack && c > 0 ? 0 : at(b, b.bias, lane, c));
      flat_r[d * lane + c] = at(b, b.r, lane, c);
      if (b.compliance) flat_u[d * lane + c] += at(b, b.compliance, lane, c) * flat_r[d * lane + c];
    }
  }
  cairn_law_breaks(d, b.contacts, mu, w_nn, flat_r, flat_u, broken);
  for (int lane = 0; lane < b.contacts; ++lane) {
    speed[lane] = size(broken + d * lane, d);
    impulse[lane] = size(flat_r + d * lane, d);
  }
}

// The same of a law with a local solution of its own, by the impulse that it misses: rho times a velocity.
void law_misses(const cairn_schedule& schedule, std::size_t batch, const cairn_batch& b, double* speed) {
  cairn_law_misses(&schedule, std::int32_t(batch), speed);
  for (int lane = 0; lane < b.contacts; ++lane) speed[lane] = std::sqrt(speed[lane] / b.rho[lane]);
}

// Changes of the velocity of each condensed body as a whole by the impulses of all contacts (dim, bodies); its internal
// forces sum to zero.
void changes_of_condensed(const ContactSystem& system, std::vector<double>& change) {
  const int d = system.dim;
  change.assign(std::size_t(d) * system.condensed.size(), 0.0);
  const auto add = [&](std::int32_t body, double sign, const double(&impulse)[3]) {
    for (int k = 0; k < std::min(d, 3); ++k)
      change[std::size_t(d) * body + k] += sign * system.condensed[body].inverse_mass * impulse[k];
  };
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts && (b.mapped_a || b.mapped_b); ++lane) {
      double axes[3][3], impulse[3] = {0, 0, 0};
      axes_of(b, d, lane, axes);
      for (int c = 0; c < std::min(d, b.components); ++c)
        for (int k = 0; k < d; ++k) impulse[k] += at(b, b.r, lane, c) * axes[c][k];
      if (b.mapped_a) add(b.body_a[lane], 1, impulse);
      if (b.mapped_b) add(b.body_b[lane], -1, impulse);
    }
}

double change_square(const ContactSystem& system, const Velocities& velocity_free, std::int64_t body) {
  double square = 0;
  for (int k = 0; k < system.dim; ++k) {
    const double change = system.record[body].x[k] - velocity_free.bodies[body][k];
    square += change * change;
  }
  return square;
}

LightSide condensed_side(const ContactSystem& system, std::size_t i) {
  return {system.condensed[i].inverse_mass, size(&system.condensed_change[std::size_t(system.dim) * i], system.dim)};
}

const LightSide& lighter_of(const LightSide& a, const LightSide& b) { return a.inverse > b.inverse ? a : b; }

} // namespace

void give_light_bodies(ContactSystem& system, const Velocities& velocity_free, LightTerms& terms) {
  for (std::int64_t b = 0; b < system.bodies; ++b)
    terms.add_body(b, inverse_mass(system, b), change_square(system, velocity_free, b));
  changes_of_condensed(system, system.condensed_change);
  for (std::size_t i = 0; i < system.condensed.size(); ++i) {
    const LightSide s = condensed_side(system, i);
    terms.add_body(-1, s.inverse, s.change * s.change);
  }
}

void give_light_contacts(const ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
                         LightTerms& terms) {
  const auto side = [&](std::int32_t body, bool moves, bool mapped) -> LightSide {
    if (mapped) return condensed_side(system, std::size_t(body));
    if (!moves || body >= system.bodies) return {};
    return {inverse_mass(system, body), std::sqrt(change_square(system, velocity_free, body))};
  };
  for (std::size_t k = 0; k < system.batches.size(); ++k) {
    const cairn_batch& b = system.batches[k];
    // self-equilibrated bonds press and pull by more than any load: their load is not measured
    double speed[128], impulse[128] = {};
    const bool own = law_infos()[b.law].has_solve;
    own ? law_misses(schedule, k, b, speed) : cone_breaks(system.dim, schedule, k, b, speed, impulse);
    for (int lane = 0; lane < b.contacts; ++lane) {
      if (!(speed[lane] > 0) && !(impulse[lane] > 0)) continue;
      const LightSide one = side(b.body_a[lane], b.moves_a != 0, b.mapped_a != 0);
      const LightSide other = side(b.body_b[lane], b.moves_b != 0, b.mapped_b != 0);
      terms.add_contact(speed[lane], impulse[lane], lighter_of(one, other), system.candidate[b.first + lane]);
    }
  }
}

LightError measure_light(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free) {
  LightSum sum;
  give_light_bodies(system, velocity_free, sum);
  sum.close_bodies();
  give_light_contacts(system, schedule, velocity_free, sum);
  LightError out = sum.finish();
  if (!system.condensed.empty()) out.load = 0; // a body that bends is as light as each of its nodes
  return out;
}

void note(const LightError& light, SolveReport& report) {
  report.light_error = light.value();
  report.light_contact = light.worst_contact;
}

LightError measure_light(const FrictionProblem& p, const Array<double>& w_nn, const double* r, const double* u,
                         const double* unit, Array<double>& broken) {
  const ContactBodies& bodies = *p.bodies;
  const int d = p.dim, n = bodies.dofs;
  const auto side = [&](std::int32_t who) -> LightSide {
    if (who < 0) return {};
    return {inverse_mass(bodies, who), size(&bodies.velocity[std::size_t(n) * who], d)};
  };
  LightSum sum;
  for (std::int64_t b = 0; b < bodies.count; ++b) {
    const LightSide s = side(std::int32_t(b));
    sum.add_body(b, s.inverse, s.change * s.change);
  }
  sum.close_bodies();
  broken.resize(p.unknowns());
  cairn_law_breaks(d, p.contacts, p.mu.data(), w_nn.data(), r, u, broken.data());
  for (std::int64_t a = 0; a < p.contacts; ++a)
    sum.add_contact(size(&broken[d * a], d) / unit[a], size(r + d * a, d) * unit[a],
                    lighter_of(side(bodies.body[2 * a]), side(bodies.body[2 * a + 1])), a);
  return sum.finish();
}

} // namespace cairn
