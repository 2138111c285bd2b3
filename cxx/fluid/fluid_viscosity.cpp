// Viscosity of the incompressible form, and what it allows in the weakly compressible one.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../base/number_text.hpp"
#include "fluid_implicit.hpp"
#include "fluid_turning.hpp"

namespace cairn {

namespace {
constexpr double most_shears = 1000; // sub-steps of viscosity
constexpr double calm = 10; // Reynolds number of a spacing at the speed sqrt(p/rho) up to which a liquid is viscous
} // namespace

// Pressure forces that are the adjoint of a corrected divergence do not resist a new arrangement of particles. Without
// enough viscosity these then move from rest: only viscous liquids have such forces.
bool Fluid::corrects_pressure() const {
  if (!(settings.viscosity > 0) || granular_) return false;
  double most = 0;
  for (std::size_t i = 0; i < density_.size(); ++i) most = std::max(most, std::abs(pressure_of(i) + raised_));
  return std::sqrt(most * settings.density) * settings.spacing <= calm * settings.viscosity;
}

// Viscosity, explicit, in as many parts as it needs, of the liquid and the bodies that it holds.
void Fluid::shear(double h) {
  Implicit& s = *implicit_;
  const double length = settings.smoothing * settings.spacing;
  const double parts = std::max(1.0, std::ceil(h * settings.viscosity / (0.125 * length * length * settings.density)));
  if (!(parts <= most_shears))
    throw Error("a step of " + number_text(h) + " s takes " + number_text(parts) +
                " sub-steps of the viscosity of the incompressible fluid, at most " + number_text(most_shears) +
                " are made: give a dt of " + number_text(h * most_shears / parts) +
                " s or less, a smaller viscosity, or a larger spacing");
  const double dt = h / parts, volume = std::pow(settings.spacing, dim_) * settings.depth;
  const cairn_fluid_rows r = rows();
  const auto add_belts = [&](double sign) { // surfaces that move along their bodies
    for (std::size_t k = 0; k < bodies_.size(); ++k)
      for (std::size_t c = 0; c < 6; ++c) s.free[6 * k + c] += sign * bodies_[k].belt[c];
  };
  add_belts(1);
  for (int part = 0; part < int(parts); ++part) {
    of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
      cairn_fluid_viscous(&r, settings.viscosity, first, last, s.star.data(), s.free.data(), s.change.data());
    });
    tell(s.change, 3, of_particles_.first());
    std::fill(s.impulse.begin(), s.impulse.end(), 0.0);
    for (std::size_t i = 0; i < s.used_wall.size(); ++i)
      for (std::int64_t k = s.first_wall[i]; k < s.first_wall[i] + s.used_wall[i]; ++k) {
        const double *w = &s.wall[std::size_t(16 * k)], *v = &s.star[3 * i];
        const std::size_t body = std::size_t(s.wall_body[std::size_t(k)]);
        const double *u = &s.free[6 * body], *a = w + 13, *spin = u + 3;
        const double there[3] = {u[0] + spin[1] * a[2] - spin[2] * a[1], u[1] + spin[2] * a[0] - spin[0] * a[2],
                                 u[2] + spin[0] * a[1] - spin[1] * a[0]};
        double f[3];
        for (int c = 0; c < 3; ++c) f[c] = dt * volume * w[12] * (v[c] - there[c]);
        double* to = &s.impulse[6 * body];
        for (int c = 0; c < 3; ++c) to[c] += f[c];
        if (w[12] > 0 && body < bodies_.size() && !bodies_[body].flat)
          add_turning(spin, w, dt * volume * settings.viscosity, f, f);
        to[3] += a[1] * f[2] - a[2] * f[1];
        to[4] += a[2] * f[0] - a[0] * f[2];
        to[5] += a[0] * f[1] - a[1] * f[0];
      }
    for (std::size_t i = 0; i < s.star.size(); ++i) s.star[i] += dt * s.change[i];
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
      double change[6];
      inverse_of_body(k, &s.impulse[6 * k], change);
      for (std::size_t c = 0; c < 6; ++c) {
        s.free[6 * k + c] += change[c];
        s.known[6 * k + c] += s.impulse[6 * k + c];
      }
    }
    if (!meets_meshes()) continue;
    skins_.respond(tail(s.impulse), tail(s.of_change));
    for (std::size_t i = 6 * bodies_.size(); i < s.free.size(); ++i) {
      s.free[i] += s.of_change[i];
      s.known[i] += s.impulse[i];
    }
  }
  add_belts(-1);
}

// Viscosity acts on the velocities at the middle of the step: half of gravity along periodic axes is added before it,
// the rest after it, since pressure balances that and a liquid at rest must feel no viscosity. Bodies have half of
// their change, with pressure and contacts of the last step; meshes have their velocities at the begin.
void Fluid::shear_at_middle(const Scene& scene) {
  Implicit& s = *implicit_;
  const std::size_t n = s.star.size();
  double half[3]; // of the step's change along periodic axes [m/s]
  for (std::size_t c = 0; c < 3; ++c) half[c] = period_[c] > 0 ? 0.5 * s.h * scene.gravity[c] : 0;
  for (std::size_t i = 0; i < n; ++i) s.star[i] += half[i % 3];
  std::vector<double>& later = s.later;
  velocities_begin(later);
  for (std::size_t i = 0; i < later.size(); ++i) later[i] = s.free[i] - later[i];
  impulses_on_bodies(pressure_, s.impulse);
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    double change[6];
    inverse_of_body(k, &s.impulse[6 * k], change);
    for (std::size_t c = 0; c < 6; ++c) later[6 * k + c] -= 0.5 * (later[6 * k + c] + s.contact[6 * k + c] + change[c]);
  }
  for (std::size_t i = 0; i < later.size(); ++i) s.free[i] -= later[i];
  shear(s.h);
  for (std::size_t i = 0; i < n; ++i) s.star[i] += s.rest[i] - half[i % 3];
  for (std::size_t i = 0; i < later.size(); ++i) s.free[i] += later[i];
}

} // namespace cairn
