// Brittle joints at several points between the same two rigid faces. The impulse of one point depends on the order of
// sweeps: a body that hangs by its face may be held by a single corner, or by corners that pull against each other
// across it. So the joint is judged by its determinate force and moment, shared as by a thin elastic layer between
// stiff faces: normal, shear and twist stresses vary linearly along the face.
#include "brittle_faces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "../solvers/sweeps/batch.hpp"
#include "face_overlap.hpp"

namespace cairn {

namespace {

constexpr double level = 1e-2; // how far points of one face may be off its plane, over their distance

// A point seen along the normal of the face: its place across it [m], its area [m2], its impulse along it and across it
// [N s].
struct Borne {
  double x, y, area, normal, t, s;
};

// Shares forces and moments by area. Along a direction in which the points have no width there is no moment.
void share_elastically(std::vector<Borne>& points) {
  double area = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, normal = 0, t = 0, s = 0, about_x = 0, about_y = 0, twist = 0;
  for (const Borne& p : points) {
    area += p.area;
    x += p.area * p.x;
    y += p.area * p.y;
    normal += p.normal;
    t += p.t;
    s += p.s;
  }
  for (Borne& p : points) {
    p.x -= x / area;
    p.y -= y / area;
    xx += p.area * p.x * p.x;
    xy += p.area * p.x * p.y;
    yy += p.area * p.y * p.y;
    about_x += p.normal * p.x;
    about_y += p.normal * p.y;
    twist += p.x * p.s - p.y * p.t;
  }
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy), c = std::cos(angle), d = std::sin(angle), polar = xx + yy;
  const double most = c * c * xx + 2 * c * d * xy + d * d * yy, least = polar - most; // along the axes of the face
  const double along = most > 0 ? (c * about_x + d * about_y) / most : 0;
  const double across = least > area_rounding * most ? (c * about_y - d * about_x) / least : 0;
  const double turn = polar > 0 ? twist / polar : 0;
  for (Borne& p : points) {
    p.normal = p.area * (normal / area + along * (c * p.x + d * p.y) + across * (c * p.y - d * p.x));
    p.t = p.area * (t / area - turn * p.y);
    p.s = p.area * (s / area + turn * p.x);
  }
}

} // namespace

// Sound points of brittle laws between rigid bodies, those of the same face together.
void BrittleFaces::share() {
  shared_.clear();
  points_.clear();
  for (std::size_t which = 0; which < system_.batches.size(); ++which) {
    const cairn_batch& b = system_.batches[which];
    if (!law_infos()[b.law].brittle_face || b.mapped_a || b.mapped_b)
      continue;                                               // nodes of a mesh each give way by themselves
    if (is_radial(b.side_a) && is_radial(b.side_b)) continue; // two balls have one point
    for (int lane = 0; lane < b.contacts; ++lane)
      if (b.state[lane] > 0) {
        const std::int32_t i = system_.candidate[b.first + lane];
        points_.push_back({b.body_a[lane], b.body_b[lane], in_.candidates->image[i], classes_.entry[i], i,
                           std::int32_t(which), lane});
      }
  }
  if (points_.size() < 2) return;
  const auto joint = [](const JointPoint& p) { return std::tie(p.body_a, p.body_b, p.image, p.entry); };
  std::sort(points_.begin(), points_.end(), [&](const JointPoint& p, const JointPoint& q) {
    return joint(p) != joint(q) ? joint(p) < joint(q) : p.candidate < q.candidate;
  });
  thread_local std::vector<JointPoint> face, others; // each step asks
  for (std::size_t first = 0, end = 0; first < points_.size(); first = end) {
    while (end < points_.size() && joint(points_[end]) == joint(points_[first])) ++end;
    others.assign(points_.begin() + std::ptrdiff_t(first), points_.begin() + std::ptrdiff_t(end));
    while (others.size() > 1) { // faces that look elsewhere, and steps of a stair, are joints of their own
      const JointPoint one = others.front();
      const auto rest =
          std::stable_partition(others.begin(), others.end(), [&](const JointPoint& p) { return on_one_face(one, p); });
      face.assign(others.begin(), rest);
      others.erase(others.begin(), rest);
      if (face.size() > 1) share_face(face);
    }
  }
}

bool BrittleFaces::on_one_face(const JointPoint& one, const JointPoint& other) const {
  const int d = in_.dim();
  const double *n = &in_.candidates->normal[d * one.candidate], *m = &in_.candidates->normal[d * other.candidate];
  double alike = 0, off = 0, square = 0;
  for (int k = 0; k < d; ++k) {
    const double between =
        in_.candidates->point[d * other.candidate + k] - in_.candidates->point[d * one.candidate + k];
    alike += n[k] * m[k];
    off += n[k] * between;
    square += between * between;
  }
  return alike > flat_faces && off * off <= level * level * square;
}

// Impulses of one joint as its commit is to judge them, in the axes of their contacts.
void BrittleFaces::share_face(const std::vector<JointPoint>& face) {
  const int d = in_.dim();
  double axes[3][3] = {}, own[3][3] = {};
  const auto batch = [&](const JointPoint& p) -> const cairn_batch& { return system_.batches[std::size_t(p.batch)]; };
  axes_of(batch(face.front()), d, face.front().lane, axes);
  thread_local std::vector<Borne> points;
  points.clear();
  for (const JointPoint& p : face) {
    const cairn_batch& b = batch(p);
    axes_of(b, d, p.lane, own);
    Borne to{};
    for (int k = 0; k < d; ++k) {
      const double from =
          in_.candidates->point[d * p.candidate + k] - in_.candidates->point[d * face.front().candidate + k];
      to.x += axes[1][k] * from;
      to.y += axes[2][k] * from;
      for (int l = 1; l < d; ++l) {
        to.t += axes[1][k] * own[l][k] * at(b, b.r, p.lane, l);
        to.s += axes[2][k] * own[l][k] * at(b, b.r, p.lane, l);
      }
    }
    to.normal = at(b, b.r, p.lane, 0);
    to.area = b.state[law_infos()[b.law].state_column("area", d) * b.count + p.lane];
    points.push_back(to);
  }
  share_elastically(points);
  if (shared_.empty()) shared_.assign(3 * system_.candidate.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t j = 0; j < face.size(); ++j) {
    const cairn_batch& b = batch(face[j]);
    double* to = &shared_[3 * std::size_t(b.first + face[j].lane)];
    axes_of(b, d, face[j].lane, own);
    to[0] = points[j].normal;
    for (int l = 1; l < d; ++l) {
      to[l] = 0;
      for (int k = 0; k < d; ++k) to[l] += own[l][k] * (axes[1][k] * points[j].t + axes[2][k] * points[j].s);
    }
  }
}

} // namespace cairn
