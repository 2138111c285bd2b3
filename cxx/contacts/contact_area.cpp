// Area and effective radius of a contact; and contacts of bodies that came in touching.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "face_overlap.hpp"
#include "interaction_state.hpp"

namespace cairn {

namespace {

// Length that some points of a line span.
double span_of(const double* point, int count, const double* normal) {
  double least = 0, most = 0;
  for (int i = 1; i < count; ++i) {
    const double along = (point[2 * i + 1] - point[1]) * normal[0] - (point[2 * i] - point[0]) * normal[1];
    least = std::min(least, along);
    most = std::max(most, along);
  }
  return most - least;
}

} // namespace

// Contact area [m2], in 2D per metre across the plane: disk of the effective radius for round bodies and round ends,
// tributary area for nodes of meshes, part of the shared face for each contact point of bodies with sides.
double Interactions::State::area_of(std::int64_t i) const {
  const Candidates& c = *candidates;
  const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
  const int d = dim();
  if (meshes)
    for (const std::int32_t contactor : {ca, cb})
      if (kind[contactor] & mapped)
        if (const double area = meshes->area(contactor); area > 0) {
          const std::int32_t other = contactor == ca ? cb : ca;
          if ((kind[other] & mapped) || !info(Shape(*contactors->shape[other])).ball()) return area;
          const double r = effective_radius(i); // a grain on a node is not joined by more than it is elsewhere
          return std::min(meshes->near_area(contactor), d == 2 ? r : std::numbers::pi * r * r);
        }
  if (info(Shape(*contactors->shape[ca])).ball() || !info(Shape(*contactors->shape[ca])).is_hull()) {
    const double r = effective_radius(i);
    return d == 2 ? r : std::numbers::pi * r * r;
  }
  if (d == 3 && !((kind[ca] | kind[cb]) & mapped)) {
    const double r = cap_radius(i);
    return r > 0 ? std::numbers::pi * r * r : face_area(i);
  }
  const auto same_pair = [&](std::int64_t j) {
    return j >= 0 && j < c.count && c.contactor_a[j] == ca && c.contactor_b[j] == cb && c.image[j] == c.image[i];
  };
  std::int64_t first = i, last = i + 1; // points of a pair stand together
  while (same_pair(first - 1)) --first;
  while (same_pair(last)) ++last;
  const int count = int(std::min<std::int64_t>(last - first, most_face_points));
  const double *point = &c.point[d * first], *normal = &c.normal[d * i];
  return (d == 2 ? span_of(point, count, normal) : area_of_points(point, count, normal)) / count;
}

void Interactions::State::find_mesh_areas() {
  if (!meshes || meshes->has_areas()) return;
  find_joints();
  std::vector<std::uint8_t> is_mark;
  for (const std::int32_t c : meshes->mapped().contactor)
    is_mark.push_back(!joint_material.empty() && joint_material[std::size_t(*contactors->material[c])]);
  meshes->find_areas(is_mark);
}

// Effective radius [m]: that of the ball against flat sides, more in a hollow. Bodies with corners count by the radius
// of their bounding ball, as a size where no ball is there.
double Interactions::State::effective_radius(std::int64_t i) const {
  const std::int32_t ca = candidates->contactor_a[i], cb = candidates->contactor_b[i];
  const double ra = *contactors->radius[ca], rb = *contactors->radius[cb];
  const ShapeInfo &a = info(Shape(*contactors->shape[ca])), &b = info(Shape(*contactors->shape[cb]));
  if (a.ball() != b.ball()) {
    const double r = a.ball() ? ra : rb, other = a.ball() ? rb : ra;
    if (r > 0) return (a.ball() ? b : a).hollow() && other > r ? r * other / (other - r) : r;
  }
  if (ra > 0 && rb > 0) return ra * rb / (ra + rb);
  if (ra > 0 || rb > 0 || !meshes) return std::max(ra, rb);
  for (const std::int32_t contactor : {ca, cb}) // a node has no size: the size of a cell counts instead
    if (kind[contactor] & mapped) return meshes->meshes[meshes->mesh_of(contactor)].size();
  return 0;
}

bool Interactions::State::came_in_touching(std::int64_t i) const {
  const ContactKey k = key(i);
  if (memory.has_seen(k.contactor_a) && memory.has_seen(k.contactor_b)) return false;
  const LawTable::Entry& e = laws->entry(entry[i]);
  if (law_infos()[std::size_t(e.law)].joins) return !(e.params[joint_pulley] > 0) || is_rope(i);
  const int within = law_infos()[std::size_t(e.law)].within;
  const std::int32_t ca = candidates->contactor_a[i], cb = candidates->contactor_b[i];
  if (kind[ca] & kind[cb] & mapped && meshes->parted_warped(ca, cb)) return true;
  double furthest = 0; // from the origin of those who gave places, which rounded them
  for (int k = 0; k < dim(); ++k)
    furthest = std::max(furthest, std::abs(candidates->point[dim() * i + k]) + std::abs(origin[std::size_t(k)]));
  const double radius = effective_radius(i), coarse = std::min(rounding_of_gaps(furthest), radius / 64);
  return candidates->gap[i] <= std::max(touch * radius, within < 0 ? 0 : e.params[within]) + coarse;
}

} // namespace cairn
