#include "joint_parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "../base/call.hpp"
#include "../base/number_text.hpp"
#include "../contactors/shapes.hpp"
#include "../contacts/interaction.hpp"

namespace cairn {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double mark_share = 0.1; // radius of the mark of an end, of its body's size

const JointKind& kind_named(const std::string& name) {
  std::string known;
  for (const JointKind& kind : joint_kinds()) {
    if (name == kind.name) return kind;
    known += (known.empty() ? "" : ", ") + std::string(kind.name);
  }
  throw Error("there is no joint '" + name + "'; there are " + known);
}

bool spans(const JointKind& kind) { return kind.points > 1; }
bool is_rope(const JointKind& kind) { return kind.points == 3; }

[[noreturn]] void refuse(const std::string& what, const JointKind& kind, double value, const char* remedy) {
  throw Error(what + " of " + kind.name + " is " + number_text(value) + "; " + remedy);
}

double length(const double (&x)[3]) { return std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

// Numbers given by name; checks that each name comes once and exists for the kind.
class Numbers {
public:
  Numbers(const JointKind& of, const JointDraft& draft) : kind(of), given(draft.numbers) {
    std::vector<std::string> known{"strength"};
    if (kind.has_limits) known.insert(known.end(), {"lowest", "highest"});
    if (kind.has_spring) known.insert(known.end(), {"stiffness", "damping", "rest"});
    if (is_rope(kind)) known.insert(known.end(), {"length", "pulley"});
    if (kind.has_motor) known.insert(known.end(), {"speed", "effort"});
    for (std::size_t k = 0; k < given.size(); ++k) {
      const auto& [name, value] = given[k];
      if (std::find(known.begin(), known.end(), name) == known.end()) {
        std::string all;
        for (const std::string& word : known) all.append(all.empty() ? "" : ", ").append(word);
        throw Error(std::string(kind.name).append(" has no '").append(name).append("'; there are ").append(all));
      }
      for (std::size_t before = 0; before < k; ++before)
        if (given[before].first == name)
          throw Error(name + " of " + kind.name + " is given twice; leave one of them out");
      const bool may_be_infinite = name == "strength" || name == "lowest" || name == "highest";
      if (std::isnan(value) || (!may_be_infinite && !std::isfinite(value)))
        refuse(name, kind, value, may_be_infinite ? "give a number" : "give a finite number");
    }
  }
  std::optional<double> find(const std::string& name) const {
    for (const auto& [word, value] : given)
      if (word == name) return value;
    return std::nullopt;
  }
  double get(const std::string& name, double otherwise) const { return find(name).value_or(otherwise); }
  bool any(std::initializer_list<const char*> names) const {
    return std::any_of(names.begin(), names.end(), [&](const char* name) { return find(name).has_value(); });
  }

private:
  const JointKind& kind;
  const std::vector<std::pair<std::string, double>>& given;
};

void check_numbers(const JointKind& kind, const Numbers& given) {
  const double low = given.get("lowest", -infinity), high = given.get("highest", infinity);
  if (!(low <= high)) refuse("lowest", kind, low, ("give no more than highest, " + number_text(high)).c_str());
  if (spans(kind) && given.any({"lowest", "highest"}) && !(low > 0))
    refuse("lowest", kind, low, "give a length above 0 [m]");
  if (given.any({"speed", "effort"})) {
    const double effort = given.get("effort", 0);
    if (!(effort > 0)) refuse("effort", kind, effort, "give what its motor has at most, above 0 [N m, N]");
    if (!given.find("speed")) throw Error(std::string("speed of ") + kind.name + " is missing; give it beside effort");
  }
  for (const char* name : {"stiffness", "damping"})
    if (given.get(name, 0) < 0) refuse(name, kind, given.get(name, 0), "give a value from 0 on");
  if (given.find("rest") && !given.any({"stiffness", "damping"}))
    refuse("rest", kind, given.get("rest", 0), "give the stiffness of its spring as well");
  if (!(given.get("length", infinity) > 0))
    refuse("length", kind, given.get("length", infinity), "give a length above 0 [m]");
  if (!(given.get("strength", infinity) > 0))
    refuse("strength", kind, given.get("strength", infinity), "give a force above 0 [N]");
}

bool is_node(const Scene& scene, std::int64_t id) { return id >= 0 && scene.find_node(id) >= 0; }

// The largest side of the box that the nodes of a mesh stand in.
double size_of_mesh(const Scene& scene, std::int64_t id) {
  const MeshParts& part = *scene.part(id);
  double low[3], high[3], size = 0;
  std::fill_n(low, 3, infinity);
  std::fill_n(high, 3, -infinity);
  for (std::int64_t i = part.first; i < part.first + part.count; ++i)
    for (int k = 0; k < scene.dim; ++k) {
      const double x = scene.nodes.position[scene.node(i)][k];
      low[k] = std::min(low[k], x);
      high[k] = std::max(high[k], x);
    }
  for (int k = 0; k < scene.dim; ++k) size = std::max(size, high[k] - low[k]);
  return size;
}

void check_end(const Scene& scene, const JointKind& kind, const char* side, std::int64_t id, const double* point) {
  if (scene.find_body(id) >= 0) return;
  const std::string which = std::string(side) + " of a joint is " + std::to_string(id);
  if (!is_node(scene, id))
    throw Error(which + (scene.part(id)
                             ? ", a point, an edge or a face of a mesh; give one of its nodes, or a rigid body"
                             : "; give the id of a rigid body or of a node of the scene"));
  if (side == std::string("pulley"))
    throw Error(which + ", a node of a mesh; give a rigid body, or leave it out: the world");
  double away = 0;
  for (int k = 0; k < scene.dim; ++k)
    away = std::max(away, std::abs(point[k] - scene.origin[std::size_t(k)] - scene.nodes.position[scene.node(id)][k]));
  if (!(away <= 1e-9 * size_of_mesh(scene, id)))
    throw Error("point of " + std::string(kind.name) + " is " + number_text(away) + " m away from node " +
                std::to_string(id) + "; give the place of the node, which is where a mesh is joined");
}

// Checks joints at nodes of meshes, which have no axes: a joint there cannot block rotations.
void check_nodes(const Scene& scene, const JointKind& kind, const JointDraft& draft) {
  const MeshParts *a = scene.part(draft.a), *b = draft.b < 0 ? nullptr : scene.part(draft.b);
  if (a && b && is_rope(kind))
    throw Error("a and b of Cable are nodes " + std::to_string(draft.a) + " and " + std::to_string(draft.b) +
                " of meshes; give one end a rigid body, or the world");
  if (a && b && a->mesh == b->mesh)
    throw Error("a and b of a joint are nodes " + std::to_string(draft.a) + " and " + std::to_string(draft.b) +
                " of one mesh; give nodes of two, or a cell more");
  if (kind.name == std::string("Hinge"))
    throw Error("Hinge holds an axis, and a node of a mesh has none; give a Ball, or hinges at two nodes");
  if (kind.coordinate[scene.dim - 2] <= scene.dim) return;
  for (const auto& [name, value] : draft.numbers)
    if (name != "strength")
      throw Error(name + " of " + kind.name +
                  " is of an angle, and a node of a mesh has none; leave it out, or join rigid bodies");
}

std::array<double, 3> axis_of(const Scene& scene, const JointKind& kind, std::span<const double> given) {
  std::array<double, 3> axis{};
  if (!kind.has_axis) {
    if (!given.empty()) throw Error(std::string("axis of ") + kind.name + " is given; it has none, leave it out");
    axis[scene.dim == 3 ? 2 : 0] = 1;
    return axis;
  }
  double whole[3] = {};
  std::copy_n(given.begin(), std::min<std::size_t>(given.size(), 3), whole);
  const double size = length(whole);
  if (given.empty()) throw Error(std::string("axis of ") + kind.name + " is missing; give a direction");
  if (!(size > 0) || !std::isfinite(size)) refuse("length of the axis", kind, size, "give a finite direction");
  for (int k = 0; k < scene.dim; ++k) axis[std::size_t(k)] = given[std::size_t(k)] / size;
  return axis;
}

bool moves(const Scene& scene, std::int64_t id) {
  if (id < 0) return false;
  if (is_node(scene, id)) return true;
  const std::uint8_t all = std::uint8_t((1 << scene.bodies.dofs()) - 1);
  return !scene.bodies.driven.active || (*scene.bodies.driven[scene.internal(id)] & all) != all;
}

std::int64_t body_of_pulley(const JointDraft& draft) {
  for (const auto& [name, value] : draft.numbers)
    if (name == "pulley") return std::int64_t(value);
  return -1;
}

// Which mark of a, pulley and b is at the end that the contact of the other two pulls as well, from 1: one of these
// two moves. Beyond its pulley a rope pulls rigid bodies alone, so that a node is a side of the contact.
int far_mark(const Scene& scene, const JointDraft& draft) {
  if (is_node(scene, draft.b)) return 1;
  return moves(scene, draft.a) || moves(scene, body_of_pulley(draft)) ? 3 : 1;
}

int far_end(const Scene& scene, const JointKind& kind, const JointDraft& draft, std::optional<double> given) {
  const std::int64_t pulley = body_of_pulley(draft);
  if (given) {
    if (*given != double(pulley) || pulley < 0)
      throw Error("pulley of Cable is " + number_text(*given) +
                  "; give the id of a rigid body, or leave it out: the world");
    check_end(scene, kind, "pulley", pulley, draft.point.data());
  }
  if (pulley >= 0 && (pulley == draft.a || pulley == draft.b))
    throw Error("pulley of Cable is body " + std::to_string(pulley) +
                ", which is one of its ends as well; give a Distance, or another body");
  if (!moves(scene, draft.a) && !moves(scene, pulley) && !moves(scene, draft.b))
    throw Error("a, b and the pulley of Cable do not move; give one that does");
  return far_mark(scene, draft);
}

// The farthest that contactors of a body reach round their middles; 0 without any.
double size_of(const Scene& scene, std::int32_t body) {
  double size = 0;
  for (std::int64_t c = 0; c < scene.contactors.count; ++c)
    if (*scene.contactors.body[c] == body) size = std::max(size, *scene.contactors.radius[c]);
  return size;
}

// A vector in space as a body has it in its axes.
void turn_back(const Scene& scene, std::int32_t body, double* x) {
  if (!scene.bodies.rotation.active) return;
  const double* q = scene.bodies.rotation[body];
  if (scene.dim == 2) {
    const double c = std::cos(q[0]), s = std::sin(q[0]), first = x[0];
    x[0] = c * first + s * x[1];
    x[1] = c * x[1] - s * first;
    return;
  }
  const auto crossed = [q](const double* v, double* out) { // by the conjugate's vector
    out[0] = -q[2] * v[2] + q[3] * v[1];
    out[1] = -q[3] * v[0] + q[1] * v[2];
    out[2] = -q[1] * v[1] + q[2] * v[0];
  };
  double once[3], twice[3];
  crossed(x, once);
  crossed(once, twice);
  for (int k = 0; k < 3; ++k) x[k] += 2 * (q[0] * once[k] + twice[k]);
}

// The mark of an end on a body, at a point in space.
std::int64_t put_mark(Scene& scene, std::int64_t id, const double* point, std::int32_t material, double radius) {
  const Shape shape = scene.dim == 2 ? Shape::disk : Shape::sphere;
  if (is_node(scene, id)) {
    const double none = 0;
    return scene.add_contactors({1, shape, {&id, 1}, {&material, 1}, {&none, 1}, {}, {}});
  }
  const std::int32_t body = scene.internal(id);
  double lever[3] = {};
  for (int k = 0; k < scene.dim; ++k)
    lever[k] = point[k] - scene.origin[std::size_t(k)] - scene.bodies.position[body][k];
  turn_back(scene, body, lever);
  const std::span<const double> offset(lever, std::size_t(scene.dim));
  return scene.add_contactors({1, shape, {&id, 1}, {&material, 1}, {&radius, 1}, offset, {}});
}

} // namespace

Law joint_law() {
  const auto& all = law_infos();
  return Law(std::find_if(all.begin(), all.end(), [](const LawInfo& law) { return law.joins; }) - all.begin());
}

std::span<const JointKind> joint_kinds() {
  constexpr bool YES = true, NO = false;
  static constexpr JointKind kinds[] = {
#define CAIRN_JOINT(name, blocked2, blocked3, coordinate2, coordinate3, points, axis, turns, limits, spring, motor,    \
                    instead)                                                                                           \
  {#name, {blocked2, blocked3}, {coordinate2, coordinate3}, points, axis, turns, limits, spring, motor, instead},
#include "joints.def"
#undef CAIRN_JOINT
  };
  return kinds;
}

int joint_points(const std::string& kind) { return kind_named(kind).points; }

std::vector<double> joint_parameters(const Scene& scene, const JointDraft& draft) {
  const JointKind& kind = kind_named(draft.kind);
  const auto d = std::size_t(scene.dim), which = d - 2;
  if (kind.blocked[which] < 0)
    throw Error(std::string(kind.name) + " is a joint of " + (d == 2 ? "3D: in 2D" : "2D: in 3D") + " give " +
                kind.instead);
  for (std::size_t k = 0; k < draft.point.size(); ++k)
    if (!std::isfinite(draft.point[k]))
      refuse("point[" + std::to_string(k) + "]", kind, draft.point[k], "give a finite number");
  check_end(scene, kind, "a", draft.a, draft.point.data());
  if (draft.b != -1) check_end(scene, kind, "b", draft.b, draft.point.data() + d * std::size_t(kind.points - 1));
  if (draft.a == draft.b)
    throw Error("a and b of a joint are both body " + std::to_string(draft.a) +
                "; give two bodies, or -1 for b: the world");
  const bool on_node = is_node(scene, draft.a) || is_node(scene, draft.b);
  if (on_node) check_nodes(scene, kind, draft);
  const Numbers given(kind, draft);
  check_numbers(kind, given);
  double begin = 0;
  for (std::size_t part = 1; part < std::size_t(kind.points); ++part) {
    double between[3] = {};
    for (std::size_t k = 0; k < d; ++k) between[k] = draft.point[part * d + k] - draft.point[(part - 1) * d + k];
    if (!(length(between) > 0))
      throw Error(std::string("points of ") + kind.name +
                  (is_rope(kind) ? " are the same beside each other; give the pulley's apart from both ends"
                                 : " are the same; give two that differ, or a Pivot or Ball"));
    begin += length(between);
  }
  if (is_rope(kind) && given.get("length", begin) < begin * (1 - 0x1p-30))
    refuse("length", kind, given.get("length", begin),
           ("give at least the " + number_text(begin) + " m that it spans").c_str());
  const int far = is_rope(kind) ? far_end(scene, kind, draft, given.find("pulley")) : 0;
  const bool let_go = kind.points == 2 && given.any({"lowest", "highest", "stiffness", "damping"});
  const std::array<double, 3> axis = axis_of(scene, kind, draft.axis);
  const int own = on_node ? (1 << scene.dim) - 1 : -1, blocked = kind.blocked[which] & own;
  const int coordinate = on_node && kind.coordinate[which] > scene.dim ? 0 : kind.coordinate[which];
  const std::pair<const char*, double> values[] = {
      {"blocked", let_go ? 0 : blocked},
      {"coordinate", let_go ? 1 : coordinate},
      {"axis_x", axis[0]},
      {"axis_y", axis[1]},
      {"axis_z", axis[2]},
      {"spans", spans(kind) ? 1 : 0},
      {"rest", given.get("rest", begin)},
      {"lowest", given.get("lowest", -infinity)},
      {"highest", is_rope(kind) ? given.get("length", begin) : given.get("highest", infinity)},
      {"speed", given.get("speed", 0)},
      {"effort", given.get("effort", 0)},
      {"strength", given.get("strength", infinity)},
      {"stiffness", given.get("stiffness", 0)},
      {"damping", given.get("damping", 0)},
      {"pulley", is_rope(kind) ? 2 : 0},
      {"far", far}};
  std::vector<double> parameters;
  for (const LawParameter& wanted : law_infos()[std::size_t(joint_law())].parameters)
    for (const auto& [name, value] : values)
      if (wanted.name == name) parameters.push_back(value);
  return parameters;
}

std::array<std::int64_t, 2> add_joint_ends(Scene& scene, const JointDraft& draft, std::int32_t material) {
  const JointKind& kind = kind_named(draft.kind);
  const auto d = std::size_t(scene.dim);
  const double* at_a = draft.point.data();
  if (kind.turns) scene.activate(Need::rotation);
  const auto radius_on = [&](std::int64_t id, const double* point) {
    if (is_node(scene, id)) return mark_share * size_of_mesh(scene, id);
    const std::int32_t body = scene.internal(id);
    double lever[3] = {};
    for (std::size_t k = 0; k < d; ++k) lever[k] = point[k] - scene.origin[k] - scene.bodies.position[body][k];
    const double size = size_of(scene, body);
    return mark_share * (size > 0 ? size : length(lever));
  };
  const double radius = radius_on(draft.a, at_a);
  const auto put = [&](std::int64_t id, const double* point) {
    if (id >= 0) return put_mark(scene, id, point, material, radius_on(id, point));
    const double one[] = {1, 1, 1}; // the world
    id = scene.add_bodies({1, {point, d}, {}, {}, {one, 1}, {one, d == 2 ? std::size_t(1) : std::size_t(3)}});
    scene.drive({&id, 1}, std::uint8_t((1 << scene.bodies.dofs()) - 1), {});
    return put_mark(scene, id, point, material, radius);
  };
  const std::int64_t first = put(draft.a, at_a);
  if (!is_rope(kind)) return {first, put(draft.b, at_a + std::size_t(kind.points - 1) * d)};
  const std::int64_t pulley = put(body_of_pulley(draft), at_a + d), last = put(draft.b, at_a + 2 * d);
  return {far_mark(scene, draft) == 3 ? first : last, pulley};
}

} // namespace cairn
