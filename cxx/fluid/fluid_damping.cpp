// Damping of what particles of the incompressible form move between each other.
#include <algorithm>

#include "fluid_implicit.hpp"

namespace cairn {

// Beside a free surface, walls that the lattice of the particles does not fit stir the liquid without end: what gravity
// adds to the pressure at points of walls does work on particles that circulate there. The damping has the speed of a
// fall from the highest particle, and less where the pressure is less. Without a surface the drift keeps particles
// even.
void Fluid::damp_noise() {
  if (closed_) return;
  Implicit& s = *implicit_;
  s.slope.resize(9 * std::size_t(count()));
  s.divergence.resize(std::size_t(count())); // here the part of the pressure that is by gravity
  const double high = s.level.empty() ? 0 : *std::min_element(s.level.begin(), s.level.end());
  for (std::size_t i = 0; i < s.level.size(); ++i) s.divergence[i] = std::min(pressure_[i], s.level[i] - high);
  const cairn_fluid_rows r = rows();
  of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
    cairn_fluid_velocity_slopes(&r, first, last, velocity_.data(), s.slope.data());
  });
  tell(s.slope, 9, of_particles_.first());
  of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
    cairn_fluid_damp(&r, settings.viscosity, settings.spacing, first, last, velocity_.data(), s.slope.data(),
                     s.divergence.data(), s.change.data());
  });
  tell(s.change, 3, of_particles_.first());
  for (std::size_t i = 0; i < s.star.size(); ++i) s.star[i] += s.change[i];
}

} // namespace cairn
