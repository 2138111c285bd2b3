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
// Way of a ball in parts of its reach until its close triangles are sought again. A longer way lasts longer, and every
// step tests more triangles.
constexpr double near_skin = 0.02;

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

// Pairs of a kind by ball and body, which stand one after the other.
void NearFacets::list_groups(const OrderedPairs& found, std::int64_t first, std::int64_t last) {
  const Contactors& k = *scene_.contactors;
  for (std::int64_t p = first; p < last; ++p) {
    const std::int32_t body = k.body.values[std::size_t(found.b[p])], image = found.image[p] & image_bits;
    if (p == first || groups_.back().ball != found.a[p] || groups_.back().body != body ||
        groups_.back().image != image) {
      groups_.emplace_back();
      groups_.back().first = p;
      groups_.back().ball = found.a[p];
      groups_.back().body = body;
      groups_.back().image = image;
    }
    groups_.back().last = p + 1;
    if (!placed_[std::size_t(found.b[p])]) place_facet(found.b[p]);
  }
}

void NearFacets::place_facet(std::int32_t i) {
  const Contactors& k = *scene_.contactors;
  const Hulls& hulls = k.hulls;
  placed_[std::size_t(i)] = 1;
  const std::int32_t hull = k.hull.values[std::size_t(i)], face = hulls.first_face[std::size_t(hull)];
  double* of = &facet_[std::size_t(i) * facet_numbers];
  for (int d = 0; d < 3; ++d) of[d] = k.offset.active ? k.offset[i][d] : 0;
  std::copy_n(&hulls.normal[3 * std::size_t(face)], 3, of + 3);
  of[6] = hulls.offset[std::size_t(face)];
  of[7] = hulls.radius[std::size_t(hull)];
  const double* v[3];
  for (int d = 0; d < 3; ++d) v[d] = &hulls.vertex[3 * std::size_t(hulls.first_vertex[std::size_t(hull)] + d)];
  for (int d = 0; d < 3; ++d) place_edge(v[d], v[(d + 1) % 3], v[(d + 2) % 3], of + 3, of + 8 + 4 * d);
}

// Where the ball of a group is, in the axes of the body of its triangles.
void NearFacets::place_ball(const Group& group, double* x) const {
  double at[3], shift[3] = {0, 0, 0};
  place_of(group.ball, at);
  if (scene_.any_periodic) image_shift(*scene_.cell, group.image, shift);
  for (int d = 0; d < 3; ++d) at[d] -= shift[d] + scene_.position[3 * std::int64_t(group.body) + d];
  if (!scene_.rotation) return void(std::copy_n(at, 3, x));
  const double* q = &scene_.rotation[4 * std::int64_t(group.body)];
  const double back[4] = {q[0], -q[1], -q[2], -q[3]};
  turn(back, at, x);
}

// A contact needs a point of the triangle within the reach of the ball: in the disk that this reach cuts from the plane
// of the triangle. No such point exists if the disk lies beyond an edge, or farther than the ball around the triangle.
bool NearFacets::is_far(const OrderedPairs& found, std::int64_t p, const double* ball, double reach) const {
  const double* of = &facet_[std::size_t(found.b[p]) * facet_numbers];
  double height = -of[6], square = 0, along[3];
  for (int d = 0; d < 3; ++d) {
    along[d] = ball[d] - of[d];
    height += along[d] * of[3 + d];
    square += along[d] * along[d];
  }
  reach = (reach + scene_.share(found.b[p])) * (1 + on_the_safe_side) + on_the_safe_side * of[7];
  const double disk = reach * reach - height * height;
  const double cut = std::sqrt(std::max(disk, 0.0)), apart = cut + of[7];
  bool far = disk < 0 || square - height * height > apart * apart * (1 + on_the_safe_side);
  for (int d = 0; d < 3 && !far; ++d) {
    const double* edge = of + 8 + 4 * d;
    far = along[0] * edge[0] + along[1] * edge[1] + along[2] * edge[2] - edge[3] > cut + on_the_safe_side * of[7];
  }
  return far && !(found.image[p] & declared_bit);
}

// Marks which of the close pairs of a group may touch; these are sought again once the ball is elsewhere.
void NearFacets::look_at(const OrderedPairs& found, Group& group) {
  double x[3], square = 0;
  place_ball(group, x);
  const double reach = scene_.contactors->radius.values[std::size_t(group.ball)] + scene_.share(group.ball);
  for (int d = 0; d < 3; ++d) square += (x[d] - group.at[d]) * (x[d] - group.at[d]);
  const double room = near_skin * group.reach - (reach - group.reach);
  if (!group.known || scene_.margin->per_contactor || !(room >= 0) || !(square <= room * room)) {
    group.known = true;
    group.close = 0;
    group.reach = reach;
    std::copy_n(x, 3, group.at);
    for (std::int64_t p = group.first; p < group.last; ++p)
      if (!is_far(found, p, x, (1 + near_skin) * reach)) close_[std::size_t(group.first + group.close++)] = p;
  }
  for (std::int64_t n = group.first; n < group.first + group.close; ++n)
    may_touch_[std::size_t(n)] = !is_far(found, close_[std::size_t(n)], x, reach);
}

void NearFacets::find(const OrderedPairs& found, std::int64_t searches) {
  const auto first_of = [&](int kind) { return kind > 0 ? found.kind_end[std::size_t(kind - 1)] : 0; };
  if (placed_in_ != searches) {
    placed_in_ = searches;
    facet_.resize(std::size_t(scene_.contactors->count) * facet_numbers);
    placed_.assign(std::size_t(scene_.contactors->count), 0);
    close_.resize(std::size_t(found.count()));
    may_touch_.resize(std::size_t(found.count()));
    groups_.clear();
    kind_groups_.assign(kinds, 0);
    for (int kind = 0; kind < kinds; ++kind) {
      if (pair_kinds[kind].hull_contact == cairn_pair_sphere_facet)
        list_groups(found, first_of(kind), found.kind_end[std::size_t(kind)]);
      kind_groups_[std::size_t(kind)] = groups_.size();
    }
  }
  const auto count = std::int64_t(groups_.size());
#pragma omp parallel for schedule(static) if (count > 1024)
  for (std::int64_t g = 0; g < count; ++g) look_at(found, groups_[std::size_t(g)]);
  near_.begin(kinds);
  std::size_t g = 0;
  for (int kind = 0; kind < kinds; ++kind) {
    if (pair_kinds[kind].hull_contact && pair_kinds[kind].hull_contact != cairn_pair_sphere_facet)
      near_.append(found, first_of(kind), found.kind_end[std::size_t(kind)]);
    for (; g < kind_groups_[std::size_t(kind)]; ++g)
      for (std::int64_t n = groups_[g].first; n < groups_[g].first + groups_[g].close; ++n)
        if (may_touch_[std::size_t(n)]) near_.append(found, close_[std::size_t(n)], close_[std::size_t(n)] + 1);
    near_.kind_end[std::size_t(kind)] = near_.count();
  }
}

} // namespace cairn::detection
