#include "near_facets.hpp"

#include <algorithm>
#include <cmath>

#include "detection_grid.hpp"
#include "pair_kinds.hpp"
#include "pair_list.hpp"

namespace cairn::detection {

namespace {

// Centre, normal, offset of the plane from the centre, radius of the ball around it; of each edge the unit vector in
// the plane that points away from the triangle, and its offset.
constexpr int facet_numbers = 20;
constexpr double on_the_safe_side = 1e-6; // of lengths, against rounding

// Turns x from the axes of a body to those of space; q: unit quaternion (w, x, y, z).
void turn(const double* q, const double* x, double* out) {
  double t[3];
  for (int k = 0; k < 3; ++k) t[k] = 2 * (q[1 + (k + 1) % 3] * x[(k + 2) % 3] - q[1 + (k + 2) % 3] * x[(k + 1) % 3]);
  for (int k = 0; k < 3; ++k)
    out[k] = x[k] + q[0] * t[k] + q[1 + (k + 1) % 3] * t[(k + 2) % 3] - q[1 + (k + 2) % 3] * t[(k + 1) % 3];
}

// Where the edge from x to y ends the triangle, seen from its third vertex z.
void place_edge(const double* x, const double* y, const double* z, const double* normal, double* out) {
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

void NearFacets::place_of(std::int32_t contactor, double* x) const {
  const Contactors& k = *scene_.contactors;
  const std::int64_t body = k.body.values[std::size_t(contactor)];
  for (int d = 0; d < 3; ++d) x[d] = scene_.position[3 * body + d];
  if (!k.offset.active) return;
  double turned_offset[3];
  const double* offset = k.offset[contactor];
  if (scene_.rotation)
    turn(&scene_.rotation[4 * body], offset, turned_offset);
  else
    std::copy_n(offset, 3, turned_offset);
  for (int d = 0; d < 3; ++d) x[d] += turned_offset[d];
}

// Triangles of the pairs of a search, each once, and their bodies.
void NearFacets::list_facets(const OrderedPairs& found, std::int64_t first, std::int64_t last) {
  const Contactors& k = *scene_.contactors;
  const auto keep_each_once = [](std::vector<std::int32_t>& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  facet_.resize(std::size_t(k.count) * facet_numbers);
  facets_.assign(found.b.begin() + first, found.b.begin() + last);
  keep_each_once(facets_);
  bodies_.clear();
  for (const std::int32_t i : facets_) bodies_.push_back(k.body.values[std::size_t(i)]);
  keep_each_once(bodies_);
  pose_.assign(7 * bodies_.size(), 0);
}

// Marks the bodies that have another pose than when their triangles were placed; false if there are none.
bool NearFacets::mark_moved(bool all) {
  moved_.assign(bodies_.size(), 0);
  bool any = false;
  for (std::size_t j = 0; j < bodies_.size(); ++j) {
    const std::int64_t body = bodies_[j];
    double pose[7] = {0, 0, 0, 1, 0, 0, 0};
    std::copy_n(&scene_.position[3 * body], 3, pose);
    if (scene_.rotation) std::copy_n(&scene_.rotation[4 * body], 4, pose + 3);
    moved_[j] = all || !std::equal(pose, pose + 7, &pose_[7 * j]);
    std::copy_n(pose, 7, &pose_[7 * j]);
    any = any || moved_[j];
  }
  return any;
}

// Places triangles of bodies that moved since they were placed, or all after a search.
void NearFacets::place_facets(const OrderedPairs& found, std::int64_t first, std::int64_t last, std::int64_t searches) {
  const bool searched_anew = placed_in_ != searches;
  placed_in_ = searches;
  if (searched_anew) list_facets(found, first, last);
  if (!mark_moved(searched_anew)) return;
  const Contactors& k = *scene_.contactors;
  const Hulls& hulls = k.hulls;
  in_slices(std::int64_t(facets_.size()), [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t n = begin; n < end; ++n) {
      const std::int32_t i = facets_[std::size_t(n)], body = k.body.values[std::size_t(i)];
      const auto j = std::size_t(std::lower_bound(bodies_.begin(), bodies_.end(), body) - bodies_.begin());
      if (!moved_[j]) continue;
      const std::int32_t hull = k.hull.values[std::size_t(i)], face = hulls.first_face[std::size_t(hull)];
      double* of = &facet_[std::size_t(i) * facet_numbers];
      place_of(i, of);
      const double* normal = &hulls.normal[3 * std::size_t(face)];
      if (scene_.rotation)
        turn(&scene_.rotation[4 * std::int64_t(body)], normal, of + 3);
      else
        std::copy_n(normal, 3, of + 3);
      of[6] = hulls.offset[std::size_t(face)];
      of[7] = hulls.radius[std::size_t(hull)];
      double v[3][3];
      for (int d = 0; d < 3; ++d) {
        const double* x = &hulls.vertex[3 * std::size_t(hulls.first_vertex[std::size_t(hull)] + d)];
        if (scene_.rotation)
          turn(&scene_.rotation[4 * std::int64_t(body)], x, v[d]);
        else
          std::copy_n(x, 3, v[d]);
      }
      for (int d = 0; d < 3; ++d) place_edge(v[d], v[(d + 1) % 3], v[(d + 2) % 3], of + 3, of + 8 + 4 * d);
    }
  });
}

// A contact needs a point of the triangle within the reach of the ball: in the disk that this reach cuts from the plane
// of the triangle. No such point exists if the disk lies beyond an edge, or farther than the ball around the triangle.
void NearFacets::drop_far(const OrderedPairs& found, int kind, std::int64_t first, std::int64_t last) {
  const Contactors& k = *scene_.contactors;
  may_touch_.resize(std::size_t(last - first));
  in_slices(last - first, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t n = begin; n < end; ++n) {
      const std::int64_t p = first + n;
      const std::int32_t ball = found.a[p], facet = found.b[p];
      const double* of = &facet_[std::size_t(facet) * facet_numbers];
      double x[3], shift[3] = {0, 0, 0};
      place_of(ball, x);
      if (scene_.any_periodic) image_shift(*scene_.cell, found.image[p] & image_bits, shift);
      double height = -of[6], square = 0, along[3];
      for (int d = 0; d < 3; ++d) {
        along[d] = x[d] - of[d] - shift[d];
        height += along[d] * of[3 + d];
        square += along[d] * along[d];
      }
      const double reach =
          (k.radius.values[std::size_t(ball)] + scene_.share(ball) + scene_.share(facet)) * (1 + on_the_safe_side) +
          on_the_safe_side * of[7];
      const double disk = reach * reach - height * height;
      const double cut = std::sqrt(std::max(disk, 0.0)), apart = cut + of[7];
      bool far = disk < 0 || square - height * height > apart * apart * (1 + on_the_safe_side);
      for (int d = 0; d < 3 && !far; ++d) {
        const double* edge = of + 8 + 4 * d;
        far = along[0] * edge[0] + along[1] * edge[1] + along[2] * edge[2] - edge[3] > cut + on_the_safe_side * of[7];
      }
      may_touch_[std::size_t(n)] = !far || (found.image[p] & declared_bit);
    }
  });
  for (std::int64_t n = 0; n < last - first; ++n)
    if (may_touch_[std::size_t(n)]) near_.append(found, first + n, first + n + 1);
  near_.kind_end[std::size_t(kind)] = near_.count();
}

void NearFacets::find(const OrderedPairs& found, std::int64_t searches) {
  near_.begin(kinds);
  for (int kind = 0; kind < kinds; ++kind) {
    const std::int64_t first = kind > 0 ? found.kind_end[std::size_t(kind - 1)] : 0,
                       last = found.kind_end[std::size_t(kind)];
    if (pair_kinds[kind].hull_contact == cairn_pair_sphere_facet && last > first) {
      place_facets(found, first, last, searches);
      drop_far(found, kind, first, last);
    } else if (pair_kinds[kind].hull_contact) {
      near_.append(found, first, last);
    }
    near_.kind_end[std::size_t(kind)] = near_.count();
  }
}

} // namespace cairn::detection
