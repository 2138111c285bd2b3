// Bodies as the liquid meets them: their motion within the step, the points of their surfaces, the forces on them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../base/number_text.hpp"
#include "../base/vectors.hpp"
#include "../bodies/rigid_motion.hpp"
#include "../contacts/body_axes.hpp"
#include "fluid.hpp"
#include "fluid_turning.hpp"

namespace cairn {

// Bodies as they stand, and the accelerations that the liquid does not give them: gravity, forces, and that part of the
// last step's contacts that was there in the step before too.
void Fluid::load_bodies(const Scene& scene, double h) {
  const Bodies& all = scene.bodies;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    Body& b = bodies_[k];
    b.at = scene.find_body(b.id);
    std::fill_n(b.impulse, 6, 0.0);
    std::fill_n(b.belt, 6, 0.0);
    if (b.at < 0) continue;
    const int nd = all.dofs();
    const auto wide = [&](const double* from, double* to) { // (3 | 6) to six
      std::fill_n(to, 6, 0.0);
      for (int c = 0; c < dim_; ++c) to[c] = from[c];
      for (int c = dim_; c < nd; ++c) to[dim_ == 2 ? 5 : c] = from[c];
    };
    std::fill_n(b.position, 3, 0.0);
    std::copy_n(all.position[b.at], dim_, b.position);
    wide(all.velocity[b.at], b.velocity);
    const Rotation turn = all.rotation.active ? rotation_of(dim_, all.rotation[b.at]) : upright;
    std::copy(turn.begin(), turn.end(), b.turn);
    if (all.surface_velocity.active) {
      const double* own = all.surface_velocity[b.at];
      to_space_axes(all, dim_, b.at, own, b.belt);
      dim_ == 2 ? void(b.belt[5] = own[2]) : to_space_axes(all, 3, b.at, own + 3, b.belt + 3);
    }
    const bool driven = all.driven.active;
    const int mask = driven ? *all.driven[b.at] : 0;
    double force[6] = {}, target[6] = {};
    if (all.force.active) wide(all.force[b.at], force);
    if (all.driven_velocity.active) wide(all.driven_velocity[b.at], target);
    const double m = *all.mass[b.at];
    double inverse[3]; // of the inertia
    for (int c = 0; c < 3; ++c) {
      const double own = dim_ == 2 ? *all.inertia[b.at] : all.inertia[b.at][c];
      inverse[c] = std::isfinite(own) && own > 0 ? 1 / own : 0;
      if (dim_ == 2 && c < 2) inverse[c] = 0;
      b.inverse_mass[c] = std::isfinite(m) && !(mask >> c & 1) && c < dim_ ? 1 / m : 0;
    }
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int l = 0; l < 3; ++l) sum += b.turn[3 * r + l] * inverse[l] * b.turn[3 * c + l];
        const bool held = dim_ == 2 ? (mask >> 2 & 1) != 0 : (mask >> (3 + r) & 1) || (mask >> (3 + c) & 1);
        b.inverse_inertia[3 * r + c] = held ? 0 : sum;
      }
    for (int c = 0; c < 6; ++c) {
      const double last = contact_[6 * k + std::size_t(c)], before = contact_before_[6 * k + std::size_t(c)];
      const double kept = last * before <= 0 ? 0 : std::abs(last) < std::abs(before) ? last : before;
      b.kept[c] = kept;
      const int dof = dim_ == 3 ? c : c < 2 ? c : 2;
      const bool is_driven = (mask >> dof & 1) && (dim_ == 3 || c < 2 || c == 5);
      if (is_driven)
        b.constant[c] = (target[c] - b.velocity[c]) / h;
      else if (c < 3)
        b.constant[c] =
            b.inverse_mass[c] * force[c] + (b.inverse_mass[c] > 0 ? scene.gravity[std::size_t(c)] : 0) + kept;
      else
        b.constant[c] = kept + b.inverse_inertia[3 * (c - 3)] * force[3] +
                        b.inverse_inertia[3 * (c - 3) + 1] * force[4] + b.inverse_inertia[3 * (c - 3) + 2] * force[5];
    }
  }
}

void Fluid::set_skins(FluidSkin points, std::vector<double> size) {
  skins_.set(dim_, std::move(points), std::move(size));
  burden_step_ = 0;
  list_known_ = false;
  list_.at.clear();
}

// Matrices of linear bodies are those of the step alone.
void Fluid::load_meshes(Scene& scene, const FluidStep& step) {
  skins_.load(scene, step);
  const bool same = step.meshes && step.meshes->linear() && step.scheme.h == burden_step_;
  if (same) return;
  burden_ = skins_.burden(settings.density, settings.smoothing * settings.spacing, settings.spacing, settings.depth);
  burden_step_ = step.scheme.h;
}

// Half a kick of all.
void Fluid::accelerate(double dt) {
  const auto n = std::int64_t(velocity_.size());
#pragma omp parallel for schedule(static)
  for (std::int64_t i = 0; i < n; ++i) velocity_[std::size_t(i)] += 0.5 * dt * acceleration_[std::size_t(i)];
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    Body& b = bodies_[k];
    if (b.at < 0) continue;
    const double* f = &force_[6 * k];
    for (int c = 0; c < 3; ++c) {
      b.velocity[c] += 0.5 * dt * (b.inverse_mass[c] * f[c] + b.constant[c]);
      double spin = b.constant[3 + c];
      for (int l = 0; l < 3; ++l) spin += b.inverse_inertia[3 * c + l] * f[3 + l];
      b.velocity[3 + c] += 0.5 * dt * spin;
    }
    for (int c = 0; c < 6; ++c) b.impulse[c] += 0.5 * dt * f[c];
  }
  skins_.accelerate(dt);
}

void Fluid::move_bodies(double dt) {
  skins_.move(dt);
  for (Body& b : bodies_) {
    if (b.at < 0) continue;
    for (int c = 0; c < 3; ++c) b.position[c] += dt * b.velocity[c];
    const double* w = b.velocity + 3;
    const double speed = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    if (!(speed > 0)) continue;
    const double s = std::sin(speed * dt) / speed, half = std::sin(0.5 * speed * dt) / speed, c = 2 * half * half;
    double old[9]; // Rodrigues' formula
    std::copy_n(b.turn, 9, old);
    for (int j = 0; j < 3; ++j) {
      const double x[3] = {old[j], old[3 + j], old[6 + j]};
      const double cross[3] = {w[1] * x[2] - w[2] * x[1], w[2] * x[0] - w[0] * x[2], w[0] * x[1] - w[1] * x[0]};
      const double twice[3] = {w[1] * cross[2] - w[2] * cross[1], w[2] * cross[0] - w[0] * cross[2],
                               w[0] * cross[1] - w[1] * cross[0]};
      for (int r = 0; r < 3; ++r) b.turn[3 * r + j] = x[r] + s * cross[r] + c * twice[r];
    }
  }
}

// Root of the mass of the liquid in a layer about a body over the least mass that this sets against it, 1 at least.
double Fluid::lightness(const Body& body) const {
  if (body.at < 0 || body.surface == 0) return 1;
  const double around = settings.density * body.surface * settings.smoothing * settings.spacing * settings.depth;
  double lightest = 0;
  for (int k = 0; k < 3; ++k) {
    lightest = std::max(lightest, body.inverse_mass[k]);
    lightest = std::max(lightest, body.inverse_inertia[4 * k] * body.seen * body.seen);
  }
  return std::sqrt(std::max(1.0, around * lightest));
}

// Names the body beside the liquid whose surface moves faster than sound, which the liquid cannot follow.
std::string Fluid::too_fast() const {
  double most = settings.sound_speed;
  std::string text;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    const auto meets = [](double f) { return f < 0 || f > 0; };
    if (b.at < 0 || b.reach == 0 || std::none_of(&force_[6 * k], &force_[6 * k] + 6, meets)) continue;
    double way = 0, turn = 0;
    for (int c = 0; c < 3; ++c) {
      way += b.velocity[c] * b.velocity[c];
      turn += b.velocity[3 + c] * b.velocity[3 + c];
    }
    const double speed = std::sqrt(way) + b.seen * std::sqrt(turn);
    if (speed <= most) continue;
    most = speed;
    text = "body " + std::to_string(b.id) + " moves at " + number_text(std::sqrt(way)) + " m/s and spins at " +
           number_text(std::sqrt(turn)) + " rad/s, faster than the sound of the fluid about it, " +
           number_text(settings.sound_speed) +
           " m/s: give a smaller dt, a heavier body, cn.fluid(sound_speed=...) ten times the greatest speed, or "
           "cn.fluid(incompressible=True)";
  }
  return text;
}

// Velocity of a place at a lever from the centre of a body, by velocity and spin (6).
static void velocity_at(const double* motion, const double* lever, double* out) {
  std::copy_n(motion, 3, out);
  add_cross(motion + 3, lever, out);
}

// Points of surfaces and half-spaces where their bodies are.
void Fluid::place_surfaces() {
  const auto turned = [](const Body& b, const double* x, double* to) {
    for (int r = 0; r < 3; ++r) to[r] = b.turn[3 * r] * x[0] + b.turn[3 * r + 1] * x[1] + b.turn[3 * r + 2] * x[2];
  };
  const std::int64_t n = points_.count();
  surface_.resize(std::size_t(cairn_fluid_surface_record * all_points()));
#pragma omp parallel for schedule(static) if (n > 4096)
  for (std::int64_t i = 0; i < n; ++i) {
    double* to = &surface_[std::size_t(cairn_fluid_surface_record * i)];
    const Body& b = bodies_[std::size_t(body_of_point_[std::size_t(i)])];
    double arm[3];
    turned(b, &points_.offset[std::size_t(3 * i)], arm);
    turned(b, &points_.normal[std::size_t(3 * i)], to + 6);
    const double centre = points_.centre[std::size_t(i)];
    double seen[3]; // place whose velocity the liquid feels: a surface that slides shows no spin about its centre
    const bool slides = points_.slip[std::size_t(i)] == std::int8_t(Slip::slides);
    for (int c = 0; c < 3; ++c) seen[c] = arm[c] + (slides ? -centre : points_.depth[std::size_t(i)]) * to[6 + c];
    double own[3], belt[3], through = 0; // a belt moves along the surface: its part across it is taken off
    velocity_at(b.velocity, seen, own);
    velocity_at(b.belt, seen, belt);
    for (int c = 0; c < 3; ++c) through += belt[c] * to[6 + c];
    const bool there = b.at >= 0 && points_.slip[std::size_t(i)] != std::int8_t(Slip::none);
    for (int c = 0; c < 3; ++c) {
      to[c] = there ? b.position[c] + arm[c] : std::numeric_limits<double>::infinity();
      to[3 + c] = own[c] + belt[c] - through * to[6 + c];
    }
    to[10 - 1] = points_.depth[std::size_t(i)];
    to[11 - 1] = points_.volume[std::size_t(i)];
    to[12 - 1] = points_.slip[std::size_t(i)];
    to[13 - 1] = std::numeric_limits<double>::max();
    to[14 - 1] = centre;
  }
  if (skins_.count() > 0) skins_.place(skin_records());
  plane_.clear();
  for (std::int64_t i = 0; i < planes_.count(); ++i) {
    const Body& b = bodies_[std::size_t(body_of_plane_[std::size_t(i)])];
    double at[3], normal[3];
    turned(b, &planes_.offset[std::size_t(3 * i)], at);
    turned(b, &planes_.normal[std::size_t(3 * i)], normal);
    const bool there = b.at >= 0 && planes_.slip[std::size_t(i)] != std::int8_t(Slip::none);
    for (int c = 0; c < 3; ++c) // a half-space that is gone is far below
      plane_.push_back(there ? b.position[c] + at[c] : -std::numeric_limits<double>::max() * 1e-3 * normal[c]);
    plane_.insert(plane_.end(), normal, normal + 3);
    plane_.insert(plane_.end(), b.position, b.position + 3);
    double through = 0;
    for (int c = 0; c < 3; ++c) through += b.belt[c] * normal[c];
    for (int c = 0; c < 6; ++c) plane_.push_back(b.velocity[c] + b.belt[c] - (c < 3 ? through * normal[c] : 0));
    plane_.push_back(planes_.slip[std::size_t(i)]);
  }
  hide_points_in_planes();
}

// A half-space fills what is below its surface: points of bodies that are let into it take no space there again, which
// would stir the liquid above. A point stands for a layer a spacing thick, and keeps the share of it above the surface.
void Fluid::hide_points_in_planes() {
  const std::int64_t n = all_points();
  const std::size_t planes = std::size_t(planes_.count());
  if (planes == 0) return;
#pragma omp parallel for schedule(static) if (n > 4096)
  for (std::int64_t i = 0; i < n; ++i) {
    double* point = &surface_[std::size_t(cairn_fluid_surface_record * i)];
    for (std::size_t p = 0; p < planes; ++p) {
      const double* plane = &plane_[cairn_fluid_plane_record * p];
      double high = 0;
      for (std::size_t c = 0; c < 3; ++c) high += (point[c] - plane[c]) * plane[3 + c];
      if (high < 0.5 * settings.spacing) point[11 - 1] *= std::max(0.0, 0.5 + high / settings.spacing);
    }
  }
}

// Liquid that nothing bears falls freely, and has no pressure by its weight.
bool Fluid::is_borne() const {
  if (!list_.particle.empty()) return true;
  const std::size_t size = planes_.count() > 0 ? plane_.size() / std::size_t(planes_.count()) : 0;
  const double near = reach() + skin();
  for (std::size_t p = 0; p + size <= plane_.size() && size > 0; p += size)
    for (std::size_t i = 0; i < position_.size(); i += 3) {
      double high = 0;
      for (std::size_t c = 0; c < 3; ++c) high += (position_[i + c] - plane_[p + c]) * plane_[p + 3 + c];
      if (high < near) return true;
    }
  return false;
}

// Sums in the order of points and tiles.
void Fluid::add_surface_forces() {
  std::fill(force_.begin(), force_.end(), 0.0);
  for (std::int64_t i = 0; i < points_.count(); ++i) {
    if (list_.first_of_point[std::size_t(i)] == list_.first_of_point[std::size_t(i + 1)]) continue;
    const std::size_t k = std::size_t(body_of_point_[std::size_t(i)]);
    const double *f = &on_points_[std::size_t(3 * i)], *s = &shear_on_points_[std::size_t(3 * i)],
                 *x = &surface_[std::size_t(cairn_fluid_surface_record * i)];
    double* to = &force_[6 * k];
    double arm[3], lever[3], p[3], t[3]; // pressure acts at the centre of curvature, viscosity at the surface
    const double *own = bodies_[k].velocity, *belt = bodies_[k].belt;
    const double spin[3] = {own[3] + belt[3], own[4] + belt[4], own[5] + belt[5]};
    add_turning(spin, &side_of_points_[std::size_t(3 * i)], settings.viscosity, s, t);
    for (int c = 0; c < 3; ++c) {
      lever[c] = x[c] - bodies_[k].position[c];
      arm[c] = lever[c] + x[9] * x[6 + c];
      lever[c] -= x[13] * x[6 + c];
      p[c] = f[c] - s[c];
      to[c] += f[c];
    }
    to[3] += arm[1] * t[2] - arm[2] * t[1] + lever[1] * p[2] - lever[2] * p[1];
    to[4] += arm[2] * t[0] - arm[0] * t[2] + lever[2] * p[0] - lever[0] * p[2];
    to[5] += arm[0] * t[1] - arm[1] * t[0] + lever[0] * p[1] - lever[1] * p[0];
  }
  const std::int64_t planes = planes_.count(), tiles = (count() + fluid_tile - 1) / fluid_tile;
  for (std::int64_t t = 0; t < tiles; ++t)
    for (std::int64_t p = 0; p < planes; ++p)
      for (std::size_t c = 0; c < 6; ++c)
        force_[6 * std::size_t(body_of_plane_[std::size_t(p)]) + c] +=
            on_planes_[std::size_t(6 * (planes * t + p)) + c];
  for (double& f : force_) f *= settings.depth;
  if (skins_.count() > 0) skins_.take(skin_records(), &on_points_[std::size_t(3 * points_.count())], settings.depth);
}

// Mean forces of the step, beside those that bodies have.
void Fluid::give_forces(Scene& scene, double h) {
  Bodies& all = scene.bodies;
  skins_.give(h);
  if (bodies_.empty()) return;
  if (!all.force.active) scene.activate(all.force.need);
  given_.assign(6 * bodies_.size(), 0.0);
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    for (std::size_t c = 0; c < 6; ++c) mean_[6 * k + c] = b.impulse[c] / h;
    add_force(scene, k);
  }
  added_ = true;
}

// Keeps the force that a body has without the liquid, and adds that of the liquid.
void Fluid::add_force(Scene& scene, std::size_t body) {
  Bodies& all = scene.bodies;
  const std::int32_t at = scene.find_body(bodies_[body].id);
  if (at < 0) return;
  double* to = all.force[at];
  std::copy_n(to, all.dofs(), &given_[6 * body]);
  for (int c = 0; c < dim_; ++c) to[c] += mean_[6 * body + std::size_t(c)];
  for (int c = dim_; c < all.dofs(); ++c) to[c] += mean_[6 * body + std::size_t(dim_ == 2 ? 5 : c)];
}

void Fluid::add_force_again(Scene& scene, std::int64_t body) {
  if (!added_) return;
  const auto found =
      std::lower_bound(bodies_.begin(), bodies_.end(), body, [](const Body& b, std::int64_t id) { return b.id < id; });
  if (found != bodies_.end() && found->id == body) add_force(scene, std::size_t(found - bodies_.begin()));
}

void Fluid::put_forces_back(Scene& scene) {
  skins_.put_back();
  if (!added_) return;
  Bodies& all = scene.bodies;
  for (std::size_t k = 0; k < bodies_.size(); ++k) // bodies may have other numbers since
    if (const std::int32_t at = scene.find_body(bodies_[k].id); at >= 0)
      std::copy_n(&given_[6 * k], all.dofs(), all.force[at]);
  added_ = false;
}

// The difference from the motion that was foreseen is due to contacts.
void Fluid::end(Scene& scene, double h) {
  put_forces_back(scene);
  skins_.end(h);
  contact_before_.swap(contact_);
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    const std::int32_t at = scene.find_body(b.id);
    for (int c = 0; c < 6; ++c) {
      const bool has = at >= 0 && (dim_ == 3 || c < 2 || c == 5);
      const double now = has ? scene.bodies.velocity[at][dim_ == 3 || c < 2 ? c : 2] : 0;
      contact_[6 * k + std::size_t(c)] = has ? b.kept[c] + (now - b.velocity[c]) / h : 0;
    }
  }
  if (ends_) pass_ends();
}

std::array<double, 6> Fluid::force_on(std::int64_t body) const {
  std::array<double, 6> out{};
  for (std::size_t k = 0; k < bodies_.size(); ++k)
    if (bodies_[k].id == body) std::copy_n(&mean_[6 * k], 6, out.begin());
  return out;
}

} // namespace cairn
