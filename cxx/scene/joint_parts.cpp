#include "joint_parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "../base/call.hpp"
#include "../contactors/shapes.hpp"
#include "../contacts/interaction.hpp"

namespace cairn {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double mark_share = 0.1; // radius of the mark of an end, of its body's size

// Bits of what is blocked: n, t [, s], rotations; the coordinate: a component from 1, 0: none. Blocked -1: not of this
// dim.
struct JointKind {
  const char* name;
  int blocked[2], coordinate[2]; // in 2D, in 3D
  bool has_axis, turns, moves, driven;
  const char* instead; // in the other dim
};

// has_axis: it is made with one; turns: it asks how its bodies have turned; moves: limits and springs are of its
// coordinate; driven: motors as well.
constexpr JointKind kinds[] = {
    {"Ball", {-1, 7}, {0, 0}, false, false, false, false, "Pivot"},
    {"Hinge", {-1, 55}, {0, 4}, true, true, true, true, "Pivot"},
    {"Pivot", {3, -1}, {3, 0}, false, true, true, true, "Ball or Hinge"},
    {"Fixed", {7, 63}, {0, 0}, false, true, false, false, ""},
    {"Slider", {6, 62}, {1, 1}, true, true, true, true, ""},
    {"Distance", {1, 1}, {0, 0}, false, false, true, false, ""},
};

const JointKind& kind_named(const std::string& name) {
  std::string known;
  for (const JointKind& kind : kinds) {
    if (name == kind.name) return kind;
    known += (known.empty() ? "" : ", ") + std::string(kind.name);
  }
  throw Error("there is no joint '" + name + "'; there are " + known);
}

bool spans(const JointKind& kind) { return kind.name == std::string("Distance"); }

std::string told(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", x);
  return text;
}

[[noreturn]] void refuse(const std::string& what, const JointKind& kind, double value, const char* remedy) {
  throw Error(what + " of " + kind.name + " is " + told(value) + "; " + remedy);
}

double length(std::span<const double> x) {
  double square = 0;
  for (const double c : x) square += c * c;
  return std::sqrt(square);
}

// What was given by name, each name once and one that the kind has.
class Numbers {
public:
  Numbers(const JointKind& of, const JointDraft& draft) : kind(of), given(draft.numbers) {
    std::vector<std::string> known{"strength"};
    if (kind.moves) known.insert(known.end(), {"lowest", "highest", "stiffness", "damping", "rest"});
    if (kind.driven) known.insert(known.end(), {"speed", "effort"});
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
  const double low = given.get("lowest", -infinite), high = given.get("highest", infinite);
  if (!(low <= high)) refuse("lowest", kind, low, ("give no more than highest, " + told(high)).c_str());
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
  if (!(given.get("strength", infinite) > 0))
    refuse("strength", kind, given.get("strength", infinite), "give a force above 0 [N]");
}

void check_body(const Scene& scene, const char* side, std::int64_t id) {
  if (scene.find_body(id) >= 0) return;
  const char* remedy = scene.part(id) ? ", of a mesh; give a rigid body: nodes are joined by Python's Scene.join"
                                      : "; give the id of a rigid body of the scene";
  throw Error(std::string(side) + " of a joint is " + std::to_string(id) + remedy);
}

std::array<double, 3> axis_of(const Scene& scene, const JointKind& kind, std::span<const double> given) {
  std::array<double, 3> axis{};
  if (!kind.has_axis) {
    if (!given.empty()) throw Error(std::string("axis of ") + kind.name + " is given; it has none, leave it out");
    axis[scene.dim == 3 ? 2 : 0] = 1;
    return axis;
  }
  const double size = length(given);
  if (given.empty()) throw Error(std::string("axis of ") + kind.name + " is missing; give a direction");
  if (!(size > 0) || !std::isfinite(size)) refuse("length of the axis", kind, size, "give a finite direction");
  for (int k = 0; k < scene.dim; ++k) axis[std::size_t(k)] = given[std::size_t(k)] / size;
  return axis;
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
  const std::int32_t body = scene.internal(id);
  double lever[3] = {};
  for (int k = 0; k < scene.dim; ++k)
    lever[k] = point[k] - scene.origin[std::size_t(k)] - scene.bodies.position[body][k];
  turn_back(scene, body, lever);
  const Shape shape = scene.dim == 2 ? Shape::disk : Shape::sphere;
  const std::span<const double> offset(lever, std::size_t(scene.dim));
  return scene.add_contactors({1, shape, {&id, 1}, {&material, 1}, {&radius, 1}, offset, {}});
}

} // namespace

Law joint_law() {
  const auto& all = law_infos();
  return Law(std::find_if(all.begin(), all.end(), [](const LawInfo& law) { return law.joins; }) - all.begin());
}

int joint_points(const std::string& kind) { return spans(kind_named(kind)) ? 2 : 1; }

std::vector<double> joint_parameters(const Scene& scene, const JointDraft& draft) {
  const JointKind& kind = kind_named(draft.kind);
  const auto d = std::size_t(scene.dim), which = d - 2;
  if (kind.blocked[which] < 0)
    throw Error(std::string(kind.name) + " is a joint of " + (d == 2 ? "3D: in 2D" : "2D: in 3D") + " give " +
                kind.instead);
  check_body(scene, "a", draft.a);
  if (draft.b != -1) check_body(scene, "b", draft.b);
  if (draft.a == draft.b)
    throw Error("a and b of a joint are both body " + std::to_string(draft.a) +
                "; give two bodies, or -1 for b: the world");
  for (std::size_t k = 0; k < draft.point.size(); ++k)
    if (!std::isfinite(draft.point[k]))
      refuse("point[" + std::to_string(k) + "]", kind, draft.point[k], "give a finite number");
  const Numbers given(kind, draft);
  check_numbers(kind, given);
  double begin = 0;
  if (spans(kind)) {
    double between[3] = {};
    for (std::size_t k = 0; k < d; ++k) between[k] = draft.point[d + k] - draft.point[k];
    begin = length({between, d});
    if (!(begin > 0)) throw Error("points of Distance are the same; give two that differ, or a Pivot or Ball");
  }
  const bool let_go = spans(kind) && given.any({"lowest", "highest", "stiffness", "damping"});
  const std::array<double, 3> axis = axis_of(scene, kind, draft.axis);
  const std::pair<const char*, double> values[] = {{"blocked", let_go ? 0 : kind.blocked[which]},
                                                   {"coordinate", let_go ? 1 : kind.coordinate[which]},
                                                   {"axis_x", axis[0]},
                                                   {"axis_y", axis[1]},
                                                   {"axis_z", axis[2]},
                                                   {"spans", spans(kind) ? 1 : 0},
                                                   {"rest", given.get("rest", begin)},
                                                   {"lowest", given.get("lowest", -infinite)},
                                                   {"highest", given.get("highest", infinite)},
                                                   {"speed", given.get("speed", 0)},
                                                   {"effort", given.get("effort", 0)},
                                                   {"strength", given.get("strength", infinite)},
                                                   {"stiffness", given.get("stiffness", 0)},
                                                   {"damping", given.get("damping", 0)}};
  std::vector<double> parameters;
  for (const LawParameter& wanted : law_infos()[std::size_t(joint_law())].parameters)
    for (const auto& [name, value] : values)
      if (wanted.name == name) parameters.push_back(value);
  return parameters;
}

std::array<std::int64_t, 2> add_joint_ends(Scene& scene, const JointDraft& draft, std::int32_t material) {
  const JointKind& kind = kind_named(draft.kind);
  const auto d = std::size_t(scene.dim);
  const double *at_a = draft.point.data(), *at_b = at_a + (spans(kind) ? d : 0);
  if (kind.turns) scene.activate(Need::rotation);
  const auto radius_on = [&](std::int64_t id, const double* point) {
    const std::int32_t body = scene.internal(id);
    double lever[3] = {};
    for (std::size_t k = 0; k < d; ++k) lever[k] = point[k] - scene.origin[k] - scene.bodies.position[body][k];
    const double size = size_of(scene, body);
    return mark_share * (size > 0 ? size : length({lever, d}));
  };
  const double radius = radius_on(draft.a, at_a);
  std::array<std::int64_t, 2> ends{};
  ends[0] = put_mark(scene, draft.a, at_a, material, radius);
  std::int64_t b = draft.b;
  if (b < 0) {
    const double one[] = {1, 1, 1};
    b = scene.add_bodies({1, {at_b, d}, {}, {}, {one, 1}, {one, d == 2 ? std::size_t(1) : std::size_t(3)}});
    scene.drive({&b, 1}, std::uint8_t((1 << scene.bodies.dofs()) - 1), {});
  }
  ends[1] = put_mark(scene, b, at_b, material, draft.b < 0 ? radius : radius_on(b, at_b));
  return ends;
}

} // namespace cairn
