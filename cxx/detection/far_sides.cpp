// A round body on a closed surface thinner than itself reaches the far side of it from behind. Its nearest point there
// is no contact, since the near side lies between. The same holds for the edges of a thin mesh in the plane, whose bars
// reach through half of it.
#include "far_sides.hpp"

#include <cstdint>

namespace cairn::detection {

namespace {

constexpr double against = -0.5; // cosine between two normals that push more against each other than together
constexpr double rounding = 1e-9;

} // namespace

// The radius round the centre of a sphere or the axis of a capsule; of other shapes, which meet no triangle from
// behind, below 0.
double FarSides::round_layer(std::int32_t contactor) const {
  const ShapeInfo& shape = scene_.shape(contactor);
  const bool has_axis = shape.hull == Hulls::Form::axial && !shape.faced;
  return shape.ball() || has_axis ? scene_.contactors->size(contactor) : -1;
}

// True if contact j is with a nearer point of the surface than contact i, behind whose triangle the centre or the axis
// lies, and their normals are opposite.
bool FarSides::is_far_side_of(const Candidates& out, std::int64_t i, std::int64_t j, double layer) const {
  const double *normal = &out.normal[3 * i], *other = &out.normal[3 * j];
  double cosine = 0, square = 0;
  for (int k = 0; k < 3; ++k) {
    cosine += normal[k] * other[k];
    const double from = out.point[3 * i + k] + (layer + out.gap[i] / 2) * normal[k];
    const double to = out.point[3 * j + k] - out.gap[j] / 2 * other[k];
    square += (to - from) * (to - from);
  }
  const double depth = (1 - rounding) * (layer + out.gap[i]);
  return cosine < against && square < depth * depth;
}

// Cosine between the normal of a contact with an edge of a mesh in the plane and that of the edge, out of the body; of
// others 0.
double FarSides::along_its_edge(const Candidates& out, std::int64_t i) const {
  const std::int32_t edge = out.contactor_b[i];
  if (scene_.mapped->place[std::size_t(edge)] < 0 || !scene_.shape(edge).bar()) return 0;
  const double* e = &scene_.direction[3 * std::int64_t(edge)]; // the body on its left
  return out.normal[2 * i] * e[1] - out.normal[2 * i + 1] * e[0];
}

// True if contact i is with the far side: another contact of A with the same carrier is with the near side.
bool FarSides::is_far(const Candidates& out, std::int64_t i) const {
  const bool space = scene_.dim == 3;
  const auto on_facet = [&](std::int64_t j) { return scene_.shape(out.contactor_b[j]).facet(); };
  const double layer = space && out.gap[i] < 0 && on_facet(i) ? round_layer(out.contactor_a[i]) : -1;
  if (space ? layer < 0 || !(out.gap[i] + layer < 0) : !(along_its_edge(out, i) < against)) return false;
  for (const int way : {-1, 1})
    for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way) {
      if (out.image[j] != out.image[i] || scene_.carrier[out.contactor_b[j]] != scene_.carrier[out.contactor_b[i]])
        continue;
      if (space ? on_facet(j) && is_far_side_of(out, i, j, layer) : along_its_edge(out, j) > -against) return true;
    }
  return false;
}

void FarSides::drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) const {
  if (scene_.dim == 3 ? !scene_.contactors->hull.active : !scene_.mapped) return;
  bool any = false;
  for (std::int64_t i = 0; i < out.count; ++i) {
    if (!is_far(out, i)) continue;
    if (!any) dropped.begin(out);
    any = true;
    dropped[i] = 1;
  }
  if (!any) return;
  dropped.spare(declared, scene_, out);
  dropped.remove(out, scene_.dim);
}

} // namespace cairn::detection
