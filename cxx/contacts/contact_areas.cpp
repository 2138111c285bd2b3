#include "contact_areas.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "../contactors/shapes.hpp"
#include "anchor_frames.hpp"

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
double ContactAreas::area_of(std::int64_t i) const {
  const Candidates& c = *in_.candidates;
  const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
  const int d = in_.dim();
  if (in_.meshes)
    for (const std::int32_t contactor : {ca, cb})
      if (classes_.is_mapped(contactor))
        if (const double area = in_.meshes->area(contactor); area > 0) {
          const std::int32_t other = contactor == ca ? cb : ca;
          if (classes_.is_mapped(other) || !info(Shape(*in_.contactors->shape[other])).ball()) return area;
          const double r =
              curvature_.effective_radius(i); // a grain on a node is not joined by more than it is elsewhere
          return std::min(in_.meshes->near_area(contactor), d == 2 ? r : std::numbers::pi * r * r);
        }
  if (info(Shape(*in_.contactors->shape[ca])).ball() || !info(Shape(*in_.contactors->shape[ca])).is_hull()) {
    const double r = curvature_.effective_radius(i);
    return d == 2 ? r : std::numbers::pi * r * r;
  }
  if (d == 3 && !(classes_.is_mapped(ca) || classes_.is_mapped(cb))) {
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

void find_tributary_areas(const AssemblyInput& in, AnchorFrames& frames) {
  if (!in.meshes || in.meshes->has_areas()) return;
  frames.find_joints();
  std::vector<std::uint8_t> is_mark;
  for (const std::int32_t c : in.meshes->mapped().contactor)
    is_mark.push_back(frames.is_of_joint(*in.contactors->material[c]));
  in.meshes->find_areas(is_mark);
}

} // namespace cairn
