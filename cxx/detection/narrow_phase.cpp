// From pairs that may touch to contacts: the kernels of pairs.def, by batches.
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "detection_workspace.hpp"

namespace cairn {

using namespace detection;

namespace {
constexpr std::int64_t none = std::numeric_limits<std::int64_t>::max(); // of the pairs
}

void InteractionHandler::Workspace::narrow(const OrderedPairs& pairs, Candidates& out) {
  const std::vector<std::int64_t>& kind_end = pairs.kind_end;
  std::int64_t slots = 0, begin = 0;
  const auto left_alone = [&](int k) { return hulls_again && !pair_kinds[k].hull_contact; };
  for (int k = 0; k < kinds; ++k) {
    if (!left_alone(k)) slots += (kind_end[k] - begin) * pair_kinds[k].most;
    begin = kind_end[k];
  }
  if (slots > std::numeric_limits<std::int32_t>::max())
    throw Error("detection: " + std::to_string(pairs.count()) +
                " pairs are within reach, with more contacts than one process " +
                "can number; lower the margin or check sizes and positions");
  a = pairs.a.data();
  b = pairs.b.data();
  image = pairs.image.data();
  for (auto* array : {&out.contactor_a, &out.contactor_b, &out.image, &out.feature}) fit(*array, slots);
  fit(out.gap, slots);
  fit(out.normal, slots * dim);
  fit(out.point, slots * dim);
  const int threads = omp_get_max_threads();
  pieces.clear();
  std::int64_t slot = 0;
  begin = 0;
  spoilt = -1;
  for (int k = 0; k < kinds; ++k) {
    const std::int64_t end = kind_end[k], size = pair_kinds[k].hull_contact ? hull_batch : batch;
    if (end == begin || left_alone(k)) {
      begin = end;
      continue;
    }
    if (recalls(pair_kinds[k])) {
      first_recalled = begin;
      recalled.begin(end - begin, a + begin, b + begin, image + begin);
    }
    const std::int64_t batches = (end - begin + size - 1) / size, parts = batches > 8 ? threads : 1;
    const auto known = std::int64_t(pieces.size());
    const auto first_of = [&](std::int64_t part) { return std::min(begin + batches * part / parts * size, end); };
    for (std::int64_t p = 0; p < parts; ++p)
      pieces.push_back({slot + (first_of(p) - begin) * pair_kinds[k].most, 0, none});
#pragma omp parallel for schedule(static) if (parts > 1)
    for (std::int64_t p = 0; p < parts; ++p)
      narrow_piece(k, first_of(p), first_of(p + 1), pieces[std::size_t(known + p)], out);
    slot += (end - begin) * pair_kinds[k].most;
    begin = end;
  }
  if (spoilt >= 0)
    throw Error("the plugged routine of a pair gave a gap that is no number to " +
                name_of(*contactors, *bodies, a[spoilt]) + " and " + name_of(*contactors, *bodies, b[spoilt]) +
                ": look at its input, or remove it");
  close_ranks(out);
  leave_far_sides(out);
  leave_out_spares(out);
  leave_to_next_edges(out);
  leave_to_sides(out);
  leave_seams(out);
}

void InteractionHandler::Workspace::narrow_piece(int kind, std::int64_t first, std::int64_t last, Piece& piece,
                                                 Candidates& out) {
  const bool hulls = pair_kinds[kind].hull_contact;
  for (const std::int64_t size = hulls ? hull_batch : batch; first < last; first += size) {
    const std::int64_t end = std::min(first + size, last), to = piece.slot + piece.kept;
    const std::int64_t kept =
        hulls ? narrow_hulls(kind, first, end, to, out) : narrow_batch(kind, first, end, to, piece, out);
    piece.kept += drop_own_insides(to, kept, out);
  }
}

bool InteractionHandler::Workspace::repeated(std::int64_t i) const {
  return i > 0 && a[i] == a[i - 1] && b[i] == b[i - 1] && (image[i] & image_bits) == (image[i - 1] & image_bits);
}

std::int64_t InteractionHandler::Workspace::narrow_batch(int kind, std::int64_t first, std::int64_t last,
                                                         std::int64_t slot, Piece& piece, Candidates& out) {
  alignas(64) double between[3 * batch], radius_a[batch], radius_b[batch], direction_b[4 * batch];
  alignas(64) double gap[batch], normal[3 * batch], point[3 * batch];
  alignas(64) std::int32_t status[batch];
  const std::int32_t n = std::int32_t(last - first);
  cairn_pair_gather(dim, n, a + first, b + first, image + first, centre.data(), contactors->radius.values.data(),
                    info(pair_kinds[kind].b).directed, direction.data(), any_periodic, cell->vectors, between, radius_a,
                    radius_b, direction_b);
  pair_kinds[kind].contact(n, between, radius_a, radius_b, direction_b, gap, normal, point, status);
  if (pair_kinds[kind].contact != pair_kinds[kind].built_in)
    for (std::int32_t i = 0; i < n; ++i)
      if (!std::isfinite(gap[i])) {
#pragma omp atomic write
        spoilt = first + i;
      }
  for (std::int32_t i = 0; i < n && !declared.empty(); ++i)
    if (repeated(first + i)) status[i] = cairn_repeated;
  std::int32_t kept = 0, refused = -1;
  cairn_pair_keep(dim, n, a + first, b + first, image + first, centre.data(), gap, normal, point, status,
                  margin->per_contactor ? -1 : margin->constant, margin->per_contactor, out.contactor_a.data() + slot,
                  out.contactor_b.data() + slot, out.image.data() + slot, out.feature.data() + slot,
                  out.gap.data() + slot, out.normal.data() + slot * dim, out.point.data() + slot * dim, &kept,
                  &refused);
  if (refused >= 0) piece.refused = std::min(piece.refused, first + refused);
  return kept;
}

std::int64_t InteractionHandler::Workspace::narrow_hulls(int kind, std::int64_t first, std::int64_t last,
                                                         std::int64_t slot, Candidates& out) {
  alignas(64) double between[3 * hull_batch], radius_a[hull_batch], radius_b[hull_batch], direction_b[4 * hull_batch];
  alignas(64) double limit[hull_batch];
  std::int32_t count[hull_batch];
  const std::int32_t n = std::int32_t(last - first), most = pair_kinds[kind].most;
  const Hulls& h = contactors->hulls;
  const cairn_hulls hulls{dim,
                          most,
                          info(pair_kinds[kind].a).convex,
                          info(pair_kinds[kind].b).convex,
                          contactors->hull.values.data(),
                          h.first_vertex.data(),
                          h.first_face.data(),
                          h.first_edge.data(),
                          h.first_corner.data(),
                          h.corner_vertex.data(),
                          h.corner_edge.data(),
                          h.edge.data(),
                          h.offset.data(),
                          h.inner.data(),
                          hull_place.data(),
                          turned.data(),
                          recalls(pair_kinds[kind]) ? recalled.features(first - first_recalled, n) : nullptr};
  cairn_pair_gather(dim, n, a + first, b + first, image + first, centre.data(), contactors->radius.values.data(),
                    info(pair_kinds[kind].b).directed, direction.data(), any_periodic, cell->vectors, between, radius_a,
                    radius_b, direction_b);
  for (std::int32_t i = 0; i < n; ++i) {
    const std::int64_t pair = first + i;
    limit[i] = share(a[pair]) + share(b[pair]);
    if (image[pair] & declared_bit) limit[i] = std::numeric_limits<double>::max();
  }
  double* point = out.point.data() + slot * dim;
  pair_kinds[kind].hull_contact(n, &hulls, a + first, b + first, between, radius_a, radius_b, direction_b, limit, count,
                                out.gap.data() + slot, out.normal.data() + slot * dim, point,
                                out.feature.data() + slot);
  std::int64_t to = slot;
  for (std::int32_t i = 0; i < n; ++i) {
    const std::int64_t pair = first + i;
    if (!declared.empty() && repeated(pair)) continue;
    const double* at = &centre[std::int64_t(a[pair]) * dim];
    const std::int64_t from = slot + std::int64_t(i) * most;
    if (from != to) move_contacts(from, count[i], to, out);
    for (std::int32_t k = 0; k < count[i]; ++k, ++to) {
      out.contactor_a[to] = a[pair];
      out.contactor_b[to] = b[pair];
      out.image[to] = image[pair] & image_bits;
      for (int c = 0; c < dim; ++c) out.point[to * dim + c] += at[c];
    }
  }
  return to - slot;
}

// Points of a body that touches itself which are behind one of its sides, through the body, are not in contact with it.
std::int64_t InteractionHandler::Workspace::drop_own_insides(std::int64_t begin, std::int64_t count,
                                                             Candidates& out) const {
  if (!mapped || mapped->apart.empty()) return count;
  std::int64_t to = begin;
  for (std::int64_t i = begin; i < begin + count; ++i) {
    const std::int32_t first = out.contactor_a[i], second = out.contactor_b[i];
    if (same_mesh(first, second)) {
      const double deep = std::max(mapped->apart_depth[std::size_t(mapped->place[std::size_t(first)])],
                                   mapped->apart_depth[std::size_t(mapped->place[std::size_t(second)])]);
      bool behind = out.gap[i] < -deep;
      if (dim == 2) { // an edge is a bar with two sides, the body on its left
        const double *along = &direction[std::int64_t(second) * 3], *normal = &out.normal[2 * i];
        behind = behind || !(normal[0] * along[1] - normal[1] * along[0] > 0);
      }
      if (behind) continue;
    }
    move_contacts(i, 1, to++, out);
  }
  return to - begin;
}

// To places before their own.
void InteractionHandler::Workspace::move_contacts(std::int64_t from, std::int64_t count, std::int64_t to,
                                                  Candidates& out) const {
  const auto move = [&](auto& array, std::int64_t width) {
    std::copy(array.begin() + from * width, array.begin() + (from + count) * width, array.begin() + to * width);
  };
  for (auto* array : {&out.contactor_a, &out.contactor_b, &out.image, &out.feature}) move(*array, 1);
  move(out.gap, 1);
  move(out.normal, dim);
  move(out.point, dim);
}

void InteractionHandler::Workspace::trim(Candidates& out, std::int64_t count) const {
  for (auto* array : {&out.contactor_a, &out.contactor_b, &out.image, &out.feature}) array->resize(count);
  out.gap.resize(count);
  out.normal.resize(count * dim);
  out.point.resize(count * dim);
  out.count = count;
}

// Moves the contacts of all pieces together, in their order.
void InteractionHandler::Workspace::close_ranks(Candidates& out) {
  std::int64_t count = 0, refused = none;
  for (const Piece& piece : pieces) {
    if (piece.slot != count) move_contacts(piece.slot, piece.kept, count, out);
    count += piece.kept;
    refused = std::min(refused, piece.refused);
  }
  trim(out, count);
  if (refused == none) return;
  const std::int32_t one = a[refused], other = b[refused];
  throw Error("radius: " + name_of(*contactors, *bodies, one) + " (" + std::to_string(contactors->radius.values[one]) +
              " m) is wider than " + name_of(*contactors, *bodies, other) + " (" +
              std::to_string(contactors->radius.values[other]) + " m) and cannot be inside it");
}

} // namespace cairn
