#include "fluid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "../base/call.hpp"
#include "../base/number_text.hpp"
#include "../base/threads.hpp"
#include "fluid_drift.hpp"
#include "fluid_implicit.hpp"

namespace cairn {

namespace {
constexpr std::int64_t tile = fluid_tile;
constexpr int record = cairn_fluid_record, surface_record = cairn_fluid_surface_record;

template <class T>
void reorder(std::vector<T>& values, const std::vector<std::int32_t>& order, std::size_t components) {
  std::vector<T> out(values.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t c = 0; c < components; ++c)
      out[components * i + c] = values[components * std::size_t(order[i]) + c];
  values.swap(out);
}
} // namespace

void Fluid::set_particles(std::span<const double> position, std::span<const double> velocity,
                          std::span<const double> pressure) {
  const std::size_t n = pressure.size();
  position_.assign(position.begin(), position.end());
  velocity_.assign(velocity.begin(), velocity.end());
  density_.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    density_[i] = settings.density + pressure[i] / (settings.sound_speed * settings.sound_speed);
  acceleration_.assign(3 * n, 0.0);
  open_.assign(n, 0);
  if (settings.incompressible) {
    pressure_.assign(pressure.begin(), pressure.end());
    density_.assign(n, settings.density);
    norm_.assign(1, 0.0);
  }
  number_.resize(n);
  std::iota(number_.begin(), number_.end(), 0);
  known_ = list_known_ = false;
}

// Forces of bodies that were known stay theirs.
void Fluid::set_surfaces(FluidSurface points, FluidSurface planes, FluidGrains grains) {
  std::vector<std::int64_t> ids;
  for (const auto* from : {&points.body, &planes.body, &grains.body}) ids.insert(ids.end(), from->begin(), from->end());
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  std::vector<Body> bodies(ids.size());
  std::vector<double> force(6 * ids.size()), contact(6 * ids.size()), before(6 * ids.size());
  for (std::size_t k = 0; k < ids.size(); ++k) {
    bodies[k] = {};
    bodies[k].id = ids[k];
    const auto was = std::lower_bound(bodies_.begin(), bodies_.end(), ids[k],
                                      [](const Body& b, std::int64_t id) { return b.id < id; });
    if (was == bodies_.end() || was->id != ids[k]) continue;
    const auto j = std::size_t(was - bodies_.begin());
    for (std::size_t c = 0; c < 6; ++c) {
      force[6 * k + c] = force_[6 * j + c];
      contact[6 * k + c] = contact_[6 * j + c];
      before[6 * k + c] = contact_before_[6 * j + c];
    }
  }
  const auto places = [&](const std::vector<std::int64_t>& of) {
    std::vector<std::int32_t> out;
    out.reserve(of.size());
    for (const std::int64_t id : of)
      out.push_back(std::int32_t(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin()));
    return out;
  };
  body_of_point_ = places(points.body);
  body_of_plane_ = places(planes.body);
  const std::vector<std::int32_t> of_grains = places(grains.body);
  points_ = std::move(points);
  points_.centre.resize(points_.body.size(), 0.0);
  planes_ = std::move(planes);
  bodies_ = std::move(bodies);
  force_ = std::move(force);
  contact_ = std::move(contact);
  contact_before_ = std::move(before);
  mean_.assign(6 * bodies_.size(), 0.0);
  pose_listed_.assign(12 * bodies_.size(), 0.0);
  for (std::int64_t b = 0; b < points_.count(); ++b) {
    Body& body = bodies_[std::size_t(body_of_point_[std::size_t(b)])];
    const double* x = &points_.offset[std::size_t(3 * b)];
    body.reach = std::max(body.reach, std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]));
    double seen = 0; // a round side that slides shows none of a spin about its centre
    for (std::size_t c = 0; c < 3; ++c) {
      const bool slides = points_.slip[std::size_t(b)] == std::int8_t(Slip::slides);
      const double arm =
          x[c] - (slides ? points_.centre[std::size_t(b)] * points_.normal[std::size_t(3 * b) + c] : 0.0);
      seen += arm * arm;
    }
    body.seen = std::max(body.seen, std::sqrt(seen));
    if (points_.depth[std::size_t(b)] < settings.spacing)
      body.surface += points_.volume[std::size_t(b)] / settings.spacing;
    if (const double* n = &points_.normal[std::size_t(3 * b)]; points_.depth[std::size_t(b)] < settings.spacing)
      for (int c = 0; c < 3; ++c) // Gauss
        body.volume += points_.volume[std::size_t(b)] / settings.spacing / dim_ * n[c] *
                       (x[c] + points_.depth[std::size_t(b)] * n[c]);
  }
  for (const std::int32_t k : body_of_plane_) bodies_[std::size_t(k)].flat = true;
  list_known_ = false;
  list_.at.clear();
  set_grains(std::move(grains), of_grains);
}

void Fluid::check(const Scene& scene) {
  period_ = corner_ = {};
  const Cell& cell = scene.cell;
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 3; ++i)
      if (i != k && cell.vectors[i + 3 * k] != 0)
        throw Error("the fluid flows in no cell that leans: leave out lean and shear_rate");
    if (cell.velocity_gradient[4 * k] != 0 || cell.velocity_gradient[6] != 0 || cell.velocity_gradient[3] != 0)
      throw Error("the fluid flows in no cell that shears: leave out shear_rate");
    if (!cell.periodic[k]) continue;
    period_[std::size_t(k)] = cell.vectors[4 * k];
    corner_[std::size_t(k)] = cell.corner[k];
    const double least = 3 * (reach() + skin());
    if (period_[std::size_t(k)] < least)
      throw Error(
          "the periodic cell is " + number_text(period_[std::size_t(k)]) + " m long along axis " + std::to_string(k) +
          ", and the fluid needs " + number_text(least) +
          " m, three times the distance over which particles are listed: give it a smaller spacing, or a longer "
          "cell");
  }
  list_.period = period_;
  list_.low = corner_;
}

bool Fluid::list_is_old() {
  if (!list_known_) return true;
  double most = 0;
  const auto n = std::int64_t(position_.size());
#pragma omp parallel for schedule(static) reduction(max : most)
  for (std::int64_t i = 0; i < n; i += 3) {
    double square = 0;
    for (std::int64_t c = 0; c < 3; ++c) {
      const double d = position_[std::size_t(i + c)] - list_.at[std::size_t(i + c)];
      square += d * d;
    }
    most = std::max(most, square);
  }
  double of_bodies = 0;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    if (b.at < 0 || (b.reach == 0 && !granular_)) continue;
    const double* was = &pose_listed_[12 * k];
    double way = 0, turn = 0;
    for (std::size_t c = 0; c < 3; ++c) way += (b.position[c] - was[c]) * (b.position[c] - was[c]);
    for (std::size_t c = 0; c < 9; ++c) turn += (b.turn[c] - was[3 + c]) * (b.turn[c] - was[3 + c]);
    of_bodies = std::max(of_bodies, std::sqrt(way) + b.reach * std::sqrt(turn));
  }
  if (skins_.count() > 0)
    of_bodies =
        std::max(of_bodies, skins_.way(surface_.data() + std::size_t(surface_record) * std::size_t(points_.count())));
  const double particles = std::sqrt(most);
  return !(particles + std::max(particles, of_bodies) < skin());
}

void Fluid::renew_list() {
  for (std::size_t i = 0; i < position_.size(); ++i)
    if (const double p = period_[i % 3]; p > 0) {
      const double low = corner_[i % 3];
      position_[i] -= p * std::floor((position_[i] - low) / p);
    }
  const std::vector<std::int32_t> order = list_.order(position_, reach() + skin());
  if (!std::is_sorted(order.begin(), order.end())) {
    reorder(position_, order, 3);
    reorder(velocity_, order, 3);
    reorder(acceleration_, order, 3);
    reorder(density_, order, 1);
    reorder(number_, order, 1);
    reorder(open_, order, 1);
    if (settings.incompressible) reorder(pressure_, order, 1);
    if (ends_) reorder(end_, order, 1);
    if (granular_) {
      reorder(mass_, order, 1);
      reorder(solid_, order, 1);
    }
  }
  list_.at = position_;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    std::copy_n(bodies_[k].position, 3, &pose_listed_[12 * k]);
    std::copy_n(bodies_[k].turn, 9, &pose_listed_[12 * k + 3]);
  }
  if (skins_.count() > 0) skins_.keep_listed(skin_records());
  list_.make(reach() + skin(), surface_.data(), all_points(), surface_record);
  list_grains();
  cut_shares();
  list_known_ = true;
  ++report.lists;
  report.neighbours = count() > 0 ? double(list_.neighbour.size()) / double(count()) : 0;
  report.surface_points = std::int64_t(list_.particle.size());
}

void Fluid::use(std::shared_ptr<ParticleShares> ranks) {
  if (ranks == ranks_) return;
  ranks_ = std::move(ranks);
  if (list_known_) cut_shares();
}

// A sum costs as many terms as its list is long, and one more.
void Fluid::cut_shares() {
  of_particles_.cut(count(), ranks_.get(), [&](std::int64_t k) {
    return list_.first[std::size_t(k)] + list_.first_point[std::size_t(k)] + k;
  });
  of_points_.cut(all_points(), ranks_.get(), [&](std::int64_t k) { return list_.first_of_point[std::size_t(k)] + k; });
}

// The list as it was made, after a state was restored: sums keep their order.
void Fluid::renew_as_listed() {
  if (list_.at.size() != position_.size()) return renew_list();
  const std::vector<Body> now = bodies_;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    std::copy_n(&pose_listed_[12 * k], 3, bodies_[k].position);
    std::copy_n(&pose_listed_[12 * k + 3], 9, bodies_[k].turn);
  }
  place_surfaces();
  if (skins_.count() > 0) skins_.show_listed(skin_records());
  list_.make(reach() + skin(), surface_.data(), all_points(), surface_record);
  list_grains();
  cut_shares();
  bodies_ = now;
  place_surfaces();
  list_known_ = true;
}

void Fluid::pack() {
  const std::int64_t n = count();
  record_.resize(std::size_t(record * n));
  const double m = mass(), c2 = settings.sound_speed * settings.sound_speed;
#pragma omp parallel for schedule(static)
  for (std::int64_t i = 0; i < n; ++i) {
    double* to = &record_[std::size_t(record * i)];
    std::copy_n(&position_[std::size_t(3 * i)], 3, to);
    std::copy_n(&velocity_[std::size_t(3 * i)], 3, to + 3);
    to[6] = (mass_.empty() ? m : mass_[std::size_t(i)]) / density_[std::size_t(i)];
    to[7] = c2 * (fluid_density(std::size_t(i)) - settings.density) + raised_;
  }
}

cairn_fluid Fluid::view(const Scene& scene) const {
  cairn_fluid f{};
  f.dim = dim_;
  f.planes = std::int32_t(planes_.count());
  f.smoothing = settings.smoothing * settings.spacing;
  f.spacing = settings.spacing;
  f.mass = mass();
  f.density = settings.density;
  f.sound_speed = settings.sound_speed;
  f.viscosity = settings.viscosity;
  f.diffusion = settings.diffusion;
  f.limiter = settings.limiter;
  f.artificial = settings.artificial;
  for (std::size_t k = 0; k < 3; ++k) {
    f.gravity[k] = scene.gravity[k];
    f.resting[k] = period_[k] > 0 || !borne_ ? 0 : scene.gravity[k];
    f.period[k] = period_[k];
  }
  f.record = record_.data();
  f.first = list_.first.data();
  f.neighbour = list_.neighbour.data();
  f.surface = surface_.data();
  f.first_point = list_.first_point.data();
  f.point = list_.point.data();
  f.plane = plane_.data();
  f.open = open_.data();
  f.masses = mass_.empty() ? nullptr : mass_.data();
  f.gradient_correction = gradient_correction_.empty() ? nullptr : gradient_correction_.data();
  return f;
}

// Forces of the particles on each other and on bodies, at their places, velocities and densities.
void Fluid::find_forces(const Scene& scene) {
  pack();
  if (granular_) weigh_grains(scene);
  // Viscosity of volume where the liquid is compressed (von Neumann & Richtmyer 1950): sound dies, and shear feels
  // none.
  const double h = settings.smoothing * settings.spacing, linear = settings.bulk * h * settings.sound_speed;
  for (std::size_t i = 0; i < rate_.size(); ++i)
    if (const double r = rate_[i] / density_[i]; r > 0)
      record_[record * i + 7] += density_[i] * (linear * r + 4 * h * h * r * r);
  const std::int64_t n = count(), tiles = (n + tile - 1) / tile, planes = planes_.count();
  drift_.resize(std::size_t(3 * n));
  open_new_.resize(std::size_t(n));
  on_planes_.assign(std::size_t(6 * std::max<std::int64_t>(1, planes) * tiles), 0.0);
  const cairn_fluid f = view(scene);
  of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
    cairn_fluid_acceleration(&f, first, last, acceleration_.data(), drift_.data(), open_new_.data(),
                             &on_planes_[std::size_t(6 * planes * (first / tile))]);
  });
  const std::int64_t points = all_points();
  on_points_.resize(std::size_t(3 * points));
  shear_on_points_.resize(std::size_t(3 * points));
  side_of_points_.resize(std::size_t(3 * points));
  of_points_.each_tile(
      [&](std::int64_t first, std::int64_t last) {
        cairn_fluid_on_points(&f, first, last, list_.first_of_point.data(), list_.particle.data(), on_points_.data(),
                              shear_on_points_.data(), side_of_points_.data());
      },
      points > 256);
  if (settings.surface_tension > 0) pull_surface(scene);
  tell(acceleration_, 3, of_particles_.first());
  tell(open_new_, 1, of_particles_.first());
  if (spreads()) tell(drift_, 3, of_particles_.first());
  if (planes > 0) tell(on_planes_, std::size_t(6 * planes), of_particles_.first_tile());
  tell(on_points_, 3, of_points_.first());
  tell(shear_on_points_, 3, of_points_.first());
  if (settings.viscosity > 0) tell(side_of_points_, 3, of_points_.first());
  if (granular_) align_among_grains(scene);
  open_.swap(open_new_);
  if (ends_) hold_ends();
  add_surface_forces();
  if (granular_) push_grains(scene);
}

void Fluid::sub_step(const Scene& scene, double dt) {
  const std::int64_t n = count();
  accelerate(dt);
  if (granular_) drag_grains(scene, 0.5 * dt);
#pragma omp parallel for schedule(static)
  for (std::int64_t i = 0; i < 3 * n; ++i) position_[std::size_t(i)] += dt * velocity_[std::size_t(i)];
  move_bodies(dt);
  place_surfaces();
  if (list_is_old()) renew_list();
  pack();
  rate_.resize(std::size_t(n));
  const cairn_fluid f = view(scene);
  of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
    cairn_fluid_density_rate(&f, first, last, rate_.data(), gradient_correction_.data());
  });
  tell(rate_, 1, of_particles_.first());
  if (!gradient_correction_.empty()) tell(gradient_correction_, 6, of_particles_.first());
  // A free surface bears no tension beyond the pressure of the flow.
  const double mach = fastest_ / settings.sound_speed, least = settings.density * (1 - mach * mach);
#pragma omp parallel for schedule(static)
  for (std::int64_t i = 0; i < n; ++i) {
    double& rho = density_[std::size_t(i)];
    rho += dt * rate_[std::size_t(i)];
    if (open_[std::size_t(i)] == 2) rho = std::max(rho, solid_.empty() ? least : least * (1 - solid_[std::size_t(i)]));
  }
  if (ends_) fill_ends(scene);
  find_forces(scene);
  accelerate(dt);
  if (granular_) drag_grains(scene, 0.5 * dt);
  if (granular_) spread_among_grains(dt);
  if (!spreads()) return;
  const double dx = settings.spacing, h = settings.smoothing * dx;
#pragma omp parallel for schedule(static)
  for (std::int64_t i = 0; i < 3 * n; ++i)
    position_[std::size_t(i)] += drift_within(settings.drift * dt * fastest_ * h * drift_[std::size_t(i)], dx);
}

double Fluid::fastest() const {
  double square = 0;
  const auto n = std::int64_t(velocity_.size());
#pragma omp parallel for schedule(static) reduction(max : square)
  for (std::int64_t i = 0; i < n; i += 3) {
    const double* v = &velocity_[std::size_t(i)];
    square = std::max(square, v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }
  return std::sqrt(square);
}

double Fluid::stable_step(const Scene& scene) const {
  if (settings.incompressible) return 0.4 * settings.spacing / fastest();
  const double h = settings.smoothing * settings.spacing, c = settings.sound_speed;
  double pull = 0;
  for (const double g : scene.gravity) pull += g * g;
  double dt = settings.courant * h / (c + fastest());
  if (settings.viscosity > 0)
    dt = std::min(dt, 0.125 * h * h * settings.density / settings.viscosity * (granular_ ? least_porosity() : 1));
  if (pull > 0) dt = std::min(dt, 0.25 * std::sqrt(h / std::sqrt(pull)));
  if (settings.surface_tension > 0) // of the shortest waves along a surface (Morris 2000)
    dt =
        std::min(dt, 0.25 * std::sqrt(settings.density * h * h * h / (2 * std::acos(-1.0) * settings.surface_tension)));
  // A body lighter than the liquid about it follows that as on a spring of its compressibility.
  for (const Body& b : bodies_) dt = std::min(dt, settings.courant * h / c / lightness(b));
  if (burden_ > 1) dt = std::min(dt, settings.courant * h / c / std::sqrt(burden_));
  if (granular_) dt = std::min(dt, settings.courant * h / c / swiftness_of_grains());
  return dt;
}

// Greatest speed and compression; refuses a flow that the speed of sound is too low for.
void Fluid::measure_flow() {
  double speed = 0, compression = 0;
  for (std::int64_t i = 0; i < count(); ++i) {
    const double* v = &velocity_[std::size_t(3 * i)];
    const double square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    const double share = std::abs(fluid_density(std::size_t(i)) / settings.density - 1);
    if (!(square < std::numeric_limits<double>::infinity()) || !(share < 0.5))
      throw Error("particle " + std::to_string(number_[std::size_t(i)]) + " of the fluid has a density of " +
                  number_text(density_[std::size_t(i)]) + " kg/m3 and a speed of " + number_text(std::sqrt(square)) +
                  " m/s: its sound speed of " + number_text(settings.sound_speed) +
                  " m/s is too low for this flow, or bodies stand within the liquid; give cn.fluid(sound_speed=...) "
                  "ten times the greatest speed");
    speed = std::max(speed, square);
    compression = std::max(compression, share);
  }
  report.speed = std::sqrt(speed);
  report.compression = compression;
}

void Fluid::advance(Scene& scene, double h, const FluidStep& step) {
  check(scene);
  if (ends_) check_ends(h);
  const Threads threads(settings.threads, 40 * count());
  keep_before();
  load_bodies(scene, h);
  try {
    if (meets_meshes()) load_meshes(scene, step);
    place_surfaces();
    gradient_correction_.clear();
    if (!known_) {
      if (list_is_old()) renew_list();
      find_forces(scene);
      find_forces(scene); // free surfaces are known then
      if (granular_) make_room(scene);
      known_ = true;
    } else {
      if (!list_known_) renew_as_listed();
      if (granular_) { // contacts have moved grains otherwise than was foreseen
        if (list_is_old()) renew_list();
        pack();
        weigh_grains(scene);
      }
    }
    borne_ = is_borne();
    report.drag_loss = 0;
    const double limit = stable_step(scene);
    report.light_factor = 1;
    for (const Body& b : bodies_)
      if (const double factor = lightness(b); factor > report.light_factor) {
        report.light_factor = factor;
        report.light_body = b.id;
      }
    fastest_ = fastest();
    // Without a free surface the level of pressure is free: under tension particles clump.
    closed_ = std::all_of(open_.begin(), open_.end(), [](std::int8_t open) { return open == 0; });
    raised_ = closed_ ? settings.density * fastest_ * fastest_ : 0;
    const double parts = std::ceil(h / limit * (1 - 1e-12));
    if (!(parts <= 1e6))
      throw Error("a step of " + number_text(h) + " s takes the fluid " + number_text(parts) + " sub-steps of " +
                  number_text(limit) + " s: give a smaller dt or sound_speed, or a larger spacing");
    if (corrects_pressure()) gradient_correction_.assign(std::size_t(6 * count()), 0.0);
    report.sub_steps = int(parts);
    for (int k = 0; k < report.sub_steps; ++k) sub_step(scene, h / parts);
    measure_flow();
    report.too_fast = too_fast();
    measure_volume(scene);
  } catch (const Error& error) {
    const std::string cause = too_fast();
    restore_before();
    if (cause.empty()) throw;
    throw Error(std::string(error.what()) + "; " + cause);
  } catch (...) {
    restore_before();
    throw;
  }
  give_forces(scene, h);
}

void Fluid::keep_before() {
  before_.position = position_;
  before_.velocity = velocity_;
  before_.density = density_;
  before_.acceleration = acceleration_;
  before_.force = force_;
  before_.number = number_;
  before_.open = open_;
  before_.known = known_;
  before_.listed = list_.at;
  before_.pose = pose_listed_;
  before_.pressure = pressure_;
  before_.norm = norm_;
  before_.mass = mass_;
  before_.end = end_;
  before_.passed = passed_;
  before_.volume_begin = volume_begin_;
  before_.solid = solid_;
  before_.skins = skins_.state;
}

void Fluid::restore_before() {
  position_ = before_.position;
  velocity_ = before_.velocity;
  density_ = before_.density;
  acceleration_ = before_.acceleration;
  force_ = before_.force;
  number_ = before_.number;
  open_ = before_.open;
  known_ = before_.known;
  list_.at = before_.listed;
  pose_listed_ = before_.pose;
  pressure_ = before_.pressure;
  norm_ = before_.norm;
  mass_ = before_.mass;
  end_ = before_.end;
  passed_ = before_.passed;
  volume_begin_ = before_.volume_begin;
  solid_ = before_.solid;
  skins_.state = before_.skins;
  list_known_ = false;
}

void Fluid::undo(Scene& scene) {
  if (settings.incompressible && !std::exchange(within_, false)) return; // the step failed before the liquid moved
  restore_before();
  put_forces_back(scene);
}

void Fluid::state_restored() {
  known_ = list_.at.size() == position_.size() && !position_.empty();
  list_known_ = false;
  rate_.clear();
  raised_ = 0;
}

std::vector<double> Fluid::in_order(const std::vector<double>& values, int components) const {
  std::vector<double> out(values.size());
  for (std::size_t i = 0; i < number_.size(); ++i)
    std::copy_n(&values[i * std::size_t(components)], components,
                &out[std::size_t(number_[i]) * std::size_t(components)]);
  return out;
}

std::vector<double> Fluid::position() const { return in_order(position_, 3); }
std::vector<double> Fluid::velocity() const { return in_order(velocity_, 3); }
std::vector<double> Fluid::density() const {
  std::vector<double> of = density_;
  for (std::size_t i = 0; i < solid_.size(); ++i) of[i] = fluid_density(i);
  return in_order(of, 1);
}
std::vector<double> Fluid::masses() const {
  return mass_.empty() ? std::vector<double>(density_.size(), mass()) : in_order(mass_, 1);
}
std::vector<double> Fluid::porosity() const {
  if (solid_.empty()) return std::vector<double>(density_.size(), 1.0);
  std::vector<double> out = in_order(solid_, 1);
  for (double& v : out) v = 1 - v;
  return out;
}
std::vector<double> Fluid::pressure() const {
  if (settings.incompressible) return in_order(pressure_, 1);
  std::vector<double> out = density();
  for (double& p : out) p = settings.sound_speed * settings.sound_speed * (p - settings.density);
  return out;
}
std::vector<std::int8_t> Fluid::at_surface() const {
  std::vector<std::int8_t> out(open_.size());
  for (std::size_t i = 0; i < number_.size(); ++i) out[std::size_t(number_[i])] = open_[i];
  return out;
}

} // namespace cairn
