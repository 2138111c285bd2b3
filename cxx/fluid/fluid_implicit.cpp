// The incompressible form: the liquid at the middle of the step of the bodies, where contacts are detected; its
// pressure at the end of it, as the impulse that keeps the density.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../base/number_text.hpp"
#include "../base/threads.hpp"
#include "fluid_drift.hpp"
#include "fluid_implicit.hpp"

namespace cairn {

namespace {
constexpr double loose = 0.9;  // fill below which particles at a free surface may come nearer
constexpr int few_passes = 12; // by which rigid bodies converge, unless light ones bear others
constexpr double most_way = 2; // of a particle in a step, over the spacing

// Range of the particles whose sums this process makes: number of the first, and of the one after the last.
std::array<std::int64_t, 2> own_particles(const TileShares& shares, const ParticleShares* ranks) {
  if (!ranks) return {0, shares.items()};
  return {shares.first()[std::size_t(ranks->first_local())], shares.first()[std::size_t(ranks->last_local())]};
}
} // namespace

Fluid::Fluid(int dim, const FluidSettings& given) : settings(given), dim_(dim) {}
Fluid::~Fluid() = default;

std::int64_t Fluid::Implicit::bytes() const {
  std::int64_t sum = solver.bytes();
  for (const auto* v : {&wall,       &centre,   &shape,  &load,     &rest,      &level, &star,     &change,  &laplacian,
                        &divergence, &constant, &beside, &diagonal, &of_change, &free,  &contact,  &pressed, &given,
                        &known,      &impulse,  &left,   &now,      &begin,     &later, &of_begin, &slope})
    sum += std::int64_t(8 * v->capacity());
  for (const auto* v : {&used, &near, &used_wall, &wall_body, &body_of_point}) sum += std::int64_t(4 * v->capacity());
  return sum + std::int64_t(8 * first_wall.capacity() + 4 * pair.capacity() + filtered.capacity());
}

cairn_fluid_rows Fluid::rows() const {
  Implicit& s = *implicit_;
  cairn_fluid_rows r{};
  r.dim = dim_;
  r.bodies = std::int32_t(sides());
  r.step = s.h;
  r.density = settings.density;
  r.volume = std::pow(settings.spacing, dim_);
  r.first = list_.first.data();
  r.used = s.used.data();
  r.near = s.near.data();
  r.pair = s.pair.data();
  r.first_wall = s.first_wall.data();
  r.used_wall = s.used_wall.data();
  r.wall_body = s.wall_body.data();
  r.wall = s.wall.data();
  r.body_of_point = s.body_of_point.data();
  r.body_of_plane = body_of_plane_.data();
  r.centre = s.centre.data();
  r.shape = s.shape.data();
  return r;
}

std::size_t Fluid::sides() const { return std::max<std::size_t>(1, bodies_.size() + std::size_t(skins_.count())); }

// Rows where the liquid and bodies stand, and which particles are at a free surface.
void Fluid::lay_rows(const Scene& scene) {
  Implicit& s = *implicit_;
  const std::int64_t n = count(), planes = planes_.count();
  s.used.resize(std::size_t(n));
  s.used_wall.resize(std::size_t(n));
  s.near.resize(list_.neighbour.size());
  s.pair.resize(std::size_t(dim_ + 1) * list_.neighbour.size());
  s.first_wall.assign(std::size_t(n + 1), 0);
  s.body_of_point = body_of_point_;
  s.centre.resize(3 * sides());
  for (std::size_t k = 0; k < bodies_.size(); ++k) std::copy_n(bodies_[k].position, 3, &s.centre[3 * k]);
  for (std::size_t p = 0; p < std::size_t(skins_.count()); ++p) { // they have no arm, and no spin
    s.body_of_point.push_back(std::int32_t(bodies_.size() + p));
    std::copy_n(skin_records() + cairn_fluid_surface_record * p, 3, &s.centre[3 * (bodies_.size() + p)]);
  }
  for (std::int64_t i = 0; i < n; ++i) { // bodies beside it at most
    std::int64_t most = 0;
    std::int32_t last = -1;
    for (std::int64_t k = list_.first_point[std::size_t(i)]; k < list_.first_point[std::size_t(i + 1)]; ++k) {
      const std::int32_t body = s.body_of_point[std::size_t(list_.point[std::size_t(k)])];
      most += body != last;
      last = body;
    }
    for (std::int64_t p = 0; p < planes; ++p) {
      const double* plane = &plane_[std::size_t(cairn_fluid_plane_record * p)];
      double high = 0;
      for (int c = 0; c < 3; ++c) high += (position_[std::size_t(3 * i + c)] - plane[c]) * plane[3 + c];
      most += high < reach();
    }
    s.first_wall[std::size_t(i + 1)] = s.first_wall[std::size_t(i)] + most;
  }
  s.wall_body.resize(std::size_t(s.first_wall.back()));
  s.wall.resize(std::size_t(cairn_fluid_wall_record * s.first_wall.back()));
  s.shape.resize(std::size_t(3 * (dim_ - 1) * n));
  s.load.resize(s.shape.size());
  open_new_.resize(std::size_t(n));
  pack();
  for (int round = known_ ? 1 : 0; round < 2; ++round) { // neighbours of a free surface are known in the second
    const cairn_fluid f = view(scene);
    const cairn_fluid_rows r = rows();
    of_particles_.each_tile(
        [&](std::int64_t first, std::int64_t last) { cairn_fluid_fill_rows(&f, &r, first, last, open_new_.data()); });
    tell(open_new_, 1, of_particles_.first());
    open_.swap(open_new_);
  }
  // Each rank keeps the rows of its own particles for its products. Rows of walls go to all ranks, since each of them
  // adds up the impulses on all bodies, in the order of particles, so that bits are the same.
  tell(s.shape, std::size_t(3 * (dim_ - 1)), of_particles_.first());
  tell(s.used_wall, 1, of_particles_.first());
  s.wall_of_ranks.clear();
  for (const std::int64_t first : of_particles_.first()) s.wall_of_ranks.push_back(s.first_wall[std::size_t(first)]);
  tell(s.wall_body, 1, s.wall_of_ranks);
  tell(s.wall, cairn_fluid_wall_record, s.wall_of_ranks);
}

void Fluid::divergence(const std::vector<double>& velocity, const std::vector<double>& of_body,
                       std::vector<double>& out) {
  out.resize(std::size_t(count()));
  const cairn_fluid_rows r = rows();
  of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
    cairn_fluid_divergence(&r, first, last, velocity.data(), of_body.data(), out.data());
  });
  tell(out, 1, of_particles_.first());
}

void Fluid::push(const std::vector<double>& p) {
  Implicit& s = *implicit_;
  const cairn_fluid_rows r = rows();
  const std::size_t wide = std::size_t(3 * (dim_ - 1));
  for (std::size_t i = 0; i < s.load.size(); ++i) s.load[i] = p[i / wide] * s.shape[i];
  of_particles_.each_tile([&](std::int64_t first, std::int64_t last) {
    cairn_fluid_push(&r, s.filtered.data(), first, last, p.data(), s.load.data(), s.change.data(), s.laplacian.data());
  });
  tell(s.change, 3, of_particles_.first());
  tell(s.laplacian, 1, of_particles_.first());
}

// In the order of particles.
void Fluid::impulses_on_bodies(const std::vector<double>& p, std::vector<double>& out) const {
  const Implicit& s = *implicit_;
  out.assign(6 * sides(), 0.0);
  for (std::size_t i = 0; i < p.size(); ++i)
    for (std::int64_t k = s.first_wall[i]; k < s.first_wall[i] + s.used_wall[i]; ++k)
      for (std::size_t c = 0; c < 6; ++c)
        out[6 * std::size_t(s.wall_body[std::size_t(k)]) + c] += p[i] * s.wall[std::size_t(16 * k) + c];
  const double factor = s.h * std::pow(settings.spacing, dim_) * settings.depth;
  for (double& v : out) v *= factor;
}

double Fluid::inverse_of_body(std::size_t body, const double* impulse, double* change) const {
  const Body& b = bodies_[body];
  double work = 0;
  for (int c = 0; c < 3; ++c) {
    change[c] = b.inverse_mass[c] * impulse[c];
    change[3 + c] = 0;
    for (int l = 0; l < 3; ++l) change[3 + c] += b.inverse_inertia[3 * c + l] * impulse[3 + l];
    work += change[c] * impulse[c] + change[3 + c] * impulse[3 + c];
  }
  return work;
}

// The part of points of meshes in an array over sides.
double* Fluid::tail(std::vector<double>& of_sides) const { return of_sides.data() + 6 * bodies_.size(); }

void Fluid::velocities_begin(std::vector<double>& out) const {
  out.assign(6 * sides(), 0.0);
  for (std::size_t k = 0; k < bodies_.size(); ++k) std::copy_n(bodies_[k].velocity, 6, &out[6 * k]);
  if (meets_meshes()) skins_.show_begin(tail(out));
}

// Free velocities of points of meshes, with the impulses that are known.
void Fluid::free_skins(const Scene& scene) {
  if (!meets_meshes()) return;
  Implicit& s = *implicit_;
  skins_.renew_free(scene);
  s.of_change.resize(6 * sides());
  skins_.show_free(tail(s.free));
  skins_.respond(tail(s.known), tail(s.of_change));
  for (std::size_t i = 6 * bodies_.size(); i < s.free.size(); ++i) s.free[i] += s.of_change[i];
}

void Fluid::predict(Scene& scene, double h, double ahead, MeshSet& meshes) {
  check(scene);
  const Threads threads(settings.threads, 40 * count());
  keep_before();
  within_ = true;
  load_bodies(scene, h);
  if (meets_meshes()) skins_.stand(scene, meshes, h);
  if (!implicit_) implicit_ = std::make_unique<Implicit>();
  Implicit& s = *implicit_;
  s.h = h;
  s.ahead = ahead;
  move_ahead(scene);
  begin_changes(scene);
  damp_noise();
  free_bodies(scene);
  free_skins(scene);
  if (settings.viscosity > 0) shear_at_middle(scene);
  for (std::size_t i = 0; i < s.star.size() && !(settings.viscosity > 0); ++i) s.star[i] += s.rest[i];
  if (meets_meshes()) skins_.take_known(scene, tail(s.known));
  begin_rows();
  add_mass();
  report.passes = report.products = 0;
}

// A particle that meets no other one would hide it: pressures would not tell of it.
void Fluid::refuse_not_finite() const {
  for (std::size_t i = 0; i < velocity_.size(); ++i)
    if (!std::isfinite(velocity_[i]))
      throw Error("the velocity of particle " + std::to_string(number_[i / 3]) + " of the fluid along axis " +
                  std::to_string(i % 3) + " is " + number_text(velocity_[i]) +
                  " m/s: begin from finite velocities, or restore a checkpoint from before");
}

// To where contacts are detected.
void Fluid::move_ahead(const Scene& scene) {
  const double h = implicit_->h, ahead = implicit_->ahead;
  refuse_not_finite();
  fastest_ = fastest();
  if (!(fastest_ * h <= most_way * settings.spacing))
    throw Error("a step of " + number_text(h) + " s moves the fluid by " +
                number_text(fastest_ * h / settings.spacing) + " of its spacing: give a dt of " +
                number_text(0.4 * settings.spacing / fastest_) + " s");
  for (std::size_t i = 0; i < position_.size(); ++i) position_[i] += ahead * velocity_[i];
  place_surfaces();
  if (known_ && !list_known_) renew_as_listed();
  if (list_is_old()) renew_list();
  lay_rows(scene);
  measure_volume(scene);
  known_ = true;
  closed_ = std::all_of(open_.begin(), open_.end(), [](std::int8_t open) { return open == 0; });
}

// What gravity changes: velocities of particles, and the pressure that it adds at points of walls, where the liquid
// presses.
void Fluid::begin_changes(const Scene& scene) {
  Implicit& s = *implicit_;
  const std::size_t n = std::size_t(count());
  s.change.resize(3 * n);
  s.laplacian.resize(n);
  s.star = velocity_;
  s.filtered.resize(n);
  for (auto* v : {&s.free, &s.known, &s.impulse, &s.contact}) v->assign(6 * sides(), 0.0);
  s.rest.assign(3 * n, 0.0);
  s.level.assign(n, 0.0);
  const double h = s.h, volume = std::pow(settings.spacing, dim_) * settings.depth;
  for (std::size_t i = 0; i < n; ++i) {
    s.filtered[i] = closed_ || (pressure_[i] > 0 && open_[i] != 2);
    for (std::size_t c = 0; c < 3; ++c) {
      s.rest[3 * i + c] = h * scene.gravity[c];
      if (!(period_[c] > 0)) s.level[i] += settings.density * scene.gravity[c] * position_[3 * i + c];
    }
    if (!closed_ && !(pressure_[i] > 0)) continue;
    for (std::int64_t k = s.first_wall[i]; k < s.first_wall[i] + s.used_wall[i]; ++k) {
      const double* w = &s.wall[std::size_t(16 * k)];
      for (std::size_t c = 0; c < 3; ++c) s.rest[3 * i + c] += h / settings.density * w[6 + c];
      for (std::size_t c = 0; c < 6; ++c)
        s.known[6 * std::size_t(s.wall_body[std::size_t(k)]) + c] -= h * volume * w[6 + c];
    }
  }
}

// Velocities of bodies without pressure and contacts, and changes by contacts as in the last step.
void Fluid::free_bodies(const Scene& scene) {
  Implicit& s = *implicit_;
  const Bodies& all = scene.bodies;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    if (b.at < 0) continue;
    for (int c = 0; c < dim_; ++c) s.free[6 * k + std::size_t(c)] = all.velocity_free[b.at][c];
    for (int c = dim_; c < all.dofs(); ++c) s.free[6 * k + std::size_t(dim_ == 2 ? 5 : c)] = all.velocity_free[b.at][c];
    double change[6];
    inverse_of_body(k, &s.known[6 * k], change);
    for (std::size_t c = 0; c < 6; ++c) {
      s.free[6 * k + c] += change[c];
      s.contact[6 * k + c] = s.h * contact_[6 * k + c];
    }
  }
}

// Right-hand sides and diagonal of the rows: without the bodies' part, and less what the filter leaves of a liquid at
// rest.
void Fluid::begin_rows() {
  Implicit& s = *implicit_;
  const std::size_t n = std::size_t(count());
  const double h = s.h, filter = settings.filter, stiff = stiffness(),
               volume = std::pow(settings.spacing, dim_) * settings.depth;
  push(s.level);
  s.now.assign(6 * sides(), 0.0); // bodies at rest
  divergence(s.rest, s.now, s.beside);
  s.diagonal.assign(n, 0.0);
  const auto [own, behind] = own_particles(of_particles_, ranks_.get());
  for (std::size_t i = 0; i < n; ++i) {
    double& rho = density_[i];
    if (!closed_ && open_[i] == 2) rho = settings.density;
    const double excess = rho / settings.density - 1;
    double wanted = (excess > 0 || closed_ ? settings.correction : 1.0) * excess / h;
    if (settings.sound_speed > 0) wanted = excess / h;
    if (!closed_ && open_[i] == 2) wanted = -std::max(0.0, 1 - fill_[i] / loose) / h;
    s.beside[i] = -wanted - filter * (s.beside[i] + s.laplacian[i]);
    if (std::int64_t(i) < own || std::int64_t(i) >= behind) continue;
    double whole[3] = {}, square = 0, laplacian = 0;
    const std::size_t wide = std::size_t(dim_ + 1);
    for (std::int64_t k = list_.first[i]; k < list_.first[i] + s.used[i]; ++k) {
      const float* g = &s.pair[wide * std::size_t(k)];
      for (int c = 0; c < dim_; ++c) {
        whole[c] += g[c];
        square += double(g[c]) * g[c];
      }
      if (s.filtered[i] && s.filtered[std::size_t(s.near[std::size_t(k)])]) laplacian += g[dim_];
    }
    double of_bodies = 0;
    for (std::int64_t k = s.first_wall[i]; k < s.first_wall[i] + s.used_wall[i]; ++k) {
      const double* w = &s.wall[std::size_t(16 * k)];
      for (int c = 0; c < dim_; ++c) whole[c] += w[c];
      const auto body = std::size_t(s.wall_body[std::size_t(k)]);
      double change[6];
      if (body < bodies_.size()) of_bodies += inverse_of_body(body, w, change); // of meshes it gains no product
    }
    for (const double v : whole) square += v * v;
    s.diagonal[i] = (1 - filter) * h / settings.density * square + h * volume * of_bodies +
                    filter * 2 * h / settings.density * laplacian + stiff;
  }
  tell(s.diagonal, 1, of_particles_.first());
}

// The mass of the liquid about bodies, as an estimate from below: with that, passes converge. A body displaces its
// volume, and its surface moves the liquid by generalised normals (n, r x n).
void Fluid::add_mass() {
  Implicit& s = *implicit_;
  const double carried = dim_ == 2 ? 0.8 : 0.4; // mass over the displaced: 1 of a cylinder, 1/2 of a sphere
  constexpr double turned = 0.25;               // of that for rotations: shorter waves
  auto &area = s.area, &wet = s.wet, &twist = s.twist;
  for (auto* v : {&area, &wet, &twist}) v->assign(bodies_.size(), 0.0);
  for (std::size_t b = 0; b < body_of_point_.size(); ++b) {
    if (points_.depth[b] >= settings.spacing) continue;
    const std::size_t k = std::size_t(body_of_point_[b]);
    const double *x = &points_.offset[3 * b], *m = &points_.normal[3 * b], size = points_.volume[b] / settings.spacing;
    area[k] += size;
    if (list_.first_of_point[b] < list_.first_of_point[b + 1]) wet[k] += size;
    const double t[3] = {x[1] * m[2] - x[2] * m[1], x[2] * m[0] - x[0] * m[2], x[0] * m[1] - x[1] * m[0]};
    twist[k] += size * (t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
  }
  s.share.assign(2 * std::max<std::size_t>(1, bodies_.size()), 1.0);
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    if (b.at < 0 || !(area[k] > 0) || !(b.volume > 0)) continue;
    const double mass = carried * settings.density * b.volume * settings.depth * wet[k] / area[k];
    const double inertia = turned * mass * twist[k] / (area[k] / dim_) / (dim_ == 2 ? 1 : 3);
    const double light = std::max({b.inverse_mass[0], b.inverse_mass[1], b.inverse_mass[2]});
    const double easy = std::max({b.inverse_inertia[0], b.inverse_inertia[4], b.inverse_inertia[8]});
    s.share[2 * k] = 1 / (1 + mass * light);
    s.share[2 * k + 1] = 1 / (1 + inertia * easy);
  }
}

// A mesh lighter than the liquid about it is pressed on contacts by the mass of the liquid, of which these know
// nothing: passes alone would converge by the ratio of that mass to the sum of both.
void Fluid::mix_contacts(bool other_matrices) {
  Implicit& s = *implicit_;
  const std::size_t nodes = skins_.changes_by_contacts().size(), of_bodies = 6 * bodies_.size();
  s.mixed.resize(nodes + of_bodies);
  std::copy_n(skins_.changes_by_contacts().data(), nodes, s.mixed.data());
  std::copy_n(s.contact.data(), of_bodies, s.mixed.data() + nodes);
  if (report.passes == 0 || other_matrices || (!meets_meshes() && report.passes < few_passes)) {
    s.mixing.forget();
  } else {
    s.mixed_weight.assign(s.mixed.size(), 1.0);
    for (std::size_t i = 0; i < of_bodies; ++i)
      if (i % 6 >= 3) s.mixed_weight[nodes + i] = bodies_[i / 6].reach * bodies_[i / 6].reach;
    s.mixing.next(s.mixed_weight, s.mixed_from, s.mixed);
    std::copy_n(s.mixed.data(), nodes, skins_.changes_by_contacts().data());
    std::copy_n(s.mixed.data() + nodes, of_bodies, s.contact.data());
  }
  s.mixed_from = s.mixed;
}

void Fluid::press(Scene& scene, bool other_matrices) {
  Implicit& s = *implicit_;
  const Threads threads(settings.threads, 40 * count());
  mix_contacts(other_matrices);
  if (meets_meshes()) {
    skins_.renew_free(scene);
    skins_.show_free(tail(s.free));
    skins_.show_contacts(tail(s.contact));
  }
  s.now = s.free;
  for (std::size_t i = 0; i < s.now.size(); ++i) s.now[i] += s.contact[i];
  divergence(s.star, s.now, s.constant);
  velocities_begin(s.begin);
  divergence(s.star, s.begin, s.divergence);
  for (std::size_t i = 0; i < s.beside.size(); ++i) {
    s.constant[i] += s.beside[i];
    s.divergence[i] += s.beside[i];
  }
  constexpr double closer = 0.1; // once contacts are known: what the solver leaves would keep passes from converging
  const double enough = settings.tolerance * (report.passes > 0 ? closer : 1);
  PressureSolver::Problem problem{[this](const std::vector<double>& p, std::vector<double>& out) { product(p, out); },
                                  &s.constant,
                                  &s.diagonal,
                                  &s.divergence,
                                  !closed_,
                                  enough,
                                  settings.iterations};
  const PressureSolver::Report found = s.solver.solve(problem, pressure_, norm_[0]);
  report.products += found.products;
  report.residual = found.residual;
  ++report.passes;
  for (std::size_t i = 0; i < pressure_.size(); ++i)
    if (!std::isfinite(pressure_[i]))
      throw Error("the pressure of particle " + std::to_string(number_[i]) +
                  " of the fluid is not finite: give a smaller dt");
  impulses_on_bodies(pressure_, s.impulse);
  if (meets_meshes()) skins_.press(scene, tail(s.impulse));
  give_pressed(scene);
}

// Rows times pressures: what these change of the divergence.
void Fluid::product(const std::vector<double>& p, std::vector<double>& out) {
  Implicit& s = *implicit_;
  const double filter = settings.filter, stiff = stiffness();
  push(p);
  impulses_on_bodies(p, s.of_change);
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    double change[6];
    inverse_of_body(k, &s.of_change[6 * k], change);
    for (std::size_t c = 0; c < 6; ++c) s.of_change[6 * k + c] = change[c] / (1 - filter); // the filter is the liquid's
  }
  if (meets_meshes()) {
    skins_.respond(tail(s.of_change), tail(s.of_change));
    for (std::size_t i = 6 * bodies_.size(); i < s.of_change.size(); ++i) s.of_change[i] /= 1 - filter;
  }
  divergence(s.change, s.of_change, out);
  for (std::size_t i = 0; i < p.size(); ++i) out[i] = (1 - filter) * out[i] + filter * s.laplacian[i] + stiff * p[i];
}

// Of a liquid that sound crosses in a finite time: change of its divergence by a pressure [1/(Pa s)].
double Fluid::stiffness() const {
  const double c = settings.sound_speed;
  return c > 0 ? 1 / (settings.density * c * c * implicit_->h) : 0;
}

// Velocities of bodies under the pressure, and those that contacts begin from, with inverse masses for these.
void Fluid::give_pressed(Scene& scene) {
  Implicit& s = *implicit_;
  s.pressed = s.now;
  s.given.assign(s.now.size(), 0.0);
  Bodies& all = scene.bodies;
  const bool first = report.passes == 1;
  if (first) {
    s.inverse_mass = all.inverse_mass.values;
    if (all.inverse_inertia.active) s.inverse_inertia = all.inverse_inertia.values;
  }
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    double change[6];
    inverse_of_body(k, &s.impulse[6 * k], change);
    const Body& b = bodies_[k];
    for (std::size_t c = 0; c < 6; ++c) {
      s.pressed[6 * k + c] += change[c];
      const double share = s.share[2 * k + c / 3];
      s.given[6 * k + c] = share * (s.free[6 * k + c] + change[c]) + (1 - share) * s.pressed[6 * k + c];
    }
    if (b.at < 0) continue;
    for (int c = 0; c < all.dofs(); ++c) {
      all.velocity_free[b.at][c] = s.given[6 * k + std::size_t(dim_ == 2 && c == 2 ? 5 : c)];
      if (first) all.inverse_mass[b.at][c] *= s.share[2 * k + (c >= dim_)];
    }
    if (first && all.inverse_inertia.active)
      for (int c = 0; c < 6; ++c) all.inverse_inertia[b.at][c] *= s.share[2 * k + 1];
  }
}

double Fluid::scale_of_speed(const Scene& scene) const {
  const Implicit& s = *implicit_;
  double pull = 0, most = 0;
  for (const double g : scene.gravity) pull += g * g;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) square += s.pressed[6 * k + c] * s.pressed[6 * k + c];
    most = std::max(most, square);
  }
  const double of_meshes = meets_meshes() ? skins_.speed() : 0;
  return std::sqrt(pull) * s.h + std::max({fastest_, std::sqrt(most), of_meshes});
}

double Fluid::misfit(const Scene& scene, const Array<double>& velocity) {
  Implicit& s = *implicit_;
  const int nd = scene.bodies.dofs();
  double most = meets_meshes() ? skins_.take_contacts() : 0;
  s.left = s.pressed;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    if (b.at < 0) continue;
    double way = 0, turn = 0;
    for (int c = 0; c < nd; ++c) {
      const std::size_t at = 6 * k + std::size_t(dim_ == 2 && c == 2 ? 5 : c);
      const double v = velocity[std::size_t(nd * b.at + c)], off = v - s.pressed[at];
      s.left[at] = v;
      (at % 6 < 3 ? way : turn) += off * off;
      s.contact[at] = (v - s.given[at]) / s.share[2 * k + (at % 6) / 3];
    }
    if (s.share[2 * k] < 1) most = std::max(most, std::sqrt(way) + b.reach * std::sqrt(turn)); // others meet no liquid
  }
  const double scale = scale_of_speed(scene);
  return report.misfit = scale > 0 ? most / scale : 0;
}

// Bodies get the sum of both impulses, to rounding; on light ones, where they cancel, what contacts left.
void Fluid::settle(Scene& scene) {
  Implicit& s = *implicit_;
  constexpr double light = 0.5; // share of its own in the mass that contacts see
  Bodies& all = scene.bodies;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    Body& b = bodies_[k];
    double change[6];
    inverse_of_body(k, &s.impulse[6 * k], change);
    const bool by_contacts = s.share[2 * k] < light;
    for (std::size_t c = 0; c < 6; ++c) {
      b.impulse[c] = s.known[6 * k + c] + s.impulse[6 * k + c];
      s.pressed[6 * k + c] = by_contacts ? s.left[6 * k + c] : s.free[6 * k + c] + change[c] + s.contact[6 * k + c];
    }
    if (b.at < 0 || by_contacts || !(s.share[2 * k] < 1)) continue;
    for (int c = 0; c < all.dofs(); ++c)
      all.velocity[b.at][c] = s.pressed[6 * k + std::size_t(dim_ == 2 && c == 2 ? 5 : c)];
  }
  if (meets_meshes()) skins_.show_now(scene, tail(s.pressed));
  all.inverse_mass.values = s.inverse_mass;
  if (all.inverse_inertia.active) all.inverse_inertia.values = s.inverse_inertia;
  give_forces(scene, s.h);
}

// Without a free surface particles drift to an even spread, away from walls, down the gradient of their concentration:
// a flow gathers them along lines else (Lind et al. 2012).
void Fluid::spread() {
  const Implicit& s = *implicit_;
  const double dx = settings.spacing;
  const double way =
      std::min(settings.drift * s.h * fastest_ * settings.smoothing * dx, dx * dx); // beyond, it overshoots
  const std::size_t wide = std::size_t(dim_ + 1);
  const auto [own, behind] = own_particles(of_particles_, ranks_.get());
  for (auto i = std::size_t(own); i < std::size_t(behind); ++i) {
    if (s.used_wall[i] > 0) continue;
    double slope[3] = {};
    for (std::int64_t k = list_.first[i]; k < list_.first[i] + s.used[i]; ++k)
      for (int c = 0; c < dim_; ++c) slope[c] += double(s.pair[wide * std::size_t(k) + std::size_t(c)]);
    for (int c = 0; c < dim_; ++c) position_[3 * i + std::size_t(c)] += drift_within(-way * slope[c], dx);
  }
  tell(position_, 3, of_particles_.first());
}

void Fluid::finish(Scene& scene) {
  Implicit& s = *implicit_;
  const Threads threads(settings.threads, 40 * count());
  put_forces_back(scene);
  within_ = false;
  const std::size_t n = std::size_t(count());
  push(pressure_);
  velocities_begin(s.begin);
  for (std::size_t i = 0; i < contact_.size(); ++i) contact_[i] = s.contact[i] / s.h;
  skins_.end(s.h);
  divergence(velocity_, s.begin, s.of_begin);
  for (std::size_t i = 0; i < 3 * n; ++i) velocity_[i] = s.star[i] + s.change[i];
  divergence(velocity_, s.pressed, s.divergence);
  for (std::size_t i = 0; i < n; ++i) density_[i] *= 1 - (s.ahead * s.of_begin[i] + (s.h - s.ahead) * s.divergence[i]);
  for (std::size_t i = 0; i < 3 * n; ++i) position_[i] += (s.h - s.ahead) * velocity_[i];
  if (closed_) spread();
  report.sub_steps = 1;
  report.speed = fastest();
  report.compression = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (open_[i] != 2) report.compression = std::max(report.compression, std::abs(density_[i] / settings.density - 1));
}

} // namespace cairn
