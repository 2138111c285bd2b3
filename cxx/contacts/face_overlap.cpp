#include "face_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "../base/vectors.hpp"
#include "../solvers/sweeps/batch.hpp"

namespace cairn {

namespace {

using Point = std::array<double, 2>;

double cross_of(const Point& a, const Point& b) { return a[0] * b[1] - a[1] * b[0]; }
double dot_of(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1]; }
Point between(const Point& from, const Point& to) { return {to[0] - from[0], to[1] - from[1]}; }

// Part of a convex polygon on the left of the line through two points.
void cut_by_line(const std::vector<Point>& from, const Point& start, const Point& end, std::vector<Point>& to) {
  to.clear();
  const Point along = between(start, end);
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Point &one = from[i], &next = from[(i + 1) % from.size()];
    const double here = cross_of(along, between(start, one)), there = cross_of(along, between(start, next));
    if (here >= 0) to.push_back(one);
    if ((here >= 0) == (there >= 0)) continue;
    const double share = here / (here - there);
    to.push_back({one[0] + share * (next[0] - one[0]), one[1] + share * (next[1] - one[1])});
  }
}

double shared_by_polygons(const FaceOutline& a, const FaceOutline& b) {
  thread_local std::vector<Point> now, cut; // assembly asks in every step
  now.assign(a.corner.begin(), a.corner.end());
  for (std::size_t i = 0; i < b.corner.size() && now.size() > 2; ++i) {
    cut_by_line(now, b.corner[i], b.corner[(i + 1) % b.corner.size()], cut);
    now.swap(cut);
  }
  return std::max(0.0, signed_area(now));
}

// Area of the disk round 0 within the triangle from 0 to two points, with the sign of their turn.
double shared_by_sector(const Point& one, const Point& other, double radius) {
  const auto sector = [&](const Point& p, const Point& q) {
    return radius * radius / 2 * std::atan2(cross_of(p, q), dot_of(p, q));
  };
  const Point along = between(one, other);
  const double square = dot_of(along, along), middle = -dot_of(one, along) / square;
  const double off = cross_of(one, other) / std::sqrt(square);
  if (!(square > 0) || !(std::abs(off) < radius)) return square > 0 ? sector(one, other) : 0;
  const double half = std::sqrt((radius - off) * (radius + off) / square);
  const double first = std::max(0.0, middle - half), last = std::min(1.0, middle + half);
  if (!(first < last)) return sector(one, other);
  const Point in{one[0] + first * along[0], one[1] + first * along[1]};
  const Point out{one[0] + last * along[0], one[1] + last * along[1]};
  return (first > 0 ? sector(one, in) : 0) + cross_of(in, out) / 2 + (last < 1 ? sector(out, other) : 0);
}

double shared_with_disk(const FaceOutline& polygon, const FaceOutline& disk) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.corner.size(); ++i)
    sum += shared_by_sector(between(disk.centre, polygon.corner[i]),
                            between(disk.centre, polygon.corner[(i + 1) % polygon.corner.size()]), disk.radius);
  return std::max(0.0, sum);
}

double shared_by_disks(const FaceOutline& a, const FaceOutline& b) {
  const Point apart = between(a.centre, b.centre);
  const double d = std::sqrt(dot_of(apart, apart)), smaller = std::min(a.radius, b.radius);
  if (d >= a.radius + b.radius) return 0;
  if (d <= std::abs(a.radius - b.radius)) return std::numbers::pi * smaller * smaller;
  double sum = 0;
  for (const double r : {a.radius, b.radius}) { // the part of each beyond the line through both crossings
    const double other = r == a.radius ? b.radius : a.radius;
    const double to_line = (d * d + (r - other) * (r + other)) / (2 * d);
    const double half = std::acos(std::clamp(to_line / r, -1.0, 1.0));
    sum += r * r * (half - std::sin(half) * std::cos(half));
  }
  return sum;
}

} // namespace

double area_of_points(const double* point, int count, const double* normal) {
  if (count < 3) return 0;
  struct Corner {
    double x, y, angle;
  } corner[most_face_points];
  double t[3], s[3], centre[2] = {0, 0};
  tangent_of(normal, t);
  cross(normal, t, s);
  double furthest = 0; // square, from the first
  for (int i = 0; i < count; ++i) {
    Corner& c = corner[i] = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
      c.x += t[k] * (point[3 * i + k] - point[k]);
      c.y += s[k] * (point[3 * i + k] - point[k]);
    }
    furthest = std::max(furthest, c.x * c.x + c.y * c.y);
    centre[0] += c.x / count;
    centre[1] += c.y / count;
  }
  for (int i = 0; i < count; ++i) corner[i].angle = std::atan2(corner[i].y - centre[1], corner[i].x - centre[0]);
  std::sort(corner, corner + count, [](const Corner& a, const Corner& b) { return a.angle < b.angle; });
  double twice = 0;
  for (int i = 0; i < count; ++i) {
    const Corner &a = corner[i], &b = corner[(i + 1) % count];
    twice += (a.x - centre[0]) * (b.y - centre[1]) - (b.x - centre[0]) * (a.y - centre[1]);
  }
  return twice > area_rounding * furthest ? twice / 2 : 0; // none of points on a line
}

// With the shares f the point inside has (1 - f) / 2 of each corner, and edges are cut as their ends have shares: areas
// then are the shares, and no part has a dent.
void part_of_corner(const FaceOutline& triangle, const double* share, int corner, FaceOutline& part) {
  const std::size_t one = std::size_t(corner), two = (one + 1) % 3, three = (one + 2) % 3;
  const Point &x = triangle.corner[one], &y = triangle.corner[two], &z = triangle.corner[three];
  const double sum = share[0] + share[1] + share[2], own = share[one];
  const auto cut = [&](const Point& end, double other) -> Point {
    const double way = own + other > 0 ? own / (own + other) : 0.5;
    return {x[0] + way * (end[0] - x[0]), x[1] + way * (end[1] - x[1])};
  };
  const double to_y = (1 - share[two] / sum) / 2, to_z = (1 - share[three] / sum) / 2;
  part.clear();
  part.corner.push_back(x);
  part.corner.push_back(cut(y, share[two]));
  part.corner.push_back(
      {x[0] + to_y * (y[0] - x[0]) + to_z * (z[0] - x[0]), x[1] + to_y * (y[1] - x[1]) + to_z * (z[1] - x[1])});
  part.corner.push_back(cut(z, share[three]));
}

double shared_area(const FaceOutline& a, const FaceOutline& b) {
  if (a.endless || b.endless) return a.endless ? (b.endless ? 0 : b.area()) : a.area();
  if (a.is_disk() && b.is_disk()) return shared_by_disks(a, b);
  if (a.is_disk()) return shared_with_disk(b, a);
  return b.is_disk() ? shared_with_disk(a, b) : shared_by_polygons(a, b);
}

} // namespace cairn
