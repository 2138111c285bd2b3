// From pairs that may touch to contacts: the kernels of pairs.def, by batches.
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/call.hpp"
#include "detection_workspace.hpp"

namespace cairn {

using namespace detection;

void InteractionHandler::Workspace::narrow(Candidates& out) {
  const std::int64_t pairs = out.count;
  std::int64_t slots = 0, begin = 0;
  for (int k = 0; k < kinds; ++k) {
    slots += (kind_end[k] - begin) * pair_kinds[k].most;
    begin = kind_end[k];
  }
  if (slots > std::numeric_limits<std::int32_t>::max())
    throw Error("detection: " + std::to_string(pairs) +
                " pairs are within reach, with more contacts than one process " +
                "can number; lower the margin or check sizes and positions");
  if (slots > pairs) {
    pair_a.swap(out.contactor_a);
    pair_b.swap(out.contactor_b);
    pair_image.swap(out.image);
    for (auto* array : {&out.contactor_a, &out.contactor_b, &out.image}) fit(*array, slots);
  }
  a = (slots > pairs ? pair_a : out.contactor_a).data();
  b = (slots > pairs ? pair_b : out.contactor_b).data();
  image = (slots > pairs ? pair_image : out.image).data();
  fit(out.gap, slots);
  fit(out.normal, slots * dim);
  fit(out.point, slots * dim);
  fit(out.feature, slots);
  keep.make_room(*scratch, slots);
  std::int64_t kept = 0, slot = 0;
  begin = 0;
  spoilt = -1;
  for (int k = 0; k < kinds; ++k) {
    const bool hulls = pair_kinds[k].hull_contact;
    const int most = pair_kinds[k].most, size = hulls ? hull_batch : batch;
    if (recalls(pair_kinds[k]) && kind_end[k] > begin) {
      first_recalled = begin;
      recalled.begin(kind_end[k] - begin, a + begin, b + begin, image + begin);
    }
    const std::int64_t batches = (kind_end[k] - begin + size - 1) / size;
#pragma omp parallel for schedule(static) reduction(+ : kept) if (batches > 8)
    for (std::int64_t i = 0; i < batches; ++i) {
      const std::int64_t first = begin + i * size, last = std::min(first + size, kind_end[k]);
      const std::int64_t at = slot + i * size * most;
      kept += hulls ? narrow_hulls(k, first, last, at, out) : narrow_batch(k, first, last, at, out);
    }
    slot += (kind_end[k] - begin) * most;
    begin = kind_end[k];
  }
  if (spoilt >= 0) {
    out.count = 0;
    throw Error("the plugged routine of a pair gave a gap that is no number to " +
                name_of(*contactors, *bodies, a[spoilt]) + " and " + name_of(*contactors, *bodies, b[spoilt]) +
                ": look at its input, or remove it");
  }
  out.count = kept;
}

bool InteractionHandler::Workspace::repeated(std::int64_t i) const {
  return i > 0 && a[i] == a[i - 1] && b[i] == b[i - 1] && (image[i] & image_bits) == (image[i - 1] & image_bits);
}

std::int64_t InteractionHandler::Workspace::narrow_batch(int kind, std::int64_t first, std::int64_t last,
                                                         std::int64_t slot, Candidates& out) {
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
  std::int32_t kept = 0;
  cairn_pair_store(dim, n, a + first, b + first, image + first, centre.data(), gap, normal, point, status,
                   margin->per_contactor ? -1 : margin->constant, margin->per_contactor, out.gap.data() + slot,
                   out.normal.data() + slot * dim, out.point.data() + slot * dim, keep.data() + slot, &kept);
  std::fill_n(out.feature.begin() + slot, n, 0);
  for (std::int32_t i = 0; i < n && !declared.empty(); ++i) {
    if (!keep[slot + i] || !repeated(first + i)) continue;
    keep[slot + i] = 0;
    --kept;
  }
  if (a == out.contactor_a.data()) return kept;
  std::copy_n(a + first, n, out.contactor_a.data() + slot);
  std::copy_n(b + first, n, out.contactor_b.data() + slot);
  std::copy_n(image + first, n, out.image.data() + slot);
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
  std::int64_t kept = 0;
  for (std::int32_t i = 0; i < n; ++i) {
    const std::int64_t pair = first + i;
    if (!declared.empty() && repeated(pair)) count[i] = 0;
    kept += count[i];
    const double* at = &centre[std::int64_t(a[pair]) * dim];
    for (std::int32_t k = 0; k < most; ++k) {
      const std::int64_t to = slot + i * most + k;
      keep[to] = k < count[i];
      out.contactor_a[to] = a[pair];
      out.contactor_b[to] = b[pair];
      out.image[to] = image[pair];
      for (int c = 0; c < dim && k < count[i]; ++c) out.point[to * dim + c] += at[c];
    }
  }
  return kept;
}

// Points of a body that touches itself which are behind one of its sides, through the body, are not in contact with it.
void InteractionHandler::Workspace::drop_own_insides(Candidates& out) {
  if (!mapped || mapped->apart.empty()) return;
  for (std::int64_t i = 0; i < std::int64_t(out.gap.size()); ++i) {
    const std::int32_t first = out.contactor_a[i], second = out.contactor_b[i];
    if (!keep[i] || !same_mesh(first, second)) continue;
    const double deep = std::max(mapped->apart_depth[std::size_t(mapped->place[std::size_t(first)])],
                                 mapped->apart_depth[std::size_t(mapped->place[std::size_t(second)])]);
    bool behind = out.gap[i] < -deep;
    if (dim == 2) { // an edge is a bar with two sides, the body on its left
      const double *along = &direction[std::int64_t(second) * 3], *normal = &out.normal[2 * i];
      behind = behind || !(normal[0] * along[1] - normal[1] * along[0] > 0);
    }
    if (!behind) continue;
    keep[i] = 0;
    --out.count;
  }
}

// Closes the ranks.
void InteractionHandler::Workspace::drop_what_does_not_count(Candidates& out) {
  const std::int64_t slots = std::int64_t(out.gap.size());
  if (out.count < slots || !declared.empty()) {
    std::int64_t to = 0;
    for (std::int64_t i = 0; i < slots; ++i) {
      if (!keep[i]) continue;
      out.contactor_a[to] = out.contactor_a[i];
      out.contactor_b[to] = out.contactor_b[i];
      out.image[to] = out.image[i] & image_bits;
      out.feature[to] = out.feature[i];
      out.gap[to] = out.gap[i];
      for (int k = 0; k < dim; ++k) {
        out.normal[to * dim + k] = out.normal[i * dim + k];
        out.point[to * dim + k] = out.point[i * dim + k];
      }
      keep[to++] = keep[i];
    }
    out.count = to;
  }
  const auto refused = std::find(keep.begin(), keep.begin() + out.count, std::int8_t(2));
  const std::int64_t at = refused - keep.begin();
  const std::int64_t count = out.count;
  for (auto* array : {&out.contactor_a, &out.contactor_b, &out.image, &out.feature}) array->resize(count);
  out.gap.resize(count);
  out.normal.resize(count * dim);
  out.point.resize(count * dim);
  if (at == count) return;
  out.count = 0;
  throw Error("radius: " + name_of(*contactors, *bodies, out.contactor_a[at]) + " (" +
              std::to_string(contactors->radius.values[out.contactor_a[at]]) + " m) is wider than " +
              name_of(*contactors, *bodies, out.contactor_b[at]) + " (" +
              std::to_string(contactors->radius.values[out.contactor_b[at]]) + " m) and cannot be inside it");
}

} // namespace cairn
