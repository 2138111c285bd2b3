#include "broad_phase.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "../base/call.hpp"
#include "cairn/core.h"

namespace cairn::detection {

namespace {

constexpr std::int64_t cells_at_once = 2048;

} // namespace

void BroadPhase::begin() {
  for (auto* array : {&item_x_, &item_reach_}) *array = {};
  for (auto* array : {&bounded_, &item_contactor_, &item_lattice_, &ghost_of_, &place_}) *array = {};
  triangle_ = {};
  lists_.resize(std::max<std::size_t>(lists_.size(), omp_get_max_threads()));
  for (PairList& list : lists_) list.begin();
}

void BroadPhase::search(DeclaredPairs& declared, double wall_skin, OrderedPairs& out) {
  make_items();
  search_grid();
  search_walls(wall_skin);
  if (scene_.facets_apart)
    search_surfaces();
  else
    trees_made_ = false;
  declared.add_to(lists_[0], scene_);
  order_pairs(out);
}

// Walls are kept apart; all else is an item of the grid, and in a periodic cell so are its ghosts.
void BroadPhase::make_items() {
  const std::int64_t n = scene_.contactors->count;
  bounded_.make_room(*scene_.scratch, n);
  walls_.clear();
  std::int64_t nb = 0;
  const std::int16_t* shape = scene_.contactors->shape.values.data();
  scene_.each_placed([&](std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) {
      if (shape_table[shape[i]].bounded)
        bounded_[nb++] = std::int32_t(i);
      else
        walls_.push_back(std::int32_t(i));
    }
  });
  items_ = real_items_ = nb;
  if (scene_.any_periodic) return make_ghosts();
  if (nb == n) return; // the contactors themselves are the items
  item_x_.make_room(*scene_.scratch, nb * scene_.dim);
  item_reach_.make_room(*scene_.scratch, nb);
  in_slices(nb, [&](std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) {
      for (int k = 0; k < scene_.dim; ++k)
        item_x_[i * scene_.dim + k] = scene_.centre[std::int64_t(bounded_[i]) * scene_.dim + k];
      item_reach_[i] = scene_.reach[bounded_[i]];
    }
  });
}

// Adds the periodic images that may meet contactors of the scene.
void BroadPhase::make_ghosts() {
  const std::int64_t nb = real_items_;
  // Which lattice points are in reach does not depend on where the cell begins.
  const double no_corner[3] = {0, 0, 0};
  std::int64_t ghosts = 0, too_wide = -1, capacity = std::max<std::int64_t>(std::int64_t(item_reach_.size()) - nb, 0);
  for (;;) {
    item_x_.make_room(*scene_.scratch, (nb + capacity) * scene_.dim);
    item_reach_.make_room(*scene_.scratch, nb + capacity);
    item_lattice_.make_room(*scene_.scratch, (nb + capacity) * 3);
    item_contactor_.make_room(*scene_.scratch, nb + capacity);
    ghost_of_.make_room(*scene_.scratch, capacity);
    cairn_periodic_items(scene_.dim, nb, bounded_.data(), scene_.centre.data(), scene_.reach.data(), scene_.periodic,
                         scene_.cell->vectors, no_corner, item_x_.data(), item_reach_.data(), item_lattice_.data());
    cairn_periodic_ghosts(scene_.dim, 0, nb, item_x_.data(), item_reach_.data(), item_lattice_.data(), scene_.periodic,
                          scene_.cell->vectors, no_corner, capacity, ghost_of_.data(), item_x_.data() + nb * scene_.dim,
                          item_reach_.data() + nb, item_lattice_.data() + 3 * nb, &ghosts, &too_wide);
    if (too_wide >= 0)
      throw Error("cell: " + name_of(*scene_.contactors, *scene_.bodies, bounded_[too_wide]) +
                  " is more than 511 cells wide; enlarge the cell or lower the margin");
    if (ghosts <= capacity) break;
    capacity = ghosts + ghosts / 4;
    if (nb + capacity > std::numeric_limits<std::int32_t>::max())
      throw Error("cell: it is so small beside the contactors that " + std::to_string(ghosts) +
                  " periodic images may meet; enlarge the cell");
  }
  items_ = nb + ghosts;
  std::copy_n(bounded_.begin(), nb, item_contactor_.begin());
  for (std::int64_t g = 0; g < ghosts; ++g) item_contactor_[nb + g] = bounded_[ghost_of_[g]];
}

// Keeps what may be a contact of the `added` pairs at the end of a list.
void BroadPhase::admit(PairList& list, std::int64_t added) const {
  std::int64_t kept = 0;
  const std::int64_t at = list.count;
  const LawRules::Arrays filter = scene_.rules ? scene_.rules->arrays() : LawRules::Arrays{};
  cairn_pair_admit(added, list.a + at, list.b + at, list.image + at, shapes, kind_table.kind, kind_table.turn,
                   scene_.carrier, scene_.contactors->shape.values.data(), scene_.contactors->id.values.data(),
                   scene_.movable.data(), scene_.rules && !scene_.rules->all_meet(),
                   scene_.contactors->material.values.data(), filter.meet, filter.word, filter.apart, filter.alone,
                   filter.any, filter.places, filter.key, filter.rule, list.kind + at, &kept);
  if (scene_.mapped &&
      !scene_.mapped->apart.empty()) { // sides next to a point of the same body are none that it may meet
    std::int64_t to = at;
    for (std::int64_t i = at; i < at + kept; ++i) {
      if (scene_.same_mesh(list.a[i], list.b[i]) && scene_.mapped->are_near(list.a[i], list.b[i])) continue;
      list.a[to] = list.a[i];
      list.b[to] = list.b[i];
      list.image[to] = list.image[i];
      list.kind[to++] = list.kind[i];
    }
    kept = to - at;
  }
  list.count += kept;
}

// Items that are triangles, which meet no triangles (pairs.def); null if there are none.
const std::int8_t* BroadPhase::triangles() {
  if (!scene_.contactors->hull.active || scene_.dim == 2) return nullptr;
  triangle_.make_room(*scene_.scratch, items_);
  const std::int16_t* shape = scene_.contactors->shape.values.data();
  const std::int32_t* contactor = scene_.any_periodic ? item_contactor_.begin() : bounded_.begin();
  bool any = false;
  for (std::int64_t i = 0; i < items_; ++i) {
    triangle_[i] = shape[contactor[i]] == std::int16_t(Shape::facet);
    any = any || triangle_[i];
  }
  return any ? triangle_.begin() : nullptr;
}

void BroadPhase::search_grid() {
  const bool direct = !scene_.any_periodic && items_ == scene_.contactors->count;
  grid_.build(scene_.dim, items_, direct ? scene_.centre.data() : item_x_.data(),
              direct ? scene_.reach.data() : item_reach_.data(), *scene_.scratch, triangles());
  const std::int64_t chunks = (grid_.cells() + cells_at_once - 1) / cells_at_once;
#pragma omp parallel for schedule(dynamic) if (chunks > 1)
  for (std::int64_t c = 0; c < chunks; ++c) {
    PairList& list = lists_[omp_get_thread_num()];
    const std::int64_t last = std::min((c + 1) * cells_at_once, grid_.cells());
    std::int64_t found = grid_.search(c * cells_at_once, last, list.hits);
    list.reserve(list.count + found, *scene_.scratch);
    std::int32_t *a = list.a + list.count, *b = list.b + list.count, *image = list.image + list.count;
    if (scene_.any_periodic)
      cairn_pairs_of_ghosts(found, list.hits.data(), grid_.order(), item_contactor_.data(), real_items_,
                            item_lattice_.data(), item_reach_.data(), a, b, image, &found);
    else
      cairn_pairs_of_hits(found, list.hits.data(), grid_.order(), bounded_.data(), a, b, image);
    if (scene_.dim == 2 && scene_.contactors->direction.active)
      cairn_bar_search(found, a, b, image, int(Shape::segment), scene_.contactors->shape.values.data(),
                       scene_.centre.data(), scene_.direction.data(), scene_.reach.data(), scene_.cell->vectors,
                       &found);
    if (scene_.contactors->hull.active)
      cairn_box_search(scene_.dim, found, a, b, image, scene_.centre.data(), scene_.box.data(), scene_.cell->vectors,
                       &found);
    admit(list, found);
  }
}

void BroadPhase::search_walls(double wall_skin) {
  if (walls_.empty() || real_items_ == 0) return;
  for (std::int32_t wall : walls_) {
    const double* origin = &scene_.centre[std::int64_t(wall) * scene_.dim];
    const ShapeInfo& shape = scene_.shape(wall);
    const double* axis = shape.directed ? &scene_.direction[std::int64_t(wall) * (scene_.dim + 1)] : nullptr;
    in_slices(real_items_, [&](std::int64_t first, std::int64_t last) {
      PairList& list = lists_[omp_get_thread_num()];
      list.reserve(list.count + (last - first), *scene_.scratch);
      std::int32_t* near = list.a + list.count;
      std::int64_t found = 0;
      if (shape.hollow())
        cairn_tube_search(scene_.dim, last - first, bounded_.data() + first, scene_.centre.data(), scene_.reach.data(),
                          origin, axis, scene_.contactors->radius.values[wall], scene_.share(wall) + wall_skin,
                          last - first, near, &found);
      else
        cairn_plane_search(scene_.dim, last - first, bounded_.data() + first, scene_.centre.data(), scene_.reach.data(),
                           origin, axis, scene_.share(wall) + wall_skin, last - first, near, &found);
      std::fill_n(list.b + list.count, found, wall);
      std::fill_n(list.image + list.count, found, own_image);
      admit(list, found);
    });
  }
}

void BroadPhase::search_surfaces() {
  if (!scene_.surfaces_known || !trees_made_) trees_.make(*scene_.contactors);
  trees_made_ = true;
  for (const FacetTrees::Tree& tree : trees_.trees()) {
    for (int d = 0; d < 3; ++d)
      if (!std::isfinite(scene_.position[3 * std::int64_t(tree.body()) + d]))
        throw Error("position: " + name_of(*scene_.contactors, *scene_.bodies, tree.facets()[0]) +
                    " stands nowhere; check its velocity, force and the step before");
    search_surface(tree);
  }
}

// Contactors near the triangles of a body.
void BroadPhase::search_surface(const FacetTrees::Tree& tree) {
  constexpr double on_the_safe_side = 1 + 1e-6;
  double share = 0;
  for (const std::int32_t facet : tree.facets()) {
    share = std::max(share, scene_.share(facet));
    if (!scene_.margin->per_contactor) break;
  }
  in_slices(real_items_, [&](std::int64_t first, std::int64_t last) {
    PairList& list = lists_[omp_get_thread_num()];
    Array<std::int32_t>& facets = list.hits;
    for (std::int64_t k = first; k < last; ++k) {
      const std::int32_t i = bounded_[k];
      if (scene_.carrier[i] == tree.body()) continue;
      double x[3];
      const double rounded = scene_.into_body(tree.body(), &scene_.centre[3 * std::int64_t(i)], x);
      facets.clear();
      tree.find(x, (scene_.reach[i] + share) * on_the_safe_side + rounded, facets);
      const auto found = std::int64_t(facets.size());
      if (found == 0) continue;
      list.reserve(list.count + found, *scene_.scratch);
      std::fill_n(list.a + list.count, found, i);
      std::copy_n(facets.begin(), found, list.b + list.count);
      std::fill_n(list.image + list.count, found, own_image);
      admit(list, found);
    }
  });
}

// Counting sort by (kind, a), then each candidate's few pairs by b and image.
void BroadPhase::order_pairs(OrderedPairs& out) {
  const std::int64_t n = scene_.contactors->count;
  std::int64_t pairs = 0;
  bool present[kinds] = {};
  for (const PairList& list : lists_) {
    pairs += list.count;
    for (std::int64_t i = 0; i < list.count; ++i) {
      present[list.kind[i]] = true;
      if (list.image[i] < 0)
        throw Error("position: " + name_of(*scene_.contactors, *scene_.bodies, list.a[i]) + " and " +
                    name_of(*scene_.contactors, *scene_.bodies, list.b[i]) +
                    " are more than 511 cells apart; bring the bodies back into the periodic cell");
    }
  }
  if (pairs > std::numeric_limits<std::int32_t>::max())
    throw Error("detection: " + std::to_string(pairs) + " pairs are within reach, more than one process can number; " +
                "lower the margin or check radii and positions");
  std::int32_t slots = 0;
  for (int k = 0; k < kinds; ++k) slot_of_kind_[k] = present[k] ? slots++ : slots;
  place_.make_room(*scene_.scratch, n * slots + 1);
  std::fill_n(place_.begin(), n * slots, 0);
  for (const PairList& list : lists_) cairn_pair_count(list.count, n, slot_of_kind_, list.kind, list.a, place_.data());
  cairn_pair_starts(n * slots, place_.data());
  for (auto* array : {&out.a, &out.b, &out.image}) fit(*array, pairs);
  for (const PairList& list : lists_)
    cairn_pair_scatter(list.count, n, slot_of_kind_, list.kind, list.a, list.b, list.image, place_.data(), out.a.data(),
                       out.b.data(), out.image.data());
  in_slices(n * slots, [&](std::int64_t first, std::int64_t last) {
    cairn_pair_tidy(first, last, place_.data(), out.b.data(), out.image.data());
  });
  out.kind_end.resize(kinds);
  for (int k = 0; k < kinds; ++k) {
    const std::int64_t end = (slot_of_kind_[k] + (present[k] ? 1 : 0)) * n;
    out.kind_end[k] = end == 0 ? 0 : place_[end - 1];
  }
}

std::size_t BroadPhase::bytes() const {
  std::size_t total = grid_.bytes() + trees_.bytes();
  for (const PairList& list : lists_) total += list.hits.capacity() * sizeof(std::int32_t);
  return total;
}

} // namespace cairn::detection
