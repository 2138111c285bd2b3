#include "neighbour_list.hpp"

#include "../../base/call.hpp"
#include "../../base/held_bytes.hpp"
#include "../../contactors/shapes.hpp"
#include "lanes.hpp"

namespace cairn {
namespace {

constexpr int ways = 3; // within a tile, to another one, on bodies that are on every rank
constexpr int to_another = 1, on_all = 2;

int kinds_of(bool shaped) { return shaped ? 1 : int(smooth_pair_kinds().size()); }

int row_of(Shape a, Shape b) {
  const std::span<const SmoothPairKind> kinds = smooth_pair_kinds();
  for (std::size_t k = 0; k < kinds.size(); ++k)
    if (kinds[k].a == a && kinds[k].b == b) return int(k);
  return -1; // a contact of shapes, which is found anew in each step
}

} // namespace

void NeighbourList::lay_out(const Simulation& s, const Candidates& found, bool shaped, const BodyTiles& tiles,
                            const PairNumbers& numbers) {
  count_pairs(s, found, shaped, tiles);
  place_pairs(s, found, shaped);
  state.assign(pairs * numbers.states, 0);
  force.assign(pairs * numbers.dim, 0);
  moment.assign(numbers.moments ? pairs * (2 * numbers.dim - 3) : 0, 0);
  across.assign(numbers.across ? pairs : 0, 0);
  active.assign(pairs, 0);
  loss.assign(numbers.losses ? pairs : 0, 0);
  cut_batches(s, shaped, tiles.count());
  other.resize(others * numbers.dofs);
  kept.resize(2 * kept_pairs * numbers.dofs);
  list_incoming(tiles);
}

// The group of each pair, and where groups begin.
void NeighbourList::count_pairs(const Simulation& s, const Candidates& found, bool shaped, const BodyTiles& tiles) {
  const Contactors& c = s.scene.contactors;
  const int entries = s.laws.entries(), kinds = kinds_of(shaped), groups = ways * kinds * entries;
  const SharedBodies* shared = tiles.shared();
  start.assign(tiles.count() * groups + 1, 0);
  slot.assign(found.count, -1);
  pairs = 0;
  twins = false;
  for (std::int64_t i = 0; i < found.count; ++i) {
    const std::int32_t a = found.contactor_a[i], b = found.contactor_b[i];
    if (shared && !shared->alone && !shared->keeps_pair(a, b)) continue;
    const int entry = s.laws.find(*c.material[a], *c.material[b]);
    if (entry < 0)
      throw Error("no law between materials " + s.laws.name(*c.material[a]) + " and " + s.laws.name(*c.material[b]) +
                  "; give one with Scene.interact");
    const int row = row_of(Shape(*c.shape[a]), Shape(*c.shape[b])), kind = shaped ? 0 : row;
    if (shaped != (row < 0)) continue;
    twins = twins || (i > 0 && found.contactor_a[i - 1] == a && found.contactor_b[i - 1] == b &&
                      found.image[i - 1] != found.image[i]);
    std::int64_t tile = tiles.of(*c.body[a]), way = tile != tiles.of(*c.body[b]) ? to_another : 0;
    if (tiles.everywhere(*c.body[a]) || tiles.everywhere(*c.body[b])) {
      way = on_all;
      if (tiles.everywhere(*c.body[a])) tile = tiles.of(*c.body[b]);
    }
    slot[i] = std::int32_t(tile * groups + way * (kinds * entries) + kind * entries + entry);
    ++start[slot[i] + 1];
    ++pairs;
  }
  for (std::size_t k = 1; k < start.size(); ++k) start[k] += start[k - 1];
  begin = start;
}

void NeighbourList::place_pairs(const Simulation& s, const Candidates& found, bool shaped) {
  const Contactors& c = s.scene.contactors;
  for (auto* array : {&a, &b, &body_a, &body_b, &image}) array->resize(pairs);
  source.resize(shaped ? pairs : 0);
  for (std::int64_t i = 0; i < found.count; ++i) {
    if (slot[i] < 0) continue;
    const std::int64_t to = start[slot[i]]++;
    a[to] = found.contactor_a[i];
    b[to] = found.contactor_b[i];
    body_a[to] = *c.body[found.contactor_a[i]];
    body_b[to] = *c.body[found.contactor_b[i]];
    image[to] = found.image[i];
    if (shaped) source[to] = std::int32_t(i);
  }
}

void NeighbourList::cut_batches(const Simulation& s, bool shaped, std::int64_t tiles) {
  const int entries = s.laws.entries(), kinds = kinds_of(shaped), groups = ways * kinds * entries;
  batches.clear();
  tile_batches.assign(1, 0);
  others = kept_pairs = 0;
  for (std::int64_t tile = 0; tile < tiles; ++tile) {
    for (int g = 0; g < groups; ++g) {
      const std::int64_t end = begin[tile * groups + g + 1];
      for (std::int64_t first = begin[tile * groups + g]; first < end; first += lanes) {
        Batch batch;
        batch.first = first;
        batch.count = std::int32_t(std::min<std::int64_t>(lanes, end - first));
        batch.kind = shaped ? -1 : g % (kinds * entries) / entries;
        batch.entry = g % entries;
        batch.spheres = !shaped && smooth_pair_kinds()[batch.kind].a == Shape::sphere &&
                        smooth_pair_kinds()[batch.kind].b == Shape::sphere;
        if (const int way = g / (kinds * entries); way == to_another) {
          batch.other = others;
          others += batch.count;
        } else if (way == on_all) {
          batch.kept = kept_pairs;
          kept_pairs += batch.count;
        }
        batches.push_back(batch);
      }
    }
    tile_batches.push_back(std::int64_t(batches.size()));
  }
}

void NeighbourList::list_incoming(const BodyTiles& tiles) {
  const std::int64_t nt = tiles.count();
  tile_incoming.assign(nt + 1, 0);
  incoming_body.resize(others);
  incoming_place.resize(others);
  const auto each_other = [&](auto&& f) {
    for (const Batch& batch : batches)
      for (int i = 0; i < batch.count && batch.other >= 0; ++i) f(body_b[batch.first + i], batch.other + i);
  };
  each_other([&](std::int32_t body, std::int64_t) { ++tile_incoming[tiles.of(body) + 1]; });
  for (std::int64_t t = 0; t < nt; ++t) tile_incoming[t + 1] += tile_incoming[t];
  start.assign(tile_incoming.begin(), tile_incoming.end());
  each_other([&](std::int32_t body, std::int64_t place) {
    const std::int64_t to = start[tiles.of(body)]++;
    incoming_body[to] = body;
    incoming_place[to] = std::int32_t(place);
  });
}

std::int64_t NeighbourList::bytes() const {
  return held_bytes(a, b, body_a, body_b, image, state, force, loss, moment, kept, across, active, source, start, begin,
                    slot, batches, tile_batches, tile_incoming, incoming_body, incoming_place, other, contactor_id);
}

} // namespace cairn
