// Contacts of polygons, polyhedra, surfaces and round shapes in smooth scenes: by the narrow phase of NSCD, among the
// pairs that the last search found. A tangential spring belongs to a body and not to one of its sides: where a contact
// passes over a seam to the next triangle, edge or vertex, its spring goes on.
#include <algorithm>
#include <cmath>

#include "../../contactors/shapes.hpp"
#include "../../detection/key_search.hpp"
#include "lanes.hpp"

namespace cairn {

// Which scenes have such contacts; how far bodies reach from their centres, which bounds how far their points move.
void SmoothDem::look_at_shapes(const Simulation& s) {
  const Contactors& c = s.scene.contactors;
  const auto& hull = c.hull.values;
  has_shaped_ = c.hull.active && std::any_of(hull.begin(), hull.end(), [](std::int32_t h) { return h >= 0; });
  lone_spheres_ = has_shaped_;
  if (!has_shaped_) return;
  body_arm_.assign(s.scene.bodies.count, 0);
  shaped_place_.assign(s.scene.bodies.count, 0);
  for (std::int64_t k = 0; k < c.count; ++k) ++shaped_place_[*c.body[k]];
  for (std::int64_t k = 0; k < c.count; ++k) {
    const std::int32_t body = *c.body[k];
    const bool ball = info(Shape(*c.shape[k])).ball();
    double off = 0;
    for (int d = 0; d < dim_ && c.offset.active; ++d) off = std::max(off, std::abs(c.offset[k][d]));
    lone_spheres_ = lone_spheres_ && (!ball || (shaped_place_[body] == 1 && !(off > 0)));
    if (ball && !(off > 0)) continue;
    if (info(Shape(*c.shape[k])).bounded) body_arm_[body] = std::max(body_arm_[body], arm_of(s, k));
    if (*c.hull[k] >= 0 && std::isfinite(*s.scene.bodies.mass[body]))
      widest_ = std::max(widest_, c.hulls.radius[std::size_t(*c.hull[k])]);
  }
  if (std::int64_t(ids_.size()) == c.count && list_.order_version == s.scene.order_version() &&
      list_.contactor_id == c.id.values)
    return; // the order of the last list
  surfaces_known_ = false;
  ids_.resize(c.count);
  for (std::int64_t k = 0; k < c.count; ++k) ids_[k] = {*c.id[k], *c.body[k]};
  std::sort(ids_.begin(), ids_.end());
}

// From the centre of the body to the farthest point of a contactor [m].
double SmoothDem::arm_of(const Simulation& s, std::int64_t k) const {
  const Contactors& c = s.scene.contactors;
  const Shape shape = Shape(*c.shape[k]);
  double square = 0;
  for (int d = 0; d < dim_ && c.offset.active; ++d) square += c.offset[k][d] * c.offset[k][d];
  double arm = c.hull.active && *c.hull[k] >= 0 ? c.hulls.radius[std::size_t(*c.hull[k])] : *c.radius[k];
  if (shape == Shape::segment) arm += c.direction[k][dim_];
  return std::sqrt(square) + arm;
}

// Greatest way of a point of a body in the step [m].
double SmoothDem::farthest_way(const Simulation& s) const {
  const Bodies& b = s.scene.bodies;
  double most = 0;
#pragma omp parallel for schedule(static) reduction(max : most)
  for (std::int64_t i = 0; i < b.count; ++i) {
    const double* v = b.velocity[i];
    double linear = 0, spin = 0;
    for (int k = 0; k < dim_; ++k) linear += v[k] * v[k];
    for (int k = dim_; k < b.dofs(); ++k) spin += v[k] * v[k];
    most = std::max(most, std::sqrt(linear) + body_arm_[i] * std::sqrt(spin));
  }
  return h_ * most;
}

void SmoothDem::search_shapes(Simulation& s, double margin) {
  const bool known = surfaces_known_ && !s.scene.bodies.stretch.active; // bodies that grow have other hulls
  surfaces_known_ = true;
  shaped_pairs_.search(s.scene.bodies, s.scene.contactors, s.scene.cell, margin, s.laws.rules(), known, found_);
}

void SmoothDem::find_shaped(Simulation& s) {
  if (!has_shaped_) {
    shaped_.pairs = 0;
    shaped_.valid = false;
    return;
  }
  const bool known = shaped_.valid;
  if (known) {
    for (auto* array : {&shaped_before_.impulses, &shaped_before_.states}) array->clear();
    shaped_before_.keys.clear();
    add_memory(shaped_, shaped_before_);
    shaped_before_.state_components = states_;
  }
  const ContactMemory& before = known ? shaped_before_ : memory_;
  double margin = 0;
  for (const EntryShape& e : entries_) margin = std::max(margin, e.reach);
  shaped_pairs_.contacts(s.scene.bodies, s.scene.contactors, s.scene.cell, margin, s.laws.rules(), shaped_found_);
  lay_out(s, shaped_found_, true, shaped_);
  shaped_.valid = true;
  if (!centred_) place_sides(s);
  shaped_place_.resize(shaped_.pairs);
  shaped_scratch_.begin();
  find_keys(
      before.keys, shaped_.pairs, [&](std::int64_t p) { return key_of(shaped_, p); }, 1, shaped_scratch_,
      shaped_place_.data());
  pass_on_springs(before);
  const int kept = states_ == before.state_components ? states_ : 0; // of other laws means something else
  for (std::int64_t p = 0; p < shaped_.pairs; ++p) {
    const std::int32_t from = shaped_place_[p];
    if (from < 0) continue;
    shaped_.active[p] = 1;
    if (!known && counts_loss_ && lost_.size() == before.keys.size()) shaped_.loss[p] = lost_[std::size_t(from)];
    std::copy_n(&before.states[std::size_t(from) * before.state_components], kept, &shaped_.state[p * states_]);
    std::copy_n(&before.impulses[std::size_t(from) * dim_], dim_, &shaped_.force[p * dim_]);
  }
}

// A new contact goes on with that of the same two bodies which has ended and whose force is nearest to its normal.
void SmoothDem::pass_on_springs(const ContactMemory& before) {
  const std::int64_t n = shaped_.pairs;
  if (before.keys.empty() || std::count(shaped_place_.begin(), shaped_place_.end(), -1) == 0) return;
  ended_.assign(before.keys.size(), 1);
  for (std::int64_t p = 0; p < n; ++p)
    if (shaped_place_[p] >= 0) ended_[std::size_t(shaped_place_[p])] = 0;
  ends_.clear();
  for (std::size_t i = 0; i < ended_.size(); ++i)
    if (ended_[i]) ends_.push_back({before.keys[i].contactor_a, std::int32_t(i)});
  std::sort(ends_.begin(), ends_.end());
  const auto body_of = [&](std::int64_t id) {
    const auto at = std::lower_bound(ids_.begin(), ids_.end(), std::pair(id, std::int32_t(-1)));
    return at == ids_.end() || at->first != id ? std::int32_t(-1) : at->second;
  };
  for (std::int64_t p = 0; p < n; ++p) {
    if (shaped_place_[p] >= 0) continue;
    const ContactKey key = key_of(shaped_, p);
    const double* normal = &shaped_found_.normal[std::int64_t(shaped_.source[p]) * dim_];
    double best = -1;
    std::int32_t heir = -1;
    for (auto at = std::lower_bound(ends_.begin(), ends_.end(), std::pair(key.contactor_a, std::int32_t(-1)));
         at != ends_.end() && at->first == key.contactor_a; ++at) {
      const ContactKey& old = before.keys[std::size_t(at->second)];
      if (!ended_[std::size_t(at->second)] || old.image != key.image) continue;
      if (body_of(old.contactor_b) != shaped_.body_b[p]) continue;
      double along = 0;
      for (int k = 0; k < dim_; ++k) along += normal[k] * before.impulses[std::size_t(at->second) * dim_ + k];
      if (!(along > best) || along < 0) continue;
      best = along;
      heir = at->second;
    }
    if (heir < 0) continue;
    shaped_place_[p] = heir;
    ended_[std::size_t(heir)] = 0;
  }
}

void SmoothDem::shaped_geometry(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch,
                                Lanes& w) const {
  const double* centre = centred_ ? s.scene.bodies.position.values.data() : centre_.data();
  const int n = batch.count;
  for (int i = 0; i < n; ++i) {
    const std::int64_t p = batch.first + i, from = list.source[p];
    const std::int64_t a = list.a[p], b = list.b[p];
    double shift[3] = {0, 0, 0};
    if (s.scene.cell.any()) image_shift(s.scene.cell, list.image[p], shift);
    w.gap[i] = shaped_found_.gap[from];
    w.status[i] = 0;
    w.radius_a[i] = arm_of(s, a);
    w.radius_b[i] = arm_of(s, b);
    for (int k = 0; k < dim_; ++k) {
      w.normal[k * n + i] = shaped_found_.normal[from * dim_ + k];
      w.point[k * n + i] = shaped_found_.point[from * dim_ + k] - centre[a * dim_ + k];
      w.between[k * n + i] = centre[a * dim_ + k] - centre[b * dim_ + k] - shift[k];
    }
  }
}

// Two bodies without a curvature meet as balls of half of their least widths.
void SmoothDem::shaped_grains(const Simulation& s, const NeighbourList& list, const NeighbourList::Batch& batch,
                              Lanes& w) const {
  for (int i = 0; i < batch.count; ++i) {
    if (w.grain_a[i] + w.grain_b[i] > 0) continue;
    w.grain_a[i] = flat_curvature(s, list.a[batch.first + i]);
    w.grain_b[i] = flat_curvature(s, list.b[batch.first + i]);
  }
}

double SmoothDem::flat_curvature(const Simulation& s, std::int32_t contactor) const {
  const Contactors& c = s.scene.contactors;
  if (!info(Shape(*c.shape[contactor])).faced) return 0;
  return 1 / c.size(contactor);
}

} // namespace cairn
