#include "placed_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "../base/call.hpp"
#include "../base/turning.hpp"
#include "cairn/core.h"
#include "detection_grid.hpp"
#include "pair_kinds.hpp"

namespace cairn::detection {

std::string name_of(const Contactors& contactors, const Bodies& bodies, std::int64_t i) {
  const bool mapped = contactors.body.values[i] < 0;
  return std::string(info(Shape(contactors.shape.values[i])).name) + " (contactor " +
         std::to_string(contactors.id.values[i]) + ")" + (mapped ? ", part " : " of body ") +
         std::to_string(carrier_id(bodies, contactors, i)) + (mapped ? " of a mesh" : "");
}

void PlacedScene::begin(const Bodies& in_bodies, const Contactors& in_contactors, const Cell& in_cell,
                        const Margin& in_margin, const Configuration& at, const LawRules* in_rules,
                        Scratch& in_scratch) {
  scratch = &in_scratch;
  scratch->begin();
  for (auto* array : {&centre, &direction, &reach, &turned, &box}) *array = {};
  hull_place = {};
  carrier_of_ = placed_on_of_ = {};
  movable = {};
  bodies = &in_bodies;
  contactors = &in_contactors;
  cell = &in_cell;
  margin = &in_margin;
  rules = in_rules;
  dim = bodies->dim;
  position = at.position ? at.position : bodies->position.values.data();
  rotation = at.rotation ? at.rotation : bodies->rotation.active ? bodies->rotation.values.data() : nullptr;
  static constexpr double at_origin[4] = {0, 0, 0, 0}, unturned[4] = {1, 0, 0, 0};
  if (bodies->count == 0) { // contactors mapped from nodes are first placed at a body
    position = at_origin;
    if (rotation) rotation = dim == 2 ? at_origin : unturned;
  }
  for_bonds = at.for_bonds;
  hulls_again = at.hulls_again;
  hulls_later = surfaces_known = facets_apart = false;
  step = at.step;
  mapped = at.mapped && !at.mapped->contactor.empty() ? at.mapped : nullptr;
  for (int k = 0; k < 3; ++k) periodic[k] = k < dim && cell->periodic[k];
  any_periodic = periodic[0] || periodic[1] || periodic[2];
}

void PlacedScene::seek_hulls_later(bool known) {
  hulls_later = true;
  surfaces_known = known;
  facets_apart = dim == 3 && contactors->hull.active && !mapped && !any_periodic;
}

// All contactors, or all but triangles.
void PlacedScene::list_placed() {
  placed_runs_.clear();
  if (!facets_apart) return placed_runs_.emplace_back(0, contactors->count), void();
  const std::int16_t* shape = contactors->shape.values.data();
  const auto is_facet = [](std::int16_t one) { return one == std::int16_t(Shape::facet); };
  for (std::int64_t first = 0, last = 0; first < contactors->count; first = last) {
    first = std::find_if_not(shape + first, shape + contactors->count, is_facet) - shape;
    last = std::find_if(shape + first, shape + contactors->count, is_facet) - shape;
    if (last > first) placed_runs_.emplace_back(first, last);
  }
}

void PlacedScene::place(const OrderedPairs& last) {
  if (hulls_again) return place_hulls_again(last); // of a scene that the search has checked
  check();
  place_contactors();
}

SearchedScene PlacedScene::searched() const {
  return {contactors,    rules,         dim,
          bodies->count, centre.data(), contactors->direction.active ? direction.data() : nullptr,
          reach.data(),  movable.data()};
}

void PlacedScene::check() const {
  if (contactors->dim != dim) throw Error("detection: bodies and contactors differ in dimension");
  if (!margin->per_contactor && !(margin->constant >= 0 && std::isfinite(margin->constant)))
    throw Error("margin: " + std::to_string(margin->constant) + " m; give a finite length, not negative");
  if (contactors->count > std::numeric_limits<std::int32_t>::max() / kinds)
    throw Error("detection: " + std::to_string(contactors->count) + " contactors are more than one process can number");
  if (any_periodic) check_cell();
  if (contactors->part.active && !mapped)
    for (std::int64_t i = 0; i < contactors->count; ++i)
      if (contactors->body.values[i] < 0)
        throw Error("detection: " + name_of(*contactors, *bodies, i) + " is sought where no mesh is: add the mesh");
  if (contactors->direction.active) return;
  for (std::int64_t i = 0; i < contactors->count; ++i)
    if (info(Shape(contactors->shape.values[i])).directed)
      throw Error("direction: " + name_of(*contactors, *bodies, i) +
                  " has none; activate the field and give a unit vector");
}

void PlacedScene::check_cell() const {
  for (int k = 0; k < dim; ++k) {
    if (!periodic[k]) continue;
    const double* v = cell->vectors + 3 * k;
    const char* axis[] = {"x", "y", "z"};
    if (!(v[k] > 0) || !std::isfinite(v[0]) || !std::isfinite(v[1]) || !std::isfinite(v[2]) || !std::isfinite(v[k]))
      throw Error(std::string("cell: the vector of periodic axis ") + axis[k] + " has length " + std::to_string(v[k]) +
                  " along it; give a finite length above 0");
    for (int i = k + 1; i < 3; ++i)
      if (v[i] != 0)
        throw Error(std::string("cell: the vector of axis ") + axis[k] + " leans along " + axis[i] +
                    "; turn the cell so that its vectors are upper triangular");
  }
}

void PlacedScene::name_carriers() {
  carrier = placed_on = contactors->body.values.data();
  if (!mapped) return;
  carrier_of_.make_room(*scratch, contactors->count);
  placed_on_of_.make_room(*scratch, contactors->count);
  in_slices(contactors->count, [&](std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) {
      const std::int32_t body = contactors->body.values[i];
      carrier_of_[i] = body < 0 ? std::int32_t(bodies->count) - 1 - body : body;
      placed_on_of_[i] = std::max(body, 0);
    }
  });
  for (std::size_t k = 0; k < mapped->apart.size(); ++k)
    carrier_of_[mapped->apart[k]] = std::int32_t(bodies->count) + mapped->apart_carrier[k];
  carrier = carrier_of_.begin();
  placed_on = placed_on_of_.begin();
}

void PlacedScene::place_mapped() {
  for (std::size_t k = 0; k < mapped->contactor.size(); ++k) {
    const std::int64_t i = mapped->contactor[k];
    for (int d = 0; d < dim; ++d) centre[i * dim + d] = mapped->centre[k * std::size_t(dim) + std::size_t(d)];
    for (int d = 0; d < dim; ++d)
      if (!std::isfinite(centre[i * dim + d]))
        throw Error("position: " + name_of(*contactors, *bodies, i) +
                    " stands nowhere; check the velocities of its nodes, forces and the step before");
    for (int d = 0; d < dim && contactors->direction.active; ++d)
      direction[i * (dim + 1) + d] = mapped->direction[k * std::size_t(dim) + std::size_t(d)];
    if (!(mapped->half_length[k] > 0) || !contactors->direction.active) continue;
    // Round ends keep a body that touches itself from catching on its corners, as bars of these lengths do.
    if (k < mapped->apart_depth.size() && mapped->apart_depth[k] > 0) continue;
    double& half = direction[i * (dim + 1) + dim];  // which the body that it was declared with has
    if (!(mapped->half_length[k] > half)) continue; // shortened bars catch on nodes that slide past their ends
    reach[i] += mapped->half_length[k] - half;
    half = mapped->half_length[k];
  }
}

// Makes room for all contactors, and forgets where they were.
void PlacedScene::begin_again() {
  const std::int64_t n = contactors->count;
  const Hulls& hulls = contactors->hulls;
  const std::int32_t* hull = contactors->hull.values.data();
  again_.known = true;
  again_.memory.begin();
  for (auto* array : {&again_.centre, &again_.direction, &again_.reach, &again_.turned, &again_.box}) *array = {};
  again_.hull_place = {};
  again_.centre.make_room(again_.memory, n * dim);
  again_.reach.make_room(again_.memory, n);
  if (contactors->direction.active) again_.direction.make_room(again_.memory, n * (dim + 1));
  again_.box.make_room(again_.memory, 2 * dim * n);
  again_.hull_place.make_room(again_.memory, n);
  std::int64_t next = 0;
  for (std::int64_t i = 0; i < n; ++i) {
    again_.hull_place[i] = next;
    if (hull[i] >= 0) next += std::int64_t(dim) * (hulls.vertices(hull[i]) + hulls.faces(hull[i]));
  }
  again_.turned.make_room(again_.memory, next);
  for (auto* list : {&again_.seen, &again_.placed}) list->assign(std::size_t(n), 0);
  for (auto* list : {&again_.body_seen, &again_.pose_number}) list->assign(std::size_t(bodies->count), 0);
  again_.pose.assign(std::size_t(bodies->count) * 7, 0);
}

// Number of the pose of a body, a new one if it moved since the last call.
std::int64_t PlacedScene::pose_number(std::int32_t body) {
  std::int64_t& number = again_.pose_number[std::size_t(body)];
  if (again_.body_seen[std::size_t(body)] == again_.calls) return number;
  again_.body_seen[std::size_t(body)] = again_.calls;
  const int turns = dim == 2 ? 1 : 4;
  double pose[7] = {};
  std::copy_n(position + std::int64_t(body) * dim, dim, pose);
  if (rotation) std::copy_n(rotation + std::int64_t(body) * turns, turns, pose + 3);
  double* last = &again_.pose[7 * std::size_t(body)];
  if (number > 0 && std::equal(pose, pose + 7, last)) return number;
  std::copy_n(pose, 7, last);
  return ++number;
}

// False if a contactor stands nowhere.
bool PlacedScene::place_again(std::int64_t i) {
  const Hulls& hulls = contactors->hulls;
  const std::int64_t pose = pose_number(placed_on[i]);
  const double far = contactors->radius.values[std::size_t(i)] + margin->constant / 2;
  std::int64_t& placed = again_.placed[std::size_t(i)];
  if (placed == pose && !(reach[i] < far || far < reach[i])) return true;
  placed = pose;
  std::int64_t at_centre = -1;
  const double* offset = contactors->offset.active ? contactors->offset.values.data() : nullptr;
  cairn_contactor_centres(dim, i, i + 1, placed_on, position, offset != nullptr, offset, rotation != nullptr, rotation,
                          centre.data(), &at_centre);
  if (contactors->direction.active)
    cairn_contactor_directions(dim, i, i + 1, placed_on, contactors->direction.values.data(), rotation != nullptr,
                               rotation, direction.data());
  reach[i] = far;
  cairn_hull_place(dim, i, i + 1, placed_on, contactors->hull.values.data(), hull_place.data(),
                   hulls.first_vertex.data(), hulls.first_face.data(), hulls.vertex.data(), hulls.normal.data(),
                   hulls.offset.data(), rotation != nullptr, rotation, contactors->radius.values.data(), reach.data(),
                   turned.data(), box.data());
  return at_centre < 0;
}

// Places the hulls of the pairs of the last search alone, each once: triangles far from all bodies cost nothing, and
// those of bodies that stay where they are, little.
void PlacedScene::place_hulls_again(const OrderedPairs& last) {
  name_carriers();
  if (!again_.known) begin_again();
  centre = again_.centre;
  direction = again_.direction;
  reach = again_.reach;
  turned = again_.turned;
  box = again_.box;
  hull_place = again_.hull_place;
  ++again_.calls;
  std::int64_t bad = -1;
  for (int k = 0; k < kinds; ++k) {
    if (!pair_kinds[k].hull_contact) continue;
    for (std::int64_t p = k > 0 ? last.kind_end[std::size_t(k - 1)] : 0; p < last.kind_end[std::size_t(k)]; ++p)
      for (const std::int32_t i : {last.a[p], last.b[p]}) {
        std::int64_t& seen = again_.seen[std::size_t(i)];
        if (seen == again_.calls) continue;
        seen = again_.calls;
        if (!place_again(i)) bad = i;
      }
  }
  if (bad < 0) return;
  again_.known = false;
  throw Error("position: " + name_of(*contactors, *bodies, bad) +
              " stands nowhere; check its velocity, force and the step before");
}

void PlacedScene::place_contactors() {
  again_.known = again_.known && surfaces_known; // hulls may be others
  const std::int64_t n = contactors->count;
  name_carriers();
  list_placed();
  centre.make_room(*scratch, n * dim);
  reach.make_room(*scratch, n);
  if (contactors->direction.active) direction.make_room(*scratch, n * (dim + 1));
  std::int64_t bad_centre = n, bad_reach = n;
  const double* offset = contactors->offset.active ? contactors->offset.values.data() : nullptr;
  const double* turned_from = contactors->direction.active ? contactors->direction.values.data() : nullptr;
  const auto place_some = [&](std::int64_t first, std::int64_t last) {
    std::int64_t at_centre = -1, at_reach = -1;
    cairn_contactor_centres(dim, first, last, placed_on, position, offset != nullptr, offset, rotation != nullptr,
                            rotation, centre.data(), &at_centre);
    if (turned_from)
      cairn_contactor_directions(dim, first, last, placed_on, turned_from, rotation != nullptr, rotation,
                                 direction.data());
    cairn_contactor_reach(
        dim, first, last, contactors->shape.values.data(), int(Shape::segment), contactors->radius.values.data(),
        turned_from, margin->per_contactor ? -1 : margin->constant / 2, margin->per_contactor, reach.data(), &at_reach);
#pragma omp critical(cairn_place_contactors)
    {
      if (at_centre >= 0) bad_centre = std::min(bad_centre, at_centre);
      if (at_reach >= 0) bad_reach = std::min(bad_reach, at_reach);
    }
  };
  each_placed([&](std::int64_t begin, std::int64_t end) {
    in_slices(end - begin, [&](std::int64_t first, std::int64_t last) { place_some(begin + first, begin + last); });
  });
  const std::int32_t carriers = mapped ? mapped->carriers() : 0;
  movable.make_room(*scratch, bodies->count + carriers);
  in_slices(bodies->count, [&](std::int64_t first, std::int64_t last) {
    cairn_pair_movable(bodies->dofs(), first, last, bodies->inverse_mass.values.data(), movable.data());
  });
  if (mapped) std::fill_n(movable.begin() + bodies->count, carriers, std::int8_t(1));
  if (mapped) place_mapped();
  for (std::size_t k = 0; mapped && k < mapped->contactor.size(); ++k) // sides past whose rim it is held
    reach[mapped->contactor[k]] = std::max(reach[mapped->contactor[k]], mapped->hair[k]);
  if (contactors->hull.active) place_hulls();
  check_placed(bad_centre, bad_reach);
}

void PlacedScene::check_placed(std::int64_t bad_centre, std::int64_t bad_reach) const {
  const std::int64_t n = contactors->count;
  if (bad_centre < n) {
    std::string where;
    for (int k = 0; k < dim; ++k) where += (k ? ", " : "") + std::to_string(centre[bad_centre * dim + k]);
    throw Error("position: " + name_of(*contactors, *bodies, bad_centre) + " stands at (" + where +
                ") m, which is no place; check its velocity, force and the step before");
  }
  if (bad_reach < n && margin->per_contactor && std::isfinite(contactors->radius[bad_reach][0]))
    throw Error("velocity: " + name_of(*contactors, *bodies, bad_reach) +
                " moves farther in a step than numbers tell; check its velocity, force and the step before");
  if (bad_reach < n)
    throw Error("radius or margin: " + name_of(*contactors, *bodies, bad_reach) + " has radius + margin " +
                std::to_string(reach[bad_reach]) + " m; give finite lengths, not negative");
}

void PlacedScene::place_hulls() {
  const std::int64_t n = contactors->count;
  const Hulls& hulls = contactors->hulls;
  const std::int32_t* hull = contactors->hull.values.data();
  hull_place.make_room(*scratch, n);
  box.make_room(*scratch, 2 * dim * n);
  std::int64_t next = 0;
  each_placed([&](std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) {
      hull_place[i] = next;
      if (hull[i] >= 0) next += std::int64_t(dim) * (hulls.vertices(hull[i]) + hulls.faces(hull[i]));
    }
  });
  turned.make_room(*scratch, next);
  const auto place_some = [&](std::int64_t first, std::int64_t last, bool turns) {
    cairn_hull_place(dim, first, last, placed_on, hull, hull_place.data(), hulls.first_vertex.data(),
                     hulls.first_face.data(), hulls.vertex.data(), hulls.normal.data(), hulls.offset.data(), turns,
                     rotation, contactors->radius.values.data(), reach.data(), turned.data(), box.data());
  };
  each_placed([&](std::int64_t begin, std::int64_t end) {
    in_slices(end - begin, [&](std::int64_t first, std::int64_t last) {
      place_some(begin + first, begin + last, rotation != nullptr);
    });
  });
  if (!mapped || !rotation) return;
  const std::vector<std::int32_t>& own = mapped->contactor; // their vertices are in space axes as they are
  for (std::size_t k = 0, end = 0; k < own.size(); k = end) {
    for (end = k + 1; end < own.size() && own[end] == own[end - 1] + 1; ++end) {}
    place_some(own[k], own[end - 1] + 1, false);
  }
}

double PlacedScene::into_body(std::int64_t body, const double* at, double* x) const {
  constexpr double rounding = 0x1p-48; // a few units of the last place
  const double* from = position + 3 * body;
  double apart[3], size = 0;
  for (int d = 0; d < 3; ++d) {
    apart[d] = at[d] - from[d];
    size += std::abs(at[d]) + std::abs(from[d]);
  }
  if (!rotation) {
    std::copy_n(apart, 3, x);
  } else {
    turn_about(rotation + 4 * body, -1, apart, x);
  }
  return rounding * size;
}

void PlacedScene::from_centre(std::int32_t a, std::int32_t b, std::int32_t which, double* x) const {
  double shift[3] = {0, 0, 0};
  if (any_periodic) image_shift(*cell, which, shift);
  for (int k = 0; k < dim; ++k) x[k] = centre[std::int64_t(dim) * a + k] - shift[k] - centre[std::int64_t(dim) * b + k];
}

void PlacedScene::vertex_of(std::int32_t c, int i, double* x) const {
  const std::int32_t vertices = contactors->hulls.vertices(contactors->hull.values[c]);
  for (int k = 0; k < dim; ++k) x[k] = turned[hull_place[c] + std::int64_t(k) * vertices + i];
}

void PlacedScene::normal_of(std::int32_t c, int i, double* n) const {
  const std::int32_t hull = contactors->hull.values[c], faces = contactors->hulls.faces(hull);
  const std::int64_t first = hull_place[c] + std::int64_t(dim) * contactors->hulls.vertices(hull);
  for (int k = 0; k < dim; ++k) n[k] = turned[first + std::int64_t(k) * faces + i];
}

} // namespace cairn::detection
