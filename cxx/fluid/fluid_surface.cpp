// The free surface of the liquid: how much space it fills, and surface tension.
#include <algorithm>
#include <cmath>

#include "fluid.hpp"

namespace cairn {

namespace {
constexpr double spray = 0.6; // fill below which particles fly apart, or stand in a single row
// Distance of the nearest other particle over the spacing from which one is spray, even if walls fill the space about
// it.
constexpr double apart = 1.4;
} // namespace

// Whether no other particle is near particle i, as packed last.
bool Fluid::stands_alone(std::size_t i) const {
  const double* own = &record_[cairn_fluid_record * i];
  const double near = apart * settings.spacing;
  for (std::int64_t k = list_.first[i]; k < list_.first[i + 1]; ++k) {
    const double* other = &record_[cairn_fluid_record * std::size_t(list_.neighbour[std::size_t(k)])];
    double square = 0;
    for (std::size_t c = 0; c < std::size_t(dim_); ++c) {
      double away = own[c] - other[c];
      if (period_[c] > 0) away -= period_[c] * std::round(away / period_[c]);
      square += away * away;
    }
    if (square < near * near) return false;
  }
  return true;
}

// The volume of the liquid without spray over that of its mass, for particles as packed last.
void Fluid::measure_volume(const Scene& scene) {
  const std::int64_t n = count();
  fill_.resize(std::size_t(n));
  const cairn_fluid f = view(scene);
  of_particles_.each_tile(
      [&](std::int64_t first, std::int64_t last) { cairn_fluid_fill(&f, first, last, fill_.data()); });
  tell(fill_, 1, of_particles_.first());
  double volume = 0;
  std::int64_t many = 0;
  for (std::size_t i = 0; i < fill_.size(); ++i) {
    if (!(fill_[i] > spray) || (ends_ && end_[i] != 0) || stands_alone(i)) continue;
    volume += 1 / fill_[i];
    ++many;
  }
  report.volume = many > 0 ? volume / double(many) : 1;
  if (volume_begin_.empty()) volume_begin_.assign(1, report.volume);
}

// Sum of the gradient of the color across the flat surface of a lattice times the spacing: 1/2 but for a share of a
// percent, as particles are on one side alone.
double Fluid::color_of_lattice() const {
  const double dx = settings.spacing, volume = std::pow(dx, dim_);
  const int most = int(std::ceil(2 * settings.smoothing));
  cairn_fluid f{};
  f.dim = dim_;
  f.smoothing = settings.smoothing * dx;
  f.spacing = dx;
  double sum = 0;
  for (int layer = 0; layer < most; ++layer) { // a particle, then those about it, up to the first layer
    std::vector<double> record = {0, 0, 0, 0, 0, 0, volume, 0};
    std::vector<std::int32_t> neighbour;
    for (int z = dim_ == 3 ? -most : 0; z <= (dim_ == 3 ? most : 0); ++z)
      for (int x = -most; x <= most; ++x)
        for (int y = -most; y <= layer; ++y) {
          if (x == 0 && y == 0 && z == 0) continue;
          neighbour.push_back(std::int32_t(record.size() / cairn_fluid_record));
          record.insert(record.end(), {x * dx, y * dx, z * dx, 0, 0, 0, volume, 0});
        }
    const std::int64_t first[] = {0, std::int64_t(neighbour.size())}, none[] = {0, 0};
    f.record = record.data();
    f.first = first;
    f.neighbour = neighbour.data();
    f.first_point = none;
    double color[4];
    cairn_fluid_color(&f, 0, 1, color);
    sum += color[3] * dx;
  }
  return sum;
}

// Accelerations by surface tension, for particles as packed last.
void Fluid::pull_surface(const Scene& scene) {
  if (!(lattice_color_ > 0)) lattice_color_ = color_of_lattice();
  const std::int64_t n = count();
  color_.resize(4 * std::size_t(n));
  normal_.resize(4 * std::size_t(n));
  curvature_.resize(std::size_t(n));
  const cairn_fluid f = view(scene);
  of_particles_.each_tile(
      [&](std::int64_t first, std::int64_t last) { cairn_fluid_color(&f, first, last, color_.data()); });
  tell(color_, 4, of_particles_.first());
  of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
    cairn_fluid_normals(&f, first, last, color_.data(), normal_.data());
  });
  tell(normal_, 4, of_particles_.first());
  of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
    cairn_fluid_curvature(&f, first, last, normal_.data(), curvature_.data());
  });
  tell(curvature_, 1, of_particles_.first());
  of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
    cairn_fluid_tension(&f, settings.surface_tension / lattice_color_, first, last, color_.data(), normal_.data(),
                        curvature_.data(), acceleration_.data());
  });
}

// Beside a wall within the liquid the color has a gradient too, as particles and points of the wall do not fit each
// other; it is no surface of the liquid.
double Fluid::surface_energy() const {
  double area = 0;
  for (std::size_t i = 0; 4 * i < color_.size(); ++i)
    if (open_[i] > 0) area += color_[4 * i + 3] * record_[cairn_fluid_record * i + 6];
  return area > 0 ? settings.surface_tension / lattice_color_ * settings.depth * area : 0;
}

} // namespace cairn
