#include "narrow_phase.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "../base/call.hpp"
#include "cairn/core.h"
#include "dropped_contacts.hpp"

namespace cairn::detection {

namespace {

constexpr std::int64_t none = std::numeric_limits<std::int64_t>::max(); // of the pairs
constexpr int batch = 256, hull_batch = 64;                             // pairs of a call of a kernel

} // namespace

// Contacts that the pairs may have at most: as many slots are laid out.
std::int64_t NarrowPhase::slots_of(const OrderedPairs& pairs) const {
  std::int64_t slots = 0, begin = 0;
  for (int k = 0; k < kinds; ++k) {
    if (!left_alone(k)) slots += (pairs.kind_end[k] - begin) * pair_kinds[k].most;
    begin = pairs.kind_end[k];
  }
  if (slots > std::numeric_limits<std::int32_t>::max())
    throw Error("detection: " + std::to_string(pairs.count()) +
                " pairs are within reach, with more contacts than one process " +
                "can number; lower the margin or check sizes and positions");
  return slots;
}

void NarrowPhase::find(const OrderedPairs& pairs, Candidates& out) {
  const std::int64_t slots = slots_of(pairs);
  a_ = pairs.a.data();
  b_ = pairs.b.data();
  image_ = pairs.image.data();
  for (auto* array : {&out.contactor_a, &out.contactor_b, &out.image, &out.feature}) fit(*array, slots);
  fit(out.gap, slots);
  fit(out.normal, slots * scene_.dim);
  fit(out.point, slots * scene_.dim);
  pieces_.clear();
  std::int64_t slot = 0, begin = 0;
  spoilt_ = -1;
  for (int k = 0; k < kinds; ++k) {
    const std::int64_t end = pairs.kind_end[k];
    if (end > begin && !left_alone(k)) {
      find_kind(k, begin, end, slot, out);
      slot += (end - begin) * pair_kinds[k].most;
    }
    begin = end;
  }
  if (spoilt_ >= 0)
    throw Error("the plugged routine of a pair gave a gap that is no number to " +
                name_of(*scene_.contactors, *scene_.bodies, a_[spoilt_]) + " and " +
                name_of(*scene_.contactors, *scene_.bodies, b_[spoilt_]) + ": look at its input, or remove it");
  close_ranks(out);
}

// Contacts of the pairs of a kind, on all threads.
void NarrowPhase::find_kind(int k, std::int64_t begin, std::int64_t end, std::int64_t slot, Candidates& out) {
  const std::int64_t size = pair_kinds[k].hull_contact ? hull_batch : batch;
  if (recalls(pair_kinds[k])) {
    first_recalled_ = begin;
    recalled_.begin(end - begin, a_ + begin, b_ + begin, image_ + begin);
  }
  const std::int64_t batches = (end - begin + size - 1) / size, parts = batches > 8 ? omp_get_max_threads() : 1;
  const auto known = std::int64_t(pieces_.size());
  const auto first_of = [&](std::int64_t part) { return std::min(begin + batches * part / parts * size, end); };
  for (std::int64_t p = 0; p < parts; ++p)
    pieces_.push_back({slot + (first_of(p) - begin) * pair_kinds[k].most, 0, none});
#pragma omp parallel for schedule(static) if (parts > 1)
  for (std::int64_t p = 0; p < parts; ++p)
    find_piece(k, first_of(p), first_of(p + 1), pieces_[std::size_t(known + p)], out);
}

void NarrowPhase::find_piece(int kind, std::int64_t first, std::int64_t last, Piece& piece, Candidates& out) {
  const bool hulls = pair_kinds[kind].hull_contact;
  for (const std::int64_t size = hulls ? hull_batch : batch; first < last; first += size) {
    const std::int64_t end = std::min(first + size, last), to = piece.slot + piece.kept;
    const std::int64_t kept =
        hulls ? find_hulls(kind, first, end, to, out) : find_batch(kind, first, end, to, piece, out);
    piece.kept += drop_own_insides(to, kept, out);
  }
}

bool NarrowPhase::repeated(std::int64_t i) const {
  return i > 0 && a_[i] == a_[i - 1] && b_[i] == b_[i - 1] && (image_[i] & image_bits) == (image_[i - 1] & image_bits);
}

std::int64_t NarrowPhase::find_batch(int kind, std::int64_t first, std::int64_t last, std::int64_t slot, Piece& piece,
                                     Candidates& out) {
  alignas(64) double between[3 * batch], radius_a[batch], radius_b[batch], direction_b[4 * batch];
  alignas(64) double gap[batch], normal[3 * batch], point[3 * batch];
  alignas(64) std::int32_t status[batch];
  const std::int32_t n = std::int32_t(last - first);
  cairn_pair_gather(scene_.dim, n, a_ + first, b_ + first, image_ + first, scene_.centre.data(),
                    scene_.contactors->radius.values.data(), info(pair_kinds[kind].b).directed, scene_.direction.data(),
                    scene_.any_periodic, scene_.cell->vectors, between, radius_a, radius_b, direction_b);
  pair_kinds[kind].contact(n, between, radius_a, radius_b, direction_b, gap, normal, point, status);
  if (pair_kinds[kind].contact != pair_kinds[kind].built_in)
    for (std::int32_t i = 0; i < n; ++i)
      if (!std::isfinite(gap[i])) {
#pragma omp atomic write
        spoilt_ = first + i;
      }
  for (std::int32_t i = 0; i < n && !declared_.pairs.empty(); ++i)
    if (repeated(first + i)) status[i] = cairn_repeated;
  std::int32_t kept = 0, refused = -1;
  cairn_pair_keep(scene_.dim, n, a_ + first, b_ + first, image_ + first, scene_.centre.data(), gap, normal, point,
                  status, scene_.margin->per_contactor ? -1 : scene_.margin->constant, scene_.margin->per_contactor,
                  out.contactor_a.data() + slot, out.contactor_b.data() + slot, out.image.data() + slot,
                  out.feature.data() + slot, out.gap.data() + slot, out.normal.data() + slot * scene_.dim,
                  out.point.data() + slot * scene_.dim, &kept, &refused);
  if (refused >= 0) piece.refused = std::min(piece.refused, first + refused);
  return kept;
}

std::int64_t NarrowPhase::find_hulls(int kind, std::int64_t first, std::int64_t last, std::int64_t slot,
                                     Candidates& out) {
  alignas(64) double between[3 * hull_batch], radius_a[hull_batch], radius_b[hull_batch], direction_b[4 * hull_batch];
  alignas(64) double limit[hull_batch];
  std::int32_t count[hull_batch];
  const std::int32_t n = std::int32_t(last - first), most = pair_kinds[kind].most;
  const Hulls& h = scene_.contactors->hulls;
  const cairn_hulls hulls{scene_.dim,
                          most,
                          info(pair_kinds[kind].a).convex,
                          info(pair_kinds[kind].b).convex,
                          scene_.contactors->hull.values.data(),
                          h.first_vertex.data(),
                          h.first_face.data(),
                          h.first_edge.data(),
                          h.first_corner.data(),
                          h.corner_vertex.data(),
                          h.corner_edge.data(),
                          h.edge.data(),
                          h.offset.data(),
                          h.inner.data(),
                          scene_.hull_place.data(),
                          scene_.turned.data(),
                          recalls(pair_kinds[kind]) ? recalled_.features(first - first_recalled_, n) : nullptr};
  cairn_pair_gather(scene_.dim, n, a_ + first, b_ + first, image_ + first, scene_.centre.data(),
                    scene_.contactors->radius.values.data(), info(pair_kinds[kind].b).directed, scene_.direction.data(),
                    scene_.any_periodic, scene_.cell->vectors, between, radius_a, radius_b, direction_b);
  for (std::int32_t i = 0; i < n; ++i) {
    const std::int64_t pair = first + i;
    limit[i] = scene_.share(a_[pair]) + scene_.share(b_[pair]);
    if (image_[pair] & declared_bit) limit[i] = std::numeric_limits<double>::max();
  }
  double* point = out.point.data() + slot * scene_.dim;
  pair_kinds[kind].hull_contact(n, &hulls, a_ + first, b_ + first, between, radius_a, radius_b, direction_b, limit,
                                count, out.gap.data() + slot, out.normal.data() + slot * scene_.dim, point,
                                out.feature.data() + slot);
  std::int64_t to = slot;
  for (std::int32_t i = 0; i < n; ++i) {
    const std::int64_t pair = first + i;
    if (!declared_.pairs.empty() && repeated(pair)) continue;
    const double* at = &scene_.centre[std::int64_t(a_[pair]) * scene_.dim];
    const std::int64_t from = slot + std::int64_t(i) * most;
    if (from != to) move_contacts(out, scene_.dim, from, count[i], to);
    for (std::int32_t k = 0; k < count[i]; ++k, ++to) {
      out.contactor_a[to] = a_[pair];
      out.contactor_b[to] = b_[pair];
      out.image[to] = image_[pair] & image_bits;
      for (int c = 0; c < scene_.dim; ++c) out.point[to * scene_.dim + c] += at[c];
    }
  }
  return to - slot;
}

// Points of a body that touches itself which are behind one of its sides, through the body, are not in contact with it.
std::int64_t NarrowPhase::drop_own_insides(std::int64_t begin, std::int64_t count, Candidates& out) const {
  if (!scene_.mapped || scene_.mapped->apart.empty()) return count;
  std::int64_t to = begin;
  for (std::int64_t i = begin; i < begin + count; ++i) {
    const std::int32_t first = out.contactor_a[i], second = out.contactor_b[i];
    if (scene_.same_mesh(first, second)) {
      const double deep = std::max(scene_.mapped->apart_depth[std::size_t(scene_.mapped->place[std::size_t(first)])],
                                   scene_.mapped->apart_depth[std::size_t(scene_.mapped->place[std::size_t(second)])]);
      bool behind = out.gap[i] < -deep;
      if (scene_.dim == 2) { // an edge is a bar with two sides, the body on its left
        const double *along = &scene_.direction[std::int64_t(second) * 3], *normal = &out.normal[2 * i];
        behind = behind || !(normal[0] * along[1] - normal[1] * along[0] > 0);
      }
      if (behind) continue;
    }
    move_contacts(out, scene_.dim, i, 1, to++);
  }
  return to - begin;
}

// Moves the contacts of all pieces together, in their order.
void NarrowPhase::close_ranks(Candidates& out) const {
  std::int64_t count = 0, refused = none;
  for (const Piece& piece : pieces_) {
    if (piece.slot != count) move_contacts(out, scene_.dim, piece.slot, piece.kept, count);
    count += piece.kept;
    refused = std::min(refused, piece.refused);
  }
  trim_contacts(out, scene_.dim, count);
  if (refused == none) return;
  const std::int32_t one = a_[refused], other = b_[refused];
  throw Error("radius: " + name_of(*scene_.contactors, *scene_.bodies, one) + " (" +
              std::to_string(scene_.contactors->radius.values[one]) + " m) is wider than " +
              name_of(*scene_.contactors, *scene_.bodies, other) + " (" +
              std::to_string(scene_.contactors->radius.values[other]) + " m) and cannot be inside it");
}

} // namespace cairn::detection
