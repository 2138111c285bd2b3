// Grains smaller than a particle: the room that they take, and drag, by averages over the particles about them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "fluid.hpp"

namespace cairn {

struct Fluid::Granular {
  FluidGrains of;
  std::vector<std::int32_t> body;     // numbers in bodies_
  std::vector<double> record;         // see cairn_fluid_grain_record
  std::vector<std::int64_t> first_of; // pairs by grains
  std::vector<std::int32_t> particle;
  std::vector<std::int64_t> first, pair; // by particles
  std::vector<std::int32_t> grain_of;
  std::vector<double> weight, wet, impulse, force, of_pair, of_tile, mean, pressure;
  std::vector<double> shape, uneven, stirred; // see fluid_grain_lattice.f90 (6, n) [-], (3, n) [1/m], (n) [m/s]
  std::vector<std::int8_t> within;            // (n)
  double swift = 1;
};

namespace {
constexpr int grain_record = cairn_fluid_grain_record, particle_record = cairn_fluid_record;

template <class F>
void each_grain_tile(std::int64_t n, F&& f) {
  const std::int64_t tiles = (n + fluid_tile - 1) / fluid_tile;
#pragma omp parallel for schedule(dynamic, 4)
  for (std::int64_t t = 0; t < tiles; ++t) f(t, fluid_tile * t, std::min(fluid_tile * (t + 1), n));
}
} // namespace

std::int64_t Fluid::bytes_of_grains() const {
  if (!granular_) return 0;
  const Granular& g = *granular_;
  std::int64_t sum = 0;
  for (const auto* v : {&g.record, &g.weight, &g.wet, &g.impulse, &g.force, &g.of_pair, &g.of_tile, &g.mean,
                        &g.pressure, &g.shape, &g.uneven, &g.stirred})
    sum += std::int64_t(8 * v->capacity());
  for (const auto* v : {&g.first_of, &g.first, &g.pair}) sum += std::int64_t(8 * v->capacity());
  for (const auto* v : {&g.body, &g.particle, &g.grain_of}) sum += std::int64_t(4 * v->capacity());
  return sum + std::int64_t(g.within.capacity());
}

void Fluid::set_grains(FluidGrains grains, const std::vector<std::int32_t>& body) {
  if (grains.count() == 0) {
    granular_.reset();
    mass_.clear();
    solid_.clear();
    return;
  }
  if (settings.incompressible)
    throw Error(
        "grains smaller than a particle are dragged by the weakly compressible fluid: leave out incompressible");
  granular_ = std::make_shared<Granular>();
  granular_->of = std::move(grains);
  granular_->body = body;
  if (mass_.empty()) {
    mass_.assign(density_.size(), mass());
    solid_.assign(density_.size(), 0.0);
  }
}

cairn_fluid_grains Fluid::grains() const {
  Granular& s = *granular_;
  cairn_fluid_grains g{};
  g.grains = std::int32_t(s.of.count());
  g.grain = s.record.data();
  g.first_of = s.first_of.data();
  g.particle = s.particle.data();
  g.weight = s.weight.data();
  g.first = s.first.data();
  g.grain_of = s.grain_of.data();
  g.pair = s.pair.data();
  g.wet = s.wet.data();
  g.solid = const_cast<double*>(solid_.data());
  g.mass = mass_.data();
  return g;
}

// Grains as their bodies move; those that are gone are nowhere.
void Fluid::place_grains() {
  Granular& s = *granular_;
  const std::size_t n = s.body.size();
  s.record.resize(n * grain_record);
  for (std::size_t k = 0; k < n; ++k) {
    const Body& b = bodies_[std::size_t(s.body[k])];
    double* to = &s.record[grain_record * k];
    for (int c = 0; c < 3; ++c) {
      to[c] = b.at >= 0 ? b.position[c] : std::numeric_limits<double>::infinity();
      to[3 + c] = b.velocity[c];
      to[9 + c] = b.inverse_mass[c] * settings.depth;
    }
    to[6] = b.at >= 0 ? s.of.volume[k] : 0;
    to[7] = s.of.diameter[k];
    to[8] = s.of.law[k];
  }
}

// Particles about grains, and grains about particles, both by rising number.
void Fluid::list_grains() {
  if (!granular_) return;
  Granular& s = *granular_;
  place_grains();
  list_.about(reach() + skin(), s.record.data(), s.of.count(), grain_record, s.first_of, s.particle);
  const auto n = std::size_t(count());
  s.first.assign(n + 1, 0);
  for (const std::int32_t i : s.particle) ++s.first[std::size_t(i) + 1];
  for (std::size_t i = 0; i < n; ++i) s.first[i + 1] += s.first[i];
  std::vector<std::int64_t> next(s.first.begin(), s.first.end() - 1);
  s.pair.resize(s.particle.size());
  s.grain_of.resize(s.particle.size());
  s.weight.assign(s.particle.size(), 0.0);
  s.wet.assign(s.body.size(), 0.0);
  for (std::size_t g = 0; g < s.body.size(); ++g)
    for (std::int64_t k = s.first_of[g]; k < s.first_of[g + 1]; ++k) {
      const std::int64_t at = next[std::size_t(s.particle[std::size_t(k)])]++;
      s.pair[std::size_t(at)] = k;
      s.grain_of[std::size_t(at)] = std::int32_t(g);
    }
}

// Where grains are, and with the volumes of particles in record_, whose pressures follow.
void Fluid::weigh_grains(const Scene& scene) {
  Granular& s = *granular_;
  place_grains();
  const cairn_fluid f = view(scene);
  const cairn_fluid_grains g = grains();
  each_grain_tile(s.of.count(), [&](std::int64_t, std::int64_t first, std::int64_t last) {
    cairn_fluid_grain_weights(&f, &g, first, last);
  });
  const std::int64_t n = count();
  s.of_tile.assign(std::size_t((n + fluid_tile - 1) / fluid_tile), 1.0);
  each_grain_tile(n, [&](std::int64_t t, std::int64_t first, std::int64_t last) {
    cairn_fluid_grain_solids(&f, &g, first, last, &s.of_tile[std::size_t(t)]);
  });
  s.swift = 1;
  for (const double v : s.of_tile) s.swift = std::max(s.swift, v);
  pack();
  s.force.resize(3 * s.body.size());
  s.of_pair.resize(3 * s.particle.size());
  each_grain_tile(s.of.count(), [&](std::int64_t, std::int64_t first, std::int64_t last) {
    cairn_fluid_grain_push(&f, &g, first, last, s.force.data(), s.of_pair.data());
  });
  // A particle that grows has more of the grains about it: pressure acts on its volume by what it has beyond the mean
  // about these (less rest under gravity) times its porosity. This is the derivative of the same energy as the forces
  // on grains are, without which particles leave their places at once.
  const auto beyond = [&](std::size_t i, std::size_t grain) {
    const double *x = &record_[particle_record * i], *at = &s.record[grain_record * grain];
    double p = open_[i] > 0 ? std::max(x[7], 0.0) : x[7];
    for (int c = 0; c < 3; ++c)
      if (f.resting[c] != 0) p -= f.density * f.resting[c] * (x[c] - at[c]);
    return p;
  };
  s.mean.assign(s.body.size(), 0.0);
  each_grain_tile(s.of.count(), [&](std::int64_t, std::int64_t first, std::int64_t last) {
    for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
      double sum = 0, weights = 0;
      for (auto l = std::size_t(s.first_of[k]); l < std::size_t(s.first_of[k + 1]); ++l) {
        sum += s.weight[l] > 0 ? s.weight[l] * beyond(std::size_t(s.particle[l]), k) : 0;
        weights += s.weight[l];
      }
      s.mean[k] = weights > 0 ? sum / weights : 0;
    }
  });
  s.pressure.resize(std::size_t(n));
  each_grain_tile(n, [&](std::int64_t, std::int64_t first, std::int64_t last) {
    for (auto i = std::size_t(first); i < std::size_t(last); ++i) {
      double p = record_[particle_record * i + 7];
      for (auto l = std::size_t(s.first[i]); l < std::size_t(s.first[i + 1]); ++l) {
        const auto k = std::size_t(s.grain_of[l]);
        const double share =
            s.weight[std::size_t(s.pair[l])] * s.wet[k] * s.of.volume[k] / record_[particle_record * i + 6];
        if (share > 0) p -= share * (beyond(i, k) - s.mean[k]);
      }
      s.pressure[i] = p;
    }
  });
  for (std::size_t i = 0; i < std::size_t(n); ++i) record_[particle_record * i + 7] = s.pressure[i];
}

double Fluid::swiftness_of_grains() const { return std::sqrt(granular_->swift); }

double Fluid::least_porosity() const { return 1 - *std::max_element(solid_.begin(), solid_.end()); }

// At the start particles stand in their spacing among the grains, and are lighter by the room that these take.
void Fluid::make_room(const Scene& scene) {
  for (std::size_t i = 0; i < mass_.size(); ++i) {
    mass_[i] *= 1 - solid_[i];
    density_[i] *= 1 - solid_[i];
  }
  find_forces(scene);
}

// Pressure among grains as the adjoint of the divergence, wherever the flow has drawn particles out.
void Fluid::align_among_grains(const Scene& scene) {
  Granular& s = *granular_;
  const auto n = std::size_t(count());
  s.shape.resize(6 * n);
  s.uneven.resize(3 * n);
  s.within.resize(n);
  const cairn_fluid f = view(scene);
  each_grain_tile(count(), [&](std::int64_t, std::int64_t first, std::int64_t last) {
    cairn_fluid_grain_shapes(&f, first, last, s.shape.data(), s.within.data());
  });
  each_grain_tile(count(), [&](std::int64_t, std::int64_t first, std::int64_t last) {
    cairn_fluid_grain_align(&f, first, last, s.shape.data(), s.within.data(), acceleration_.data(), s.uneven.data());
  });
}

// Particles that the liquid carries past grains drift to where an equal pressure pushes none of them: at the faces of a
// bed their volumes change over less than the kernel reaches.
void Fluid::spread_among_grains(double dt) {
  Granular& s = *granular_;
  // Drift over flow past grains and unevenness: at 32 rows at faces err by .1 of the weight.
  constexpr double fast = 256;
  s.stirred.resize(std::size_t(count()));
  const cairn_fluid_grains g = grains();
  const double h = settings.smoothing * settings.spacing, most = 0.1 * settings.spacing;
  each_grain_tile(count(), [&](std::int64_t, std::int64_t first, std::int64_t last) {
    cairn_fluid_grain_stir(&g, first, last, velocity_.data(), s.stirred.data());
    for (std::int64_t i = 3 * first; i < 3 * last; ++i) {
      const double way = std::min(fast * dt * h * s.stirred[std::size_t(i / 3)], 0.1 * h * h); // beyond, it overshoots
      position_[std::size_t(i)] += std::clamp(way * s.uneven[std::size_t(i)], -most, most);
    }
  });
}

std::vector<double> Fluid::room_without(const Scene& scene, std::span<const std::int64_t> grains_sorted) {
  std::vector<double> room;
  if (!granular_ || !known_) return room;
  FluidGrains& of = granular_->of;
  const std::vector<double> volume = of.volume;
  std::vector<double> less = volume;
  for (std::size_t k = 0; k < less.size(); ++k)
    if (std::binary_search(grains_sorted.begin(), grains_sorted.end(), of.body[k])) less[k] = 0;
  if (less == volume) return room;
  check(scene);
  load_bodies(scene, 1.0);
  place_surfaces();
  if (!list_known_) renew_as_listed();
  if (list_is_old()) renew_list();
  const auto weigh = [&] {
    pack();
    weigh_grains(scene);
  };
  const std::vector<double> solid = solid_;
  weigh();
  room = solid_;
  of.volume = std::move(less);
  weigh();
  for (std::size_t i = 0; i < room.size(); ++i) room[i] = (1 - solid_[i]) / (1 - room[i]);
  of.volume = volume;
  solid_ = solid; // none may go
  return room;
}

void Fluid::fill_room(std::span<const double> room) {
  for (std::size_t i = 0; i < room.size(); ++i) {
    mass_[i] *= room[i];
    density_[i] *= room[i];
    solid_[i] = 1 - room[i] * (1 - solid_[i]);
  }
}

// Pressures of the liquid act on the grains in it, and these on the liquid.
void Fluid::push_grains(const Scene&) {
  Granular& s = *granular_;
  const cairn_fluid_grains g = grains();
  each_grain_tile(count(), [&](std::int64_t, std::int64_t first, std::int64_t last) {
    cairn_fluid_grain_bear(&g, first, last, s.of_pair.data(), acceleration_.data());
  });
  for (std::size_t k = 0; k < s.body.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c) force_[6 * std::size_t(s.body[k]) + c] += settings.depth * s.force[3 * k + c];
}

// Drag over a time, implicit, so that it may be as strong as it will.
void Fluid::drag_grains(const Scene& scene, double dt) {
  Granular& s = *granular_;
  for (std::size_t k = 0; k < s.body.size(); ++k)
    std::copy_n(bodies_[std::size_t(s.body[k])].velocity, 3, &s.record[grain_record * k + 3]);
  const cairn_fluid f = view(scene);
  const cairn_fluid_grains g = grains();
  s.impulse.resize(4 * s.body.size());
  each_grain_tile(s.of.count(), [&](std::int64_t, std::int64_t first, std::int64_t last) {
    cairn_fluid_grain_drag(&f, &g, dt, first, last, velocity_.data(), s.impulse.data());
  });
  std::fill(s.of_tile.begin(), s.of_tile.end(), 0.0);
  each_grain_tile(count(), [&](std::int64_t t, std::int64_t first, std::int64_t last) {
    cairn_fluid_grain_react(&g, first, last, s.impulse.data(), velocity_.data(), &s.of_tile[std::size_t(t)]);
  });
  double lost = 0;
  for (const double v : s.of_tile) lost += v;
  for (std::size_t k = 0; k < s.body.size(); ++k) {
    Body& b = bodies_[std::size_t(s.body[k])];
    for (std::size_t c = 0; c < 3; ++c) {
      const double j = s.impulse[4 * k + c], change = settings.depth * b.inverse_mass[c] * j;
      lost -= j * (b.velocity[c] + change);
      b.velocity[c] += change;
      b.impulse[c] += settings.depth * j;
    }
  }
  report.drag_loss += settings.depth * lost;
}

} // namespace cairn
