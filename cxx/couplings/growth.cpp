// Rigid bodies that grow with their temperature: all lengths of their contactors by one factor.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "../contacts/body_axes.hpp"
#include "../fe/internal_forces.hpp"
#include "../networks/network.hpp"
#include "../networks/unknowns.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

// Contactors that grow have a hull of their own each.
void Network::separate_hulls(Scene& scene) {
  Contactors& k = scene.contactors;
  if (!k.hull.active) return;
  std::vector<std::int32_t> uses(std::size_t(k.hulls.count()), 0);
  for (std::int64_t c = 0; c < k.count; ++c)
    if (*k.hull[c] >= 0) ++uses[*k.hull[c]];
  for (std::int64_t c = 0; c < k.count; ++c) {
    const std::int32_t hull = *k.hull[c];
    if (hull < 0 || uses[hull] < 2 || !grows(scene, c)) continue;
    --uses[hull];
    *k.hull[c] = k.hulls.copy(hull);
  }
}

// Material of a contactor; the end of a joint has that of its body.
const NetworkMaterial& Network::material_at(const Scene& scene, std::int64_t contactor) const {
  static const NetworkMaterial none;
  const auto material = std::size_t(*scene.contactors.material[contactor]);
  if (material >= materials.size()) return none;
  if (!materials[material].joint) return materials[material];
  const std::int32_t body = *scene.contactors.body[contactor];
  const std::int32_t own = body < 0 || std::size_t(body) >= material_.size() ? -1 : material_[std::size_t(body)];
  return own < 0 ? none : materials[std::size_t(own)];
}

bool Network::grows(const Scene& scene, std::int64_t contactor) const {
  const Contactors& k = scene.contactors;
  const double expansion = material_at(scene, contactor).expansion;
  // a plane has no length; a tube has none along its axis
  const bool sized = info(Shape(*k.shape[contactor])).bounded || *k.radius[contactor] > 0;
  return (expansion < 0 || expansion > 0) && sized;
}

// From begin_ to now_.
void Network::grow(Simulation& s) {
  if (!s.scene.bodies.stretch.active) return;
  Contactors& k = s.scene.contactors;
  const int dim = s.scene.dim;
  s.scene.bodies.stretch_before.values = s.scene.bodies.stretch.values;
  std::fill(s.scene.bodies.stretch.values.begin(), s.scene.bodies.stretch.values.end(), 0.0);
  const bool bends = s.scene.bodies.gradient.active;
  if (bends) bend(s);
  for (std::int64_t c = 0; c < k.count; ++c) {
    if (!grows(s.scene, c)) continue;
    const std::int32_t body = *k.body[c];
    const double expansion = material_at(s.scene, c).expansion;
    const double now = value_at(s, now_.data(), std::int32_t(c)), begin = value_at(s, begin_.data(), std::int32_t(c));
    const double factor = (1 + expansion * (now - reference)) / (1 + expansion * (begin - reference));
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
  move_anchors(s);
  if (bends) std::copy(gradient_.begin(), gradient_.end(), s.scene.bodies.gradient.values.begin());
}

// Shapes as they came in: what a gradient adds to them is always counted from there, so that it leaves when it goes.
void Network::remember_shapes(const Scene& scene, const Network* before) {
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
void Network::bend(Simulation& s) {
  Bodies& b = s.scene.bodies;
  const Contactors& k = s.scene.contactors;
  const int dim = s.scene.dim;
  gradient_.assign(b.gradient.values.begin(), b.gradient.values.end());
  for (std::size_t j = 0; j < sources.size(); ++j)
    for (std::size_t i = 0; i < sources[j].ids.size() && sources[j].kind == NetworkSource::gradient; ++i)
      if (const std::int32_t body = source_body_[j][i]; body >= 0)
        gradient_[std::size_t(dim * body + sources[j].axis)] = sources[j].value[i];
  b.bend_before.values = b.bend.values;
  std::fill(b.bend.values.begin(), b.bend.values.end(), 0.0);
  for (std::int64_t c = 0; c < k.count; ++c) {
    if (!grows(s.scene, c)) continue;
    const std::int32_t body = *k.body[c];
    if (body < 0) continue; // of a mesh
    double rise[3] = {0, 0, 0};
    for (int d = 0; d < dim; ++d)
      rise[d] = material_at(s.scene, c).expansion * (gradient_[std::size_t(dim * body + d)] - b.gradient[body][d]);
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

// Points where bonds hold move with the bodies that carry them, and so does their slip, which laws know by velocities.
void Network::move_anchors(Simulation& s) const {
  const Contactors& k = s.scene.contactors;
  const Bodies& bodies = s.scene.bodies;
  const int dim = s.scene.dim;
  const std::span<Anchor> anchors = s.interactions.anchors();
  const std::vector<ContactKey>& keys = s.interactions.memory().keys;
  const double none[3] = {0, 0, 0};
  const bool bends = bodies.gradient.active;
  const auto move = [&](std::int32_t c, const double* shape, double* x, double* moved) {
    if (*k.body[c] < 0 || !grows(s.scene, c)) return;
    const double expansion = material_at(s.scene, c).expansion;
    const double now = value_at(s, now_.data(), c), begin = value_at(s, begin_.data(), c);
    const double factor = (1 + expansion * (now - reference)) / (1 + expansion * (begin - reference));
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
void Network::bend_hull(Contactors& k, std::int64_t contactor, double factor, double expansion, const double* from,
                        const double* to) const {
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

// Against the temperatures that mechanics saw; of several meshes the worst.
double Network::coupling(const Simulation& s) const {
  const double* saw = expected_.empty() ? begin_.data() : expected_.data();
  double worst = 0;
  const auto share = [&worst](double unseen, double all) {
    if (unseen > 0)
      worst = std::max(worst, all > 0 ? std::sqrt(unseen / all) : std::numeric_limits<double>::infinity());
  };
  for (const ThermalStress& from : stresses) {
    const MeshBody& mesh = s.meshes.meshes[from.mesh];
    const std::int64_t first = unknown_of_node(s.scene, mesh.first_node()), nodes = mesh.model.nodes();
    double unseen = 0, all = 0;
    for (std::size_t dof = 0; dof + 1 < from.start.size(); ++dof) {
      double change = 0, load = 0;
      for (std::int64_t e = from.start[dof]; e < from.start[dof + 1]; ++e) {
        const std::int64_t node = first + from.node[e];
        change += from.value[e] * (now_[node] - saw[node]);
        load += from.value[e] * (now_[node] - reference);
      }
      unseen += change * change;
      all += load * load;
    }
    for (std::int64_t n = first; n < first + nodes && !mesh.linear(); ++n) {
      const double change = now_[n] - saw[n], load = now_[n] - reference;
      unseen += change * change;
      all += load * load;
    }
    share(unseen, all);
  }
  double unseen = 0, all = 0;
  for (std::size_t i = 0; i < now_.size() && stresses.empty(); ++i) {
    unseen += (now_[i] - saw[i]) * (now_[i] - saw[i]);
    all += (now_[i] - reference) * (now_[i] - reference);
  }
  share(unseen, all);
  return worst;
}

// Thermal stress of meshes: forces on their nodes, or free strains that their materials see.
void Network::load_meshes(Simulation& s) {
  const double* all = seen(values_of(s.scene.bodies.temperature, s.scene.nodes.temperature, warm_));
  for (const ThermalStress& from : stresses) {
    MeshBody& mesh = s.meshes.meshes[from.mesh];
    const double* t = all + unknown_of_node(s.scene, mesh.first_node());
    if (!mesh.linear()) {
      if (!mesh.model.bulk->solid())
        throw Error("the mesh '" + mesh.model.name +
                    "' is of a code that is not told of its temperature: give it a material without expansion");
      std::vector<double>& swelling = mesh.model.bulk->swelling;
      swelling.resize(std::size_t(mesh.model.nodes()));
      for (std::size_t n = 0; n < swelling.size(); ++n) swelling[n] = from.expansion * (t[n] - reference);
      continue;
    }
    mesh.loads.thermal.assign(std::size_t(mesh.model.dofs()), 0.0);
    for (std::size_t dof = 0; dof + 1 < from.start.size(); ++dof)
      for (std::int64_t e = from.start[dof]; e < from.start[dof + 1]; ++e)
        mesh.loads.thermal[dof] += from.value[e] * (t[from.node[e]] - reference);
  }
}

} // namespace cairn
