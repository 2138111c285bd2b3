// Random scenes for the tests of detection, and the plain answer to compare with.
#pragma once
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <tuple>
#include <vector>

#include "cairn/core.h"
#include "contactors/shapes.hpp"
#include "detection/interaction_handler.hpp"

namespace cairn::test {

struct DetectionScene {
  explicit DetectionScene(int dim) : dim(dim), bodies(dim), contactors(dim) {
    bodies.rotation.active = true;
    contactors.offset.active = true;
    contactors.direction.active = true;
  }
  int dim;
  Bodies bodies;
  Contactors contactors;
  Cell cell;
  std::vector<double> margin; // per contactor [m]
  std::vector<std::int64_t> body_order, contactor_order;

  std::int64_t add_body(std::vector<double> x, bool movable = true) {
    const std::int64_t i = bodies.count++;
    bodies.for_each_field([&](auto& field) { field.resize(bodies.count); });
    bodies.id.values[i] = 100 + i;
    for (int k = 0; k < dim; ++k) bodies.position[i][k] = x[k];
    if (dim == 3) bodies.rotation[i][0] = 1;
    for (int k = 0; k < bodies.dofs(); ++k) bodies.inverse_mass[i][k] = movable ? 1 : 0;
    return i;
  }
  void turn(std::int64_t body, std::vector<double> rotation) {
    std::copy(rotation.begin(), rotation.end(), bodies.rotation[body]);
  }
  std::int64_t add(std::int64_t body, Shape shape, double radius, double share, std::vector<double> offset = {},
                   std::vector<double> direction = {}) {
    const std::int64_t i = contactors.count++;
    contactors.for_each_field([&](auto& field) { field.resize(contactors.count); });
    contactors.id.values[i] = i;
    contactors.body.values[i] = std::int32_t(body);
    contactors.shape.values[i] = std::int16_t(shape);
    contactors.radius.values[i] = radius;
    std::copy(offset.begin(), offset.end(), contactors.offset[i]);
    std::copy(direction.begin(), direction.end(), contactors.direction[i]);
    margin.push_back(share);
    return i;
  }
  // The same scene with bodies and contactors in another internal order.
  void shuffle(std::mt19937_64& random) {
    std::vector<std::int32_t> order(bodies.count), place(bodies.count);
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = std::int32_t(i);
    std::shuffle(order.begin(), order.end(), random);
    bodies.for_each_field([&](auto& field) { field.reorder(order); });
    for (std::size_t i = 0; i < order.size(); ++i) place[order[i]] = std::int32_t(i);
    for (auto& body : contactors.body.values) body = place[body];
    order.resize(contactors.count);
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = std::int32_t(i);
    std::shuffle(order.begin(), order.end(), random);
    contactors.for_each_field([&](auto& field) { field.reorder(order); });
    std::vector<double> next(margin.size());
    for (std::size_t i = 0; i < order.size(); ++i) next[i] = margin[order[i]];
    margin.swap(next);
  }
  void scale(double factor) {
    for (auto* array : {&bodies.position.values, &contactors.radius.values, &contactors.offset.values})
      for (double& x : *array) x *= factor;
    for (std::int64_t i = 0; i < contactors.count; ++i) contactors.direction[i][dim] *= factor;
    for (double& m : margin) m *= factor;
    for (double& x : cell.vectors) x *= factor;
    for (double& x : cell.corner) x *= factor;
  }
  Candidates detect(InteractionHandler& handler, const LawRules* rules = nullptr) const {
    Candidates out;
    handler.detect(bodies, contactors, cell, {0, margin.data()}, out, {}, nullptr, rules);
    return out;
  }
  Candidates detect() const {
    InteractionHandler handler;
    return detect(handler);
  }
  // Centre of a contactor, and a direction, in long double.
  std::array<double, 4> placed(std::int64_t contactor, bool direction) const {
    const std::int64_t body = contactors.body.values[contactor];
    const double* v = direction ? contactors.direction[contactor] : contactors.offset[contactor];
    const double* q = bodies.rotation[body];
    std::array<long double, 4> y{0, 0, 0, 0};
    if (dim == 2) {
      const long double c = std::cos((long double)q[0]), s = std::sin((long double)q[0]);
      y = {c * v[0] - s * v[1], s * v[0] + c * v[1], 0, 0};
    } else { // the matrix of the quaternion
      const long double w = q[0], a = q[1], b = q[2], c = q[3];
      const long double m[3][3] = {{1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b)},
                                   {2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a)},
                                   {2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)}};
      for (int i = 0; i < 3; ++i) y[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    }
    std::array<double, 4> result{0, 0, 0, 0};
    for (int k = 0; k < dim; ++k) result[k] = double(direction ? y[k] : y[k] + (long double)bodies.position[body][k]);
    if (direction) result[dim] = v[dim];
    return result;
  }
};

struct Contact {
  double gap, normal[3], point[3];
};
using ContactMap = std::map<ContactKey, Contact>;

inline ContactMap by_key(const DetectionScene& scene, const Candidates& found) {
  ContactMap map;
  for (std::int64_t i = 0; i < found.count; ++i) {
    Contact contact{found.gap[i], {0, 0, 0}, {0, 0, 0}};
    for (int k = 0; k < scene.dim; ++k) {
      contact.normal[k] = found.normal[i * scene.dim + k];
      contact.point[k] = found.point[i * scene.dim + k];
    }
    map[{scene.contactors.id.values[found.contactor_a[i]], scene.contactors.id.values[found.contactor_b[i]],
         found.feature[i], found.image[i]}] = contact;
  }
  return map;
}

// The answer of core_f90/reference; margins widened by `more`.
inline ContactMap plain_answer(const DetectionScene& scene, const std::array<std::int32_t, 3>& span, double more = 0) {
  const std::int64_t n = scene.contactors.count;
  const int dim = scene.dim;
  std::vector<std::int32_t> form(n), immovable(scene.bodies.count);
  std::vector<double> centre(n * dim), direction(n * (dim + 1)), margin(scene.margin);
  for (double& m : margin) m += more;
  for (std::int64_t i = 0; i < scene.bodies.count; ++i) {
    immovable[i] = 1;
    for (int k = 0; k < scene.bodies.dofs(); ++k) immovable[i] &= scene.bodies.inverse_mass[i][k] == 0;
  }
  for (std::int64_t i = 0; i < n; ++i) {
    const Shape shape = Shape(scene.contactors.shape.values[i]);
    form[i] = shape == Shape::segment                               ? 1
              : shape == Shape::half_plane || shape == Shape::plane ? 2
              : shape == Shape::tube                                ? 3
                                                                    : 0;
    const auto c = scene.placed(i, false), d = scene.placed(i, true);
    std::copy_n(c.begin(), dim, &centre[i * dim]);
    std::copy_n(d.begin(), dim + 1, &direction[i * (dim + 1)]);
  }
  std::int64_t capacity = 1 << 16, found = 0;
  std::vector<std::int32_t> a(capacity), b(capacity), lattice(3 * capacity);
  std::vector<double> gap(capacity), normal(dim * capacity), point(dim * capacity);
  cairn_reference_detection(dim, std::int32_t(n), form.data(), scene.contactors.body.values.data(),
                            scene.contactors.id.values.data(), immovable.data(), centre.data(),
                            scene.contactors.radius.values.data(), direction.data(), margin.data(), scene.cell.vectors,
                            span.data(), capacity, a.data(), b.data(), lattice.data(), gap.data(), normal.data(),
                            point.data(), &found);
  ContactMap map;
  for (std::int64_t i = 0; i < std::min(found, capacity); ++i) {
    Contact contact{gap[i], {0, 0, 0}, {0, 0, 0}};
    for (int k = 0; k < dim; ++k) {
      contact.normal[k] = normal[i * dim + k];
      contact.point[k] = point[i * dim + k];
    }
    map[{scene.contactors.id.values[a[i]], scene.contactors.id.values[b[i]], 0,
         encode_image(lattice[3 * i], lattice[3 * i + 1], lattice[3 * i + 2])}] = contact;
  }
  return map;
}

// Bodies of all shapes in a box of side 1, sizes between `largest / ratio` and `largest`.
inline DetectionScene random_scene(int dim, int bodies, double largest, double ratio, std::mt19937_64& random,
                                   bool walls = true) {
  std::uniform_real_distribution<double> u(0, 1);
  std::normal_distribution<double> g;
  DetectionScene scene(dim);
  auto unit = [&](int n) {
    std::vector<double> e(n);
    double s = 0;
    for (double& x : e) {
      x = g(random);
      s += x * x;
    }
    for (double& x : e) x /= std::sqrt(s);
    return e;
  };
  auto direction = [&](double half) {
    auto e = unit(dim);
    e.push_back(half);
    return e;
  };
  const Shape round = dim == 2 ? Shape::disk : Shape::sphere;
  for (int i = 0; i < bodies; ++i) {
    std::vector<double> x(dim), offset(dim);
    for (double& c : x) c = u(random);
    const auto body = scene.add_body(x, u(random) > 0.1);
    scene.turn(body, dim == 2 ? std::vector<double>{6 * u(random)} : unit(4));
    const double size = largest * std::pow(ratio, -u(random));
    const double kind = u(random);
    for (double& c : offset) c = size * (u(random) - 0.5);
    if (dim == 2 && kind < 0.2)
      scene.add(body, Shape::segment, size / 4, size * u(random) / 10, offset, direction(size));
    else
      scene.add(body, round, size, size * u(random) / 10, kind < 0.6 ? std::vector<double>(dim, 0.0) : offset);
    if (kind > 0.9) scene.add(body, round, size / 2, size * u(random) / 10, offset);
  }
  if (!walls) return scene;
  for (int i = 0; i < 3; ++i) {
    const auto body = scene.add_body(std::vector<double>(dim, u(random) / 5), i == 0);
    scene.turn(body, dim == 2 ? std::vector<double>{6 * u(random)} : unit(4));
    scene.add(body, dim == 2 ? Shape::half_plane : Shape::plane, 0, largest * u(random) / 5,
              std::vector<double>(dim, u(random) / 7), direction(0));
    if (dim == 3)
      scene.add(body, Shape::tube, 0.6, largest * u(random) / 5, std::vector<double>(dim, u(random) / 7),
                direction(i == 0 ? INFINITY : 0.3));
  }
  return scene;
}

} // namespace cairn::test
