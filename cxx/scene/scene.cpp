#include "scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <type_traits>
#include <unordered_set>

#include "../base/call.hpp"
#include "../base/fastest.hpp"
#include "../base/zero_pages.hpp"
#include "../detection/interaction_handler.hpp"
#include "cell_boundaries.hpp"

namespace cairn {
namespace {

constexpr std::int64_t most_items = std::numeric_limits<std::int32_t>::max() / 8;

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

[[noreturn]] void refuse(const std::string& what, std::int64_t item, double value, const std::string& remedy) {
  throw Error(what + "[" + std::to_string(item) + "] is " + number(value) + "; " + remedy);
}

void check_size(const char* what, std::size_t size, std::int64_t count, int components, bool may_be_empty) {
  if ((size == 0 && may_be_empty) || size == std::size_t(count) * components) return;
  throw Error(std::string(what) + " holds " + std::to_string(size) + " numbers; " + std::to_string(count) +
              " items of " + std::to_string(components) + " need " + std::to_string(count * components));
}

void check_finite(const char* what, std::span<const double> values, int components) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i])) refuse(what, i / components, values[i], "give a finite number");
}

void check_speed(const char* what, std::span<const double> values, int components) {
  check_finite(what, values, components);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::abs(values[i]) > fastest) refuse(what, i / components, values[i], too_fast);
}

void check_positive(const char* what, std::span<const double> values, int components, bool zero_allowed,
                    bool inf_allowed) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double x = values[i];
    const bool fine = (x > 0 || (zero_allowed && x == 0)) && (std::isfinite(x) || inf_allowed);
    if (!fine) refuse(what, i / components, x, zero_allowed ? "give zero or more" : "give a positive number");
    if (std::isfinite(x) && x > 0 && !std::isfinite(1 / x))
      refuse(what, i / components, x, "its inverse overflows: rescale the units of the scene");
  }
}

// Values of new items, for which there is room unless their numbers are left to others.
template <class T>
void append(Field<T>& field, std::int64_t old_count, std::int64_t count, std::span<const double> values,
            double fallback) {
  if (!field.active || field.values.empty()) return;
  T* out = field[old_count];
  for (std::int64_t i = 0; i < count * field.components; ++i) out[i] = T(values.empty() ? fallback : values[i]);
}

} // namespace

Scene::Scene(int dimension) : dim(dimension), bodies(dimension), nodes(dimension), contactors(dimension) {
  if (dim != 2 && dim != 3) throw Error("dim is " + std::to_string(dim) + "; give 2 or 3");
}

bool Scene::has(Need need) const {
  const auto active = [need](const auto& field) { return field.need == need && field.active; };
  switch (need) {
  case Need::rotation: return bodies.rotation.active;
  case Need::force: return bodies.force.active;
  case Need::anisotropic: return bodies.angular_momentum.active;
  case Need::driven: return bodies.driven.active;
  case Need::damping: return bodies.damping.active;
  case Need::belts: return bodies.surface_velocity.active;
  case Need::smooth: return bodies.contact_force.active;
  case Need::acceleration: return bodies.acceleration.active;
  case Need::jerk:
  case Need::snap:
  case Need::crackle: return std::any_of(bodies.kept.begin(), bodies.kept.end(), active);
  case Need::thermal: return bodies.temperature.active;
  case Need::growing: return bodies.stretch.active;
  case Need::bending: return bodies.bend.active;
  case Need::electrical: return bodies.potential.active;
  case Need::offset: return contactors.offset.active;
  case Need::direction: return contactors.direction.active;
  case Need::hull: return contactors.hull.active;
  case Need::mapped: return contactors.part.active;
  default: return true;
  }
}

namespace {

// True if the numbers of the field are left to others.
template <class T>
bool leaves(const Field<T>&, bool numbers) {
  return numbers && std::is_same_v<T, double>;
}

// Gives memory back of items from `first` on that hold zeros; drives and directions of walls do for most bodies.
template <class T>
void give_back_zeros(const Field<T>& field, std::int64_t first) {
  const auto from = std::min(std::size_t(first) * std::size_t(field.components), field.values.size());
  give_back_zero_pages(field.values.data() + from, (field.values.size() - from) * sizeof(T));
}

} // namespace

// Vectors of arrays grow by a sixteenth where they have to, and are not doubled by a few items.
template <class Holder>
void Scene::make_room(Holder& holder, std::int64_t count, std::int64_t room) const {
  holder.for_each_field([&](auto& field) {
    if (!field.active || leaves(field, leaves_numbers_)) return;
    const auto due = std::size_t(count) * std::size_t(field.components);
    const auto known = std::size_t(room) * std::size_t(field.components);
    if (due > field.values.capacity()) field.values.reserve(std::max(known, due + field.values.capacity() / 16));
    field.values.resize(due);
  });
}

void Scene::activate(Need need) {
  if (has(need)) return;
  auto open = [&](auto& field, std::int64_t count, std::int64_t room) {
    if (field.need != need) return;
    field.active = true;
    if (leaves(field, leaves_numbers_)) return;
    field.values.reserve(std::size_t(std::max(room, count)) * std::size_t(field.components));
    field.resize(count);
    give_back_zeros(field, 0);
  };
  bodies.for_each_field([&](auto& field) { open(field, bodies.count, room_[0]); });
  nodes.for_each_field([&](auto& field) { open(field, nodes.count, 0); });
  contactors.for_each_field([&](auto& field) { open(field, contactors.count, room_[1]); });
  if (need == Need::rotation && dim == 3 && !leaves_numbers_)
    for (std::int64_t i = 0; i < bodies.count; ++i) bodies.rotation[i][0] = 1;
  if (need == Need::hull) std::fill(contactors.hull.values.begin(), contactors.hull.values.end(), -1);
  if (need == Need::mapped) std::fill(contactors.part.values.begin(), contactors.part.values.end(), -1);
}

std::int64_t Scene::add_bodies(const BodyBatch& b) {
  const int nd = bodies.dofs(), ni = bodies.inertia.components, nr = bodies.rotation.components;
  if (b.count < 0 || bodies.count + nodes.count + b.count > most_items) throw Error("too many bodies for one process");
  check_size("position", b.position.size(), b.count, dim, false);
  check_size("rotation", b.rotation.size(), b.count, nr, true);
  check_size("velocity", b.velocity.size(), b.count, nd, true);
  check_size("mass", b.mass.size(), b.count, 1, false);
  check_size("inertia", b.inertia.size(), b.count, ni, false);
  check_finite("position", b.position, dim);
  check_finite("rotation", b.rotation, nr);
  check_speed("velocity", b.velocity, nd);
  check_positive("mass", b.mass, 1, false, true);
  check_positive("inertia", b.inertia, ni, false, true);
  bool anisotropic = false;
  for (std::int64_t i = 0; dim == 3 && i < b.count; ++i) {
    const double* j = &b.inertia[3 * i];
    anisotropic |= !(j[0] == j[1] && j[1] == j[2]);
    if (std::isfinite(j[0] + j[1] + j[2]) &&
        std::max({j[0], j[1], j[2]}) > (j[0] + j[1] + j[2]) / 2 * (1 + 64 * std::numeric_limits<double>::epsilon()))
      refuse("inertia", i, j[0],
             "no body has a principal moment larger than the sum of the other two: check the tensor");
  }
  std::vector<double> unit(b.rotation.begin(), b.rotation.end());
  for (std::int64_t i = 0; dim == 3 && i * 4 < std::int64_t(unit.size()); ++i) {
    double* q = &unit[4 * i];
    const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(size > 0)) refuse("rotation", i, size, "give a quaternion (w, x, y, z) of unit length");
    for (int c = 0; c < 4; ++c) q[c] /= size;
  }
  if (anisotropic || !b.rotation.empty()) activate(Need::rotation);
  if (anisotropic) activate(Need::anisotropic);

  const std::int64_t first = next_body_id, old = bodies.count;
  make_room(bodies, old + b.count, room_[0]);
  append(bodies.position, old, b.count, b.position, 0);
  for (std::int64_t i = 0; i < b.count * dim && !leaves_numbers_; ++i) bodies.position[old][i] -= origin[i % dim];
  append(bodies.rotation, old, b.count, unit, 0);
  if (dim == 3 && unit.empty() && bodies.rotation.active && !leaves_numbers_)
    for (std::int64_t i = old; i < old + b.count; ++i) bodies.rotation[i][0] = 1;
  append(bodies.velocity, old, b.count, b.velocity, 0);
  append(bodies.mass, old, b.count, b.mass, 0);
  append(bodies.inertia, old, b.count, b.inertia, 0);
  for (std::int64_t i = 0; i < b.count; ++i) *bodies.id[old + i] = next_body_id++;
  bodies.count = old + b.count;
  if (bodies.angular_momentum.active && !leaves_numbers_)
    cairn_momentum_update(b.count, 2, bodies.inertia[old], bodies.rotation[old], bodies.velocity[old],
                          bodies.velocity[old], bodies.angular_momentum[old], nullptr);
  bodies.for_each_field([&](auto& field) { give_back_zeros(field, old); });
  append_to_orders(old, nodes.count, contactors.count);
  return first;
}

// Radii of the hulls of a batch.
std::vector<double> Scene::check_hulls(const ContactorBatch& b) const {
  if (info(b.shape).dim != dim) throw Error("polygons are of 2D scenes, polyhedra of 3D scenes");
  check_size("hull", b.hull.size(), b.count, 1, false);
  std::vector<double> radius(b.count);
  for (std::int64_t i = 0; i < b.count; ++i) {
    if (b.hull[i] < 0 || b.hull[i] >= contactors.hulls.count())
      refuse("hull", i, b.hull[i], "there are " + std::to_string(contactors.hulls.count()) + " hulls, numbered from 0");
    if (contactors.hulls.form(b.hull[i]) != info(b.shape).hull)
      refuse("hull", i, b.hull[i], "it is of another kind of shape than the contactors");
    radius[i] = contactors.hulls.radius[b.hull[i]];
  }
  return radius;
}

namespace {

void check_contactors(const ContactorBatch& b, int dim) {
  check_size("body", b.body.size(), b.count, 1, false);
  check_size("material", b.material.size(), b.material.size() == 1 ? 1 : b.count, 1, false);
  for (std::size_t i = 0; i < b.material.size(); ++i)
    if (b.material[i] < 0) refuse("material", std::int64_t(i), b.material[i], "materials are numbered from 0");
  check_size("radius", b.radius.size(), b.count, 1, true);
  check_size("offset", b.offset.size(), b.count, dim, true);
  check_size("direction", b.direction.size(), b.count, dim + 1, true);
  const ShapeInfo& shape = info(b.shape);
  check_positive("radius", b.radius, 1, !shape.hollow(), false); // a disk or sphere of radius 0 is a point
  if (shape.round != 0 && b.radius.empty() && b.count > 0)
    throw Error("radius is missing; a round contactor needs one");
  check_finite("offset", b.offset, dim);
  if (shape.directed && shape.round == 0 && b.direction.empty() && b.count > 0)
    throw Error("direction is missing; a flat contactor needs one");
}

// Directions of unit length, with the half lengths that follow them.
std::vector<double> unit_directions(const ContactorBatch& b, int dim) {
  const int components = dim + 1;
  std::vector<double> direction(b.direction.begin(), b.direction.end());
  for (std::int64_t i = 0; i * components < std::int64_t(direction.size()); ++i) {
    double* d = &direction[components * i];
    double size = 0;
    for (int c = 0; c < dim; ++c) size += d[c] * d[c];
    size = std::sqrt(size);
    if (!(size > 0) || !std::isfinite(size)) refuse("direction", i, size, "give a vector of non-zero, finite length");
    for (int c = 0; c < dim; ++c) d[c] /= size;
    if (!(d[dim] >= 0)) refuse("half length", i, d[dim], "give zero or more");
  }
  return direction;
}

} // namespace

std::int64_t Scene::add_contactors(const ContactorBatch& b) {
  check_contactors(b, dim);
  const int components = contactors.direction.components;
  const ShapeInfo& shape = info(b.shape);
  std::vector<double> radius(b.radius.begin(), b.radius.end());
  if (shape.is_hull()) radius = check_hulls(b);
  std::vector<std::int32_t> body(b.count);
  bool mapped = false, carried = b.count == 0;
  for (std::int64_t i = 0; i < b.count; ++i) {
    const MeshParts* of = part(b.body[i]);
    body[i] = of ? -of->mesh : internal(b.body[i]);
    (of ? mapped : carried) = true;
  }
  const std::vector<double> direction = unit_directions(b, dim);
  for (std::int64_t i = 0; !shape.bounded && cell.any() && i < b.count; ++i)
    check_in_cell(*this, b.shape, b.body[i], direction.empty() ? nullptr : &direction[components * i],
                  radius.empty() ? 0 : radius[i]);
  const auto off_centre = std::any_of(b.offset.begin(), b.offset.end(), [](double x) { return x != 0; });
  if (off_centre) activate(Need::offset);
  if (carried && (off_centre || shape.is_hull() || !direction.empty())) activate(Need::rotation);
  if (mapped) activate(Need::mapped);
  if (shape.is_hull()) activate(Need::hull);
  if (!direction.empty()) activate(Need::direction);

  const std::int64_t first = next_contactor_id, old = contactors.count;
  make_room(contactors, old + b.count, room_[1]);
  append(contactors.radius, old, b.count, radius, 0);
  append(contactors.offset, old, b.count, b.offset, 0);
  append(contactors.direction, old, b.count, direction, 0);
  for (std::int64_t i = 0; i < b.count; ++i) {
    *contactors.id[old + i] = next_contactor_id++;
    *contactors.body[old + i] = body[i];
    if (contactors.part.active) *contactors.part[old + i] = body[i] < 0 ? b.body[i] : -1;
    *contactors.shape[old + i] = std::int16_t(b.shape);
    if (contactors.hull.active) *contactors.hull[old + i] = shape.is_hull() ? b.hull[i] : -1;
    *contactors.material[old + i] = b.material[b.material.size() == 1 ? 0 : i];
  }
  contactors.count = old + b.count;
  contactors.for_each_field([&](auto& field) { give_back_zeros(field, old); });
  append_to_orders(bodies.count, nodes.count, old);
  return first;
}

std::int64_t Scene::add_nodes(std::int32_t mesh, std::span<const double> position, std::span<const double> velocity,
                              std::span<const double> mass) {
  const auto n = std::int64_t(mass.size());
  if (bodies.count + nodes.count + n > most_items) throw Error("too many nodes for one process");
  check_size("position", position.size(), n, dim, false);
  check_size("velocity", velocity.size(), n, dim, true);
  check_finite("position", position, dim);
  check_speed("velocity", velocity, dim);
  check_positive("mass", mass, 1, false, false);
  const std::int64_t first = next_body_id, old = nodes.count;
  make_room(nodes, old + n, 0);
  append(nodes.position, old, n, position, 0);
  for (std::int64_t i = 0; i < n * dim && !leaves_numbers_; ++i) nodes.position[old][i] -= origin[i % dim];
  append(nodes.velocity, old, n, velocity, 0);
  append(nodes.mass, old, n, mass, 0);
  for (std::int64_t i = old; i < old + n; ++i) {
    *nodes.id[i] = next_body_id++;
    *nodes.mesh[i] = mesh;
  }
  nodes.count = old + n;
  if (n > 0) parts_.push_back({first, n, mesh, true});
  meshes_ = std::max(meshes_, mesh);
  append_to_orders(bodies.count, old, contactors.count);
  return first;
}

std::int64_t Scene::add_parts(std::int32_t mesh, std::int64_t count) {
  const std::int64_t first = next_body_id;
  if (count > 0) parts_.push_back({first, count, mesh, false});
  next_body_id += count;
  meshes_ = std::max(meshes_, mesh);
  return first;
}

const MeshParts* part_with(std::span<const MeshParts> parts, std::int64_t id) {
  const auto after = std::upper_bound(parts.begin(), parts.end(), id,
                                      [](std::int64_t wanted, const MeshParts& p) { return wanted < p.first; });
  if (after == parts.begin() || id >= std::prev(after)->first + std::prev(after)->count) return nullptr;
  return &*std::prev(after);
}

void Scene::give_id(std::int64_t id, std::int64_t wanted) {
  const std::int32_t body = internal(id);
  const bool taken = std::any_of(insertion_order_.begin(), insertion_order_.end(),
                                 [&](std::int32_t b) { return *bodies.id[b] == wanted; });
  if (taken || part(wanted) || part(id) || wanted < 0 || wanted >= next_body_id)
    throw Error("body " + std::to_string(id) + " cannot be number " + std::to_string(wanted) +
                ": give the id of a body that was removed");
  *bodies.id[body] = wanted;
  refresh_orders();
}

void Scene::remove_bodies(std::span<const std::int64_t> ids) {
  std::vector<std::int64_t> going(ids.begin(), ids.end());
  std::sort(going.begin(), going.end());
  if (const auto twice = std::adjacent_find(going.begin(), going.end()); twice != going.end())
    throw Error("body " + std::to_string(*twice) + " is named twice among those to remove");
  std::vector<char> gone(bodies.count, 0), node_gone(nodes.count, 0);
  for (const std::int64_t id : ids)
    if (const MeshParts* of = part(id); !of)
      gone[internal(id)] = 1;
    else if (of->nodes)
      node_gone[node(id)] = 1;
  const auto kept = [](const std::vector<char>& going) {
    std::vector<std::int32_t> out;
    for (std::size_t i = 0; i < going.size(); ++i)
      if (!going[i]) out.push_back(std::int32_t(i));
    return out;
  };
  reorder(kept(gone), kept(node_gone), going);
  std::erase_if(parts_, [&](const MeshParts& p) { return std::binary_search(going.begin(), going.end(), p.first); });
}

void Scene::drive(std::span<const std::int64_t> ids, std::uint8_t mask, std::span<const double> velocity) {
  const int nd = bodies.dofs();
  if (mask >> nd) throw Error("the mask of driven dofs names more than " + std::to_string(nd) + " dofs");
  check_size("driven_velocity", velocity.size(), ids.size(), nd, true);
  check_speed("driven_velocity", velocity, nd);
  std::vector<std::int32_t> items;
  for (const std::int64_t id : ids) items.push_back(internal(id));
  activate(Need::driven);
  for (std::size_t k = 0; k < items.size(); ++k) {
    *bodies.driven[items[k]] = mask;
    for (int c = 0; c < nd && !leaves_numbers_; ++c)
      bodies.driven_velocity[items[k]][c] = velocity.empty() ? 0 : velocity[nd * k + c];
  }
}

void Scene::renumber() {
  const std::int64_t n = bodies.count, all = n + nodes.count;
  if (all < 2 || leaves_numbers_) return; // by places that others hold
  if (nodes.count == 0) return reorder(space_filling_order(dim, n, bodies.position.values.data()), {});
  std::vector<double> place(bodies.position.values.begin(), bodies.position.values.end());
  place.insert(place.end(), nodes.position.values.begin(), nodes.position.values.end());
  std::vector<std::int32_t> body_order, node_order;
  for (const std::int32_t i : space_filling_order(dim, all, place.data())) {
    if (i < n)
      body_order.push_back(i);
    else if (i == n || *nodes.mesh[i - n] != *nodes.mesh[i - n - 1]) // the first of its body: all come with it
      for (std::int64_t k = i - n; k < nodes.count && *nodes.mesh[k] == *nodes.mesh[i - n]; ++k)
        node_order.push_back(std::int32_t(k));
  }
  reorder(body_order, node_order);
}

std::vector<std::int32_t> Scene::renumber(std::span<const double> position) {
  std::vector<std::int32_t> order = space_filling_order(dim, bodies.count, position.data());
  reorder(order, {});
  return order;
}

namespace {

std::vector<std::int32_t> as_it_is(std::int64_t count) {
  std::vector<std::int32_t> out(static_cast<std::size_t>(count));
  std::iota(out.begin(), out.end(), 0);
  return out;
}

} // namespace

// Nodes as they are to stand: those of a mesh together, where its first are.
std::vector<std::int32_t> Scene::nodes_together() const {
  std::vector<std::int32_t> out = as_it_is(nodes.count), first(std::size_t(meshes_) + 1, -1);
  for (const std::int32_t i : out)
    if (std::int32_t& of = first[std::size_t(*nodes.mesh[i])]; of < 0) of = i;
  const auto before = [&](std::int32_t i) { return first[std::size_t(*nodes.mesh[i])]; };
  if (!std::is_sorted(out.begin(), out.end(), [&](auto i, auto j) { return before(i) < before(j); }))
    std::stable_sort(out.begin(), out.end(), [&](auto i, auto j) { return before(i) < before(j); });
  return out;
}

bool Scene::meshes_in_order() const {
  const auto mapped = [](std::int32_t body) { return body < 0; };
  const auto& body = contactors.body.values;
  const auto first = std::find_if(body.begin(), body.end(), mapped);
  if (std::find_if_not(first, body.end(), mapped) != body.end()) return false;
  const std::vector<std::int32_t> order = nodes_together();
  return std::is_sorted(order.begin(), order.end());
}

void Scene::put_meshes_in_order() { reorder(as_it_is(bodies.count), nodes_together()); }

// Order key of each contactor: that of its body; behind all rigid ones, that of the first node of its mesh; -1: its
// body is removed.
std::vector<std::int32_t> Scene::places_of_contactors(const std::vector<std::int32_t>& now,
                                                      const std::vector<std::int32_t>& node_order) const {
  std::vector<std::int32_t> out(std::size_t(contactors.count), -1), of_mesh(std::size_t(meshes_), -1);
  for (std::size_t k = node_order.size(); k-- > 0;)
    of_mesh[std::size_t(*nodes.mesh[node_order[k]]) - 1] = std::int32_t(now.size() + k);
  for (std::int64_t k = 0; k < contactors.count; ++k) {
    const std::int32_t body = *contactors.body[k];
    out[std::size_t(k)] = body >= 0 ? now[body] : of_mesh[std::size_t(-body - 1)];
  }
  return out;
}

// Bodies: new number i was body_order[i], nodes likewise; those not named go, with their contactors. gone: numbers of
// parts that go, rising.
void Scene::reorder(const std::vector<std::int32_t>& body_order, const std::vector<std::int32_t>& node_order,
                    std::span<const std::int64_t> gone) {
  std::vector<std::int32_t> now(bodies.count, -1);
  for (std::size_t i = 0; i < body_order.size(); ++i) now[body_order[i]] = std::int32_t(i);
  const std::vector<std::int32_t> place = places_of_contactors(now, node_order);
  const auto stays = [&](std::int64_t k) {
    return place[k] >= 0 &&
           !(*contactors.body[k] < 0 && std::binary_search(gone.begin(), gone.end(), *contactors.part[k]));
  };
  std::vector<std::int32_t> contactor_order;
  for (std::int64_t k = 0; k < contactors.count; ++k)
    if (stays(k)) contactor_order.push_back(std::int32_t(k));
  std::stable_sort(contactor_order.begin(), contactor_order.end(), [&](std::int32_t a, std::int32_t b) {
    return place[a] != place[b] ? place[a] < place[b] : *contactors.id[a] < *contactors.id[b];
  });
  const auto put = [](const std::vector<std::int32_t>& order) { // numbers may be with others
    return [&order](auto& field) {
      if (!field.values.empty()) field.reorder(order);
      give_back_zeros(field, 0);
    };
  };
  bodies.for_each_field(put(body_order));
  nodes.for_each_field(put(node_order));
  contactors.for_each_field(put(contactor_order));
  bodies.count = std::int64_t(body_order.size());
  nodes.count = std::int64_t(node_order.size());
  contactors.count = std::int64_t(contactor_order.size());
  for (std::int32_t& body : contactors.body.values)
    if (body >= 0) body = now[body];
  refresh_orders();
}

void Scene::state_assigned() {
  if (bodies.angular_momentum.active)
    cairn_momentum_update(bodies.count, 2, bodies.inertia.values.data(), bodies.rotation.values.data(),
                          bodies.velocity.values.data(), bodies.velocity.values.data(),
                          bodies.angular_momentum.values.data(), nullptr);
}

void Scene::refresh_orders() {
  ++order_version_;
  auto by_id = [](std::vector<std::int32_t>& order, const Field<std::int64_t>& id, std::int64_t count) {
    order.resize(count);
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) { return *id[a] < *id[b]; });
  };
  by_id(insertion_order_, bodies.id, bodies.count);
  by_id(node_insertion_order_, nodes.id, nodes.count);
  by_id(contactor_insertion_order_, contactors.id, contactors.count);
}

// New bodies have the largest ids, so they come last in the orders.
void Scene::append_to_orders(std::int64_t first_body, std::int64_t first_node, std::int64_t first_contactor) {
  ++order_version_;
  const auto append_to = [](std::vector<std::int32_t>& order, std::int64_t first, std::int64_t count) {
    const auto due = std::size_t(count);
    if (due > order.capacity()) order.reserve(due + order.capacity() / 16);
    order.resize(due);
    std::iota(order.begin() + first, order.end(), std::int32_t(first));
  };
  append_to(insertion_order_, first_body, bodies.count);
  append_to(node_insertion_order_, first_node, nodes.count);
  append_to(contactor_insertion_order_, first_contactor, contactors.count);
}

void Scene::fields_restored(std::vector<MeshParts> parts) {
  parts_ = std::move(parts);
  for (const MeshParts& p : parts_) meshes_ = std::max(meshes_, p.mesh);
  bodies.count = std::int64_t(bodies.id.values.size());
  nodes.count = std::int64_t(nodes.id.values.size());
  contactors.count = std::int64_t(contactors.id.values.size());
  refresh_orders();
}

namespace {

// Place of an id by an order of rising ids; -1: it is not there.
std::int32_t place_of_id(const std::vector<std::int32_t>& order, const Field<std::int64_t>& ids, std::int64_t id) {
  const auto found = std::lower_bound(order.begin(), order.end(), id,
                                      [&](std::int32_t i, std::int64_t wanted) { return *ids[i] < wanted; });
  return found == order.end() || *ids[*found] != id ? -1 : *found;
}

} // namespace

std::int32_t Scene::find_body(std::int64_t id) const { return place_of_id(insertion_order_, bodies.id, id); }
std::int32_t Scene::find_node(std::int64_t id) const { return place_of_id(node_insertion_order_, nodes.id, id); }

std::int32_t Scene::internal(std::int64_t id) const {
  if (const std::int32_t found = find_body(id); found >= 0) return found;
  if (const MeshParts* of = part(id))
    throw Error("number " + std::to_string(id) + " is a " + (of->nodes ? "node" : "point or side") +
                " of a mesh, and no rigid body: give the number of a body");
  throw Error("there is no body " + std::to_string(id) + "; it was never added, or was removed");
}

std::int32_t Scene::node(std::int64_t id) const {
  if (const std::int32_t found = find_node(id); found >= 0) return found;
  throw Error("there is no node " + std::to_string(id) + "; it was never added, or was removed");
}

void Scene::move_facets(std::span<const std::int32_t> contactor, std::span<const double> vertex) {
  std::size_t at = 0;
  for (const std::int32_t c : contactor) {
    const std::int32_t hull = *contactors.hull[c];
    const auto size = 3 * std::size_t(contactors.hulls.vertices(hull));
    if (at + size > vertex.size()) throw Error("vertex holds fewer numbers than the facets have");
    contactors.hulls.move_facet(hull, vertex.subspan(at, size));
    *contactors.radius[c] = contactors.hulls.radius[hull];
    at += size;
  }
}

} // namespace cairn
