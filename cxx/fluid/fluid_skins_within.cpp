// Deformable bodies in the step of an incompressible liquid. A velocity at the end of the step is linear in the
// impulses of pressure p and contacts c, v = v_free + A^-1 (p + c), with the matrix A of the theta-method. The pressure
// is solved with this inverse, so that bodies carry the mass of the liquid about them. The impulse is a load of the
// bodies.
#include <algorithm>
#include <array>
#include <cmath>

#include "../base/call.hpp"
#include "../bodies/nodes.hpp"
#include "fluid_skins.hpp"

namespace cairn {
namespace {

constexpr int wide = 6; // components of a point

bool is_zero(double value) { return std::fpclassify(value) == FP_ZERO; }

double farthest(int dim, const std::vector<double>& velocity, const std::vector<std::int8_t>& met) {
  double most = 0;
  for (std::size_t i = 0; i < velocity.size(); i += std::size_t(dim)) {
    if (!met[i]) continue;
    double square = 0;
    for (std::size_t k = 0; k < std::size_t(dim); ++k) square += velocity[i + k] * velocity[i + k];
    if (!(square <= most)) most = square; // one that is not finite is kept
  }
  return std::sqrt(most);
}

} // namespace

// A point lies by its depth below the foot of its side, along the normal n = g x f / |g x f|, which turns with the
// side. With weights w, and slopes a and b along g and f, a node moves the point by
//   w v - depth (1 - n n') (a v x f + b g x v) / |g x f|.
void FluidSkins::make_maps() {
  const auto dim = std::size_t(dim_), most = std::size_t(points_.most);
  within_.map.assign(dim * dim * most * std::size_t(count()), 0.0);
  std::fill(within_.met.begin(), within_.met.end(), std::int8_t(0));
  for (std::size_t p = 0; p < std::size_t(count()); ++p) {
    const Mesh& m = meshes_[std::size_t(points_.mesh[p])];
    if (!m.body || m.slip <= 0) continue;
    std::array<double, 3> g{}, f{};
    for (std::size_t e = most * p; e < most * (p + 1); ++e)
      for (std::size_t k = 0; k < dim; ++k) {
        const double x = place_[std::size_t(m.first) + dim * std::size_t(points_.node[e]) + k];
        g[k] += points_.along[e] * x;
        f[k] += points_.across[e] * x;
      }
    if (dim == 2) f = {0, 0, 1};
    const auto cross = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
      return std::array<double, 3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    std::array<double, 3> n = cross(g, f);
    const double size = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (!(size > 0)) continue;
    for (double& c : n) c /= size;
    for (std::size_t e = most * p; e < most * (p + 1); ++e)
      for (std::size_t k = 0; k < dim; ++k) {
        std::array<double, 3> unit{}, slope{}, turn{};
        unit[k] = points_.along[e];
        slope[k] = points_.across[e];
        turn = cross(unit, f);
        const std::array<double, 3> other = cross(g, slope);
        for (std::size_t r = 0; r < 3; ++r) turn[r] = (turn[r] + other[r]) / size;
        const double about = turn[0] * n[0] + turn[1] * n[1] + turn[2] * n[2];
        for (std::size_t r = 0; r < dim; ++r)
          within_.map[dim * (dim * e + r) + k] =
              (r == k ? points_.weight[e] : 0) - points_.depth[p] * (turn[r] - about * n[r]);
        const std::size_t dof = std::size_t(m.first) + dim * std::size_t(points_.node[e]) + k;
        if (points_.weight[e] < 0 || points_.weight[e] > 0) within_.met[dof] = 1;
      }
  }
}

void FluidSkins::to_points(const std::vector<double>& of_nodes, double* of_points) const {
  const auto dim = std::size_t(dim_), most = std::size_t(points_.most);
  const std::int64_t n = count();
#pragma omp parallel for schedule(static) if (n > 1024)
  for (std::int64_t point = 0; point < n; ++point) {
    const auto p = std::size_t(point);
    double* to = of_points + wide * p;
    std::fill_n(to, wide, 0.0);
    const std::size_t first = std::size_t(meshes_[std::size_t(points_.mesh[p])].first);
    for (std::size_t e = most * p; e < most * (p + 1); ++e) {
      const double *map = &within_.map[dim * dim * e], *v = &of_nodes[first + dim * std::size_t(points_.node[e])];
      for (std::size_t r = 0; r < dim; ++r)
        for (std::size_t k = 0; k < dim; ++k) to[r] += map[dim * r + k] * v[k];
    }
  }
}

// In the order of points.
void FluidSkins::to_nodes(const double* of_points, std::vector<double>& of_nodes) const {
  const auto dim = std::size_t(dim_), most = std::size_t(points_.most);
  of_nodes.assign(velocity_.size(), 0.0);
  for (std::size_t p = 0; p < std::size_t(count()); ++p) {
    const double* from = of_points + wide * p;
    if (std::all_of(from, from + 3, is_zero)) continue;
    const std::size_t first = std::size_t(meshes_[std::size_t(points_.mesh[p])].first);
    for (std::size_t e = most * p; e < most * (p + 1); ++e) {
      const double* map = &within_.map[dim * dim * e];
      double* to = &of_nodes[first + dim * std::size_t(points_.node[e])];
      for (std::size_t r = 0; r < dim; ++r)
        for (std::size_t k = 0; k < dim; ++k) to[k] += map[dim * r + k] * from[r];
    }
  }
}

void FluidSkins::respond_nodes(const std::vector<double>& impulse, std::vector<double>& change) {
  change.assign(velocity_.size(), 0.0);
  for (Mesh& m : meshes_)
    if (m.body) m.body->answer(&impulse[std::size_t(m.first)], m.dofs, &change[std::size_t(m.first)]);
}

void FluidSkins::stand(Scene& scene, MeshSet& meshes, double h) {
  Within& w = within_;
  w.h = h;
  for (auto* v : {&w.free, &w.contact, &w.pressed, &w.known, &w.impulse}) v->assign(velocity_.size(), 0.0);
  w.met.resize(velocity_.size());
  const auto dim = std::size_t(dim_);
  find_bodies(&meshes);
  for (Mesh& m : meshes_) {
    if (!m.body) continue;
    m.row = m.body->first_node();
    const std::size_t first = std::size_t(m.first), row = dim * std::size_t(m.row);
    for (std::size_t i = 0; i < std::size_t(m.dofs); ++i) {
      place_[first + i] = scene.nodes.position.values[row + i];
      velocity_[first + i] = scene.nodes.velocity.values[row + i];
      w.contact[first + i] = h * state.contact[first + i];
    }
    m.keep_loads();
  }
  given_ = true;
  make_maps();
}

// They stay with the loads where a free velocity is made anew.
void FluidSkins::add_loads(Scene& scene, const std::vector<double>& impulse) {
  std::vector<double>& force = within_.force;
  for (Mesh& m : meshes_) {
    if (!m.body) continue;
    const double* from = &impulse[std::size_t(m.first)];
    force.assign(from, from + m.dofs);
    for (std::size_t i = 0; i < force.size(); ++i) {
      force[i] /= within_.h;
      if (!std::isfinite(force[i]))
        throw Error("the force of the fluid on node " + std::to_string(std::int64_t(i) / dim_) + " of '" +
                    m.body->model.name + "' is not finite: give a smaller dt");
      m.body->loads.begin[i] += force[i];
      m.body->loads.end[i] += force[i];
    }
    m.body->add_load(force.data(), m.dofs, scene.nodes);
  }
}

void FluidSkins::take_known(Scene& scene, const double* impulse) {
  to_nodes(impulse, within_.known);
  add_loads(scene, within_.known);
}

void FluidSkins::renew_free(const Scene& scene) {
  Within& w = within_;
  respond_nodes(w.impulse, w.change);
  for (const Mesh& m : meshes_) {
    if (!m.body) continue;
    const std::size_t first = std::size_t(m.first), row = std::size_t(dim_ * m.row);
    for (std::size_t i = 0; i < std::size_t(m.dofs); ++i)
      w.free[first + i] = scene.nodes.velocity_free.values[row + i] - w.change[first + i];
  }
}

void FluidSkins::show_begin(double* velocity) const { to_points(velocity_, velocity); }
void FluidSkins::show_free(double* velocity) const { to_points(within_.free, velocity); }
void FluidSkins::show_contacts(double* change) const { to_points(within_.contact, change); }

void FluidSkins::show_now(const Scene& scene, double* velocity) {
  std::vector<double>& now = within_.now;
  now.assign(velocity_.size(), 0.0);
  for (const Mesh& m : meshes_)
    if (m.body)
      std::copy_n(&scene.nodes.velocity.values[std::size_t(dim_ * m.row)], m.dofs, &now[std::size_t(m.first)]);
  to_points(now, velocity);
}

void FluidSkins::respond(const double* impulse, double* change) {
  to_nodes(impulse, within_.nodal);
  respond_nodes(within_.nodal, within_.change);
  to_points(within_.change, change);
}

void FluidSkins::press(Scene& scene, const double* impulse) {
  Within& w = within_;
  to_nodes(impulse, w.nodal);
  respond_nodes(w.nodal, w.change);
  for (std::size_t i = 0; i < w.free.size(); ++i) w.pressed[i] = w.free[i] + w.contact[i] + w.change[i];
  for (std::size_t i = 0; i < w.free.size(); ++i) w.change[i] = w.nodal[i] - w.impulse[i];
  w.impulse = w.nodal;
  for (std::size_t i = 0; i < w.free.size(); ++i) impulse_[i] = w.known[i] + w.impulse[i];
  add_loads(scene, w.change);
}

double FluidSkins::take_contacts() {
  Within& w = within_;
  w.nodal.assign(velocity_.size(), 0.0);
  for (const Mesh& m : meshes_)
    if (m.body) std::copy_n(m.body->impulse.data(), m.dofs, &w.nodal[std::size_t(m.first)]);
  respond_nodes(w.nodal, w.change);
  w.change.swap(w.contact);
  for (std::size_t i = 0; i < w.change.size(); ++i) w.change[i] = w.contact[i] - w.change[i];
  return farthest(dim_, w.change, w.met);
}

double FluidSkins::speed() const { return farthest(dim_, within_.pressed, within_.met); }

} // namespace cairn
