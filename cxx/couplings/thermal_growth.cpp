#include "../networks/thermal_growth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../contacts/body_axes.hpp"
#include "../networks/network.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

namespace {

// x: now; shape: before any gradient, from the middle of the body
void move_point(int dim, double factor, double expansion, const double* from, const double* to, const double* shape,
                double* x) {
  double along_from = 0, along_to = 0, square = 0;
  for (int d = 0; d < dim; ++d) {
    along_from += from[d] * shape[d];
    along_to += to[d] * shape[d];
    square += shape[d] * shape[d];
  }
  for (int d = 0; d < dim; ++d) {
    const double had = expansion * (along_from * shape[d] - from[d] * square / 2);
    x[d] = (x[d] - had) * factor + expansion * (along_to * shape[d] - to[d] * square / 2);
  }
}

// True if the law of two contactors is a full bond: no slip or rotation, either.
bool holds_fast(const Simulation& s, std::int32_t a, std::int32_t b) {
  const int entry = s.laws.find(*s.scene.contactors.material[a], *s.scene.contactors.material[b]);
  if (entry < 0) return false;
  const LawInfo& law = law_infos()[std::size_t(s.laws.entry(entry).law)];
  return law.holds && !law.joins;
}

// Where the law of two contactors keeps its slip, -1 if it has none.
int place_of_slip(const Simulation& s, std::int32_t a, std::int32_t b) {
  const int entry = s.laws.find(*s.scene.contactors.material[a], *s.scene.contactors.material[b]);
  if (entry < 0) return -1;
  int place = 0;
  for (const std::string& name : law_infos()[std::size_t(s.laws.entry(entry).law)].state) {
    if (name == "slip*") return place;
    place += name.back() == '*' && s.scene.dim == 3 ? 3 : 1;
  }
  return -1;
}

} // namespace

void ThermalGrowth::separate_hulls(Scene& scene, const NetworkInput& in) const {
  Contactors& k = scene.contactors;
  if (!k.hull.active) return;
  std::vector<std::int32_t> uses(std::size_t(k.hulls.count()), 0);
  for (std::int64_t c = 0; c < k.count; ++c)
    if (*k.hull[c] >= 0) ++uses[*k.hull[c]];
  for (std::int64_t c = 0; c < k.count; ++c) {
    const std::int32_t hull = *k.hull[c];
    if (hull < 0 || uses[hull] < 2 || !grows(scene, in, c)) continue;
    --uses[hull];
    *k.hull[c] = k.hulls.copy(hull);
  }
}

// Material of a contactor; the end of a joint has that of its body.
const NetworkMaterial& ThermalGrowth::material_at(const Scene& scene, const NetworkInput& in,
                                                  std::int64_t contactor) const {
  static const NetworkMaterial none;
  const auto material = std::size_t(*scene.contactors.material[contactor]);
  if (material >= in.materials.size()) return none;
  if (!in.materials[material].joint) return in.materials[material];
  const std::int32_t body = *scene.contactors.body[contactor];
  const std::int32_t own =
      body < 0 || std::size_t(body) >= rows_.material.size() ? -1 : rows_.material[std::size_t(body)];
  return own < 0 ? none : in.materials[std::size_t(own)];
}

bool ThermalGrowth::grows(const Scene& scene, const NetworkInput& in, std::int64_t contactor) const {
  const Contactors& k = scene.contactors;
  const double expansion = material_at(scene, in, contactor).expansion;
  // a plane has no length; a tube has none along its axis
  const bool sized = info(Shape(*k.shape[contactor])).bounded || *k.radius[contactor] > 0;
  return (expansion < 0 || expansion > 0) && sized;
}

// Factor of all lengths of a contactor in the step.
double ThermalGrowth::factor_of(const Simulation& s, const Rise& rise, std::int32_t c) const {
  const double expansion = material_at(s.scene, rise.in, c).expansion, from = rise.in.reference;
  const double now = value_at(s, rise.end.data(), c), begin = value_at(s, rise.begin.data(), c);
  return (1 + expansion * (now - from)) / (1 + expansion * (begin - from));
}

void ThermalGrowth::grow(Simulation& s, const NetworkInput& in, const std::vector<double>& begin,
                         const std::vector<double>& end) {
  if (!s.scene.bodies.stretch.active) return;
  Contactors& k = s.scene.contactors;
  const int dim = s.scene.dim;
  s.scene.bodies.stretch_before.values = s.scene.bodies.stretch.values;
  std::fill(s.scene.bodies.stretch.values.begin(), s.scene.bodies.stretch.values.end(), 0.0);
  const bool bends = s.scene.bodies.gradient.active;
  if (bends) bend(s, in);
  for (std::int64_t c = 0; c < k.count; ++c) {
    if (!grows(s.scene, in, c)) continue;
    const std::int32_t body = *k.body[c];
    const double expansion = material_at(s.scene, in, c).expansion;
    const double factor = factor_of(s, {in, begin, end}, std::int32_t(c));
    if ((factor < 1 || factor > 1) && body >= 0) *s.scene.bodies.stretch[body] = factor - 1;
    if (bends && body >= 0) {
      const double *from = s.scene.bodies.gradient[body], *to = &gradient_[std::size_t(dim * body)];
      const bool flat = std::all_of(from, from + dim, [](double g) { return !(g < 0 || g > 0); }) &&
                        std::all_of(to, to + dim, [](double g) { return !(g < 0 || g > 0); });
      if (!flat) {
        bend_hull(k, c, factor, expansion, from, to);
        continue;
      }
    }
    if (!(factor < 1 || factor > 1)) continue;
    *k.radius[c] *= factor;
    if (k.offset.active)
      for (int d = 0; d < dim; ++d) k.offset[c][d] *= factor;
    if (k.direction.active) k.direction[c][dim] *= factor;
    if (k.hull.active && *k.hull[c] >= 0) k.hulls.scale(*k.hull[c], factor);
  }
  move_anchors(s, {in, begin, end});
  if (bends) std::copy(gradient_.begin(), gradient_.end(), s.scene.bodies.gradient.values.begin());
}

void ThermalGrowth::remember_shapes(const Scene& scene, const ThermalGrowth* before) {
  const Contactors& k = scene.contactors;
  if (before) {
    vertex_ = before->vertex_;
    offset_ = before->offset_;
  }
  for (std::size_t i = vertex_.size(); i < k.hulls.vertex.size(); ++i) vertex_.push_back(k.hulls.vertex[i]);
  if (!k.offset.active) return;
  // by the number of a contactor, which stays
  const auto dim = std::size_t(scene.dim);
  offset_.resize(dim * std::size_t(scene.next_contactor_id), std::numeric_limits<double>::quiet_NaN());
  for (std::int64_t c = 0; c < k.count; ++c)
    for (std::size_t d = 0; d < dim; ++d)
      if (double& at = offset_[dim * std::size_t(*k.id[c]) + d]; std::isnan(at)) at = k.offset[c][d];
}

// Gradients at the end of the step, and by how much they bend bodies in it, in space axes.
void ThermalGrowth::bend(Simulation& s, const NetworkInput& in) {
  Bodies& b = s.scene.bodies;
  const Contactors& k = s.scene.contactors;
  const int dim = s.scene.dim;
  gradient_.assign(b.gradient.values.begin(), b.gradient.values.end());
  for (std::size_t j = 0; j < in.sources.size(); ++j)
    for (std::size_t i = 0; i < in.sources[j].ids.size() && in.sources[j].kind == NetworkSource::gradient; ++i)
      if (const std::int32_t body = rows_.source_body[j][i]; body >= 0)
        gradient_[std::size_t(dim * body + in.sources[j].axis)] = in.sources[j].value[i];
  b.bend_before.values = b.bend.values;
  std::fill(b.bend.values.begin(), b.bend.values.end(), 0.0);
  for (std::int64_t c = 0; c < k.count; ++c) {
    if (!grows(s.scene, in, c)) continue;
    const std::int32_t body = *k.body[c];
    if (body < 0) continue; // of a mesh
    double rise[3] = {0, 0, 0};
    for (int d = 0; d < dim; ++d)
      rise[d] = material_at(s.scene, in, c).expansion * (gradient_[std::size_t(dim * body + d)] - b.gradient[body][d]);
    double* out = b.bend[body];
    if (dim == 2) {
      const double angle = *b.rotation[body];
      out[0] = std::cos(angle) * rise[0] - std::sin(angle) * rise[1];
      out[1] = std::sin(angle) * rise[0] + std::cos(angle) * rise[1];
      continue;
    }
    const double *q = b.rotation[body], w = q[0];
    for (int d = 0; d < 3; ++d) { // v + 2 w (u x v) + 2 u x (u x v)
      const int e = (d + 1) % 3, f = (d + 2) % 3;
      const double cross_e = q[1 + f] * rise[d] - q[1 + d] * rise[f], cross_f = q[1 + d] * rise[e] - q[1 + e] * rise[d];
      const double cross_d = q[1 + e] * rise[f] - q[1 + f] * rise[e];
      out[d] = rise[d] + 2 * w * cross_d + 2 * (q[1 + e] * cross_f - q[1 + f] * cross_e);
    }
  }
}

// Points where bonds hold move with the bodies that carry them, and so does their slip, which laws know by velocities.
void ThermalGrowth::move_anchors(Simulation& s, const Rise& rise) const {
  const NetworkInput& in = rise.in;
  const Contactors& k = s.scene.contactors;
  const Bodies& bodies = s.scene.bodies;
  const int dim = s.scene.dim;
  const std::span<Anchor> anchors = s.interactions.anchors();
  const std::vector<ContactKey>& keys = s.interactions.memory().keys;
  const double none[3] = {0, 0, 0};
  const bool bends = bodies.gradient.active;
  const auto move = [&](std::int32_t c, const double* shape, double* x, double* moved) {
    if (*k.body[c] < 0 || !grows(s.scene, in, c)) return;
    const double expansion = material_at(s.scene, in, c).expansion;
    const double factor = factor_of(s, rise, c);
    const double *from = bends ? bodies.gradient[*k.body[c]] : none,
                 *to = bends ? &gradient_[std::size_t(dim * *k.body[c])] : none;
    double before[3];
    std::copy_n(x, 3, before);
    move_point(dim, factor, expansion, from, to, shape, x);
    for (int d = 0; d < dim; ++d) moved[d] = x[d] - before[d];
    to_space_axes(bodies, dim, *k.body[c], moved, moved);
  };
  for (std::size_t i = 0; i < anchors.size(); ++i) {
    Anchor& anchor = anchors[i];
    const std::int32_t a = s.contactor(keys[i].contactor_a), b = s.contactor(keys[i].contactor_b);
    if (anchor.reach < 0 || a < 0 || b < 0) continue;
    double of_a[3] = {}, of_b[3] = {}, slip[3] = {}, normal[3] = {}, along = 0;
    move(a, anchor.shape_a, anchor.a, of_a);
    move(b, anchor.shape_b, anchor.b, of_b);
    const int place = place_of_slip(s, a, b);
    const std::span<double> state = s.interactions.states(i);
    const bool fast = anchor.length > 0 && holds_fast(s, a, b);
    if (!(state[0] > 0) || (!fast && place < 0)) continue;
    for (int d = 0; d < dim; ++d) slip[d] = of_a[d] - of_b[d];
    to_body_axes(bodies, dim, *k.body[b], slip, slip);
    std::copy_n(anchor.normal, 3, normal);
    if (fast) { // a full bond has no slip to measure: its anchor moves along
      for (int d = 0; d < dim; ++d) along += slip[d] * normal[d];
      for (int d = 0; d < dim; ++d) anchor.b[d] += slip[d] - along * normal[d];
      continue;
    }
    if (dim == 2) {
      state[std::size_t(place)] += normal[0] * slip[1] - normal[1] * slip[0];
      continue;
    }
    for (int d = 0; d < 3; ++d) along += slip[d] * normal[d];
    for (int d = 0; d < 3; ++d) state[std::size_t(place + d)] += slip[d] - along * normal[d];
  }
}

// A temperature T + g.x frees the displacement a ((T - T0) x + (g.x) x - g x.x/2), which has no stress.
void ThermalGrowth::bend_hull(Contactors& k, std::int64_t contactor, double factor, double expansion,
                              const double* from, const double* to) const {
  Hulls& hulls = k.hulls;
  const std::int32_t hull = *k.hull[contactor];
  const int dim = hulls.dim == 2 ? 2 : 3;
  const double* place = k.offset.active ? &offset_[std::size_t(dim * *k.id[contactor])] : nullptr;
  const auto move = [&](double* x, const double* shape) { move_point(dim, factor, expansion, from, to, shape, x); };
  double before[3] = {0, 0, 0}, after[3] = {0, 0, 0}, zero[3] = {0, 0, 0}, shape[3] = {0, 0, 0}, x[3] = {0, 0, 0};
  if (place) {
    std::copy_n(k.offset[contactor], dim, before);
    std::copy_n(before, 3, after);
    move(after, place);
    std::copy_n(after, dim, k.offset[contactor]);
  } else {
    place = zero;
  }
  if (hull < 0) return; // the end of a joint
  for (std::int32_t v = hulls.first_vertex[hull]; v < hulls.first_vertex[hull + 1]; ++v) {
    for (int d = 0; d < dim; ++d) {
      x[d] = before[d] + hulls.vertex[std::size_t(dim * v + d)];
      shape[d] = place[d] + vertex_[std::size_t(dim * v + d)];
    }
    move(x, shape);
    for (int d = 0; d < dim; ++d) hulls.vertex[std::size_t(dim * v + d)] = x[d] - after[d];
  }
  hulls.follow_vertices(hull);
  *k.radius[contactor] = hulls.radius[std::size_t(hull)];
}

} // namespace cairn
