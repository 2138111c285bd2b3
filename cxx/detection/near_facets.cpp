// Pairs of balls and triangles of a kept list are sifted here before their narrow phase: a search reaches farther than
// most of its pairs ever come. Nothing is left out that the narrow phase would count.
#include <algorithm>
#include <cmath>

#include "detection_workspace.hpp"

namespace cairn {

using namespace detection;

namespace {

// centre, normal, offset of the plane from the centre, radius of the ball around it; of each edge the direction in the
// plane that points away from the triangle, and its offset
constexpr int facet_numbers = 20;
constexpr double on_the_safe_side = 1e-6; // of lengths, against rounding

// Turns x from the axes of a body into those of space; q: unit quaternion (w, x, y, z).
void turn(const double* q, const double* x, double* out) {
  double t[3];
  for (int k = 0; k < 3; ++k) t[k] = 2 * (q[1 + (k + 1) % 3] * x[(k + 2) % 3] - q[1 + (k + 2) % 3] * x[(k + 1) % 3]);
  for (int k = 0; k < 3; ++k)
    out[k] = x[k] + q[0] * t[k] + q[1 + (k + 1) % 3] * t[(k + 2) % 3] - q[1 + (k + 2) % 3] * t[(k + 1) % 3];
}

// Where the edge from x to y ends the triangle, seen from its third vertex z.
void see_edge(const double* x, const double* y, const double* z, const double* normal, double* out) {
  double e[3], size = 0, beyond = 0;
  for (int k = 0; k < 3; ++k) e[k] = y[k] - x[k];
  for (int k = 0; k < 3; ++k) out[k] = e[(k + 1) % 3] * normal[(k + 2) % 3] - e[(k + 2) % 3] * normal[(k + 1) % 3];
  for (int k = 0; k < 3; ++k) size += out[k] * out[k];
  size = size > 0 ? std::sqrt(size) : 1;
  for (int k = 0; k < 3; ++k) out[k] /= size;
  out[3] = 0;
  for (int k = 0; k < 3; ++k) {
    out[3] += out[k] * x[k];
    beyond += out[k] * (z[k] - x[k]);
  }
  if (beyond > 0)
    for (int k = 0; k < 4; ++k) out[k] = -out[k];
}

} // namespace

void InteractionHandler::Workspace::place_of(std::int32_t contactor, double* x) const {
  const std::int64_t body = contactors->body.values[std::size_t(contactor)];
  for (int k = 0; k < 3; ++k) x[k] = position[3 * body + k];
  if (!contactors->offset.active) return;
  double turned_offset[3];
  const double* offset = contactors->offset[contactor];
  if (rotation)
    turn(&rotation[4 * body], offset, turned_offset);
  else
    std::copy_n(offset, 3, turned_offset);
  for (int k = 0; k < 3; ++k) x[k] += turned_offset[k];
}

// Triangles of bodies that moved since they were seen, or all after a search.
void InteractionHandler::Workspace::see_facets(std::int64_t first, std::int64_t last) {
  const bool searched_anew = facets_seen_at != searches;
  facets_seen_at = searches;
  if (searched_anew) {
    facet_bodies.clear();
    facet_pose.clear();
    facet_number.resize(std::size_t(contactors->count) * facet_numbers);
    near_facets.assign(found.b.begin() + first, found.b.begin() + last);
    std::sort(near_facets.begin(), near_facets.end());
    near_facets.erase(std::unique(near_facets.begin(), near_facets.end()), near_facets.end());
    for (const std::int32_t i : near_facets) facet_bodies.push_back(contactors->body.values[std::size_t(i)]);
    std::sort(facet_bodies.begin(), facet_bodies.end());
    facet_bodies.erase(std::unique(facet_bodies.begin(), facet_bodies.end()), facet_bodies.end());
    facet_pose.assign(7 * facet_bodies.size(), 0);
  }
  facet_moved.assign(facet_bodies.size(), 0);
  bool any = false;
  for (std::size_t j = 0; j < facet_bodies.size(); ++j) {
    const std::int64_t body = facet_bodies[j];
    double pose[7] = {0, 0, 0, 1, 0, 0, 0};
    std::copy_n(&position[3 * body], 3, pose);
    if (rotation) std::copy_n(&rotation[4 * body], 4, pose + 3);
    facet_moved[j] = searched_anew || !std::equal(pose, pose + 7, &facet_pose[7 * j]);
    std::copy_n(pose, 7, &facet_pose[7 * j]);
    any = any || facet_moved[j];
  }
  if (!any) return;
  const Hulls& hulls = contactors->hulls;
  in_slices(std::int64_t(near_facets.size()), [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t n = begin; n < end; ++n) {
      const std::int32_t i = near_facets[std::size_t(n)], body = contactors->body.values[std::size_t(i)];
      const auto j =
          std::size_t(std::lower_bound(facet_bodies.begin(), facet_bodies.end(), body) - facet_bodies.begin());
      if (!facet_moved[j]) continue;
      const std::int32_t hull = contactors->hull.values[std::size_t(i)], face = hulls.first_face[std::size_t(hull)];
      double* of = &facet_number[std::size_t(i) * facet_numbers];
      place_of(i, of);
      const double* normal = &hulls.normal[3 * std::size_t(face)];
      if (rotation)
        turn(&rotation[4 * std::int64_t(body)], normal, of + 3);
      else
        std::copy_n(normal, 3, of + 3);
      of[6] = hulls.offset[std::size_t(face)];
      of[7] = hulls.radius[std::size_t(hull)];
      double v[3][3];
      for (int k = 0; k < 3; ++k) {
        const double* x = &hulls.vertex[3 * std::size_t(hulls.first_vertex[std::size_t(hull)] + k)];
        if (rotation)
          turn(&rotation[4 * std::int64_t(body)], x, v[k]);
        else
          std::copy_n(x, 3, v[k]);
      }
      for (int k = 0; k < 3; ++k) see_edge(v[k], v[(k + 1) % 3], v[(k + 2) % 3], of + 3, of + 8 + 4 * k);
    }
  });
}

// A contact needs a point of the triangle within the reach of the ball: in the disk which that cuts from its plane,
// which is beyond none of the edges then.
void InteractionHandler::Workspace::leave_far_facets(int kind, std::int64_t first, std::int64_t last) {
  see_facets(first, last);
  near_now.resize(std::size_t(last - first));
  in_slices(last - first, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t n = begin; n < end; ++n) {
      const std::int64_t p = first + n;
      const std::int32_t ball = found.a[p], facet = found.b[p];
      const double* of = &facet_number[std::size_t(facet) * facet_numbers];
      double x[3], shift[3] = {0, 0, 0};
      place_of(ball, x);
      if (any_periodic) image_shift(*cell, found.image[p] & image_bits, shift);
      double height = -of[6], square = 0, d[3];
      for (int k = 0; k < 3; ++k) {
        d[k] = x[k] - of[k] - shift[k];
        height += d[k] * of[3 + k];
        square += d[k] * d[k];
      }
      const double reach_of =
          (contactors->radius.values[std::size_t(ball)] + share(ball) + share(facet)) * (1 + on_the_safe_side) +
          on_the_safe_side * of[7];
      const double disk = reach_of * reach_of - height * height;
      const double cut = std::sqrt(std::max(disk, 0.0)), apart = cut + of[7];
      bool far = disk < 0 || square - height * height > apart * apart * (1 + on_the_safe_side);
      for (int k = 0; k < 3 && !far; ++k) {
        const double* edge = of + 8 + 4 * k;
        far = d[0] * edge[0] + d[1] * edge[1] + d[2] * edge[2] - edge[3] > cut + on_the_safe_side * of[7];
      }
      near_now[std::size_t(n)] = !far || (found.image[p] & declared_bit);
    }
  });
  for (std::int64_t n = 0; n < last - first; ++n)
    if (near_now[std::size_t(n)]) again.append(found, first + n, first + n + 1);
  again.kind_end[std::size_t(kind)] = again.count();
}

// The pairs of the last search that may touch where their bodies are now.
void InteractionHandler::Workspace::find_near_again() {
  again.begin(kinds);
  for (int k = 0; k < kinds; ++k) {
    const std::int64_t first = k > 0 ? found.kind_end[std::size_t(k - 1)] : 0, last = found.kind_end[std::size_t(k)];
    if (pair_kinds[k].hull_contact == cairn_pair_sphere_facet && last > first)
      leave_far_facets(k, first, last);
    else if (pair_kinds[k].hull_contact)
      again.append(found, first, last);
    again.kind_end[std::size_t(k)] = again.count();
  }
}

} // namespace cairn
