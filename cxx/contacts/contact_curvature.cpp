// Curvatures of surfaces at a contact, and the radii by which one rolls on the other: those of the sum of both, along
// the principal directions of that (Johnson 1985, Contact Mechanics, 4.1).
#include "contact_curvature.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "../contactors/curved_surfaces.hpp"
#include "../contactors/shapes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"

namespace cairn {

// Finds the curvature of the surface of A (side 0) or B; false where the shape does not tell.
bool ContactCurvature::surface_at(std::int64_t i, int side, const double axes[3][3], SurfaceCurvature& out) const {
  const Candidates& c = *in_.candidates;
  const std::int32_t contactor = side ? c.contactor_b[i] : c.contactor_a[i], carrier = in_.body(contactor);
  if (carrier < 0) return true; // a side of a mesh is flat
  const ShapeSurface& surface = surface_of(Shape(*in_.contactors->shape[contactor]));
  const double sense = side ? 1 : -1;
  const int d = in_.dim();
  CurvatureView view{};
  view.size = *in_.contactors->radius[contactor];
  double shift[3] = {0, 0, 0}, n[3] = {0, 0, 0};
  if (in_.cell->any() && side) image_shift(*in_.cell, c.image[i], shift);
  for (int l = 0; l < d; ++l) {
    n[l] = sense * axes[0][l];
    view.at[l] = c.point[d * i + l] - c.gap[i] / 2 * n[l] - shift[l] - in_.bodies->position[carrier][l];
  }
  to_body_axes(*in_.bodies, d, carrier, n, view.outward);
  to_body_axes(*in_.bodies, d, carrier, axes[1], view.t);
  to_body_axes(*in_.bodies, d, carrier, axes[2], view.s);
  to_body_axes(*in_.bodies, d, carrier, view.at, view.at);
  for (int l = 0; l < d && in_.contactors->offset.active; ++l) view.at[l] -= in_.contactors->offset[contactor][l];
  return surface.curvature(data_of(*in_.contactors, contactor), view, out);
}

SurfacePair ContactCurvature::of(std::int64_t i, const double axes[3][3]) const {
  SurfacePair out;
  for (const std::int32_t contactor : {in_.candidates->contactor_a[i], in_.candidates->contactor_b[i]}) {
    const double radius = *in_.contactors->radius[contactor];
    if (!(radius > 0) || in_.body(contactor) < 0 || !info(Shape(*in_.contactors->shape[contactor])).mover) continue;
    out.size = out.size > 0 ? std::min(out.size, radius) : radius;
  }
  out.known = out.size > 0 && surface_at(i, 0, axes, out.a) && surface_at(i, 1, axes, out.b);
  return out;
}

bool SurfacePair::radii(double p[3]) const {
  constexpr double flat = 0x1p-30; // of the inverse of the size
  std::fill_n(p, 3, 0.0);
  const double sum[3] = {a.k[0] + b.k[0], a.k[1] + b.k[1], a.k[2] + b.k[2]};
  const double *one = a.across, *other = b.across;
  if (a.sharp + b.sharp > 0) {
    if (a.sharp == 2 || b.sharp == 2) return true;
    if (a.sharp && b.sharp && std::abs(one[0] * other[1] - one[1] * other[0]) > 1e-6) return true; // they cross
    const double* across = a.sharp ? one : other;
    const double along[2] = {-across[1], across[0]};
    const double curvature =
        sum[0] * along[0] * along[0] + 2 * sum[1] * along[0] * along[1] + sum[2] * along[1] * along[1];
    if (curvature * size > flat) surface::add(1 / curvature, along, p);
    return curvature * size > -flat;
  }
  double value[2], first[2];
  surface::principal(sum, value, first);
  const double second[2] = {-first[1], first[0]};
  for (int k = 0; k < 2; ++k)
    if (value[k] * size > flat) surface::add(1 / value[k], k ? second : first, p);
  return value[1] * size > -flat;
}

// Effective radius and radii about the axes t and s of a rolling contact, in columns of its geometry. Contacts that are
// round in both directions keep the effective radius.
void ContactCurvature::rolling_radii(const cairn_batch& b, int lane, double* geometry) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  const int n = b.count, d = in_.dim();
  const ShapeInfo& one = info(Shape(*in_.contactors->shape[in_.candidates->contactor_a[i]]));
  const ShapeInfo& other = info(Shape(*in_.contactors->shape[in_.candidates->contactor_b[i]]));
  double axes[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  axes_of(b, d, lane, axes);
  const SurfacePair c = of(i, axes);
  const auto meets_even = [&](const ShapeInfo& with, const SurfaceCurvature& surface) {
    return with.ball() || surface.is_flat() || (d == 2 && with.hollow());
  };
  double radii[3] = {geometry[n], 0, geometry[n]};
  if (c.known && !(one.ball() && meets_even(other, c.b)) && !(other.ball() && meets_even(one, c.a))) {
    double p[3], value[2], along[2];
    c.radii(p);
    if (d == 2) {
      geometry[n] = p[0];
    } else {
      surface::principal(p, value, along);
      // what rolls along a direction turns about the one across it
      radii[0] = p[2];
      radii[1] = -p[1];
      radii[2] = p[0];
      geometry[n] = value[1] > 0 ? std::sqrt(value[0] * value[1]) : std::max(value[0], 0.0);
    }
  }
  for (int l = 0; l < 3; ++l) geometry[(3 + l) * n] = radii[l];
}

// Effective radius [m]: that of the ball against flat sides, more in a hollow. Bodies with corners count by the radius
// of their bounding ball, as a size where no ball is there.
double ContactCurvature::effective_radius(std::int64_t i) const {
  const std::int32_t ca = in_.candidates->contactor_a[i], cb = in_.candidates->contactor_b[i];
  const double ra = *in_.contactors->radius[ca], rb = *in_.contactors->radius[cb];
  const ShapeInfo &a = info(Shape(*in_.contactors->shape[ca])), &b = info(Shape(*in_.contactors->shape[cb]));
  if (a.ball() != b.ball()) {
    const double r = a.ball() ? ra : rb, other = a.ball() ? rb : ra;
    if (r > 0) return (a.ball() ? b : a).hollow() && other > r ? r * other / (other - r) : r;
  }
  if (ra > 0 && rb > 0) return ra * rb / (ra + rb);
  if (ra > 0 || rb > 0 || !in_.meshes) return std::max(ra, rb);
  for (const std::int32_t contactor : {ca, cb}) // a node has no size: the size of a cell counts instead
    if (classes_.is_mapped(contactor)) return in_.meshes->meshes[in_.meshes->mesh_of(contactor)].size();
  return 0;
}

} // namespace cairn
