#include "fluid_skins.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "../bodies/nodes.hpp"

namespace cairn {
namespace {

constexpr int point_record = cairn_fluid_surface_record;
using Vector = std::array<double, 3>;

Vector cross_of(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot_of(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Values of nodes at the foot of a point: their mean and derivatives along the side; across an edge of the plane lies
// the third axis.
struct Foot {
  Vector mean{}, along{}, across{};
};

void multiply(const SparseMatrix& lower, const std::vector<double>& x, std::vector<double>& out) {
  std::fill(out.begin(), out.end(), 0.0);
  for (std::size_t j = 0; j < x.size(); ++j)
    for (std::int64_t e = lower.start[j]; e < lower.start[j + 1]; ++e) {
      const auto i = std::size_t(lower.row[std::size_t(e)]);
      out[i] += lower.value[std::size_t(e)] * x[j];
      if (i != j) out[j] += lower.value[std::size_t(e)] * x[i];
    }
}

// The velocity (dim) of held dofs along each axis, 0 where none is held; false: they do not move along with each other.
bool find_base(const MeshModel& model, const double* v, Vector& base) {
  std::array<bool, 3> known{};
  base = {};
  for (std::size_t i = 0; i < std::size_t(model.dofs()); ++i) {
    const std::size_t k = i % std::size_t(model.dim);
    if (!model.held[i]) continue;
    if (known[k] && (v[i] < base[k] || v[i] > base[k])) return false;
    base[k] = v[i];
    known[k] = true;
  }
  return true;
}

// out = S x with S = A^-1 M, 0 at held dofs; pull: memory.
void answer_to_momentum(MeshBody& body, const std::vector<double>& x, std::vector<double>& pull,
                        std::vector<double>& out) {
  pull.resize(x.size());
  out.resize(x.size());
  multiply(body.model.mass, x, pull);
  body.answer(pull.data(), std::int64_t(x.size()), out.data());
}

// Filters a change of velocities (dofs) to 2 S v - S S v, relative to held dofs: motions that the step resolves stay to
// second order, faster vibrations go. Held dofs that do not move along with each other leave all as it is.
void smooth(MeshBody& body, const std::vector<double>& v, std::vector<double>& out) {
  out = v;
  Vector base;
  if (!find_base(body.model, v.data(), base)) return;
  const auto dim = std::size_t(body.model.dim);
  std::vector<double> x(v.size()), pull, once, twice;
  for (std::size_t i = 0; i < v.size(); ++i) x[i] = v[i] - base[i % dim];
  answer_to_momentum(body, x, pull, once);
  answer_to_momentum(body, once, pull, twice);
  for (std::size_t i = 0; i < v.size(); ++i) out[i] = base[i % dim] + 2 * once[i] - twice[i];
}

// Finds the velocities at the end of the step without the liquid (dofs). A body at large strains has the tangent of its
// begin: a step of the velocity of its vibrations would compress it, and the tangent there may be singular. With w
// relative to held dofs, A v_free = h (f - F) + M v - (1 - theta)/theta (A - M) w.
void find_free(MeshBody& body, Scene& scene, const cairn_scheme& scheme, std::vector<double>& v,
               std::vector<double>& free) {
  Nodes& nodes = scene.nodes;
  const auto n = std::size_t(body.model.dofs()), dim = std::size_t(body.model.dim);
  double *velocity = &nodes.velocity.values[dim * std::size_t(body.first_node())],
         *found = &nodes.velocity_free.values[dim * std::size_t(body.first_node())];
  v.assign(velocity, velocity + n);
  Vector base{};
  const bool from_rest = !body.linear() && find_base(body.model, v.data(), base);
  if (from_rest) std::fill_n(velocity, n, 0.0);
  try {
    body.free_velocity(nodes, scene.gravity.data(), scheme, false);
  } catch (...) {
    std::copy(v.begin(), v.end(), velocity);
    throw;
  }
  std::copy(v.begin(), v.end(), velocity);
  free.assign(found, found + n);
  if (!from_rest) return;
  const double theta = scheme.share;
  std::vector<double> x(n), pull, of_base, of_rest;
  for (std::size_t i = 0; i < n; ++i) x[i] = base[i % dim];
  answer_to_momentum(body, x, pull, of_base);
  for (std::size_t i = 0; i < n; ++i) x[i] = v[i] - base[i % dim];
  answer_to_momentum(body, x, pull, of_rest);
  for (std::size_t i = 0; i < n; ++i)
    if (!body.model.held[i]) free[i] += of_base[i] + (of_rest[i] - (1 - theta) * x[i]) / theta;
}

} // namespace

// Forces of meshes that were known stay theirs.
void FluidSkins::set(int dim, FluidSkin points, std::vector<double> size) {
  State before;
  std::swap(before, state);
  const std::vector<Mesh> were = std::move(meshes_);
  const std::vector<double> mean_before = std::move(mean_);
  dim_ = dim;
  points_ = std::move(points);
  size_ = std::move(size);
  meshes_.clear();
  meshes_.reserve(points_.first_node.size());
  std::vector<std::int32_t> last(points_.first_node.size(), 0);
  for (std::int64_t p = 0; p < count(); ++p)
    for (std::int64_t a = 0; a < points_.most; ++a) {
      std::int32_t& of = last[std::size_t(points_.mesh[std::size_t(p)])];
      of = std::max(of, points_.node[std::size_t(points_.most * p + a)]);
    }
  std::int64_t dofs = 0;
  for (std::size_t k = 0; k < points_.first_node.size(); ++k) {
    Mesh m;
    m.id = points_.first_node[k];
    m.slip = points_.slip[k];
    m.first = dofs;
    m.dofs = dim_ * std::int64_t(last[k] + 1);
    dofs += m.dofs;
    meshes_.push_back(std::move(m));
  }
  for (std::vector<double>* v : {&place_, &velocity_, &constant_, &kept_, &answer_, &impulse_, &mean_, &state.force,
                                 &state.contact, &state.contact_before})
    v->assign(std::size_t(dofs), 0.0);
  state.listed.assign(std::size_t(3 * count()), 0.0);
  for (const Mesh& m : meshes_)
    for (const Mesh& was : were) {
      if (was.id != m.id || was.dofs != m.dofs || before.force.size() < std::size_t(was.first + was.dofs)) continue;
      std::copy_n(&before.force[std::size_t(was.first)], m.dofs, &state.force[std::size_t(m.first)]);
      std::copy_n(&before.contact[std::size_t(was.first)], m.dofs, &state.contact[std::size_t(m.first)]);
      std::copy_n(&before.contact_before[std::size_t(was.first)], m.dofs, &state.contact_before[std::size_t(m.first)]);
      std::copy_n(&mean_before[std::size_t(was.first)], m.dofs, &mean_[std::size_t(m.first)]);
    }
}

// The velocity at the end of the step is linear in the impulse p of the liquid, v_end = v_free + A^-1 p, with the
// matrix A of the integrator. Nodes accelerate by A^-1 f within the step. They thus end with the velocity that the step
// of the bodies finds for the mean of f, but for contacts and what is not linear. Vibrations that the step does not
// resolve turn over in each step at theta = 1/2. If the liquid saw their velocity, its forces would work along another
// way than that of the step, and add energy. The liquid therefore sees the mean velocity of the step, theta v_free + (1
// - theta) v, and the resolved part of the change about it.
void FluidSkins::find_bodies(MeshSet* meshes) {
  for (Mesh& m : meshes_) {
    m.body = nullptr;
    if (!meshes) continue;
    for (MeshBody& mesh : meshes->meshes)
      if (mesh.model.node_ids.front() == m.id && mesh.model.dofs() >= m.dofs) m.body = &mesh;
  }
}

void FluidSkins::Mesh::keep_loads() {
  begin = body->loads.begin;
  end = body->loads.end;
  body->loads.begin.resize(std::size_t(body->model.dofs()), 0.0);
  body->loads.end.resize(body->loads.begin.size(), 0.0);
}

void FluidSkins::load(Scene& scene, const FluidStep& step) {
  Nodes& nodes = scene.nodes;
  find_bodies(step.meshes);
  if (count() > 0) nodes.position_begin.values = nodes.position.values;
  std::vector<double> begin, end, change, seen;
  for (Mesh& m : meshes_) {
    const auto first = std::size_t(m.first), n = std::size_t(m.dofs);
    std::fill_n(&impulse_[first], n, 0.0);
    if (!m.body) continue;
    m.row = m.body->first_node();
    m.body->loads.time = step.time;
    find_free(*m.body, scene, step.scheme, begin, end);
    const auto row = std::size_t(dim_ * m.row);
    change.resize(end.size());
    for (std::size_t i = 0; i < change.size(); ++i) change[i] = end[i] - begin[i];
    smooth(*m.body, change, seen);
    const double h = step.scheme.h, theta = step.scheme.share;
    for (std::size_t i = 0; i < n; ++i) {
      const double v = begin[i], free = end[i];
      const double last = state.contact[first + i], before = state.contact_before[first + i];
      kept_[first + i] = last * before <= 0 ? 0 : std::abs(last) < std::abs(before) ? last : before;
      place_[first + i] = nodes.position.values[row + i];
      velocity_[first + i] = theta * free + (1 - theta) * v - theta * seen[i];
      constant_[first + i] = seen[i] / h + kept_[first + i];
    }
  }
  answer();
}

void FluidSkins::answer() {
  for (Mesh& m : meshes_) {
    if (!m.body) continue;
    const double* force = &state.force[std::size_t(m.first)];
    m.body->answer(force, m.dofs, &answer_[std::size_t(m.first)]);
  }
}

void FluidSkins::accelerate(double dt) {
  for (std::size_t i = 0; i < velocity_.size(); ++i) {
    velocity_[i] += 0.5 * dt * (constant_[i] + answer_[i]);
    impulse_[i] += 0.5 * dt * state.force[i];
  }
}

void FluidSkins::move(double dt) {
  for (std::size_t i = 0; i < place_.size(); ++i) place_[i] += dt * velocity_[i];
}

void FluidSkins::place(double* records) const {
  const std::int64_t n = count();
#pragma omp parallel for schedule(static) if (n > 1024)
  for (std::int64_t p = 0; p < n; ++p) {
    double* to = records + point_record * p;
    const Mesh& m = meshes_[std::size_t(points_.mesh[std::size_t(p)])];
    Foot x, v;
    for (std::int64_t a = 0; a < points_.most; ++a) {
      const auto e = std::size_t(points_.most * p + a);
      const std::size_t at = std::size_t(m.first + dim_ * points_.node[e]);
      for (int c = 0; c < dim_; ++c) {
        const auto k = std::size_t(c);
        x.mean[k] += points_.weight[e] * place_[at + k];
        x.along[k] += points_.along[e] * place_[at + k];
        x.across[k] += points_.across[e] * place_[at + k];
        v.mean[k] += points_.weight[e] * velocity_[at + k];
        v.along[k] += points_.along[e] * velocity_[at + k];
        v.across[k] += points_.across[e] * velocity_[at + k];
      }
    }
    if (dim_ == 2) x.across = {0, 0, 1};
    Vector normal = cross_of(x.along, x.across);
    const double size = std::sqrt(dot_of(normal, normal));
    const bool there = m.body && m.slip > 0 && size > 0;
    for (double& c : normal) c /= size > 0 ? size : 1;
    Vector turn = cross_of(v.along, x.across); // rate of the normal
    const Vector other = cross_of(x.along, v.across);
    for (std::size_t k = 0; k < 3; ++k) turn[k] = size > 0 ? (turn[k] + other[k]) / size : 0;
    const double about = dot_of(turn, normal), depth = points_.depth[std::size_t(p)];
    for (std::size_t k = 0; k < 3; ++k) {
      to[k] = there ? x.mean[k] - depth * normal[k] : std::numeric_limits<double>::infinity();
      to[3 + k] = v.mean[k] - depth * (turn[k] - about * normal[k]);
      to[6 + k] = normal[k];
    }
    to[9] = depth;
    to[10] = points_.volume[std::size_t(p)] * size / size_[std::size_t(p)];
    to[11] = m.slip;
    to[12] = points_.behind[std::size_t(p)];
    to[13] = 0; // nodes take forces where they act
  }
}

// A force f on a point adds N f to a node, and what turns the normal: with f' = - depth (f - n n.f) / |g1 x g2|, the
// derivatives of N along the side times g2 x f' and f' x g1.
void FluidSkins::take(const double* records, const double* forces, double thickness) {
  std::fill(state.force.begin(), state.force.end(), 0.0);
  for (std::int64_t p = 0; p < count(); ++p) {
    const double* f = forces + 3 * p;
    if (!(f[0] < 0 || f[0] > 0 || f[1] < 0 || f[1] > 0 || f[2] < 0 || f[2] > 0)) continue;
    const Mesh& m = meshes_[std::size_t(points_.mesh[std::size_t(p)])];
    Foot x;
    for (std::int64_t a = 0; a < points_.most; ++a) {
      const auto e = std::size_t(points_.most * p + a);
      const std::size_t at = std::size_t(m.first + dim_ * points_.node[e]);
      for (int c = 0; c < dim_; ++c) {
        x.along[std::size_t(c)] += points_.along[e] * place_[at + std::size_t(c)];
        x.across[std::size_t(c)] += points_.across[e] * place_[at + std::size_t(c)];
      }
    }
    if (dim_ == 2) x.across = {0, 0, 1};
    const Vector base = cross_of(x.along, x.across);
    const double size = std::sqrt(dot_of(base, base));
    const double* n = records + point_record * p + 6;
    const double normal = f[0] * n[0] + f[1] * n[1] + f[2] * n[2];
    Vector bend;
    for (std::size_t k = 0; k < 3; ++k)
      bend[k] = size > 0 ? -points_.depth[std::size_t(p)] * (f[k] - normal * n[k]) / size : 0;
    const Vector first = cross_of(x.across, bend), second = cross_of(bend, x.along);
    for (std::int64_t a = 0; a < points_.most; ++a) {
      const auto e = std::size_t(points_.most * p + a);
      double* to = &state.force[std::size_t(m.first + dim_ * points_.node[e])];
      for (int c = 0; c < dim_; ++c) {
        const auto k = std::size_t(c);
        to[c] += thickness * (points_.weight[e] * f[k] + points_.along[e] * first[k] + points_.across[e] * second[k]);
      }
    }
  }
  answer();
}

// The greatest eigenvalue of A^-1 B, with the mass B of the liquid in the layer, shared out to nodes: by powers, from a
// rough vector, as the roughest motions are the lightest.
double FluidSkins::burden(double density, double layer, double spacing, double thickness) {
  constexpr int powers = 8;
  constexpr double missed = 1.25; // by so few powers
  double greatest = 0;
  std::vector<double> carried(velocity_.size(), 0.0), x(velocity_.size()), y(velocity_.size());
  for (std::int64_t p = 0; p < count(); ++p) {
    if (points_.depth[std::size_t(p)] >= spacing) continue;
    const Mesh& m = meshes_[std::size_t(points_.mesh[std::size_t(p)])];
    if (m.slip == 0) continue;
    for (std::int64_t a = 0; a < points_.most; ++a) {
      const auto e = std::size_t(points_.most * p + a);
      for (int c = 0; c < dim_; ++c)
        carried[std::size_t(m.first + dim_ * points_.node[e] + c)] +=
            std::abs(points_.weight[e]) * density * layer * points_.volume[std::size_t(p)] / spacing * thickness;
    }
  }
  for (const Mesh& m : meshes_) {
    if (!m.body) continue;
    const auto first = std::size_t(m.first), n = std::size_t(m.dofs);
    std::uint32_t seed = 1;
    for (std::size_t i = first; i < first + n; ++i) {
      seed = 1664525u * seed + 1013904223u; // Numerical Recipes' generator
      x[i] = double(seed) / double(std::numeric_limits<std::uint32_t>::max()) - 0.5;
    }
    double found = 0;
    for (int k = 0; k < powers; ++k) {
      double with = 0, without = 0; // x.B y and x.B x
      for (std::size_t i = first; i < first + n; ++i) y[i] = carried[i] * x[i];
      m.body->answer(&y[first], m.dofs, &y[first]);
      for (std::size_t i = first; i < first + n; ++i) {
        with += y[i] * carried[i] * y[i];
        without += x[i] * carried[i] * x[i];
      }
      if (!(without > 0)) break;
      found = std::sqrt(with / without);
      if (!(found > 0)) break;
      for (std::size_t i = first; i < first + n; ++i) x[i] = y[i] / found;
    }
    greatest = std::max(greatest, missed * found);
  }
  return greatest;
}

void FluidSkins::give(double h) {
  for (std::size_t i = 0; i < mean_.size(); ++i) mean_[i] = impulse_[i] / h;
  if (given_) return; // within the step of an incompressible liquid
  for (Mesh& m : meshes_) {
    if (!m.body) continue;
    m.keep_loads();
    MeshLoads& loads = m.body->loads;
    for (std::int64_t i = 0; i < m.dofs; ++i) {
      loads.begin[std::size_t(i)] += mean_[std::size_t(m.first + i)];
      loads.end[std::size_t(i)] += mean_[std::size_t(m.first + i)];
    }
  }
  given_ = true;
}

void FluidSkins::put_back() {
  if (!given_) return;
  for (Mesh& m : meshes_)
    if (m.body) {
      m.body->loads.begin.swap(m.begin);
      m.body->loads.end.swap(m.end);
    }
  given_ = false;
}

void FluidSkins::end(double h) {
  state.contact_before.swap(state.contact);
  for (const Mesh& m : meshes_) {
    double* of = &state.contact[std::size_t(m.first)];
    std::fill_n(of, m.dofs, 0.0);
    if (m.body) m.body->answer(m.body->impulse.data(), m.dofs, of);
    for (std::int64_t i = 0; i < m.dofs; ++i) of[i] /= h;
  }
}

void FluidSkins::keep_listed(const double* records) {
  for (std::int64_t p = 0; p < count(); ++p)
    std::copy_n(records + point_record * p, 3, &state.listed[std::size_t(3 * p)]);
}

void FluidSkins::show_listed(double* records) const {
  for (std::int64_t p = 0; p < count(); ++p)
    std::copy_n(&state.listed[std::size_t(3 * p)], 3, records + point_record * p);
}

double FluidSkins::way(const double* records) const {
  double most = 0;
  for (std::int64_t p = 0; p < count(); ++p) {
    double square = 0;
    for (std::int64_t k = 0; k < 3; ++k) {
      const double d = records[point_record * p + k] - state.listed[std::size_t(3 * p + k)];
      square += d * d;
    }
    if (square > most) most = square;
  }
  return std::sqrt(most);
}

std::vector<double> FluidSkins::forces(std::int64_t first_node) const {
  for (const Mesh& m : meshes_)
    if (m.id == first_node)
      return {mean_.begin() + std::ptrdiff_t(m.first), mean_.begin() + std::ptrdiff_t(m.first + m.dofs)};
  return {};
}

std::int64_t FluidSkins::bytes() const {
  std::int64_t sum = std::int64_t(4 * (points_.mesh.capacity() + points_.node.capacity()));
  for (const auto* v : {&points_.weight,
                        &points_.along,
                        &points_.across,
                        &points_.depth,
                        &points_.volume,
                        &points_.behind,
                        &size_,
                        &place_,
                        &velocity_,
                        &constant_,
                        &kept_,
                        &answer_,
                        &impulse_,
                        &mean_,
                        &state.force,
                        &state.contact,
                        &state.contact_before,
                        &state.listed,
                        &within_.map,
                        &within_.free,
                        &within_.contact,
                        &within_.pressed,
                        &within_.known,
                        &within_.impulse,
                        &within_.nodal,
                        &within_.change,
                        &within_.now,
                        &within_.force})
    sum += std::int64_t(8 * v->capacity());
  return sum;
}

} // namespace cairn
