// Flight of a contact: gain of its relative velocity [m/s] at the velocities of the begin of the step, from the
// configuration of detection to the middle of the motion to the next detection. Laws hold there, while impulses act
// along the normal of detection. Gaps are then those of SHAKE (Ryckaert, Ciccotti & Berendsen 1977), of second order on
// curved or turning surfaces, and a contact that stays closed neither gives nor takes energy. Flat contacts without
// rotation gain nothing.
#include "midpoint_motion.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "../contactors/shapes.hpp"
#include "../detection/pair_kinds.hpp"
#include "../laws/bond_laws.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/side_names.hpp"
#include "body_axes.hpp"
#include "contact_curvature.hpp"

namespace cairn {

namespace {

using Vector = double[3];

bool vanishes(const Vector a) { return !(a[0] != 0 || a[1] != 0 || a[2] != 0); }

// Kind of curvature of two contactors at their contact. Round: centres a sum of radii apart. Ring, tube: a centre seen
// from inside. Plane: a round body or a corner on a flat side. Faces: corners and flat sides of both.
enum class Curved { unknown, round, ring, tube, plane, segment, faces };

Curved curved(Shape a, Shape b) {
  const bool ball = info(a).ball();
  const ShapeInfo& other = info(b);
  if (!ball && !info(a).corners()) return Curved::unknown;
  if (other.half_space() || other.facet()) return Curved::plane;
  if (!ball) return other.bar() || other.corners() ? Curved::faces : Curved::unknown;
  if (other.ball()) return Curved::round;
  if (other.hollow()) return other.directed ? Curved::tube : Curved::ring;
  if (other.bar()) return Curved::segment;
  return other.corners() ? Curved::plane : Curved::unknown;
}

// True if either is a capsule, cylinder or superquadric: these roll by radii from the curvatures of their surfaces.
bool has_radii(Shape a, Shape b) { return info(a).curved_hull() || info(b).curved_hull(); }

// A routine of a user's library may find other surfaces than the names of the shapes tell.
bool replaced(Shape a, Shape b) {
  for (const detection::PairKind& kind : detection::pair_kinds)
    if (kind.contact != kind.built_in && kind.a == a && kind.b == b) return true;
  return false;
}

// The motion of a body as long as nothing acts on it. In 2D along x and y, about z.
struct Motion {
  Vector velocity{}, spin{}, spin_rate{};
  double kept = 1; // of the square of a turn, so that what turns far in a step stays on its circle
  bool turns = false;

  Motion() = default; // of a point of a mesh, which flies straight
  Motion(const Bodies& b, const cairn_record& record, std::int32_t body, int dim, double h) {
    std::copy_n(record.x, dim, velocity);
    if (dim == 2)
      spin[2] = record.x[2];
    else
      std::copy_n(record.x + 3, 3, spin);
    turns = !vanishes(spin);
    if (!turns) return;
    const Vector half = {h / 2 * spin[0], h / 2 * spin[1], h / 2 * spin[2]};
    const double angle = std::sqrt(dot(half, half));
    if (angle > 1e-8) kept = (std::sin(angle) / angle) * (std::sin(angle) / angle);
    if (!b.angular_momentum.active) return;
    const double* inertia = b.inertia[body];
    if (!(inertia[0] != inertia[1] || inertia[0] != inertia[2])) return;
    Vector torque;
    cross(b.angular_momentum[body], spin, torque);
    if (!std::isfinite(torque[0] + torque[1] + torque[2])) return; // nothing turns it but its drive
    const double* j = b.inverse_inertia[body];
    spin_rate[0] = j[0] * torque[0] + j[3] * torque[1] + j[4] * torque[2];
    spin_rate[1] = j[3] * torque[0] + j[1] * torque[1] + j[5] * torque[2];
    spin_rate[2] = j[4] * torque[0] + j[5] * torque[1] + j[2] * torque[2];
  }

  // Velocity and acceleration of a point that the body carries at a lever.
  void carry(const Vector lever, Vector v, Vector a) const {
    std::copy_n(velocity, 3, v);
    std::fill_n(a, 3, 0.0);
    if (!turns) return;
    Vector around, towards, along;
    cross(spin, lever, around);
    cross(spin, around, towards);
    cross(spin_rate, lever, along);
    for (int k = 0; k < 3; ++k) {
      v[k] += around[k];
      a[k] = kept * (towards[k] + along[k]);
    }
  }
};

// The axis of a tube, in space.
void axis_of(const Contactors& c, const Bodies& b, std::int32_t contactor, Vector axis) {
  std::copy_n(c.direction[contactor], 3, axis);
  if (!b.rotation.active) return;
  const double *q = b.rotation[*c.body[contactor]], x[3] = {axis[0], axis[1], axis[2]};
  Vector once, twice;
  cross(q + 1, x, once);
  cross(q + 1, once, twice);
  for (int k = 0; k < 3; ++k) axis[k] = x[k] + 2 * (q[0] * once[k] + twice[k]);
}

// True if a segment in the plane is touched at a round end; its sides are flat.
bool at_end(const Contactors& c, const Bodies& b, std::int32_t contactor, std::int32_t body, const double* n) {
  Vector axis{};
  const double turned = b.rotation.active ? *b.rotation[body] : 0;
  const double *along = c.direction[contactor], cosine = std::cos(turned), sine = std::sin(turned);
  axis[0] = cosine * along[0] - sine * along[1];
  axis[1] = sine * along[0] + cosine * along[1];
  return std::abs(dot(axis, n)) > 1e-6;
}

// True if bodies lie on each other in several points, of a face or of several triangles of a surface: then they neither
// roll nor turn on each other. Their spins are residuals of a solution, and conditions that differ from point to point
// by these would cost a solver ten times the iterations. Lying means that gaps differ by less than a thousandth of the
// distance of the points, for any other contents of the margin.
template <class BodyOf>
bool lies_with_others(const Candidates& c, int dim, std::int64_t i, const BodyOf& body_of) {
  const auto same_pair = [&](std::int64_t j) {
    return j >= 0 && j < c.count && body_of(c.contactor_a[j]) == body_of(c.contactor_a[i]) &&
           body_of(c.contactor_b[j]) == body_of(c.contactor_b[i]);
  };
  const auto lies = [&](std::int64_t j) {
    double way = 0;
    for (int k = 0; k < dim; ++k) {
      const double apart = c.point[dim * j + k] - c.point[dim * i + k];
      way += apart * apart;
    }
    return std::abs(c.gap[j] - c.gap[i]) < 0x1p-10 * std::sqrt(way);
  };
  // points of a pair stand together; a body on a thousand triangles is not asked of all
  constexpr std::int64_t some = 16;
  for (std::int64_t j = i - 1; j >= i - some && same_pair(j); --j)
    if (lies(j)) return true;
  for (std::int64_t j = i + 1; j <= i + some && same_pair(j); ++j)
    if (lies(j)) return true;
  return false;
}

// How fast the speed along a side turns by itself, added to `rate`, the accelerations of the two points; and what the
// gap gets by the way being bent. The normal turns with the body whose side it stands on; between faces, with either.
double flat_rate(Curved how, const Motion& A, const Motion& B, const double* n, const double* v, double ra, double h,
                 double* rate) {
  Vector turning, swing, rolled, pressed, slip, drawn{};
  for (int k = 0; k < 3; ++k)
    turning[k] = how == Curved::plane ? B.kept * B.spin[k] : (A.kept * A.spin[k] + B.kept * B.spin[k]) / 2;
  cross(turning, n, swing);
  for (int k = 0; k < 3; ++k) slip[k] = v[k] - ra * swing[k];
  if (how == Curved::plane) cross(turning, slip, drawn);
  cross(A.spin, swing, rolled);
  cross(A.spin_rate, n, pressed);
  for (int k = 0; k < 3; ++k) rate[k] = rate[k] - ra * (pressed[k] + rolled[k]) - drawn[k];
  return h * (dot(swing, v) - ra / 2 * dot(swing, swing));
}

// Gain across the branch of a sound bond of two round bodies, whose direction turns with their spins on a cone. A root,
// like the motion of round bodies: with chord velocities bonds of one body would turn by different angles, and strain
// it by the square of the step.
void turned_branch(const Motion& A, const Motion& B, const double* n, double ra, double rb, double gap, double h,
                   double* gain) {
  const double distance = ra + rb + gap;
  Vector spin, swing;
  for (int k = 0; k < 3; ++k) spin[k] = (ra * A.spin[k] + rb * B.spin[k]) / (ra + rb);
  cross(spin, n, swing);
  cross(spin, swing, gain);
  const double square = std::min(1.0, h * h * dot(spin, spin));
  for (int k = 0; k < 3; ++k) gain[k] *= -distance * h / (1 + std::sqrt(1 - square));
}

// Gain where both are round, or one is hollow (rb < 0); `across`: velocity without its part along a tube.
double round_rate(const Motion& A, const Motion& B, const double* n, const double* across, double ra, double rb,
                  double gap, double h, double* rate) {
  Vector swing, rolled, pressed, spun, spun_rate;
  const bool hollow = rb < 0;
  const double distance = hollow ? -(ra + rb) - std::min(gap, 0.0) : ra + rb + std::min(gap, 0.0);
  const double bend = flight_of_round(across, n, 3, distance, h), normal = dot(across, n);
  for (int k = 0; k < 3; ++k) {
    swing[k] = distance > 0 ? (across[k] - normal * n[k]) / (hollow ? -distance : distance) : 0;
    spun[k] = ra * A.spin[k] + rb * B.spin[k];
    spun_rate[k] = ra * A.spin_rate[k] + rb * B.spin_rate[k];
  }
  cross(spun, swing, rolled);
  cross(spun_rate, n, pressed);
  for (int k = 0; k < 3; ++k) rate[k] = rate[k] - pressed[k] - rolled[k];
  return hollow ? -bend : bend;
}

} // namespace

// Rows n, t and s of one contact.
void MidpointMotion::change_of(const cairn_batch& b, int lane, double out[3]) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  const std::int32_t ca = in_.candidates->contactor_a[i], cb = in_.candidates->contactor_b[i];
  const auto shape_a = Shape(*in_.contactors->shape[ca]), shape_b = Shape(*in_.contactors->shape[cb]);
  Curved how = curved(shape_a, shape_b);
  const LawInfo& law = law_infos()[b.law];
  const bool beside_mesh = b.mapped_a || b.mapped_b;
  if (anchors_.is_anchored(i) && (!beside_mesh || law.joins || law.spans)) return change_of_anchored(b, lane, out);
  std::fill_n(out, 3, 0.0);
  if (beside_mesh) return change_beside_mesh(b, lane, out);
  const int d = in_.dim();
  const auto turns = [&](std::int32_t of) {
    const double* x = system_.record[of].x;
    return d == 2 ? x[2] != 0 : !vanishes(x + 3);
  };
  if (how == Curved::plane && is_radial(b.side_a) && !turns(b.body_b[lane])) return; // what slides or rolls on a plane
  const bool bonded = is_sound_bond(b, lane);
  const auto lies = [&] {
    return info(shape_a).is_hull() &&
           lies_with_others(*in_.candidates, d, i, [&](std::int32_t of) { return in_.body(of); });
  };
  if (how == Curved::unknown || replaced(shape_a, shape_b)) {
    if (bonded)
      change_of_carried(b, lane, out);
    else if (!replaced(shape_a, shape_b) && has_radii(shape_a, shape_b) && !lies())
      change_of_surfaces(b, lane, out);
    return;
  }
  if (lies()) return;
  const Motion A(*in_.bodies, system_.record[b.body_a[lane]], b.body_a[lane], d, in_.h);
  const Motion B(*in_.bodies, system_.record[b.body_b[lane]], b.body_b[lane], d, in_.h);
  if (how == Curved::plane && !A.turns && !B.turns) return; // what slides on a plane

  double axes[3][3] = {};
  axes_of(b, d, lane, axes);
  const double* n = axes[0];
  const bool ball = info(shape_a).ball(), hull_b = info(shape_b).is_hull();
  const double gap = in_.candidates->gap[i], ra = ball ? *in_.contactors->radius[ca] : 0;
  double rb = hull_b || how == Curved::plane ? 0 : *in_.contactors->radius[cb];
  if (how == Curved::segment)
    how = at_end(*in_.contactors, *in_.bodies, cb, b.body_b[lane], n) ? Curved::round : Curved::plane;
  if (how == Curved::ring || how == Curved::tube) rb = -rb;

  // centres of A's and B's curvature; for a flat side, the point on its surface
  Vector lever_a{}, lever_b{}, va, vb, aa, ab, v{};
  const double to_b = how == Curved::plane || how == Curved::faces ? gap / 2 : gap / 2 + rb;
  if (b.side_a == rigid2 || b.side_a == rigid3)
    for (int k = 0; k < d; ++k) lever_a[k] = b.lever_a[k * b.count + lane] + (gap / 2 + ra) * n[k];
  if (b.side_b == rigid2 || b.side_b == rigid3)
    for (int k = 0; k < d; ++k) lever_b[k] = b.lever_b[k * b.count + lane] - to_b * n[k];
  A.carry(lever_a, va, aa);
  B.carry(lever_b, vb, ab);
  if (in_.sheared) image_velocity(*in_.cell, in_.candidates->image[i], v);
  for (int k = 0; k < 3; ++k) v[k] = va[k] - vb[k] - v[k];

  Vector rate;
  for (int k = 0; k < 3; ++k) rate[k] = aa[k] - ab[k];
  double bend = 0;
  if (how == Curved::plane || how == Curved::faces) {
    bend = flat_rate(how, A, B, n, v, ra, in_.h, rate);
  } else {
    Vector across;
    std::copy_n(v, 3, across);
    if (how == Curved::tube) {
      Vector axis;
      axis_of(*in_.contactors, *in_.bodies, cb, axis);
      if (std::abs(dot(axis, n)) > 1e-6) { // the rim of an open end
        if (bonded) change_of_carried(b, lane, out);
        return;
      }
      const double along = dot(v, axis);
      for (int k = 0; k < 3; ++k) across[k] -= along * axis[k];
    }
    bend = round_rate(A, B, n, across, ra, rb, gap, in_.h, rate);
  }
  for (int k = 0; k < 3; ++k) out[0] += in_.h / 2 * (aa[k] - ab[k]) * n[k];
  out[0] += bend;
  // friction of round bodies takes a bias along the normal alone; a bond would tilt to first order without the others,
  // but of two disks, whose spins and branch are square to each other
  if (is_radial(b.side_a) && !(bonded && (d == 3 || !is_radial(b.side_b)))) return;
  const bool branch = how == Curved::round && is_radial(b.side_a) && is_radial(b.side_b);
  if (branch) turned_branch(A, B, n, ra, rb, gap, in_.h, rate);
  for (int k = 1; k < d; ++k) out[k] = (branch ? 1 : in_.h / 2) * dot(rate, axes[k]);
}

namespace {

// Products in the plane across a normal: matrices (11, 12, 22) or, if unsymmetric, by rows.
using Planar = double[2];
double product(const Planar a, const Planar b) { return a[0] * b[0] + a[1] * b[1]; }
void apply(const double m[3], const Planar x, Planar y) {
  const double first = m[0] * x[0] + m[1] * x[1];
  y[1] = m[1] * x[0] + m[2] * x[1];
  y[0] = first;
}

// How the point of contact of two surfaces moves, and what the gap gains by its moving.
struct Travel {
  Planar over_a{}, over_b{}; // velocity over each surface [m/s]
  double gain = 0;           // second derivative of the gap beside that of the points that bodies carry [m/s2]
};

// Motion of the contact point over both surfaces (Montana 1988): the point of A moves at v against that of B, the
// normal of A turns at `tilt` against that of B, which turns at `swing`. With curvatures Ka, Kb and P = 1/(Ka + Kb) it
// moves over B by P (tilt + Ka v), which draws the surfaces together; in a form that allows an infinite curvature on
// one side.
template <class Curvatures>
Travel travel_of(const Curvatures& c, const double p[3], const Planar v, const Planar tilt, const Planar swing,
                 double h) {
  Travel out;
  Planar rolled, bent, share, slid; // P tilt; Kb v, or Ka v where B is sharp; P Kb v; Ka P Kb v
  apply(p, tilt, rolled);
  apply((c.b.sharp ? c.a : c.b).k, v, bent);
  apply(p, bent, share);
  for (int k = 0; k < 2 && c.b.sharp; ++k) share[k] = v[k] - share[k]; // 1 - P Ka
  if (c.a.sharp) {                                                     // (1 - Kb P) Kb v
    apply(c.b.k, share, slid);
    for (int k = 0; k < 2; ++k) slid[k] = bent[k] - slid[k];
  } else {
    apply(c.a.k, share, slid);
  }
  // farther than over the body nothing rolls in a step
  const double way = h * std::sqrt(product(rolled, rolled));
  if (way > c.size)
    for (double& x : rolled) x *= c.size / way;
  out.gain = 2 * product(swing, v) + 2 * product(tilt, share) + product(v, slid) - product(tilt, rolled);
  for (int k = 0; k < 2; ++k) {
    out.over_a[k] = rolled[k] - share[k];
    out.over_b[k] = out.over_a[k] + v[k];
  }
  return out;
}

} // namespace

// Flight of two surfaces with known curvatures; one may have an edge or a corner at the contact.
void MidpointMotion::change_of_surfaces(const cairn_batch& b, int lane, double out[3]) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  double axes[3][3] = {};
  axes_of(b, 3, lane, axes);
  const double *n = axes[0], gap = in_.candidates->gap[i];
  const Motion A(*in_.bodies, system_.record[b.body_a[lane]], b.body_a[lane], 3, in_.h);
  Motion B;
  if (b.mapped_b) { // its faces turn with the mesh, by as little as strains
    const MeshSet::Middle& middle = in_.meshes->middle(in_.candidates->contactor_b[i]);
    for (int k = 0; k < 3; ++k) B.velocity[k] = middle.of(in_.nodes->velocity, k);
  } else {
    B = Motion(*in_.bodies, system_.record[b.body_b[lane]], b.body_b[lane], 3, in_.h);
  }
  const SurfacePair c = curvature_.of(i, axes);
  double radii[3];
  if (!c.known || c.a.rocks || c.b.rocks || (c.a.sharp && c.b.sharp) || !c.radii(radii)) return;
  if (!A.turns && !B.turns && (c.a.is_flat() || c.b.is_flat())) return; // what slides on a plane
  Vector lever[2], v[2], a[2], between{}, over_a{}, over_b{}, of_a, of_b;
  for (const int side : {0, 1}) {
    const double* from = (side ? b.lever_b : b.lever_a) + lane;
    const std::int32_t contactor = side ? in_.candidates->contactor_b[i] : in_.candidates->contactor_a[i];
    const double sense = side ? -1 : 1;
    const bool round = is_radial(side ? b.side_b : b.side_a), of_mesh = side && b.mapped_b;
    for (int k = 0; k < 3; ++k)
      lever[side][k] = of_mesh ? 0
                       : round ? -sense * *in_.contactors->radius[contactor] * n[k]
                               : from[std::ptrdiff_t(k) * b.count] + sense * gap / 2 * n[k];
    (side ? B : A).carry(lever[side], v[side], a[side]);
  }
  if (in_.sheared) image_velocity(*in_.cell, in_.candidates->image[i], between);
  for (int k = 0; k < 3; ++k) between[k] = v[0][k] - v[1][k] - between[k];
  Vector turn_a, turn_b;
  cross(A.spin, n, turn_a);
  cross(B.spin, n, turn_b);
  const double kept_a = std::sqrt(A.kept), kept_b = std::sqrt(B.kept);
  Planar slip, tilt, swing;
  for (int k = 0; k < 2; ++k) {
    slip[k] = dot(between, axes[k + 1]);
    swing[k] = kept_b * dot(turn_b, axes[k + 1]);
    tilt[k] = kept_a * dot(turn_a, axes[k + 1]) - swing[k];
  }
  const Travel travel = travel_of(c, radii, slip, tilt, swing, in_.h);
  out[0] = in_.h / 2 * travel.gain;
  for (int k = 0; k < 3; ++k) out[0] += in_.h / 2 * (a[0][k] - a[1][k]) * n[k];
  if (is_radial(b.side_a)) return; // friction of round bodies takes a bias along the normal alone
  for (int k = 0; k < 3; ++k) {
    over_a[k] = travel.over_a[0] * axes[1][k] + travel.over_a[1] * axes[2][k];
    over_b[k] = travel.over_b[0] * axes[1][k] + travel.over_b[1] * axes[2][k];
  }
  cross(A.spin, over_a, of_a);
  cross(B.spin, over_b, of_b);
  for (int k = 0; k < 3; ++k) of_a[k] = a[0][k] - a[1][k] + kept_a * of_a[k] - kept_b * of_b[k];
  for (int k = 1; k < 3; ++k) out[k] = in_.h / 2 * dot(of_a, axes[k]);
}

// True for a sound bond that holds along the tangents as well: its errors there add up from step to step.
bool MidpointMotion::is_sound_bond(const cairn_batch& b, int lane) const {
  return can_bond(Law(b.law)) && b.state && b.state[lane] > 0;
}

// Flight of two bonded bodies without known curvature: from the points that they carry.
void MidpointMotion::change_of_carried(const cairn_batch& b, int lane, double out[3]) const {
  const int d = in_.dim();
  double axes[3][3] = {};
  axes_of(b, d, lane, axes);
  Vector v, a[2];
  for (const int side : {0, 1}) {
    const double* from = (side ? b.lever_b : b.lever_a) + lane;
    const bool round = is_radial(side ? b.side_b : b.side_a);
    const std::int32_t of = (side ? b.body_b : b.body_a)[lane];
    Vector lever{};
    for (int k = 0; k < d; ++k) lever[k] = round ? from[0] * axes[0][k] : from[k * b.count];
    Motion(*in_.bodies, system_.record[of], of, d, in_.h).carry(lever, v, a[side]);
  }
  for (int c = 0; c < d; ++c)
    for (int k = 0; k < 3; ++k) out[c] += in_.h / 2 * (a[0][k] - a[1][k]) * axes[c][k];
}

// True for a rim, a corner or another curved surface of a rigid body on a side of a mesh, on which it rocks or rolls.
bool MidpointMotion::rocks_on_mesh(const cairn_batch& b, int lane) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  if (!b.mapped_b || b.mapped_a || anchors_.is_anchored(i) || is_sound_bond(b, lane)) return false;
  const auto shape_a = Shape(*in_.contactors->shape[in_.candidates->contactor_a[i]]),
             shape_b = Shape(*in_.contactors->shape[in_.candidates->contactor_b[i]]);
  return info(shape_a).is_hull() && (info(shape_b).facet() || info(shape_b).bar()) && !replaced(shape_a, shape_b) &&
         !lies_with_others(*in_.candidates, in_.dim(), i, [&](std::int32_t of) { return in_.body(of); });
}

// Flight of a turning body against a mesh, whose nodes fly straight: nodes that stick to it or are joined to it would
// part from it by the square of the turn in each step, and stretch the mesh as much. Along their normal gaps measure
// the error. A round body rolls on the side of a mesh with a single point.
void MidpointMotion::change_beside_mesh(const cairn_batch& b, int lane, double out[3]) const {
  if ((b.mapped_a && b.mapped_b) || law_infos()[b.law].joins) return; // or a joint that broke
  const auto side = b.mapped_a ? b.side_b : b.side_a;
  const double* from = (b.mapped_a ? b.lever_b : b.lever_a) + lane;
  const bool flat = side == rigid2 || side == rigid3;
  if (!flat && !(b.mapped_a && is_radial(side))) return;
  const int d = in_.dim();
  const std::int32_t turning = (b.mapped_a ? b.body_b : b.body_a)[lane];
  double axes[3][3] = {};
  Vector lever{}, v{}, a{};
  axes_of(b, d, lane, axes);
  for (int k = 0; k < d; ++k) lever[k] = flat ? from[k * b.count] : from[0] * axes[0][k];
  const bool rocks = rocks_on_mesh(b, lane);
  if (rocks && d == 3) return change_of_surfaces(b, lane, out);
  Motion(*in_.bodies, system_.record[turning], turning, d, in_.h).carry(lever, v, a);
  for (int c = rocks ? 0 : 1; c < d; ++c) out[c] = (b.mapped_a ? -in_.h : in_.h) / 2 * dot(a, axes[c]);
}

// Flight of two anchored points; the direction between them turns as they pass each other.
void MidpointMotion::change_of_anchored(const cairn_batch& b, int lane, double out[3]) const {
  const std::int64_t i = system_.candidate[b.first + lane];
  const int d = in_.dim();
  double axes[3][3] = {};
  axes_of(b, d, lane, axes);
  Vector lever_a{}, lever_b{}, va{}, vb{}, aa{}, ab{}, v{};
  const LawInfo& law = law_infos()[b.law];
  const Anchor& anchor = anchors_.of(i);
  const std::int32_t ca = in_.candidates->contactor_a[i], cb = in_.candidates->contactor_b[i];
  const auto carry = [&](std::int32_t contactor, const double* own, Vector lever, Vector speed, Vector rate) {
    in_.carried(contactor, own, lever);
    const std::int32_t carrier = in_.body(contactor);
    if (carrier >= 0) return Motion(*in_.bodies, system_.record[carrier], carrier, d, in_.h).carry(lever, speed, rate);
    for (int k = 0; k < d; ++k)
      speed[k] = in_.meshes->middle(contactor).of(in_.nodes->velocity, k); // a node flies straight on
  };
  carry(ca, anchor.a, lever_a, va, aa);
  carry(cb, anchor.b, lever_b, vb, ab);
  if (in_.sheared) image_velocity(*in_.cell, in_.candidates->image[i], v);
  for (int k = 0; k < 3; ++k) v[k] = va[k] - vb[k] - v[k];
  for (int k = 0; k < 3; ++k) out[k] = 0;
  for (int c = 0; c < d; ++c)
    for (int k = 0; k < 3; ++k) out[c] += in_.h / 2 * (aa[k] - ab[k]) * axes[c][k];
  const bool joint_that_spans = law.joins && classes_.rule(i).params[joint_spans] > 0;
  if (!law.spans && !joint_that_spans) return;
  double between[3] = {0, 0, 0}, shift[3] = {0, 0, 0}, square = 0;
  if (in_.cell->any()) image_shift(*in_.cell, in_.candidates->image[i], shift);
  double xa[3] = {}, xb[3] = {};
  in_.carrier_at(ca, xa);
  in_.carrier_at(cb, xb);
  for (int k = 0; k < d; ++k) {
    between[k] = xa[k] + lever_a[k] - (xb[k] + shift[k] + lever_b[k]);
    square += between[k] * between[k];
  }
  out[0] += flight_of_round(v, axes[0], 3, std::sqrt(square), in_.h);
  if (!b.rope) return;
  const Ropes::FarPart part = ropes_.far_part(i);
  for (const int end : {0, 1})
    Motion(*in_.bodies, system_.record[part.body[end]], part.body[end], d, in_.h)
        .carry(part.lever[end], end ? vb : va, end ? ab : aa);
  for (int k = 0; k < 3; ++k) v[k] = va[k] - vb[k];
  for (int k = 0; k < d; ++k) out[0] += in_.h / 2 * (aa[k] - ab[k]) * part.normal[k];
  out[0] += flight_of_round(v, part.normal, 3, part.length, in_.h);
}

// Spins of bodies that are no balls change while they turn freely; those that a bond holds as one would part by that.
void MidpointMotion::turn_of_bond(const cairn_batch& b, int lane, double out[3]) const {
  std::fill_n(out, 3, 0.0);
  if (law_infos()[b.law].holds && anchors_.is_anchored(system_.candidate[b.first + lane])) return; // see hold_places
  double axes[3][3];
  axes_of(b, 3, lane, axes);
  const Motion A(*in_.bodies, system_.record[b.body_a[lane]], b.body_a[lane], 3, in_.h);
  const Motion B(*in_.bodies, system_.record[b.body_b[lane]], b.body_b[lane], 3, in_.h);
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) out[c] += in_.h / 2 * (A.spin_rate[k] - B.spin_rate[k]) * axes[c][k];
}

// Flights of all contacts of an unpacked batch, by components; false if all are zero.
bool MidpointMotion::fill(const cairn_batch& b, double* flight) const {
  const int n = b.count, d = in_.dim();
  bool some = false;
  std::fill_n(flight, n * b.components, 0.0);
  // deformable bodies hold at detection, unless their other end may turn
  if (!in_.at_midpoint() || (b.mapped_a && b.mapped_b && !law_infos()[b.law].joins)) return false;
  for (int lane = 0; lane < b.contacts; ++lane) {
    double change[3];
    change_of(b, lane, change);
    for (int k = 0; k < d; ++k) {
      flight[k * n + lane] = change[k];
      some |= change[k] < 0 || change[k] > 0;
    }
    if (b.components < 6 || b.mapped_a || b.mapped_b || !is_sound_bond(b, lane)) continue;
    turn_of_bond(b, lane, change);
    for (int k = 0; k < 3; ++k) {
      flight[(3 + k) * n + lane] = change[k];
      some |= change[k] < 0 || change[k] > 0;
    }
  }
  return some;
}

bool MidpointMotion::applies_to_balls() const {
  return in_.at_midpoint() &&
         !(in_.dim() == 2 ? replaced(Shape::disk, Shape::disk) : replaced(Shape::sphere, Shape::sphere));
}

} // namespace cairn
