#include "interaction_handler.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "../base/call.hpp"
#include "cairn/core.h"
#include "detection_workspace.hpp"

namespace cairn {

using namespace detection;

namespace {

constexpr std::int64_t cells_at_once = 2048;

// Internal number by id: a table where ids are about as many as their range, as they are; a sorted list where they are
// not.
class IdIndex {
public:
  IdIndex(const std::int64_t* id, std::int64_t n, Array<std::int32_t>& storage) : id_(id), number_(storage) {
    for (std::int64_t i = 0; i < n; ++i) {
      low_ = i == 0 ? id[i] : std::min(low_, id[i]);
      high_ = i == 0 ? id[i] : std::max(high_, id[i]);
    }
    dense_ = n > 0 && std::uint64_t(high_) - std::uint64_t(low_) < std::uint64_t(8 * n + 1024);
    number_.assign(dense_ ? high_ - low_ + 1 : n, -1);
    for (std::int64_t i = 0; i < n; ++i) number_[dense_ ? id[i] - low_ : i] = std::int32_t(i);
    if (!dense_) std::sort(number_.begin(), number_.end(), [&](auto i, auto j) { return id[i] < id[j]; });
  }
  // -1: nobody has this id
  std::int32_t operator()(std::int64_t id) const {
    if (dense_) return id < low_ || id > high_ ? -1 : number_[id - low_];
    const auto at = std::lower_bound(number_.begin(), number_.end(), id, [&](auto i, auto v) { return id_[i] < v; });
    return at == number_.end() || id_[*at] != id ? -1 : *at;
  }

private:
  const std::int64_t* id_;
  Array<std::int32_t>& number_;
  std::int64_t low_ = 0, high_ = 0;
  bool dense_ = false;
};

} // namespace

namespace detection {

std::string name_of(const Contactors& contactors, const Bodies& bodies, std::int64_t i) {
  const bool mapped = contactors.body.values[i] < 0;
  return std::string(info(Shape(contactors.shape.values[i])).name) + " (contactor " +
         std::to_string(contactors.id.values[i]) + ")" + (mapped ? ", part " : " of body ") +
         std::to_string(carrier_id(bodies, contactors, i)) + (mapped ? " of a mesh" : "");
}

} // namespace detection

InteractionHandler::InteractionHandler() : work(std::make_unique<Workspace>()) {}
InteractionHandler::~InteractionHandler() = default;
InteractionHandler::InteractionHandler(InteractionHandler&&) noexcept = default;
InteractionHandler& InteractionHandler::operator=(InteractionHandler&&) noexcept = default;

InteractionHandler::Counts InteractionHandler::counts() const {
  return {work->real_items + std::int64_t(work->walls.size()), work->items - work->real_items};
}

std::int64_t InteractionHandler::searches() const { return work->searches; }

std::vector<DeclaredPair>& InteractionHandler::declared() { return work->declared; }

// Nothing of the last call is left.
void InteractionHandler::Workspace::begin(Scratch& in) {
  scratch = &in;
  in.begin();
  for (auto* array : {&centre, &direction, &reach, &item_x, &item_reach, &turned, &box, &seam_normal, &runs_speed})
    *array = {};
  for (auto* array :
       {&bounded, &item_contactor, &item_lattice, &ghost_of, &place, &carrier_of, &placed_on_of, &runs_of, &runs_start})
    *array = {};
  hull_place = run = {};
  movable = seam_verdict = runs_close = seam_mark = {};
  lists.resize(std::max<std::size_t>(lists.size(), omp_get_max_threads()));
  for (PairList& list : lists) list.begin();
}

void InteractionHandler::detect(const Bodies& bodies, const Contactors& contactors, const Cell& cell,
                                const Margin& margin, Candidates& out, const Configuration& configuration,
                                Scratch* scratch, const LawRules* rules) {
  Workspace& w = *work;
  out.count = 0;
  w.begin(scratch ? *scratch : w.own);
  w.bodies = &bodies;
  w.contactors = &contactors;
  w.cell = &cell;
  w.margin = &margin;
  w.rules = rules;
  w.dim = bodies.dim;
  w.position = configuration.position ? configuration.position : bodies.position.values.data();
  w.rotation = configuration.rotation   ? configuration.rotation
               : bodies.rotation.active ? bodies.rotation.values.data()
                                        : nullptr;
  static constexpr double at_origin[4] = {0, 0, 0, 0}, unturned[4] = {1, 0, 0, 0};
  if (bodies.count == 0) { // contactors mapped from nodes are first placed at a body
    w.position = at_origin;
    if (w.rotation) w.rotation = w.dim == 2 ? at_origin : unturned;
  }
  w.for_bonds = configuration.for_bonds;
  w.hulls_again = configuration.hulls_again;
  w.step = configuration.step;
  w.mapped = configuration.mapped && !configuration.mapped->contactor.empty() ? configuration.mapped : nullptr;
  for (int k = 0; k < 3; ++k) w.periodic[k] = k < w.dim && cell.periodic[k];
  w.any_periodic = w.periodic[0] || w.periodic[1] || w.periodic[2];
  w.check();
  w.place_contactors();
  const OrderedPairs& pairs = w.seek(configuration.soon_again && w.may_keep());
  w.narrow(pairs, out);
  w.hold_at_rims(pairs, configuration.seats, out);
}

// True if pairs can be kept: results depend only on positions, which change by no more than contactors move. So for
// balls, and for walls and bars at constant direction; a user's routine may depend on anything.
bool InteractionHandler::Workspace::may_keep() const {
  return declared.empty() && !mapped && !any_periodic && !contactors->hull.active &&
         std::all_of(std::begin(pair_kinds), std::end(pair_kinds),
                     [](const PairKind& kind) { return kind.contact == kind.built_in; });
}

SearchedScene InteractionHandler::Workspace::searched() const {
  return {contactors,    rules,         dim,
          bodies->count, centre.data(), contactors->direction.active ? direction.data() : nullptr,
          reach.data(),  movable.data()};
}

// The pairs that may count, of this search or kept from an earlier one.
const OrderedPairs& InteractionHandler::Workspace::seek(bool keeps) {
  wall_skin = 0;
  if (hulls_again) return again;
  if (keeps && kept.hold(searched())) {
    kept.used();
    return kept.pairs;
  }
  ++searches;
  keeps = keeps && kept.pays();
  if (keeps) wall_skin = kept.widen(searched(), reach.data());
  make_items();
  search_grid();
  search_walls();
  add_declared();
  OrderedPairs& pairs = keeps ? kept.pairs : found;
  order_pairs(pairs);
  if (keeps) kept.keep();
  return pairs;
}

void InteractionHandler::Workspace::check() const {
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

void InteractionHandler::Workspace::check_cell() const {
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

void InteractionHandler::Workspace::name_carriers() {
  carrier = placed_on = contactors->body.values.data();
  if (!mapped) return;
  carrier_of.make_room(*scratch, contactors->count);
  placed_on_of.make_room(*scratch, contactors->count);
  in_slices(contactors->count, [&](std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) {
      const std::int32_t body = contactors->body.values[i];
      carrier_of[i] = body < 0 ? std::int32_t(bodies->count) - 1 - body : body;
      placed_on_of[i] = std::max(body, 0);
    }
  });
  for (std::size_t k = 0; k < mapped->apart.size(); ++k)
    carrier_of[mapped->apart[k]] = std::int32_t(bodies->count) + mapped->apart_carrier[k];
  carrier = carrier_of.begin();
  placed_on = placed_on_of.begin();
}

void InteractionHandler::Workspace::place_mapped() {
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

// Places the hulls of the pairs of the last search alone, each once: triangles far from all bodies cost nothing.
void InteractionHandler::Workspace::place_hulls_again() {
  find_near_again();
  const std::int64_t n = contactors->count;
  const Hulls& hulls = contactors->hulls;
  const std::int32_t* hull = contactors->hull.values.data();
  const double* offset = contactors->offset.active ? contactors->offset.values.data() : nullptr;
  const double* turned_from = contactors->direction.active ? contactors->direction.values.data() : nullptr;
  name_carriers();
  centre.make_room(*scratch, n * dim);
  reach.make_room(*scratch, n);
  if (turned_from) direction.make_room(*scratch, n * (dim + 1));
  hull_place.make_room(*scratch, n);
  box.make_room(*scratch, 2 * dim * n);
  placed_again.clear();
  mark_again.resize(std::size_t(n), 0);
  std::int64_t next = 0, bad = -1;
  for (int k = 0; k < kinds; ++k) {
    if (!pair_kinds[k].hull_contact) continue;
    for (std::int64_t p = k > 0 ? again.kind_end[std::size_t(k - 1)] : 0; p < again.kind_end[std::size_t(k)]; ++p)
      for (const std::int32_t i : {again.a[p], again.b[p]}) {
        if (mark_again[std::size_t(i)]) continue;
        mark_again[std::size_t(i)] = 1;
        placed_again.push_back(i);
        hull_place[i] = next;
        if (hull[i] >= 0) next += std::int64_t(dim) * (hulls.vertices(hull[i]) + hulls.faces(hull[i]));
      }
  }
  turned.make_room(*scratch, next);
  for (const std::int32_t i : placed_again) {
    mark_again[std::size_t(i)] = 0;
    std::int64_t at_centre = -1;
    cairn_contactor_centres(dim, i, i + 1, placed_on, position, offset != nullptr, offset, rotation != nullptr,
                            rotation, centre.data(), &at_centre);
    if (at_centre >= 0) bad = i;
    if (turned_from)
      cairn_contactor_directions(dim, i, i + 1, placed_on, turned_from, rotation != nullptr, rotation,
                                 direction.data());
    reach[i] = contactors->radius.values[std::size_t(i)] + margin->constant / 2;
    cairn_hull_place(dim, i, i + 1, placed_on, hull, hull_place.data(), hulls.first_vertex.data(),
                     hulls.first_face.data(), hulls.vertex.data(), hulls.normal.data(), hulls.offset.data(),
                     rotation != nullptr, rotation, contactors->radius.values.data(), reach.data(), turned.data(),
                     box.data());
  }
  if (bad >= 0)
    throw Error("position: " + name_of(*contactors, *bodies, bad) +
                " stands nowhere; check its velocity, force and the step before");
}

void InteractionHandler::Workspace::place_contactors() {
  if (hulls_again) return place_hulls_again();
  const std::int64_t n = contactors->count;
  name_carriers();
  centre.make_room(*scratch, n * dim);
  reach.make_room(*scratch, n);
  if (contactors->direction.active) direction.make_room(*scratch, n * (dim + 1));
  std::int64_t bad_centre = n, bad_reach = n;
  const double* offset = contactors->offset.active ? contactors->offset.values.data() : nullptr;
  const double* turned_from = contactors->direction.active ? contactors->direction.values.data() : nullptr;
  in_slices(n, [&](std::int64_t first, std::int64_t last) {
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

void InteractionHandler::Workspace::place_hulls() {
  const std::int64_t n = contactors->count;
  const Hulls& hulls = contactors->hulls;
  const std::int32_t* hull = contactors->hull.values.data();
  hull_place.make_room(*scratch, n);
  box.make_room(*scratch, 2 * dim * n);
  std::int64_t next = 0;
  for (std::int64_t i = 0; i < n; ++i) {
    hull_place[i] = next;
    if (hull[i] >= 0) next += std::int64_t(dim) * (hulls.vertices(hull[i]) + hulls.faces(hull[i]));
  }
  turned.make_room(*scratch, next);
  const auto place_some = [&](std::int64_t first, std::int64_t last, bool turns) {
    cairn_hull_place(dim, first, last, placed_on, hull, hull_place.data(), hulls.first_vertex.data(),
                     hulls.first_face.data(), hulls.vertex.data(), hulls.normal.data(), hulls.offset.data(), turns,
                     rotation, contactors->radius.values.data(), reach.data(), turned.data(), box.data());
  };
  in_slices(n, [&](std::int64_t first, std::int64_t last) { place_some(first, last, rotation != nullptr); });
  if (!mapped || !rotation) return;
  const std::vector<std::int32_t>& own = mapped->contactor; // their vertices are in space axes as they are
  for (std::size_t k = 0, end = 0; k < own.size(); k = end) {
    for (end = k + 1; end < own.size() && own[end] == own[end - 1] + 1; ++end) {}
    place_some(own[k], own[end - 1] + 1, false);
  }
}

// Walls are kept apart; all else is an item of the grid, and in a periodic cell so are its ghosts.
void InteractionHandler::Workspace::make_items() {
  const std::int64_t n = contactors->count;
  bounded.make_room(*scratch, n);
  walls.clear();
  std::int64_t nb = 0;
  const std::int16_t* shape = contactors->shape.values.data();
  for (std::int64_t i = 0; i < n; ++i) {
    if (shape_table[shape[i]].bounded)
      bounded[nb++] = std::int32_t(i);
    else
      walls.push_back(std::int32_t(i));
  }
  items = real_items = nb;
  if (!any_periodic) {
    if (nb == n) return; // the contactors themselves are the items
    item_x.make_room(*scratch, nb * dim);
    item_reach.make_room(*scratch, nb);
    in_slices(nb, [&](std::int64_t first, std::int64_t last) {
      for (std::int64_t i = first; i < last; ++i) {
        for (int k = 0; k < dim; ++k) item_x[i * dim + k] = centre[std::int64_t(bounded[i]) * dim + k];
        item_reach[i] = reach[bounded[i]];
      }
    });
    return;
  }
  // Which lattice points are in reach does not depend on where the cell begins.
  const double no_corner[3] = {0, 0, 0};
  std::int64_t ghosts = 0, too_wide = -1, capacity = std::max<std::int64_t>(std::int64_t(item_reach.size()) - nb, 0);
  for (;;) {
    item_x.make_room(*scratch, (nb + capacity) * dim);
    item_reach.make_room(*scratch, nb + capacity);
    item_lattice.make_room(*scratch, (nb + capacity) * 3);
    item_contactor.make_room(*scratch, nb + capacity);
    ghost_of.make_room(*scratch, capacity);
    cairn_periodic_items(dim, nb, bounded.data(), centre.data(), reach.data(), periodic, cell->vectors, no_corner,
                         item_x.data(), item_reach.data(), item_lattice.data());
    cairn_periodic_ghosts(dim, 0, nb, item_x.data(), item_reach.data(), item_lattice.data(), periodic, cell->vectors,
                          no_corner, capacity, ghost_of.data(), item_x.data() + nb * dim, item_reach.data() + nb,
                          item_lattice.data() + 3 * nb, &ghosts, &too_wide);
    if (too_wide >= 0)
      throw Error("cell: " + name_of(*contactors, *bodies, bounded[too_wide]) +
                  " is more than 511 cells wide; enlarge the cell or lower the margin");
    if (ghosts <= capacity) break;
    capacity = ghosts + ghosts / 4;
    if (nb + capacity > std::numeric_limits<std::int32_t>::max())
      throw Error("cell: it is so small beside the contactors that " + std::to_string(ghosts) +
                  " periodic images may meet; enlarge the cell");
  }
  items = nb + ghosts;
  std::copy_n(bounded.begin(), nb, item_contactor.begin());
  for (std::int64_t g = 0; g < ghosts; ++g) item_contactor[nb + g] = bounded[ghost_of[g]];
}

// Keeps what may be a contact of the `added` pairs at the end of a list.
void InteractionHandler::Workspace::admit(PairList& list, std::int64_t added) const {
  std::int64_t kept = 0;
  const std::int64_t at = list.count;
  const LawRules::Arrays filter = rules ? rules->arrays() : LawRules::Arrays{};
  cairn_pair_admit(added, list.a + at, list.b + at, list.image + at, shapes, kind_table.kind, kind_table.turn, carrier,
                   contactors->shape.values.data(), contactors->id.values.data(), movable.data(),
                   rules && !rules->all_meet(), contactors->material.values.data(), filter.meet, filter.word,
                   filter.apart, filter.alone, filter.any, filter.places, filter.key, filter.rule, list.kind + at,
                   &kept);
  if (mapped && !mapped->apart.empty()) { // sides next to a point of the same body are none that it may meet
    std::int64_t to = at;
    for (std::int64_t i = at; i < at + kept; ++i) {
      if (same_mesh(list.a[i], list.b[i]) && mapped->are_near(list.a[i], list.b[i])) continue;
      list.a[to] = list.a[i];
      list.b[to] = list.b[i];
      list.image[to] = list.image[i];
      list.kind[to++] = list.kind[i];
    }
    kept = to - at;
  }
  list.count += kept;
}

void InteractionHandler::Workspace::search_grid() {
  const bool direct = !any_periodic && items == contactors->count;
  grid.build(dim, items, direct ? centre.data() : item_x.data(), direct ? reach.data() : item_reach.data(), *scratch);
  const std::int64_t chunks = (grid.cells() + cells_at_once - 1) / cells_at_once;
#pragma omp parallel for schedule(dynamic) if (chunks > 1)
  for (std::int64_t c = 0; c < chunks; ++c) {
    PairList& list = lists[omp_get_thread_num()];
    const std::int64_t last = std::min((c + 1) * cells_at_once, grid.cells());
    std::int64_t found = grid.search(c * cells_at_once, last, list.hits);
    list.reserve(list.count + found, *scratch);
    std::int32_t *a = list.a + list.count, *b = list.b + list.count, *image = list.image + list.count;
    if (any_periodic)
      cairn_pairs_of_ghosts(found, list.hits.data(), grid.order(), item_contactor.data(), real_items,
                            item_lattice.data(), item_reach.data(), a, b, image, &found);
    else
      cairn_pairs_of_hits(found, list.hits.data(), grid.order(), bounded.data(), a, b, image);
    if (dim == 2 && contactors->direction.active)
      cairn_bar_search(found, a, b, image, int(Shape::segment), contactors->shape.values.data(), centre.data(),
                       direction.data(), reach.data(), cell->vectors, &found);
    if (contactors->hull.active)
      cairn_box_search(dim, found, a, b, image, centre.data(), box.data(), cell->vectors, &found);
    admit(list, found);
  }
}

void InteractionHandler::Workspace::search_walls() {
  if (walls.empty() || real_items == 0) return;
  for (std::int32_t wall : walls) {
    const double* origin = &centre[std::int64_t(wall) * dim];
    const ShapeInfo& shape = info(Shape(contactors->shape.values[wall]));
    const double* axis = shape.directed ? &direction[std::int64_t(wall) * (dim + 1)] : nullptr;
    in_slices(real_items, [&](std::int64_t first, std::int64_t last) {
      PairList& list = lists[omp_get_thread_num()];
      list.reserve(list.count + (last - first), *scratch);
      std::int32_t* near = list.a + list.count;
      std::int64_t found = 0;
      if (shape.hollow())
        cairn_tube_search(dim, last - first, bounded.data() + first, centre.data(), reach.data(), origin, axis,
                          contactors->radius.values[wall], share(wall) + wall_skin, last - first, near, &found);
      else
        cairn_plane_search(dim, last - first, bounded.data() + first, centre.data(), reach.data(), origin, axis,
                           share(wall) + wall_skin, last - first, near, &found);
      std::fill_n(list.b + list.count, found, wall);
      std::fill_n(list.image + list.count, found, own_image);
      admit(list, found);
    });
  }
}

std::int32_t InteractionHandler::Workspace::nearest_image(std::int64_t a, std::int64_t b) const {
  const auto bounded = [&](std::int64_t i) { return info(Shape(contactors->shape.values[i])).bounded; };
  if (!any_periodic || !bounded(a) || !bounded(b)) return own_image;
  double d[3] = {0, 0, 0};
  for (int k = 0; k < dim; ++k) d[k] = centre[a * dim + k] - centre[b * dim + k];
  double base[3] = {0, 0, 0};
  for (int k = dim - 1; k >= 0; --k) {
    if (!periodic[k]) continue;
    base[k] = std::round(d[k] / cell->vectors[4 * k]);
    for (int i = 0; i <= k; ++i) d[i] -= base[k] * cell->vectors[i + 3 * k];
  }
  // a cell that leans by less than its width has the nearest image among the neighbours of this one
  double nearest = std::numeric_limits<double>::infinity();
  std::int32_t image = -1;
  for (int mz = -periodic[2]; mz <= periodic[2]; ++mz)
    for (int my = -periodic[1]; my <= periodic[1]; ++my)
      for (int mx = -periodic[0]; mx <= periodic[0]; ++mx) {
        const double m[3] = {base[0] + mx, base[1] + my, base[2] + mz};
        double distance = 0;
        for (int i = 0; i < 3; ++i) {
          double e = d[i];
          for (int k = 0; k < 3; ++k) e -= (m[k] - base[k]) * cell->vectors[i + 3 * k];
          distance += e * e;
        }
        if (distance >= nearest) continue;
        nearest = distance;
        const bool encodable = std::max({std::abs(m[0]), std::abs(m[1]), std::abs(m[2])}) <= 511;
        image = encodable ? encode_image(int(m[0]), int(m[1]), int(m[2])) : -1;
      }
  return image;
}

void InteractionHandler::Workspace::add_declared() {
  if (declared.empty()) return;
  const IdIndex number(contactors->id.values.data(), contactors->count, number_of_id);
  PairList& list = lists[0];
  list.reserve(list.count + std::int64_t(declared.size()), *scratch);
  for (const auto& [first, second] : declared) {
    std::int32_t a = number(std::min(first, second)), b = number(std::max(first, second));
    if (a < 0 || b < 0) continue;
    const int at = contactors->shape.values[a] + shapes * contactors->shape.values[b];
    if (kind_table.kind[at] < 0)
      throw Error("declared pair: " + name_of(*contactors, *bodies, a) + " and " + name_of(*contactors, *bodies, b) +
                  " have shapes between which no contact is defined");
    if (carrier[a] == carrier[b])
      throw Error("declared pair: " + name_of(*contactors, *bodies, a) + " and " + name_of(*contactors, *bodies, b) +
                  " are the same body; declare pairs of different bodies");
    if (kind_table.turn[at] == 1) std::swap(a, b);
    const std::int64_t i = list.count++;
    list.a[i] = a;
    list.b[i] = b;
    list.kind[i] = kind_table.kind[at];
    list.image[i] = nearest_image(a, b);
    if (list.image[i] >= 0) list.image[i] |= declared_bit;
  }
}

// Counting sort by (kind, a), then each candidate's few pairs by b and image.
void InteractionHandler::Workspace::order_pairs(OrderedPairs& out) {
  const std::int64_t n = contactors->count;
  std::int64_t pairs = 0;
  bool present[kinds] = {};
  for (const PairList& list : lists) {
    pairs += list.count;
    for (std::int64_t i = 0; i < list.count; ++i) {
      present[list.kind[i]] = true;
      if (list.image[i] < 0)
        throw Error("position: " + name_of(*contactors, *bodies, list.a[i]) + " and " +
                    name_of(*contactors, *bodies, list.b[i]) +
                    " are more than 511 cells apart; bring the bodies back into the periodic cell");
    }
  }
  if (pairs > std::numeric_limits<std::int32_t>::max())
    throw Error("detection: " + std::to_string(pairs) + " pairs are within reach, more than one process can number; " +
                "lower the margin or check radii and positions");
  std::int32_t slots = 0;
  for (int k = 0; k < kinds; ++k) slot_of_kind[k] = present[k] ? slots++ : slots;
  place.make_room(*scratch, n * slots + 1);
  std::fill_n(place.begin(), n * slots, 0);
  for (const PairList& list : lists) cairn_pair_count(list.count, n, slot_of_kind, list.kind, list.a, place.data());
  cairn_pair_starts(n * slots, place.data());
  for (auto* array : {&out.a, &out.b, &out.image}) fit(*array, pairs);
  for (const PairList& list : lists)
    cairn_pair_scatter(list.count, n, slot_of_kind, list.kind, list.a, list.b, list.image, place.data(), out.a.data(),
                       out.b.data(), out.image.data());
  in_slices(n * slots, [&](std::int64_t first, std::int64_t last) {
    cairn_pair_tidy(first, last, place.data(), out.b.data(), out.image.data());
  });
  out.kind_end.resize(kinds);
  for (int k = 0; k < kinds; ++k) {
    const std::int64_t end = (slot_of_kind[k] + (present[k] ? 1 : 0)) * n;
    out.kind_end[k] = end == 0 ? 0 : place[end - 1];
  }
}

std::size_t InteractionHandler::bytes() const {
  const Workspace& w = *work;
  std::size_t total = w.grid.bytes() + w.own.bytes() + w.recalled.bytes() + w.found.bytes() + w.kept.bytes() +
                      bytes_of(w.number_of_id) + bytes_of(w.pieces);
  for (const PairList& list : w.lists) total += bytes_of(list.hits);
  return total;
}

} // namespace cairn
