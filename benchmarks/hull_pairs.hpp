// Pairs of convex polyhedra, near each other or flush, and of round shapes, and what their kernel says of them.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "cairn/rows.h"
#include "contactors/hulls.hpp"

namespace cairn {

struct Pairs {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  static constexpr int pairs = 1024, most = 4; // twenty times slower
#else
  static constexpr int pairs = 8192, most = 4;
#endif
  Hulls hulls{3};
  std::vector<std::int32_t> hull, body, a, b, count, feature;
  std::vector<std::int64_t> place;
  std::vector<std::int32_t> recalled = std::vector<std::int32_t>(2 * pairs, 0);
  bool recalls = false;
  cairn_hull_contact* kernel = cairn_pair_polyhedron_polyhedron;
  cairn_convex seen_a = cairn_convex_polyhedron, seen_b = cairn_convex_polyhedron;
  std::vector<double> rotation, radius, reach, turned, box, between, radius_a, radius_b, direction, limit;
  std::vector<double> gap, normal, point;
  std::mt19937 random{1};

  // Pairs of hulls with equal numbers of vertices; or of boxes, the upper flush on the lower one.
  explicit Pairs(int vertices, bool boxes = false) {
    for (int k = 0; k < 2 * pairs; ++k) boxes ? add_box() : add(vertices);
    begin();
    boxes ? lay_flush() : bring_near();
  }

  // Pairs of round shapes, spheres and boxes by name, with sizes within a factor of three.
  Pairs(const std::string& first, const std::string& second) : seen_a(seen(first)), seen_b(seen(second)) {
    if (seen_a != cairn_convex_polyhedron) kernel = cairn_pair_convex;
    for (int k = 0; k < 2 * pairs; ++k) add_shape(k % 2 ? second : first);
    begin();
    bring_near();
  }

  void begin() {
    reach = radius;
    box.resize(6 * 2 * pairs);
    limit.assign(pairs, 0.02);
    direction.assign(4 * pairs, 0);
    count.resize(pairs);
    feature.resize(pairs * most);
    gap.resize(pairs * most);
    normal.resize(3 * pairs * most);
    point.resize(3 * pairs * most);
    turn();
    for (int i = 0; i < pairs; ++i) {
      a.push_back(2 * i);
      b.push_back(2 * i + 1);
      radius_a.push_back(radius[2 * i]);
      radius_b.push_back(radius[2 * i + 1]);
    }
    between.resize(3 * pairs);
  }

  // The hull of points on a sphere: every triple with all others behind it is a face.
  void add(int vertices) {
    std::normal_distribution<double> g;
    std::uniform_real_distribution<double> part(vertices > 12 ? 1 : 0.7, 1);
    std::vector<double> x;
    std::vector<std::int64_t> corner, first_corner{0};
    do {
      x.clear();
      corner.clear();
      for (int i = 0; i < vertices; ++i) {
        double v[3] = {g(random), g(random), g(random)};
        const double scale = part(random) / std::hypot(v[0], v[1], v[2]);
        for (double c : v) x.push_back(c * scale);
      }
      const auto volume = [&](int i, int j, int k, int l) {
        double d[3][3];
        const int other[3] = {j, k, l};
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c) d[r][c] = x[3 * other[r] + c] - x[3 * i + c];
        return d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) - d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
               d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
      };
      std::vector<char> used(vertices, 0);
      for (int i = 0; i < vertices; ++i)
        for (int j = i + 1; j < vertices; ++j)
          for (int k = j + 1; k < vertices; ++k) {
            int above = 0, below = 0;
            for (int l = 0; l < vertices && !(above && below); ++l)
              if (l != i && l != j && l != k) ++(volume(i, j, k, l) > 0 ? above : below);
            if (above && below) continue;
            used[i] = used[j] = used[k] = 1;
            if (above)
              corner.insert(corner.end(), {i, k, j});
            else
              corner.insert(corner.end(), {i, j, k});
          }
      if (std::count(used.begin(), used.end(), 1) < vertices) corner.clear();
    } while (corner.empty());
    centre_mass(x, corner);
    for (std::size_t k = 3; k <= corner.size(); k += 3) first_corner.push_back(std::int64_t(k));
    double q[4] = {g(random), g(random), g(random), g(random)};
    add_hull(x, first_corner, corner, q);
  }

  // Vertices from the centre of mass, as every body has them: `corner` are triangles.
  static void centre_mass(std::vector<double>& x, const std::vector<std::int64_t>& corner) {
    double volume = 0, moment[3] = {0, 0, 0};
    for (std::size_t k = 0; k < corner.size(); k += 3) {
      const double *u = &x[3 * corner[k]], *v = &x[3 * corner[k + 1]], *w = &x[3 * corner[k + 2]];
      const double part =
          u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
      volume += part;
      for (int c = 0; c < 3; ++c) moment[c] += part * (u[c] + v[c] + w[c]) / 4;
    }
    for (std::size_t i = 0; i < x.size(); ++i) x[i] -= moment[i % 3] / volume;
  }

  // Adds a box of random size; both boxes of a pair have the same orientation.
  void add_box() {
    std::normal_distribution<double> g;
    std::uniform_real_distribution<double> half(0.3, 0.8);
    const double h[3] = {half(random), half(random), half(random)};
    std::vector<double> x;
    for (int i = 0; i < 8; ++i)
      for (int k = 0; k < 3; ++k) x.push_back(i >> k & 1 ? h[k] : -h[k]);
    double q[4] = {g(random), g(random), g(random), g(random)};
    if (body.size() % 2) std::copy_n(rotation.end() - 4, 4, q);
    add_hull(x, {0, 4, 8, 12, 16, 20, 24}, {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5}, q);
  }

  void add_hull(const std::vector<double>& x, const std::vector<std::int64_t>& first_corner,
                const std::vector<std::int64_t>& corner, const double* q) {
    const std::int64_t first_vertex[] = {0, std::int64_t(x.size()) / 3};
    const std::int64_t first_face[] = {0, std::int64_t(first_corner.size()) - 1};
    const std::int32_t h = hulls.add({x, first_vertex, first_face, first_corner, corner});
    const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int c = 0; c < 4; ++c) rotation.push_back(q[c] / size);
    body.push_back(std::int32_t(body.size()));
    hull.push_back(h);
    radius.push_back(hulls.radius[h]);
    place.push_back(std::int64_t(turned.size()));
    turned.resize(turned.size() + 3 * (hulls.vertices(h) + hulls.faces(h)));
  }

  static cairn_convex seen(const std::string& shape) {
    if (shape == "sphere") return cairn_convex_point;
    if (shape == "capsule") return cairn_convex_segment;
    if (shape == "cylinder") return cairn_convex_cylinder;
    return shape == "box" || shape == "polyhedron" ? cairn_convex_polyhedron : cairn_convex_superquadric;
  }

  void add_shape(const std::string& shape) {
    if (shape == "box") return add_box();
    if (shape == "polyhedron") return add(8);
    std::normal_distribution<double> g;
    std::uniform_real_distribution<double> size(0.3, 0.9), exponent(0.3, 1.5);
    const double r = size(random), l = size(random);
    std::vector<double> x, plane;
    double ball = std::hypot(r, l);
    if (shape == "capsule" || shape == "cylinder") {
      x = {0, 0, -l, 0, 0, l};
      plane = {0, 0, 1, r};
      if (shape == "capsule") ball = r + l;
    } else if (shape != "sphere") {
      const double half[3] = {r, l, size(random)};
      const bool round = shape == "ellipsoid";
      for (int i = 0; i < 8; ++i)
        for (int k = 0; k < 3; ++k) x.push_back(i >> k & 1 ? half[k] : -half[k]);
      plane = {1, 0, 0, half[0], 0, 1, 0, half[1], 0, 0, 1, half[2]};
      for (int k = 0; k < 2; ++k) plane.insert(plane.end(), {0, 0, 0, round ? 1 : exponent(random)});
      ball = std::hypot(half[0], half[1], half[2]);
    }
    double q[4] = {g(random), g(random), g(random), g(random)};
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double c : q) rotation.push_back(c / norm);
    body.push_back(std::int32_t(body.size()));
    place.push_back(std::int64_t(turned.size()));
    if (shape == "sphere") {
      hull.push_back(-1);
      radius.push_back(r);
      return;
    }
    const std::int64_t first_vertex[] = {0, std::int64_t(x.size()) / 3},
                       first_face[] = {0, std::int64_t(plane.size()) / 4};
    hull.push_back(hulls.add({x, first_vertex, first_face, {}, {}, false, plane, {&ball, 1}}));
    radius.push_back(ball);
    turned.resize(turned.size() + x.size() + 3 * plane.size() / 4);
  }

  void turn() {
    cairn_hull_place(3, 0, 2 * pairs, body.data(), hull.data(), place.data(), hulls.first_vertex.data(),
                     hulls.first_face.data(), hulls.vertex.data(), hulls.normal.data(), hulls.offset.data(), 1,
                     rotation.data(), radius.data(), reach.data(), turned.data(), box.data());
  }

  cairn_hulls view(int first) {
    return {3,
            most,
            seen_a,
            seen_b,
            hull.data(),
            hulls.first_vertex.data(),
            hulls.first_face.data(),
            hulls.first_edge.data(),
            hulls.first_corner.data(),
            hulls.corner_vertex.data(),
            hulls.corner_edge.data(),
            hulls.edge.data(),
            hulls.offset.data(),
            hulls.inner.data(),
            place.data(),
            turned.data(),
            recalls ? recalled.data() + 2 * first : nullptr};
  }

  void detect() {
    constexpr int batch = 64; // as detection calls it
    std::array<double, 3 * batch> at{};
    for (int i = 0; i < pairs; i += batch) {
      const cairn_hulls h = view(i);
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < batch; ++j) at[k * batch + j] = between[3 * (i + j) + k];
      kernel(batch, &h, &a[i], &b[i], at.data(), &radius_a[i], &radius_b[i], &direction[4 * i], &limit[i], &count[i],
             &gap[most * i], &normal[3 * most * i], &point[3 * most * i], &feature[most * i]);
    }
  }

  // Along a random direction, to where the gap is anything between two; 1 is half the size.
  void bring_near(double least = -0.02, double largest = 0.02) {
    std::normal_distribution<double> g;
    std::uniform_real_distribution<double> wanted(least, largest);
    std::vector<double> way, low(pairs, 0), high(pairs, 3.5), goal;
    limit.assign(pairs, largest);
    for (int i = 0; i < pairs; ++i) {
      const double v[3] = {g(random), g(random), g(random)};
      for (double c : v) way.push_back(c / std::hypot(v[0], v[1], v[2]));
      goal.push_back(wanted(random));
    }
    for (int round = 0; round < 20; ++round) {
      for (int i = 0; i < pairs; ++i)
        for (int k = 0; k < 3; ++k) between[3 * i + k] = way[3 * i + k] * (low[i] + high[i]) / 2;
      detect();
      for (int i = 0; i < pairs; ++i) {
        double nearest = 1;
        for (int k = 0; k < count[i]; ++k) nearest = std::min(nearest, gap[most * i + k]);
        (nearest < goal[i] ? low : high)[i] = (low[i] + high[i]) / 2;
      }
    }
    limit.assign(pairs, 0.02);
  }

  // The first on top of the second, shifted by up to half its width; the gap is rounding.
  void lay_flush() {
    std::uniform_real_distribution<double> part(-0.5, 0.5);
    for (int i = 0; i < pairs; ++i) {
      const double *lower = &turned[place[2 * i + 1]] + 24, *upper = &turned[place[2 * i]] + 24; // normals
      const double *low = &hulls.offset[6 * (2 * i + 1)], *high = &hulls.offset[6 * (2 * i)];
      const double along = part(random) * 2 * high[5], across = part(random) * 2 * high[3];
      for (int k = 0; k < 3; ++k)
        between[3 * i + k] =
            lower[6 * k + 1] * (low[1] + high[1]) + along * upper[6 * k + 5] + across * upper[6 * k + 3];
    }
  }

  // Each body moves by about a thousandth of its size, or by another part of it.
  void move(double part = 1e-3) {
    std::normal_distribution<double> g(0, part);
    for (double& x : between) x += g(random);
    for (std::size_t k = 0; k < rotation.size(); k += 4) {
      double square = 0;
      for (int c = 0; c < 4; ++c) {
        rotation[k + c] += g(random);
        square += rotation[k + c] * rotation[k + c];
      }
      for (int c = 0; c < 4; ++c) rotation[k + c] /= std::sqrt(square);
    }
    turn();
  }
};

} // namespace cairn
