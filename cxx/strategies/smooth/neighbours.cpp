// The neighbour list: when it is rebuilt, and how contact memory passes from the old one.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../../base/call.hpp"
#include "../../base/held_bytes.hpp"
#include "../../contactors/shapes.hpp"
#include "../../detection/key_search.hpp"
#include "../../networks/network.hpp"
#include "cairn/rows/pair.h"
#include "lanes.hpp"

namespace cairn {

// 1/R of a surface seen from outside: a plane and the flank of a segment are flat, a tube and a ring are hollow, a
// capsule and a superquadric are round with half of their least width.
double SmoothDem::curvature(const Contactors& c, std::int32_t k) {
  const ShapeInfo& shape = info(Shape(*c.shape[k]));
  const bool round = shape.is_hull() && !shape.faced && shape.hull != Hulls::Form::facet;
  if (round) return 1 / c.size(k);
  return shape.round == 0 || shape.is_hull() ? 0 : shape.round / *c.radius[k];
}

std::span<const SmoothPairKind> smooth_pair_kinds() {
  static constexpr SmoothPairKind kinds[] = {
#define CAIRN_PAIR(name, a, b, most) {Shape::a, Shape::b, cairn_pair_##name},
#include "../../../core_f90/detection/pairs.def"
#undef CAIRN_PAIR
  };
  return kinds;
}

SmoothDem::SmoothDem(const SmoothDemOptions& o) : settings(o) { name = "smooth_dem"; }

SmoothDem::~SmoothDem() = default;

// The list is made anew, and so are the forces where places changed.
void SmoothDem::changed(Simulation& s, bool places) {
  list_.valid = surfaces_known_ = false;
  if (!places) return;
  forces_known_ = false;
  forget_histories(s);
}

void SmoothDem::check_bodies(const Simulation& s) const {
  if (settings.mass_scale > 1 && settings.integrator.name != "velocity_verlet")
    throw Error("mass_scale is for integrator='velocity_verlet', which this is not");
  if (s.scene.bodies.angular_momentum.active) check_uneven(s);
}

// True if the list must be rebuilt: a gap may have closed by twice the largest displacement of a body.
bool SmoothDem::list_is_old(const Simulation& s) const {
  const Scene& scene = s.scene;
  return !list_.valid || list_.order_version != scene.order_version() || list_.bodies != scene.bodies.count ||
         list_.contactors != scene.contactors.count || !(2 * moved_ <= skin());
}

// A tenth of a radius costs few pairs more than those that touch.
double SmoothDem::skin() const {
  if (!std::isnan(settings.skin)) return settings.skin;
  return 0.1 * (widest_ > 0 ? widest_ : 1);
}

// How much nearer to any body the walls, and the images in a cell that moves, came in this step [m].
double SmoothDem::walls_move(const Simulation& s) const {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  double most = 0;
  for (const std::int32_t k : walls_) {
    const double* v = b.velocity[*c.body[k]];
    const double* axis = &direction_[std::int64_t(k) * (dim_ + 1)];
    double spin = 0;
    if (dim_ == 2) {
      spin = std::abs(v[2]);
    } else {
      double square = 0, along = 0;
      for (int d = 0; d < 3; ++d) square += v[3 + d] * v[3 + d], along += v[3 + d] * axis[d];
      spin = std::sqrt(std::max(0.0, square - along * along));
    }
    most = std::max(most, h_ * spin * farthest_);
  }
  double lattice = 0;
  for (int k = 0; k < 9; ++k) lattice = std::max(lattice, std::abs(s.scene.cell.velocity_gradient[k]));
  if (lattice > 0)
    for (int k = 0; k < dim_; ++k) most += h_ * lattice * std::abs(s.scene.cell.vectors[4 * k]);
  return most;
}

// Laws of the table as pairs need them: numbers of state, and from which gap they act.
void SmoothDem::read_laws(const Simulation& s) {
  entries_.assign(s.laws.entries(), {});
  states_ = 0;
  turns_ = false;
  for (int e = 0; e < s.laws.entries(); ++e) {
    const LawInfo& law = law_infos()[std::size_t(s.laws.entry(e).law)];
    EntryShape& shape = entries_[e];
    for (const std::string& name : law.state) ++(name.back() == '*' ? shape.vectors : shape.scalars);
    states_ = std::max(states_, shape.scalars + shape.vectors * (dim_ == 2 ? 1 : 3));
    shape.turns = (dim_ == 2 ? law.components2 : law.components3) > dim_;
    turns_ = turns_ || shape.turns;
    shape.bonds = !law.state.empty() && law.state[0] == "held";
    const double overlap = 0, radius = widest_ > 0 ? widest_ : 1;
    double k[4];
    law.stiffness(1, law.components(dim_), &overlap, &radius, s.laws.entry(e).params, k, &shape.reach);
  }
}

bool SmoothDem::is_facet(const Simulation& s, std::int64_t contactor) const {
  return info(Shape(*s.scene.contactors.shape[contactor])).hull == Hulls::Form::facet;
}

// True if all translations of a body are driven; a body driven along some axes alone counts as free.
bool SmoothDem::held(const Simulation& s, std::int64_t body) const {
  const Bodies& b = s.scene.bodies;
  const int all = (1 << dim_) - 1;
  return b.driven.active && (*b.driven[body] & all) == all;
}

// Masses in the damping of contacts: a held body counts as infinitely heavy, like a wall. Returns true if any changed.
bool SmoothDem::weigh_grains(const Simulation& s) {
  const Contactors& c = s.scene.contactors;
  bool other = false;
  driven_seen_ = s.scene.bodies.driven.values;
  for (std::int64_t k = 0; k < c.count; ++k) {
    const double mass = settings.mass_scale * *s.scene.bodies.mass[*c.body[k]];
    const double inverse_mass = held(s, *c.body[k]) ? 0 : 1 / mass;
    other = other || grain_[2 * k + 1] < inverse_mass || inverse_mass < grain_[2 * k + 1];
    grain_[2 * k + 1] = inverse_mass;
  }
  return other;
}

// Bodies may have been held or let go since the list was made.
void SmoothDem::follow_drives(const Simulation& s) {
  const auto& driven = s.scene.bodies.driven;
  if (driven.active && driven.values != driven_seen_ && weigh_grains(s)) pair_limit_ = pair_limit(s);
}

void SmoothDem::make_list(Simulation& s) {
  Bodies& b = s.scene.bodies;
  check_laws(s);
  const bool heats = s.networks && s.networks->thermal && s.networks->thermal->friction != Network::Split::none;
  counts_loss_ = settings.energy || heats || keeps_loss;
  s.scene.activate(Need::smooth);
  remember(s);
  cairn_inverse_masses(dim_, b.dofs(), b.count, b.mass.values.data(), b.inertia.values.data(),
                       b.inverse_mass.values.data());
  for (double& one : b.inverse_mass.values) one /= settings.mass_scale;
  read_contactors(s);
  look_at_shapes(s);
  list_uneven(s);
  weigh_grains(s);
  read_laws(s);
  choose_records(s);
  double reach = 0;
  for (const EntryShape& e : entries_) reach = std::max(reach, e.reach);
  Margin margin{};
  margin.constant = reach + skin();
  s.handler.declared().clear();
  if (has_shaped_)
    search_shapes(s, margin.constant);
  else
    s.handler.detect(b, s.scene.contactors, s.scene.cell, margin, found_, {}, nullptr, &s.laws.rules());
  lay_out(s, found_, false, list_);
  if (shared && !shared->alone) found_ = {}; // a rank has no room to spare
  recall(s);
  reach_of_walls(s);
  list_.contactor_id = s.scene.contactors.id.values;
  list_.order_version = s.scene.order_version();
  list_.bodies = b.count;
  list_.contactors = s.scene.contactors.count;
  list_.valid = true;
  moved_ = 0;
  ++lists_made_;
  place_contactors(s);
  find_shaped(s);
  pair_limit_ = pair_limit(s);
}

// Infinite where a contactor has no size of its own [m].
double SmoothDem::bounded_size(const Simulation& s, std::int64_t contactor) const {
  const Contactors& c = s.scene.contactors;
  const ShapeInfo& shape = info(Shape(*c.shape[contactor]));
  const double size = shape.ball() ? *c.radius[contactor] : c.size(std::int32_t(contactor));
  return !is_facet(s, contactor) && shape.bounded && size > 0 ? size : std::numeric_limits<double>::infinity();
}

// Curvatures and sizes of contactors, and which of them are placed, turned and without a bound.
void SmoothDem::read_contactors(const Simulation& s) {
  const Contactors& c = s.scene.contactors;
  grain_.resize(2 * c.count);
  directed_.clear();
  walls_.clear();
  placed_.clear();
  widest_ = arm_ = 0;
  smallest_ = std::numeric_limits<double>::infinity();
  centred_ = !c.offset.active && c.count == s.scene.bodies.count;
  for (std::int64_t k = 0; k < c.count; ++k) {
    const Shape shape = Shape(*c.shape[k]);
    if (!is_facet(s, k)) {
      if (placed_.empty() || placed_.back().second != k) placed_.emplace_back(k, k);
      placed_.back().second = k + 1;
      smallest_ = std::min(smallest_, bounded_size(s, k));
    }
    grain_[2 * k] = curvature(c, std::int32_t(k));
    centred_ = centred_ && *c.body[k] == k;
    if (info(shape).ball()) widest_ = std::max(widest_, *c.radius[k]);
    if (info(shape).directed) directed_.push_back(std::int32_t(k));
    if (!info(shape).bounded) walls_.push_back(std::int32_t(k));
    double arm = shape == Shape::segment ? c.direction[k][dim_] : 0;
    if (c.offset.active) {
      double square = 0;
      for (int d = 0; d < dim_; ++d) square += c.offset[k][d] * c.offset[k][d];
      arm += std::sqrt(square);
    }
    arm_ = std::max(arm_, arm);
  }
}

// Whether contacts of spheres go the way of records, and those of the bodies as they are.
void SmoothDem::choose_records(const Simulation& s) {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  records_ = dim_ == 3 && !b.stretch.active; // bodies that grow change their radii in a step
  spheres_alone_ = records_ && (centred_ || (has_shaped_ && lone_spheres_)) && !s.scene.cell.any();
  clumps_ = records_ && !spheres_alone_ && !centred_ && !s.scene.cell.any();
  if (clumps_) offset_.resize(4 * c.count);
  if (!records_) return;
  record_.resize(12 * std::max(b.count, clumps_ ? c.count : 0));
  body_radius_.assign(b.count, 0);
  for (std::int64_t k = 0; k < c.count; ++k)
    if (Shape(*c.shape[k]) == Shape::sphere) body_radius_[*c.body[k]] = *c.radius[k];
  fill_records(s, 0, b.count);
}

// A bound on the distances of bodies from walls, for those that turn.
void SmoothDem::reach_of_walls(const Simulation& s) {
  const Bodies& b = s.scene.bodies;
  farthest_ = 0;
  for (std::int64_t i = 0; i < b.count * dim_; ++i)
    if (walls_.size() && std::isfinite(*b.mass[i / dim_]))
      farthest_ = std::max(farthest_, std::abs(b.position.values[i]));
  for (const std::int32_t k : walls_)
    for (int d = 0; d < dim_; ++d)
      farthest_ = std::max(farthest_, std::abs(b.position[*s.scene.contactors.body[k]][d]));
  farthest_ *= 2 * std::sqrt(double(dim_));
}

void SmoothDem::lay_out(const Simulation& s, const Candidates& found, bool shaped, NeighbourList& list) const {
  const bool across = shared && s.scene.cell.any();
  list.lay_out(s, found, shaped, tiles(s), {dim_, s.scene.bodies.dofs(), states_, turns_, counts_loss_, across});
  join_first(s, list);
}

// Bodies that came in together and touch may be bonded: the first state of such a law, held, is 1 until its first
// force.
void SmoothDem::join_first(const Simulation& s, NeighbourList& list) const {
  if (std::none_of(entries_.begin(), entries_.end(), [](const EntryShape& e) { return e.bonds; })) return;
  const auto& id = s.scene.contactors.id;
  for (const NeighbourList::Batch& batch : list.batches)
    for (std::int64_t p = batch.first; p < batch.first + batch.count && entries_[batch.entry].bonds; ++p) {
      if (*id[list.a[p]] < contactors_seen_ || *id[list.b[p]] < contactors_seen_) continue;
      list.state[p * states_] = 1;
      list.active[p] = 1;
    }
}

// States of pairs that act, by key: what a list leaves to the next, or to a file.
ContactMemory SmoothDem::memory(const Simulation&) const {
  if (!list_.valid && list_.pairs == 0 && shaped_.pairs == 0) { // a list without pairs has ended all that was restored
    ContactMemory known = memory_;
    known.contactors_seen = contactors_seen_;
    return known;
  }
  ContactMemory m;
  m.h = h_;
  m.impulse_components = dim_; // force on A
  m.state_components = states_;
  m.contactors_seen = contactors_seen_;
  add_memory(list_, m);
  add_memory(shaped_, m);
  return m;
}

void SmoothDem::add_memory(const NeighbourList& list, ContactMemory& m) const {
  for (std::int64_t p = 0; p < list.pairs; ++p) {
    if (!list.active[p]) continue;
    m.keys.push_back(key_of(list, p));
    m.impulses.insert(m.impulses.end(), &list.force[p * dim_], &list.force[p * dim_] + dim_);
    m.states.insert(m.states.end(), &list.state[p * states_], &list.state[p * states_] + states_);
  }
}

ContactKey SmoothDem::key_of(const NeighbourList& list, std::int64_t p) const {
  return {list_.contactor_id[list.a[p]], list_.contactor_id[list.b[p]],
          list.source.empty() ? 0 : shaped_found_.feature[list.source[p]], list.image[p]};
}

void SmoothDem::remember(Simulation& s) {
  if (list_.pairs == 0 && shaped_.pairs == 0) return;
  memory_ = memory(s);
  lost_.clear();
  for (const NeighbourList* list : {&list_, &shaped_})
    for (std::int64_t p = 0; p < std::min(list->pairs, std::int64_t(list->loss.size())); ++p)
      if (list->active[p]) lost_.push_back(list->loss[p]);
  list_.pairs = shaped_.pairs = 0;
  list_.valid = shaped_.valid = false;
}

void SmoothDem::recall(const Simulation& s) {
  const Contactors& c = s.scene.contactors;
  Scratch scratch;
  auto* place = scratch.take<std::int32_t>(list_.pairs);
  const auto key_of = [&](std::int64_t p) {
    return ContactKey{*c.id[list_.a[p]], *c.id[list_.b[p]], 0, list_.image[p]};
  };
  find_keys(memory_.keys, list_.pairs, key_of, 1, scratch, place);
  const int kept = states_ == memory_.state_components ? states_ : 0; // of other laws means something else
  for (std::int64_t p = 0; p < list_.pairs; ++p) {
    if (place[p] < 0) continue;
    list_.active[p] = 1;
    if (counts_loss_ && lost_.size() == memory_.keys.size()) list_.loss[p] = lost_[std::size_t(place[p])];
    std::copy_n(&memory_.states[std::size_t(place[p]) * memory_.state_components], kept, &list_.state[p * states_]);
    std::copy_n(&memory_.impulses[std::size_t(place[p]) * dim_], dim_, &list_.force[p * dim_]);
  }
}

void SmoothDem::restore(Simulation&, ContactMemory memory) {
  surfaces_known_ = false;
  memory_ = std::move(memory);
  contactors_seen_ = memory_.contactors_seen;
  lost_.clear();
  list_.pairs = shaped_.pairs = 0;
  list_.valid = shaped_.valid = false;
  forces_known_ = true;
}

// Pairs of shapes are sought anew then: detection keeps their images.
void SmoothDem::move_images(const Simulation&, const std::vector<std::array<int, 3>>& moved) {
  each_list([&](NeighbourList& list) {
    for (std::int64_t p = 0; p < list.pairs; ++p)
      list.image[p] = image_after_move(list.image[p], moved[list.body_a[p]].data(), moved[list.body_b[p]].data());
  });
  if (has_shaped_ || list_.twins) list_.valid = false; // twins stand in the order of their images
}

void SmoothDem::lean_images(int k, int i, int cells) {
  each_list([&](NeighbourList& list) {
    for (std::int64_t p = 0; p < list.pairs; ++p) list.image[p] = image_after_lean(list.image[p], k, i, cells);
  });
  if (has_shaped_ || list_.twins) list_.valid = false;
}

std::int64_t SmoothDem::body_bytes() const {
  return held_bytes(grain_, centre_, direction_, margins_, record_, body_radius_, offset_, body_arm_, driven_seen_);
}

std::int64_t SmoothDem::contact_bytes() const {
  return list_.bytes() + shaped_.bytes() + std::int64_t(shaped_pairs_.bytes()) +
         held_bytes(found_.contactor_a, found_.contactor_b, found_.image, found_.feature, found_.gap, found_.normal,
                    found_.point, memory_.keys, memory_.impulses, memory_.states);
}

} // namespace cairn
