// The incompressible form: the liquid at the middle of the step of the bodies, where contacts are detected; its
// pressure at the end of it, as the impulse that keeps the density.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../base/number_text.hpp"
#include "../base/threads.hpp"
#include "fluid.hpp"
#include "fluid_tiles.hpp"
#include "pressure_solver.hpp"

namespace cairn {

namespace {
constexpr double loose = 0.9;        // fill below which particles at a free surface may come nearer
constexpr double most_way = 2;       // of a particle in a step, over the spacing
constexpr double most_shears = 1000; // sub-steps of viscosity
} // namespace

struct Fluid::Implicit {
  PressureSolver solver;
  std::vector<std::int64_t> first_wall;
  std::vector<std::int32_t> used, near, used_wall, wall_body;
  std::vector<float> pair;
  std::vector<double> wall, centre, shape, load;
  double h = 0, ahead = 0;
  std::vector<double> star, change, bent, divergence, constant, beside, diagonal, of_change, shown;
  std::vector<std::int8_t> filtered;
  // Velocities of bodies (6, n): without pressure and contacts, changes by contacts, with pressure, those that contacts
  // begin from. Impulses on them: before pressure, of it. Velocities that contacts left.
  std::vector<double> free, contact, pressed, given, known, impulse, left;
  std::vector<double> share; // mass and inertia of a body over those with the liquid about it (2, n)
  Array<double> inverse_mass, inverse_inertia;
};

Fluid::Fluid(int dim, const FluidSettings& given) : settings(given), dim_(dim) {}
Fluid::~Fluid() = default;

cairn_fluid_rows Fluid::rows() const {
  Implicit& s = *implicit_;
  cairn_fluid_rows r{};
  r.dim = dim_;
  r.bodies = std::int32_t(bodies_.size());
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
  r.body_of_point = body_of_point_.data();
  r.body_of_plane = body_of_plane_.data();
  r.centre = s.centre.data();
  r.shape = s.shape.data();
  return r;
}

// Rows where the liquid and bodies stand, and which particles are at a free surface.
void Fluid::lay_rows(const Scene& scene) {
  Implicit& s = *implicit_;
  const std::int64_t n = count(), planes = planes_.count();
  s.used.resize(std::size_t(n));
  s.used_wall.resize(std::size_t(n));
  s.near.resize(list_.neighbour.size());
  s.pair.resize(std::size_t(dim_ + 1) * list_.neighbour.size());
  s.first_wall.assign(std::size_t(n + 1), 0);
  for (std::int64_t i = 0; i < n; ++i) { // bodies beside it at most
    std::int64_t most = 0;
    std::int32_t last = -1;
    for (std::int64_t k = list_.first_point[std::size_t(i)]; k < list_.first_point[std::size_t(i + 1)]; ++k) {
      const std::int32_t body = body_of_point_[std::size_t(list_.point[std::size_t(k)])];
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
  s.centre.resize(3 * bodies_.size());
  for (std::size_t k = 0; k < bodies_.size(); ++k) std::copy_n(bodies_[k].position, 3, &s.centre[3 * k]);
  s.shape.resize(std::size_t(3 * (dim_ - 1) * n));
  s.load.resize(s.shape.size());
  open_new_.resize(std::size_t(n));
  pack();
  for (int round = known_ ? 1 : 0; round < 2; ++round) { // neighbours of a free surface are known in the second
    const cairn_fluid f = view(scene);
    const cairn_fluid_rows r = rows();
    each_tile(n, [&](std::int64_t first, std::int64_t last) {
      cairn_fluid_fill_rows(&f, &r, first, last, open_new_.data());
    });
    open_.swap(open_new_);
  }
}

void Fluid::divergence(const std::vector<double>& velocity, const std::vector<double>& of_body,
                       std::vector<double>& out) {
  out.resize(std::size_t(count()));
  const cairn_fluid_rows r = rows();
  each_tile(count(), [&](std::int64_t first, std::int64_t last) {
    cairn_fluid_divergence(&r, first, last, velocity.data(), of_body.data(), out.data());
  });
}

void Fluid::push(const std::vector<double>& p) {
  Implicit& s = *implicit_;
  const cairn_fluid_rows r = rows();
  const std::size_t wide = std::size_t(3 * (dim_ - 1));
  for (std::size_t i = 0; i < s.load.size(); ++i) s.load[i] = p[i / wide] * s.shape[i];
  each_tile(count(), [&](std::int64_t first, std::int64_t last) {
    cairn_fluid_push(&r, s.filtered.data(), first, last, p.data(), s.load.data(), s.change.data(), s.bent.data());
  });
}

// In the order of particles.
void Fluid::impulses_on_bodies(const std::vector<double>& p, std::vector<double>& out) const {
  const Implicit& s = *implicit_;
  out.assign(6 * std::max<std::size_t>(1, bodies_.size()), 0.0);
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

// Viscosity, explicit, in as many parts as it needs, of the liquid and the bodies that it holds.
void Fluid::shear(double h) {
  Implicit& s = *implicit_;
  if (!(settings.viscosity > 0)) return;
  const double length = settings.smoothing * settings.spacing;
  const double parts = std::max(1.0, std::ceil(h * settings.viscosity / (0.125 * length * length * settings.density)));
  if (!(parts <= most_shears))
    throw Error("a step of " + number_text(h) + " s takes " + number_text(parts) +
                " sub-steps of the viscosity of the incompressible fluid, at most " + number_text(most_shears) +
                " are made: give a dt of " + number_text(h * most_shears / parts) +
                " s or less, a smaller viscosity, or a larger spacing");
  const double dt = h / parts, volume = std::pow(settings.spacing, dim_) * settings.depth;
  const cairn_fluid_rows r = rows();
  for (int part = 0; part < int(parts); ++part) {
    each_tile(count(), [&](std::int64_t first, std::int64_t last) {
      cairn_fluid_viscous(&r, settings.viscosity, first, last, s.star.data(), s.free.data(), s.change.data());
    });
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
  }
}

void Fluid::predict(Scene& scene, double h, double ahead) {
  check(scene);
  const Threads threads(settings.threads, 40 * count());
  keep_before();
  load_bodies(scene, h);
  if (!implicit_) implicit_ = std::make_unique<Implicit>();
  Implicit& s = *implicit_;
  s.h = h;
  s.ahead = ahead;
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
  const std::size_t n = std::size_t(count()), bodies = std::max<std::size_t>(1, bodies_.size());
  closed_ = std::all_of(open_.begin(), open_.end(), [](std::int8_t open) { return open == 0; });
  s.change.resize(3 * n);
  s.bent.resize(n);
  s.star = velocity_;
  s.filtered.resize(n);
  s.free.assign(6 * bodies, 0.0);
  s.known.assign(6 * bodies, 0.0);
  s.impulse.assign(6 * bodies, 0.0);
  s.contact.assign(6 * bodies, 0.0);
  // The pressure that gravity adds at points of walls, where the liquid presses.
  const double volume = std::pow(settings.spacing, dim_) * settings.depth;
  std::vector<double> rest(3 * n, 0.0), level(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    s.filtered[i] = closed_ || (pressure_[i] > 0 && open_[i] != 2);
    for (std::size_t c = 0; c < 3; ++c) {
      rest[3 * i + c] = h * scene.gravity[c];
      if (!(period_[c] > 0)) level[i] += settings.density * scene.gravity[c] * position_[3 * i + c];
    }
    if (!closed_ && !(pressure_[i] > 0)) continue;
    for (std::int64_t k = s.first_wall[i]; k < s.first_wall[i] + s.used_wall[i]; ++k) {
      const double* w = &s.wall[std::size_t(16 * k)];
      for (std::size_t c = 0; c < 3; ++c) rest[3 * i + c] += h / settings.density * w[6 + c];
      for (std::size_t c = 0; c < 6; ++c)
        s.known[6 * std::size_t(s.wall_body[std::size_t(k)]) + c] -= h * volume * w[6 + c];
    }
  }
  for (std::size_t i = 0; i < 3 * n; ++i) s.star[i] += 0.5 * rest[i]; // the other half after viscosity
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
      s.contact[6 * k + c] = h * contact_[6 * k + c];
    }
  }
  shear(h);
  for (std::size_t i = 0; i < 3 * n; ++i) s.star[i] += 0.5 * rest[i];
  begin_rows(rest, level);
  add_mass();
  report.passes = report.products = 0;
}

// Right-hand sides and diagonal of the rows: without the bodies' part, and less what the filter leaves of a liquid at
// rest, whose change of velocity is rest [m/s] and whose pressure is level [Pa].
void Fluid::begin_rows(const std::vector<double>& rest, std::vector<double>& level) {
  Implicit& s = *implicit_;
  const std::size_t n = std::size_t(count()), bodies = std::max<std::size_t>(1, bodies_.size());
  const double h = s.h, filter = settings.filter, volume = std::pow(settings.spacing, dim_) * settings.depth;
  push(level);
  const std::vector<double> still(6 * bodies, 0.0);
  divergence(rest, still, s.beside);
  s.diagonal.assign(n, 0.0);
  const double stiff =
      settings.sound_speed > 0 ? 1 / (settings.density * settings.sound_speed * settings.sound_speed * h) : 0;
  for (std::size_t i = 0; i < n; ++i) {
    double& rho = density_[i];
    if (!closed_ && open_[i] == 2) rho = settings.density;
    const double excess = rho / settings.density - 1;
    double wanted = (excess > 0 || closed_ ? settings.correction : 1.0) * excess / h;
    if (settings.sound_speed > 0) wanted = excess / h;
    if (!closed_ && open_[i] == 2) wanted = -std::max(0.0, 1 - fill_[i] / loose) / h;
    s.beside[i] = -wanted - filter * (s.beside[i] + s.bent[i]);
    double whole[3] = {}, square = 0, bent = 0;
    const std::size_t wide = std::size_t(dim_ + 1);
    for (std::int64_t k = list_.first[i]; k < list_.first[i] + s.used[i]; ++k) {
      const float* g = &s.pair[wide * std::size_t(k)];
      for (int c = 0; c < dim_; ++c) {
        whole[c] += g[c];
        square += double(g[c]) * g[c];
      }
      if (s.filtered[i] && s.filtered[std::size_t(s.near[std::size_t(k)])]) bent += g[dim_];
    }
    double of_bodies = 0;
    for (std::int64_t k = s.first_wall[i]; k < s.first_wall[i] + s.used_wall[i]; ++k) {
      const double* w = &s.wall[std::size_t(16 * k)];
      for (int c = 0; c < dim_; ++c) whole[c] += w[c];
      double change[6];
      of_bodies += inverse_of_body(std::size_t(s.wall_body[std::size_t(k)]), w, change);
    }
    for (const double v : whole) square += v * v;
    s.diagonal[i] = (1 - filter) * h / settings.density * square + h * volume * of_bodies +
                    filter * 2 * h / settings.density * bent + stiff;
  }
}

// The mass of the liquid about bodies, as an estimate from below: with that, passes converge. A body displaces its
// volume, and its surface moves the liquid by generalised normals (n, r x n).
void Fluid::add_mass() {
  Implicit& s = *implicit_;
  const double carried = dim_ == 2 ? 0.8 : 0.4; // mass over the displaced: 1 of a cylinder, 1/2 of a sphere
  constexpr double turned = 0.25;               // of that for rotations: shorter waves
  std::vector<double> area(bodies_.size()), wet(bodies_.size()), twist(bodies_.size());
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

void Fluid::press(Scene& scene) {
  Implicit& s = *implicit_;
  const Threads threads(settings.threads, 40 * count());
  const std::size_t n = std::size_t(count());
  std::vector<double> now = s.free;
  for (std::size_t i = 0; i < now.size(); ++i) now[i] += s.contact[i];
  divergence(s.star, now, s.constant);
  std::vector<double> begin(now.size(), 0.0);
  for (std::size_t k = 0; k < bodies_.size(); ++k) std::copy_n(bodies_[k].velocity, 6, &begin[6 * k]);
  divergence(s.star, begin, s.divergence);
  for (std::size_t i = 0; i < n; ++i) {
    s.constant[i] += s.beside[i];
    s.divergence[i] += s.beside[i];
  }
  const double filter = settings.filter, h = s.h;
  const double stiff =
      settings.sound_speed > 0 ? 1 / (settings.density * settings.sound_speed * settings.sound_speed * h) : 0;
  const auto apply = [&](const std::vector<double>& p, std::vector<double>& out) {
    push(p);
    impulses_on_bodies(p, s.of_change);
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
      double change[6];
      inverse_of_body(k, &s.of_change[6 * k], change);
      for (std::size_t c = 0; c < 6; ++c)
        s.of_change[6 * k + c] = change[c] / (1 - filter); // the filter is the liquid's
    }
    divergence(s.change, s.of_change, out);
    for (std::size_t i = 0; i < n; ++i) out[i] = (1 - filter) * out[i] + filter * s.bent[i] + stiff * p[i];
  };
  constexpr double closer = 0.1; // once contacts are known: what the solver leaves would keep passes from converging
  const double enough = settings.tolerance * (report.passes > 0 ? closer : 1);
  PressureSolver::Problem problem{apply,    &s.constant, &s.diagonal,        &s.divergence,
                                  !closed_, enough,      settings.iterations};
  const PressureSolver::Report found = s.solver.solve(problem, pressure_, norm_[0]);
  report.products += found.products;
  report.residual = found.residual;
  ++report.passes;
  for (std::size_t i = 0; i < n; ++i)
    if (!std::isfinite(pressure_[i]))
      throw Error("the pressure of particle " + std::to_string(number_[i]) +
                  " of the fluid is not finite: give a smaller dt");
  impulses_on_bodies(pressure_, s.impulse);
  s.pressed = now;
  s.given.assign(now.size(), 0.0);
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
  return std::sqrt(pull) * s.h + std::max(fastest_, std::sqrt(most));
}

double Fluid::misfit(const Scene& scene, const Array<double>& velocity) {
  Implicit& s = *implicit_;
  const int nd = scene.bodies.dofs();
  double most = 0;
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
  all.inverse_mass.values = s.inverse_mass;
  if (all.inverse_inertia.active) all.inverse_inertia.values = s.inverse_inertia;
  give_forces(scene, s.h);
}

// Without a free surface particles drift to an even spread, away from walls, down the gradient of their concentration:
// a flow gathers them along lines else (Lind et al. 2012).
void Fluid::spread() {
  const Implicit& s = *implicit_;
  const double dx = settings.spacing, most = 0.1 * dx;
  const double way =
      std::min(settings.drift * s.h * fastest_ * settings.smoothing * dx, dx * dx); // beyond, it overshoots
  const std::size_t wide = std::size_t(dim_ + 1);
  for (std::size_t i = 0; i < std::size_t(count()); ++i) {
    if (s.used_wall[i] > 0) continue;
    double slope[3] = {};
    for (std::int64_t k = list_.first[i]; k < list_.first[i] + s.used[i]; ++k)
      for (int c = 0; c < dim_; ++c) slope[c] += double(s.pair[wide * std::size_t(k) + std::size_t(c)]);
    for (int c = 0; c < dim_; ++c) position_[3 * i + std::size_t(c)] += std::clamp(-way * slope[c], -most, most);
  }
}

void Fluid::finish(Scene& scene) {
  Implicit& s = *implicit_;
  const Threads threads(settings.threads, 40 * count());
  put_forces_back(scene);
  const std::size_t n = std::size_t(count());
  push(pressure_);
  std::vector<double> begin(6 * std::max<std::size_t>(1, bodies_.size()), 0.0), of_begin;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    std::copy_n(bodies_[k].velocity, 6, &begin[6 * k]);
    for (std::size_t c = 0; c < 6; ++c) contact_[6 * k + c] = s.contact[6 * k + c] / s.h;
  }
  divergence(velocity_, begin, of_begin);
  for (std::size_t i = 0; i < 3 * n; ++i) velocity_[i] = s.star[i] + s.change[i];
  divergence(velocity_, s.pressed, s.divergence);
  for (std::size_t i = 0; i < n; ++i) density_[i] *= 1 - (s.ahead * of_begin[i] + (s.h - s.ahead) * s.divergence[i]);
  for (std::size_t i = 0; i < 3 * n; ++i) position_[i] += (s.h - s.ahead) * velocity_[i];
  if (closed_) spread();
  report.sub_steps = 1;
  report.speed = fastest();
  report.compression = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (open_[i] != 2) report.compression = std::max(report.compression, std::abs(density_[i] / settings.density - 1));
}

} // namespace cairn
