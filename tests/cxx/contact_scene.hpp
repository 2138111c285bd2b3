// Random scenes of contacts for the tests of interactions, and the plain mechanics to compare with: every side as a
// general rigid body touched at the contact point, in plain loops.
#pragma once
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "contactors/shapes.hpp"
#include "contacts/interaction.hpp"
#include "laws/law_names.hpp"

namespace cairn::test {

struct ContactScene {
  explicit ContactScene(int dim, unsigned seed = 1) : dim(dim), bodies(dim), contactors(dim), random(seed) {
    bodies.velocity_begin.active = true;
  }
  int dim;
  Bodies bodies;
  Contactors contactors;
  Candidates candidates;
  Cell cell;
  double h = 0.01, theta = 0.5;
  std::mt19937 random;
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

  std::int32_t add_body(std::vector<double> x, double inverse_mass, double inverse_inertia) {
    const std::int64_t i = bodies.count++;
    bodies.for_each_field([&](auto& field) { field.resize(bodies.count); });
    bodies.id.values[i] = i;
    for (int k = 0; k < dim; ++k) bodies.position[i][k] = x[k];
    for (int k = 0; k < bodies.dofs(); ++k) {
      bodies.inverse_mass[i][k] = k < dim ? inverse_mass : inverse_inertia;
      bodies.velocity[i][k] = inverse_mass > 0 ? uniform(-1, 1) : 0;
      bodies.velocity_free[i][k] = inverse_mass > 0 ? bodies.velocity[i][k] - (k == dim - 1 ? 0.1 : 0) : 0;
    }
    return std::int32_t(i);
  }
  std::int32_t add_contactor(std::int32_t body, Shape shape, double radius, std::int16_t material = 0) {
    const std::int64_t i = contactors.count++;
    contactors.for_each_field([&](auto& field) { field.resize(contactors.count); });
    contactors.id.values[i] = i;
    contactors.body.values[i] = body;
    contactors.shape.values[i] = std::int16_t(shape);
    contactors.material.values[i] = material;
    contactors.radius.values[i] = radius;
    return std::int32_t(i);
  }
  void add_candidate(std::int32_t a, std::int32_t b, double gap, std::vector<double> normal,
                     std::vector<double> point) {
    ++candidates.count;
    candidates.contactor_a.push_back(a);
    candidates.contactor_b.push_back(b);
    candidates.feature.push_back(0);
    candidates.image.push_back(encode_image(0, 0, 0));
    candidates.gap.push_back(gap);
    candidates.normal.insert(candidates.normal.end(), normal.begin(), normal.end());
    candidates.point.insert(candidates.point.end(), point.begin(), point.end());
  }
  // round contactors that stand closer than the margin
  void detect_round(double margin) {
    for (std::int32_t i = 0; i < contactors.count; ++i)
      for (std::int32_t j = 0; j < i; ++j) {
        if (Shape(*contactors.shape[i]) != Shape::disk && Shape(*contactors.shape[i]) != Shape::sphere) continue;
        if (Shape(*contactors.shape[j]) != Shape::disk && Shape(*contactors.shape[j]) != Shape::sphere) continue;
        if (*contactors.body[i] == *contactors.body[j]) continue;
        const auto x = place(i), y = place(j);
        double d[3] = {0, 0, 0}, distance = 0;
        for (int k = 0; k < dim; ++k) d[k] = x[k] - y[k], distance += d[k] * d[k];
        distance = std::sqrt(distance);
        const double gap = distance - *contactors.radius[i] - *contactors.radius[j];
        if (gap > margin) continue;
        std::vector<double> n(dim), p(dim);
        for (int k = 0; k < dim; ++k) n[k] = d[k] / distance, p[k] = x[k] - n[k] * (*contactors.radius[i] + gap / 2);
        add_candidate(i, j, gap, n, p);
      }
  }
  // spheres or disks against a wall through the origin, whose normal is the last axis
  void detect_floor(std::int32_t wall, double margin) {
    const std::int64_t n = contactors.count;
    for (std::int32_t i = 0; i < n; ++i) {
      if (i == wall || !(*contactors.radius[i] > 0) || *contactors.body[i] == *contactors.body[wall]) continue;
      const auto x = place(i);
      const double gap = x[dim - 1] - bodies.position[*contactors.body[wall]][dim - 1] - *contactors.radius[i];
      if (gap > margin) continue;
      std::vector<double> normal(dim, 0.0), p(x.begin(), x.begin() + dim);
      normal[dim - 1] = 1;
      p[dim - 1] -= *contactors.radius[i] + gap / 2;
      add_candidate(i, wall, gap, normal, p);
    }
  }
  std::array<double, 3> place(std::int32_t contactor) const {
    std::array<double, 3> x{0, 0, 0};
    const std::int32_t b = contactors.body.values[contactor];
    for (int k = 0; k < dim; ++k) {
      x[k] = bodies.position[b][k];
      if (contactors.offset.active) x[k] += contactors.offset[contactor][k];
    }
    return x;
  }
  // y = A^-1 f
  std::vector<double> inverse(std::int64_t b, const std::vector<double>& f) const {
    const double* m = bodies.inverse_mass[b];
    std::vector<double> y(bodies.dofs());
    for (int k = 0; k < bodies.dofs(); ++k) y[k] = m[k] * f[k];
    if (dim == 3 && bodies.inverse_inertia.active) {
      const double* j = bodies.inverse_inertia[b];
      y[3] = j[0] * f[3] + j[3] * f[4] + j[4] * f[5];
      y[4] = j[3] * f[3] + j[1] * f[4] + j[5] * f[5];
      y[5] = j[4] * f[3] + j[5] * f[4] + j[2] * f[5];
    }
    return y;
  }
  // velocity of a material point of a body at a place, and the effect of an impulse there on the body
  std::array<double, 3> velocity_at(const Field<double>& velocity, std::int64_t b, const double* p) const {
    const double *v = velocity[b], *x = bodies.position[b];
    if (dim == 2) return {v[0] - v[2] * (p[1] - x[1]), v[1] + v[2] * (p[0] - x[0]), 0};
    const double l[3] = {p[0] - x[0], p[1] - x[1], p[2] - x[2]};
    return {v[0] + v[4] * l[2] - v[5] * l[1], v[1] + v[5] * l[0] - v[3] * l[2], v[2] + v[3] * l[1] - v[4] * l[0]};
  }
  std::vector<double> torsor(std::int64_t b, const double* p, const double* r, const double* moment) const {
    const double* x = bodies.position[b];
    if (dim == 2) return {r[0], r[1], (p[0] - x[0]) * r[1] - (p[1] - x[1]) * r[0] + moment[0]};
    const double l[3] = {p[0] - x[0], p[1] - x[1], p[2] - x[2]};
    return {r[0],
            r[1],
            r[2],
            l[1] * r[2] - l[2] * r[1] + moment[0],
            l[2] * r[0] - l[0] * r[2] + moment[1],
            l[0] * r[1] - l[1] * r[0] + moment[2]};
  }
  SolveReport step(Interactions& interactions, const LawTable& laws, const SolverOptions& options) {
    interactions.options().configuration = LawConfiguration::detection; // what the checks of laws know of
    interactions.assemble(bodies, contactors, candidates, laws, cell, h, theta);
    const SolveReport report = interactions.solve(bodies, options);
    bodies.velocity_begin.values = bodies.velocity.values;
    interactions.update_velocity(bodies);
    return report;
  }
};

// a loose heap of disks or spheres over a floor
inline ContactScene heap(int dim, int per_side, unsigned seed = 1) {
  ContactScene s(dim, seed);
  const int layers = dim == 2 ? 1 : per_side;
  for (int z = 0; z < layers; ++z)
    for (int y = 0; y < per_side; ++y)
      for (int x = 0; x < per_side; ++x) {
        const double radius = s.uniform(0.45, 0.5), density = s.uniform(0.5, 2);
        const double mass = density * (dim == 2 ? radius * radius : radius * radius * radius);
        std::vector<double> at = {x + s.uniform(-0.05, 0.05), dim == 2 ? y + 0.5 : y + s.uniform(-0.05, 0.05)};
        if (dim == 3) at.push_back(z + 0.48 + s.uniform(-0.03, 0.03));
        const std::int32_t b = s.add_body(at, 1 / mass, 1 / ((dim == 2 ? 0.5 : 0.4) * mass * radius * radius));
        s.add_contactor(b, dim == 2 ? Shape::disk : Shape::sphere, radius);
      }
  const std::int32_t floor = s.add_body(std::vector<double>(dim, 0.0), 0, 0);
  const std::int32_t wall = s.add_contactor(floor, dim == 2 ? Shape::half_plane : Shape::plane, 0);
  s.detect_round(0.1);
  s.detect_floor(wall, 0.1);
  return s;
}

struct Solution {
  std::vector<double> local, space, moment, velocity, dissipated;
  std::vector<std::int32_t> status;
};

inline Solution read(const Interactions& i, int dim) {
  Solution s;
  const std::size_t n = i.count();
  s.local.resize(dim * n);
  s.space.resize(dim * n);
  s.moment.resize((dim == 2 ? 1 : 3) * n);
  s.velocity.resize(dim * n);
  s.dissipated.resize(n);
  s.status.resize(n);
  i.views().impulse_local(s.local.data());
  i.views().impulse_space(s.space.data());
  i.views().moment_space(s.moment.data());
  i.views().relative_velocity(s.velocity.data());
  i.views().dissipated(s.dissipated.data());
  i.views().status(s.status.data());
  return s;
}

// largest difference between the velocity of bodies and what impulses at the contact points give them, / largest
// velocity
inline double velocity_defect(const ContactScene& s, const Solution& x) {
  const int nd = s.bodies.dofs(), rotations = s.dim == 2 ? 1 : 3;
  std::vector<double> v = {s.bodies.velocity_free.values.begin(), s.bodies.velocity_free.values.end()};
  for (std::int64_t c = 0; c < s.candidates.count; ++c) {
    const double* p = &s.candidates.point[s.dim * c];
    for (int side = 0; side < 2; ++side) {
      const std::int64_t b = *s.contactors.body[side ? s.candidates.contactor_b[c] : s.candidates.contactor_a[c]];
      const auto dv = s.inverse(b, s.torsor(b, p, &x.space[s.dim * c], &x.moment[rotations * c]));
      for (int k = 0; k < nd; ++k) v[nd * b + k] += (side ? -1 : 1) * dv[k];
    }
  }
  double worst = 0, size = 0;
  for (std::size_t k = 0; k < v.size(); ++k) {
    worst = std::max(worst, std::abs(v[k] - s.bodies.velocity.values[k]));
    size = std::max(size, std::abs(v[k]));
  }
  return worst / size;
}

// largest violation of Signorini-Coulomb, velocities over the largest velocity, impulses over the largest impulse
inline double law_defect(const ContactScene& s, const Solution& x, double mu) {
  double worst = 0, largest_r = 0;
  for (double r : x.local) largest_r = std::max(largest_r, std::abs(r));
  const int d = s.dim;
  for (std::int64_t c = 0; c < s.candidates.count; ++c) {
    const double* p = &s.candidates.point[d * c];
    const auto va = s.velocity_at(s.bodies.velocity, *s.contactors.body[s.candidates.contactor_a[c]], p);
    const auto vb = s.velocity_at(s.bodies.velocity, *s.contactors.body[s.candidates.contactor_b[c]], p);
    double un = std::max(s.candidates.gap[c], 0.0) / s.h, rn = 0, ut[3], rt[3], slip = 0, pull = 0, work = 0;
    for (int k = 0; k < d; ++k) {
      const double n = s.candidates.normal[d * c + k];
      rn += n * x.space[d * c + k];
    }
    double u_normal = 0;
    for (int k = 0; k < d; ++k) u_normal += s.candidates.normal[d * c + k] * (va[k] - vb[k]);
    un += u_normal;
    for (int k = 0; k < d; ++k) {
      const double n = s.candidates.normal[d * c + k];
      ut[k] = va[k] - vb[k] - n * u_normal;
      rt[k] = x.space[d * c + k] - n * rn;
      slip += ut[k] * ut[k];
      pull += rt[k] * rt[k];
      work += ut[k] * rt[k];
    }
    slip = std::sqrt(slip);
    pull = std::sqrt(pull);
    worst = std::max({worst, -un, -rn / largest_r, rn / largest_r * std::abs(un), (pull - mu * rn) / largest_r,
                      (slip * pull + work) / largest_r, (mu * rn - pull) / largest_r * slip});
  }
  return worst;
}

inline LawTable coulomb(double mu) {
  LawTable laws({"rock"});
  laws.set(0, 0, Law::signorini_coulomb, {&mu, 1});
  return laws;
}

} // namespace cairn::test
