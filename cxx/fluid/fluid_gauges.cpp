// Gauges of a liquid: pressure at a place, level above it; its memory.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fluid_implicit.hpp"
#include "wendland.hpp"

namespace cairn {

double Fluid::mass() const { return settings.density * std::pow(settings.spacing, dim_); }

namespace {

// Kernel times the volume of a particle of one spacing, at a distance over the length of the kernel.
double share(int dim, double smoothing, double q) {
  const double wide = dim == 2 ? smoothing * smoothing : smoothing * smoothing * smoothing;
  const double scale = (dim == 2 ? 7 / (4 * std::numbers::pi) : 21 / (16 * std::numbers::pi)) / wide;
  return scale * wendland(q);
}

} // namespace

double Fluid::pressure_at(const Scene& scene, const double* place) const {
  const double length = settings.smoothing * settings.spacing;
  double sum = 0, weights = 0;
  for (std::size_t i = 0; i < density_.size(); ++i) {
    double square = 0, added = 0;
    for (std::size_t c = 0; c < std::size_t(dim_); ++c) {
      double away = place[c] - position_[3 * i + c];
      if (period_[c] > 0) away -= period_[c] * std::round(away / period_[c]);
      square += away * away;
      if (!(period_[c] > 0)) added += settings.density * scene.gravity[c] * away;
    }
    const double weight = share(dim_, settings.smoothing, std::sqrt(square) / length);
    sum += weight * (pressure_of(i) + added);
    weights += weight;
  }
  return weights > 0 ? sum / weights : 0.0;
}

double Fluid::level_at(const Scene& scene, const double* place) const {
  double up[3] = {}, pull = 0;
  for (const double g : scene.gravity) pull += g * g;
  for (int c = 0; c < 3; ++c) up[c] = pull > 0 ? -scene.gravity[std::size_t(c)] / std::sqrt(pull) : c == dim_ - 1;
  struct Near {
    double height, across; // along up, and the square of the distance from the line
  };
  std::vector<Near> column;
  double height = 0;
  for (std::size_t c = 0; c < std::size_t(dim_); ++c) height += place[c] * up[c];
  const double length = settings.smoothing * settings.spacing;
  for (std::size_t i = 0; i < position_.size() / 3; ++i) {
    double square = 0, along = 0;
    for (std::size_t c = 0; c < std::size_t(dim_); ++c) {
      double away = position_[3 * i + c] - place[c];
      if (period_[c] > 0) away -= period_[c] * std::round(away / period_[c]);
      square += away * away;
      along += away * up[c];
    }
    const double across = std::max(0.0, square - along * along);
    if (across < reach() * reach()) column.push_back({height + along, across});
  }
  const auto filled = [&](double height) {
    double sum = 0;
    for (const Near& p : column)
      sum += share(dim_, settings.smoothing, std::sqrt(p.across + (p.height - height) * (p.height - height)) / length);
    return sum;
  };
  double top = -std::numeric_limits<double>::infinity(), low = -top;
  for (const Near& p : column) {
    top = std::max(top, p.height);
    low = std::min(low, p.height);
  }
  const double part = settings.spacing / 8;
  double above = 0;
  for (double at = top + reach(); !column.empty() && at >= low; at -= part) {
    const double now = filled(at);
    if (now >= 0.5) return at + (now > above ? part * (now - 0.5) / (now - above) : 0.0);
    above = now;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

std::int64_t Fluid::bytes() const {
  std::int64_t sum = list_.bytes() + skins_.bytes() + bytes_of_grains() + (implicit_ ? implicit_->bytes() : 0);
  for (const auto* v : {&position_,
                        &velocity_,
                        &density_,
                        &acceleration_,
                        &drift_,
                        &record_,
                        &surface_,
                        &plane_,
                        &rate_,
                        &gradient_correction_,
                        &on_points_,
                        &shear_on_points_,
                        &side_of_points_,
                        &on_planes_,
                        &fill_,
                        &color_,
                        &normal_,
                        &curvature_,
                        &mass_,
                        &solid_,
                        &pressure_,
                        &points_.offset,
                        &points_.normal,
                        &before_.position,
                        &before_.velocity,
                        &before_.density,
                        &before_.acceleration,
                        &before_.listed,
                        &before_.pressure,
                        &before_.mass,
                        &before_.solid})
    sum += std::int64_t(8 * v->capacity());
  for (const auto* v : {&number_, &end_, &body_of_point_, &before_.number, &before_.end})
    sum += std::int64_t(4 * v->capacity());
  return sum;
}

} // namespace cairn
