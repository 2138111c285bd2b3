#include "reshaping.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "../base/call.hpp"
#include "../base/threads.hpp"
#include "../fe/bulk_model.hpp"
#include "nscd/nscd.hpp"

namespace cairn {
namespace {

// Impulses in the memory are in the frame (n, t) of the contact in 2D, in space axes in 3D.
void turn_to_space(int dim, const double* normal, double* impulse) {
  if (dim == 3) return;
  const double n = impulse[0], t = impulse[1];
  impulse[0] = n * normal[0] - t * normal[1];
  impulse[1] = n * normal[1] + t * normal[0];
}
void turn_to_contact(int dim, const double* normal, double* impulse) {
  if (dim == 3) return;
  const double x = impulse[0], y = impulse[1];
  impulse[0] = x * normal[0] + y * normal[1];
  impulse[1] = y * normal[0] - x * normal[1];
}

std::vector<std::int64_t> sorted(std::span<const std::int64_t> ids) {
  std::vector<std::int64_t> out(ids.begin(), ids.end());
  std::sort(out.begin(), out.end());
  return out;
}

// The body, or the part of a mesh, that a contactor is on.
std::int64_t carrier(const Scene& scene, std::int32_t contactor) {
  const std::int32_t body = *scene.contactors.body[contactor];
  return body < 0 ? *scene.contactors.part[contactor] : *scene.bodies.id[body];
}

bool is_stressed(const MeshModel& m) {
  if (!m.initial_force.empty()) return true;
  const BulkModel* solid = m.bulk ? m.bulk->solid() : nullptr;
  return solid && std::any_of(solid->cells().begin(), solid->cells().end(),
                              [](const BulkCells& c) { return !c.initial_stress.empty(); });
}

} // namespace

RigidMotion motion_of(const Scene& scene, std::int64_t body) {
  const std::int32_t b = scene.internal(body);
  const int dim = scene.dim;
  const Bodies& bodies = scene.bodies;
  RigidMotion out;
  out.mass = *bodies.mass[b];
  if (bodies.rotation.active) out.rotation = rotation_of(dim, bodies.rotation[b]);
  double way = 0;
  for (std::size_t k = 0; k < std::size_t(dim); ++k) {
    out.position[k] = bodies.position[b][k] + scene.origin[k];
    out.velocity[k] = bodies.velocity[b][k];
    way += out.velocity[k] * out.velocity[k];
  }
  const double* w = bodies.velocity[b] + dim;
  double turning = 0;
  if (dim == 2) {
    out.spin[0] = *bodies.inertia[b] * w[0];
    turning = w[0] * out.spin[0];
  } else {
    double own[3], moment[3];
    turn(3, transposed(out.rotation), {w, 3}, own);
    for (int k = 0; k < 3; ++k) moment[k] = bodies.inertia[b][k] * own[k];
    turn(3, out.rotation, moment, out.spin.data());
    for (std::size_t k = 0; k < 3; ++k) turning += w[k] * out.spin[k];
  }
  out.kinetic = 0.5 * (out.mass * way + turning);
  return out;
}

MeshPlace place_of(int dim, const SparseMatrix& mass, std::span<const double> points, const RigidMotion& at,
                   const Rotation& start, bool large) {
  const std::vector<double> weight = node_weights(dim, mass);
  double whole = 0;
  for (const double w : weight) whole += w;
  const auto centre = centre_of(dim, weight, points);
  MeshPlace out;
  out.factor = at.mass / whole;
  const Rotation since = times(at.rotation, transposed(start));
  if (!large) out.base = since;
  out.own.assign(points.begin(), points.end());
  for (std::size_t i = 0; i < out.own.size(); ++i) out.own[i] -= centre[i % std::size_t(dim)];
  for (auto* values : {&out.turned, &out.reference, &out.displacement}) values->resize(out.own.size());
  turn(dim, since, out.own, out.turned.data());
  for (std::size_t i = 0; i < out.own.size(); ++i) {
    const double p = at.position[i % std::size_t(dim)];
    out.reference[i] = p + (large ? out.own[i] : out.turned[i]);
    out.displacement[i] = p + out.turned[i] - out.reference[i];
  }
  return out;
}

std::vector<double> velocities_of(int dim, const SparseMatrix& mass, const MeshPlace& place, const RigidMotion& at,
                                  double& kinetic) {
  std::vector<double> momentum;
  for (std::size_t k = 0; k < std::size_t(dim); ++k) momentum.push_back(at.mass * at.velocity[k]);
  momentum.insert(momentum.end(), at.spin.begin(), at.spin.begin() + (dim == 2 ? 1 : 3));
  const std::vector<double> out = velocities_with_momentum(dim, mass, place.turned, momentum);
  kinetic = motion_of_nodes(dim, mass, place.turned, out).kinetic;
  return out;
}

Rotation turn_of(int dim, const SparseMatrix& mass, std::span<const double> x, std::span<const double> own,
                 const Rotation& base) {
  const std::vector<double> weight = node_weights(dim, mass);
  const auto centre = centre_of(dim, weight, x);
  std::vector<double> arm(x.begin(), x.end()), rest(own.size());
  for (std::size_t i = 0; i < arm.size(); ++i) arm[i] -= centre[i % std::size_t(dim)];
  turn(dim, base, own, rest.data());
  return times(nearest_turn(dim, rest, arm, weight), base);
}

std::vector<double> velocity_of(int dim, const NodesMotion& motion, const Rotation& axes,
                                std::span<const double> inertia, double& kinetic) {
  std::vector<double> out;
  kinetic = 0;
  for (std::size_t k = 0; k < std::size_t(dim); ++k) {
    out.push_back(motion.momentum[k] / motion.mass);
    kinetic += motion.momentum[k] * out[k];
  }
  const double* spin = &motion.momentum[std::size_t(dim)];
  double w[3] = {spin[0] / inertia[0], 0, 0};
  if (dim == 3) {
    double own[3];
    turn(3, transposed(axes), {spin, 3}, own);
    for (std::size_t k = 0; k < 3; ++k) own[k] /= inertia[k];
    turn(3, axes, own, w);
  }
  for (std::size_t k = 0; k < std::size_t(2 * dim - 3); ++k) {
    out.push_back(w[k]);
    kinetic += w[k] * spin[k];
  }
  kinetic *= 0.5;
  return out;
}

void check_unbonded(const Simulation& s, std::span<const std::int64_t> of, const std::string& what) {
  if (!dynamic_cast<const Nscd*>(&s.strategy()) || s.steps == 0) return;
  const std::vector<std::int64_t> ids = sorted(of);
  const ContactMemory memory = s.strategy().memory(s);
  const Contactors& c = s.scene.contactors;
  std::string first;
  std::int64_t more = 0;
  for (std::size_t k = 0; k < memory.keys.size() && memory.state_components > 0; ++k) {
    const std::int32_t a = s.contactor(memory.keys[k].contactor_a), b = s.contactor(memory.keys[k].contactor_b);
    const double held = memory.states[k * std::size_t(memory.state_components)];
    if (a < 0 || b < 0 || !(held > 0) || !(held < std::numeric_limits<double>::max())) continue; // or it has no state
    const bool mine = std::binary_search(ids.begin(), ids.end(), carrier(s.scene, a));
    if (mine == std::binary_search(ids.begin(), ids.end(), carrier(s.scene, b))) continue;
    const int entry = s.laws.find(*c.material[a], *c.material[b]);
    if (entry < 0) continue;
    const LawInfo& law = law_infos()[std::size_t(s.laws.entry(entry).law)];
    if (!law.keeps) continue;
    if (more++ > 0) continue;
    const std::int32_t other = mine ? b : a;
    first = what + " is held to " +
            (*c.body[other] < 0 ? "a mesh" : "body " + std::to_string(carrier(s.scene, other))) + " by " +
            law.python_name;
  }
  if (more == 0) return;
  throw Error(first + (more > 1 ? " (and by " + std::to_string(more - 1) + " more contacts)" : "") +
              ": bonds began at points, areas and normals that what comes in its place does not have; reshape what no "
              "bond holds, let its bonds break first, or give what shall be bonded and deformable as a mesh from the "
              "start (cn.deformable)");
}

PassedContacts::PassedContacts(Simulation& s, double h, std::span<const std::int64_t> ids) : h_(h) {
  const auto* nscd = dynamic_cast<const Nscd*>(&s.strategy());
  passes_ = nscd && !nscd->settings.pose.kernel && s.steps > 0;
  if (!passes_) return;
  memory_ = s.strategy().memory(s);
  if (!(h_ > 0)) h_ = memory_.h;
  if (!(passes_ = h_ > 0)) return;
  before_ = look(s, ids);
}

std::vector<PassedContacts::Seen> PassedContacts::look(Simulation& s, std::span<const std::int64_t> of) const {
  const std::vector<std::int64_t> ids = sorted(of);
  Nscd& nscd = stages_of(s, "a change of bodies that passes their contacts on");
  std::vector<Seen> out;
  const Threads threads(nscd.settings.solver.threads, std::max(s.candidates.count, s.scene.bodies.count));
  nscd.begin_step(s, h_);
  try {
    nscd.compute_free_velocity(s);
    nscd.detect_contacts(s);
    const Candidates& c = s.candidates;
    const auto asked_for = [&](std::int32_t i) {
      return std::binary_search(ids.begin(), ids.end(), carrier(s.scene, i));
    };
    const auto dim = std::size_t(s.scene.dim);
    for (std::size_t i = 0; i < std::size_t(c.count); ++i) {
      Seen one;
      const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
      one.key = {*s.scene.contactors.id[a], *s.scene.contactors.id[b], c.feature[i], c.image[i]};
      std::copy_n(&c.point[dim * i], dim, one.point.begin());
      std::copy_n(&c.normal[dim * i], dim, one.normal.begin());
      one.side = asked_for(a) ? 1 : asked_for(b) ? -1 : 0;
      out.push_back(one);
    }
  } catch (...) {
    nscd.undo_step(s);
    throw;
  }
  nscd.undo_step(s);
  std::sort(out.begin(), out.end(), [](const Seen& a, const Seen& b) { return a.key < b.key; });
  return out;
}

// near: contacts with the same other, that there are now. Where the point lies between the nearest one and another,
// both have a part, by the lever.
void PassedContacts::pass_one(int dim, std::size_t key, const Seen& from, const std::vector<const Seen*>& near,
                              std::vector<Passed>& passed) const {
  const auto along = [&](const auto& p, const auto& a, const auto& b) { // (p - a) (b - a)
    double sum = 0;
    for (std::size_t k = 0; k < std::size_t(dim); ++k) sum += (p[k] - a[k]) * (b[k] - a[k]);
    return sum;
  };
  std::vector<const Seen*> order = near;
  const auto square = [&](const Seen* c) { return along(from.point, c->point, from.point); };
  std::stable_sort(order.begin(), order.end(), [&](const Seen* a, const Seen* b) { return square(a) < square(b); });
  std::vector<std::pair<const Seen*, double>> shares = {{order[0], 1}};
  for (std::size_t k = 1; k < order.size() && shares.size() == 1; ++k) {
    const double whole = along(order[k]->point, order[0]->point, order[k]->point);
    const double t = whole > 0 ? along(from.point, order[0]->point, order[k]->point) / whole : -1;
    if (t > 0 && t <= 0.5 + 1e-9) shares = {{order[0], 1 - t}, {order[k], t}};
  }
  const auto components = std::size_t(memory_.impulse_components);
  std::vector<double> impulse(memory_.impulses.begin() + std::ptrdiff_t(components * key),
                              memory_.impulses.begin() + std::ptrdiff_t(components * (key + 1)));
  turn_to_space(dim, from.normal.data(), impulse.data());
  for (const auto& [to, share] : shares) {
    auto at = std::find_if(passed.begin(), passed.end(), [to = to](const Passed& p) { return p.to == to; });
    if (at == passed.end()) at = passed.insert(at, {to, key, std::vector<double>(components, 0.0)});
    for (std::size_t k = 0; k < components; ++k) at->impulse[k] += from.side * to->side * share * impulse[k];
  }
}

// Copies the memory of a key.
void PassedContacts::keep(ContactMemory& to, std::size_t key) const {
  const auto components = std::size_t(memory_.impulse_components), states = std::size_t(memory_.state_components);
  const auto impulse = memory_.impulses.begin() + std::ptrdiff_t(components * key);
  const auto state = memory_.states.begin() + std::ptrdiff_t(states * key);
  to.keys.push_back(memory_.keys[key]);
  to.impulses.insert(to.impulses.end(), impulse, impulse + std::ptrdiff_t(components));
  to.states.insert(to.states.end(), state, state + std::ptrdiff_t(states));
  if (!memory_.anchors.empty()) to.anchors.push_back(memory_.anchors[key]);
}

// Contactors of what came in place of others bond no more on first sight than those did; others that came in since the
// last step still may.
void PassedContacts::see(const Simulation& s, std::span<const std::int64_t> ids, ContactMemory& out) const {
  const std::vector<std::int64_t> mine = sorted(ids);
  const Contactors& c = s.scene.contactors;
  bool others = false;
  for (std::int64_t i = 0; i < c.count; ++i) {
    const std::int64_t id = *c.id[std::int32_t(i)];
    if (memory_.has_seen(id)) continue;
    if (std::binary_search(mine.begin(), mine.end(), carrier(s.scene, std::int32_t(i))))
      out.seen_besides.push_back(id);
    else
      others = true;
  }
  std::sort(out.seen_besides.begin(), out.seen_besides.end());
  if (others) return;
  out.seen_besides.clear();
  out.contactors_seen = s.scene.next_contactor_id;
}

void PassedContacts::pass_to(Simulation& s, std::span<const std::int64_t> ids) {
  if (!passes_) return;
  std::vector<std::int64_t> there(s.scene.contactors.id.values.begin(), s.scene.contactors.id.values.end());
  std::sort(there.begin(), there.end());
  const auto is_there = [&](std::int64_t id) { return std::binary_search(there.begin(), there.end(), id); };
  const int dim = s.scene.dim;
  const std::vector<Seen> now = look(s, ids);
  std::map<std::int64_t, std::vector<const Seen*>> of_other; // by the contactor that they have besides
  for (const Seen& c : now)
    if (c.side != 0) of_other[c.side > 0 ? c.key.contactor_b : c.key.contactor_a].push_back(&c);
  ContactMemory out = memory_;
  for (auto* values : {&out.impulses, &out.states}) values->clear();
  out.keys.clear();
  out.anchors.clear();
  std::vector<Passed> passed;
  for (std::size_t k = 0; k < memory_.keys.size(); ++k) {
    const ContactKey& key = memory_.keys[k];
    const bool a = is_there(key.contactor_a), b = is_there(key.contactor_b);
    if (a && b) keep(out, k);
    const auto from = std::lower_bound(before_.begin(), before_.end(), key,
                                       [](const Seen& c, const ContactKey& wanted) { return c.key < wanted; });
    const auto near = of_other.find(a ? key.contactor_a : key.contactor_b);
    if (a == b || from == before_.end() || !(from->key == key) || near == of_other.end()) continue;
    pass_one(dim, k, *from, near->second, passed);
  }
  for (Passed& p : passed) {
    keep(out, p.from);
    out.keys.back() = p.to->key;
    turn_to_contact(dim, p.to->normal.data(), p.impulse.data());
    std::copy(p.impulse.begin(), p.impulse.end(), out.impulses.end() - std::ptrdiff_t(p.impulse.size()));
    if (!out.anchors.empty()) out.anchors.back() = Anchor{}; // which holds nothing
  }
  see(s, ids, out);
  s.strategy().restore(s, std::move(out));
  s.forget_contacts();
}

double stored_at_begin(MeshBody& mesh, const Nodes& nodes) {
  const MeshModel& m = mesh.model;
  if (mesh.linear()) return mesh.stored(nodes) + m.initial_energy;
  if (const std::vector<double> known = mesh.memory(); !known.empty()) return known.back();
  MeshBody::Results before;
  mesh.keep(before);
  const auto n = std::size_t(m.dofs());
  std::vector<double> u(n), v(n, 0.0), force(n);
  for (std::size_t i = 0; i < n; ++i) u[i] = nodes.position[mesh.first_node()][i] - m.reference[i];
  const BulkResult found = m.bulk->evaluate({u.data(), v.data(), mesh.loads.time}, force.data(), nullptr);
  mesh.put_back(before);
  if (!found.ok()) throw Error(mesh.describe(found) + " as it stands");
  return found.energy;
}

Energy told_energy(Simulation& s) {
  Energy out = s.energy;
  if (s.steps > 0 || s.meshes.empty()) return out;
  s.place_meshes();
  for (MeshBody& mesh : s.meshes.meshes)
    if (is_stressed(mesh.model)) out.stored += stored_at_begin(mesh, s.scene.nodes);
  return out;
}

} // namespace cairn
