// Rejects states that no simulation can have written: see check_state.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "../networks/balance_terms.hpp"
#include "../simulation/report.hpp"
#include "older_states.hpp"
#include "simulation_state.hpp"

namespace cairn {

namespace {

[[noreturn]] void wrong(const std::string& what) { throw std::invalid_argument(what); }

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}

const StoredArray& array_at(const StoredValue& tree, const std::string& name, const std::string& place, bool real) {
  const StoredValue& value = tree.at(name);
  const char kind = value.array.type.kind;
  if ((value.kind != "array" && value.kind != "flags") || kind == 'S' || (kind == 'f' && !real))
    wrong(place + "/" + name + " is no array of " + (real ? "" : "whole ") + "numbers");
  return value.array;
}
std::vector<double> reals(const StoredValue& tree, const std::string& name, const std::string& place) {
  return numbers_of<double>(array_at(tree, name, place, true), place + "/" + name);
}
std::vector<std::int64_t> wholes(const StoredValue& tree, const std::string& name, const std::string& place) {
  return numbers_of<std::int64_t>(array_at(tree, name, place, false), place + "/" + name);
}

// Throws, naming the first value of which good(value) is false.
template <class T, class Good>
void all(const std::string& name, const std::vector<T>& values, Good&& good, const std::string& due) {
  const auto bad = std::find_if_not(values.begin(), values.end(), good);
  if (bad != values.end())
    wrong(name + "[" + std::to_string(bad - values.begin()) + "] is " + shown(double(*bad)) + ": " + due);
}
void finite(const std::string& name, const std::vector<double>& values) {
  all(
      name, values, [](double x) { return std::isfinite(x); }, "a finite number is due");
}
void within(const std::string& name, const std::vector<std::int64_t>& values, std::int64_t low, std::int64_t end,
            const std::string& what) {
  all(
      name, values, [&](std::int64_t x) { return x >= low && x < end; },
      "there are " + what + " from " + std::to_string(low) + " to " + std::to_string(end - 1));
}
void ids(const std::string& name, std::vector<std::int64_t> values, std::int64_t end) {
  within(name, values, 0, end, "numbers");
  std::sort(values.begin(), values.end());
  if (std::adjacent_find(values.begin(), values.end()) != values.end()) wrong(name + " holds a number twice");
}

// The fields of bodies or contactors, those that are always there among them, each with all of its components.
template <class Holder>
void check_fields(const std::string& place, const StoredValue& tree, Holder& known) {
  const auto items = std::int64_t(wholes(tree, "id", place).size());
  for (const auto& member : tree.members) {
    const std::string &name = member.name, named = std::string(place).append("/").append(name);
    bool there = false;
    known.for_each_field([&](const auto& f) {
      if (f.name != name) return;
      there = true;
      using T = typename std::decay_t<decltype(f)>::value_type;
      const auto values = numbers_of<T>(array_at(tree, name, place, std::is_floating_point_v<T>), named);
      if (std::int64_t(values.size()) != items * f.components)
        wrong(named + " holds " + std::to_string(values.size()) + " numbers: " + std::to_string(items) +
              " items need " + std::to_string(items * f.components));
    });
    if (!there) wrong(named + " is no field that there is");
  }
  known.for_each_field([&](const auto& f) {
    if (f.need == Need::always && !tree.find(std::string(f.name)))
      wrong(place + "/" + std::string(f.name) + " is missing");
  });
}

void check_bodies(int dim, const StoredValue& bodies, std::int64_t end, const Bodies& now) {
  ids("bodies/id", wholes(bodies, "id", "bodies"), end);
  const auto need = [&](const char* name, std::initializer_list<const char*> others) {
    if (!bodies.find(name)) return;
    for (const char* other : others)
      if (!bodies.find(other)) wrong(std::string("bodies/") + other + " is missing");
  };
  for (const char* name : {"position", "velocity", "rotation", "force", "driven_velocity", "angular_momentum",
                           "damping", "surface_velocity"})
    if (bodies.find(name)) finite(std::string("bodies/") + name, reals(bodies, name, "bodies"));
  all(
      "bodies/mass", reals(bodies, "mass", "bodies"), [](double m) { return m > 0; }, "it is more than 0");
  all(
      "bodies/inertia", reals(bodies, "inertia", "bodies"), [](double m) { return m >= 0; }, "it is 0 or more");
  if (bodies.find("driven"))
    within("bodies/driven", wholes(bodies, "driven", "bodies"), 0, std::int64_t(1) << (3 * dim - 3), "sets of dofs");
  need("driven", {"driven_velocity", "reaction"});
  need("rotation", {"rotation_begin"});
  need("angular_momentum", {"inverse_inertia", "momentum_begin", "rotation"});
  const auto count = std::int64_t(wholes(bodies, "id", "bodies").size());
  if (now.count > 0 && now.rotation.active && count >= now.count && !bodies.find("rotation"))
    wrong("bodies/rotation is missing");
}

// Checks nodes; those of a mesh are consecutive.
void check_nodes(const StoredValue& scene, const std::vector<MeshParts>& parts, Nodes& known) {
  std::int64_t due = 0;
  for (const MeshParts& p : parts) due += p.nodes ? p.count : 0;
  const StoredValue* nodes = scene.find("nodes");
  if (!nodes && due == 0) return;
  if (!nodes || !nodes->is_tree()) wrong("nodes are missing");
  check_fields("nodes", *nodes, known);
  const std::vector<std::int64_t> id = wholes(*nodes, "id", "nodes"), mesh = wholes(*nodes, "mesh", "nodes");
  if (std::int64_t(id.size()) != due)
    wrong("nodes/id holds " + std::to_string(id.size()) + " numbers: parts name " + std::to_string(due));
  for (const char* name : {"position", "velocity", "force"})
    finite(std::string("nodes/") + name, reals(*nodes, name, "nodes"));
  all(
      "nodes/mass", reals(*nodes, "mass", "nodes"), [](double m) { return m > 0 && std::isfinite(m); },
      "a finite number above 0 is due");
  for (std::size_t i = 0; i < id.size();) {
    const MeshParts* of = part_with(parts, id[i]);
    if (!of || !of->nodes || of->first != id[i] || std::int64_t(id.size() - i) < of->count)
      wrong("nodes/id[" + std::to_string(i) + "] is " + std::to_string(id[i]) + ", which begins no mesh");
    for (std::int64_t k = 0; k < of->count; ++k, ++i)
      if (id[i] != of->first + k || mesh[i] != of->mesh)
        wrong("nodes/id[" + std::to_string(i) + "] is " + std::to_string(id[i]) + ": nodes of mesh " +
              std::to_string(of->mesh) + " do not follow each other");
  }
}

// Numbers of parts that contactors are mapped from, each of the mesh that is named.
void check_parts(const StoredValue& contactors, const std::vector<std::int64_t>& body,
                 const std::vector<MeshParts>& parts) {
  if (std::none_of(body.begin(), body.end(), [](std::int64_t b) { return b < 0; })) return;
  const std::vector<std::int64_t> part = wholes(contactors, "part", "contactors");
  for (std::size_t c = 0; c < body.size(); ++c) {
    if (body[c] >= 0) continue;
    if (const MeshParts* of = part_with(parts, part[c]); !of || of->mesh != -body[c])
      wrong("contactors/part[" + std::to_string(c) + "] is " + std::to_string(part[c]) + ": mesh " +
            std::to_string(-body[c]) + " has no such part");
  }
}

void check_contactors(const StoredValue& contactors, std::int64_t bodies, std::int64_t end, std::int64_t species,
                      std::int64_t hulls, const std::vector<MeshParts>& parts) {
  const std::string place = "contactors";
  ids("contactors/id", wholes(contactors, "id", place), end);
  const std::vector<std::int64_t> body = wholes(contactors, "body", place);
  std::int64_t meshes = 0;
  for (const MeshParts& p : parts) meshes = std::max<std::int64_t>(meshes, p.mesh);
  within("contactors/body", body, -meshes, bodies, "bodies");
  check_parts(contactors, body, parts);
  const std::vector<std::int64_t> shape = wholes(contactors, "shape", place);
  within("contactors/shape", shape, 0, std::int64_t(shape_infos().size()), "shapes");
  within("contactors/material", wholes(contactors, "material", place), 0, std::max<std::int64_t>(species, 1),
         "materials and groups");
  all(
      "contactors/radius", reals(contactors, "radius", place), [](double r) { return std::isfinite(r) && r >= 0; },
      "a radius is 0 or more");
  for (const char* name : {"offset", "direction"})
    if (contactors.find(name)) {
      std::vector<double> values = reals(contactors, name, place);
      // a tube without end has a half length without end
      const std::size_t n = wholes(contactors, "id", place).size();
      const std::size_t each = name == std::string("direction") && n > 0 ? values.size() / n : 0;
      for (std::size_t i = each; each > 0 && i <= values.size(); i += each)
        if (values[i - 1] > std::numeric_limits<double>::max()) values[i - 1] = 0;
      finite("contactors/" + std::string(name), values);
    }
  const auto any = [&](auto&& is) {
    return std::any_of(shape.begin(), shape.end(), [&](std::int64_t k) { return is(shape_table[k]); });
  };
  if (!contactors.find("direction") && any([](const ShapeInfo& s) { return s.directed; }))
    wrong("contactors/direction is missing");
  if (!contactors.find("hull")) {
    if (any([](const ShapeInfo& s) { return s.is_hull(); })) wrong("contactors/hull is missing");
    return;
  }
  std::vector<std::int64_t> own, none;
  const std::vector<std::int64_t> hull = wholes(contactors, "hull", place);
  for (std::size_t k = 0; k < hull.size(); ++k) (shape_table[shape[k]].is_hull() ? own : none).push_back(hull[k]);
  within("contactors/hull", own, 0, hulls, "hulls");
  within("contactors/hull", none, -1, 0, "hulls of other shapes");
}

// How many there are. Their cuts rise, their numbers stay within the hull, their lengths are those that the cuts tell.
std::int64_t check_hulls(int dim, const StoredValue& hulls) {
  const std::string place = "hulls";
  const auto cut = [&](const char* name) {
    std::vector<std::int64_t> first = wholes(hulls, name, place);
    if (first.empty() || first[0] != 0 || !std::is_sorted(first.begin(), first.end()))
      wrong(place + "/" + name + " does not rise from 0");
    return first;
  };
  const auto vertex = cut("first_vertex"), face = cut("first_face"), edge = cut("first_edge"),
             corner = cut("first_corner");
  const auto size = [&](const char* name, std::int64_t is, std::int64_t due) {
    if (is != due)
      wrong(place + "/" + name + " holds " + std::to_string(is) + " numbers: " + std::to_string(due) + " are due");
  };
  const auto n = [](const auto& v) { return std::int64_t(v.size()); };
  const std::int64_t count = n(vertex) - 1, faces = face.back(), corners = corner.back(), edges = edge.back();
  size("first_face", n(face), count + 1);
  size("first_edge", n(edge), count + 1);
  if (n(corner) != 1) size("first_corner", n(corner), faces + 1);
  for (const char* name : {"corner_vertex", "corner_edge"})
    if (const auto values = wholes(hulls, name, place); !values.empty()) size(name, n(values), corners);
  const auto real = [&](const char* name, std::int64_t due) {
    const auto values = reals(hulls, name, place);
    size(name, n(values), due);
    finite(place + "/" + name, values);
  };
  real("vertex", dim * vertex.back());
  real("normal", dim * faces);
  real("offset", faces);
  real("inner", count);
  real("radius", count);
  const std::int64_t all_edges = n(wholes(hulls, "edge", place));
  if (edges > 0 && all_edges % edges)
    wrong("hulls/edge holds " + std::to_string(all_edges) + " numbers, no multiple of " + std::to_string(edges) +
          " edges");
  return count;
}

// Hulls that both have are cut and numbered alike: a simulation never changes that.
void check_same_hulls(const Hulls& now, const StoredValue& given) {
  const auto cut = wholes(given, "first_vertex", "hulls");
  const std::int64_t shared = std::min<std::int64_t>(now.count(), std::int64_t(cut.size()) - 1);
  if (shared <= 0) return;
  const auto s = std::size_t(shared);
  const std::int64_t faces = now.first_face[s], edges = now.first_edge[s];
  const std::int64_t corners = std::int64_t(now.first_corner.size()) > faces ? now.first_corner[std::size_t(faces)] : 0;
  const std::int64_t each_edge = std::int64_t(now.edge.size()) / std::max(now.first_edge.back(), 1);
  const auto same = [&](const char* name, std::vector<std::int32_t> own, std::int64_t size) {
    auto theirs = wholes(given, name, "hulls");
    if (std::string_view(name) == "edge") { // whether a facet was moved is no matter of its shape
      for (std::size_t k = 0; k + 3 < own.size(); k += 4)
        if (own[k] == own[k + 1]) own[k + 3] = 0;
      for (std::size_t k = 0; k + 3 < theirs.size(); k += 4)
        if (theirs[k] == theirs[k + 1]) theirs[k + 3] = 0;
    }
    const std::int64_t n = std::min<std::int64_t>(size, std::int64_t(own.size()));
    if (std::int64_t(theirs.size()) < n || !std::equal(own.begin(), own.begin() + n, theirs.begin()))
      wrong(std::string("hulls/") + name + " is not that of the scene");
  };
  same("first_vertex", now.first_vertex, shared + 1);
  same("first_face", now.first_face, shared + 1);
  same("first_edge", now.first_edge, shared + 1);
  same("first_corner", now.first_corner, faces + 1);
  same("corner_vertex", now.corner_vertex, corners);
  same("corner_edge", now.corner_edge, corners);
  same("edge", now.edge, edges * each_edge);
}

void check_cell(const StoredValue& cell) {
  const std::vector<bool> periodic = cell.flags("periodic");
  if (periodic.size() != 3) wrong("cell/periodic is no three of true and false");
  for (const auto& [name, due] : {std::pair{"vectors", 9}, {"corner", 3}, {"velocity_gradient", 9}}) {
    const auto values = reals(cell, name, "cell");
    if (int(values.size()) != due)
      wrong(std::string("cell/") + name + " holds " + std::to_string(values.size()) +
            " numbers: " + std::to_string(due) + " are due");
    finite(std::string("cell/") + name, values);
  }
  // the volume of the periodic directions against that of a box of their lengths
  const auto v = reals(cell, "vectors", "cell");
  double kept[3][3];
  int n = 0;
  for (int k = 0; k < 3; ++k) {
    if (!periodic[std::size_t(k)]) continue;
    double length = 0;
    for (int i = 0; i < 3; ++i) length = std::max(length, std::abs(kept[n][i] = v[std::size_t(3 * k + i)]));
    for (int m = 0; m < n && length > 0; ++m) { // remainder after projection on the vectors before
      double along = 0, square = 0;
      for (int i = 0; i < 3; ++i) {
        along += kept[m][i] * (kept[n][i] / length);
        square += kept[m][i] * kept[m][i];
      }
      for (int i = 0; i < 3; ++i) kept[n][i] -= along / square * length * kept[m][i];
    }
    double left = 0;
    for (int i = 0; i < 3; ++i) left = std::max(left, std::abs(kept[n][i]));
    if (!(left > 1e-14 * length)) wrong("cell/vectors of periodic directions lie in each other");
    for (int i = 0; i < 3; ++i) kept[n][i] /= left;
    ++n;
  }
}

void check_memory(const std::string& place, const StoredValue& memory, std::int64_t contactors) {
  finite(place + "/h", {memory.real("h")});
  memory.whole("contactors_seen");
  if (memory.find("seen_besides")) ids(place + "/seen_besides", wholes(memory, "seen_besides", place), contactors);
  const std::int64_t impulses = memory.whole("impulse_components", 7), states = memory.whole("state_components", 4096);
  const auto keys = wholes(memory, "keys", place);
  if (keys.size() % 4)
    wrong(place + "/keys holds " + std::to_string(keys.size()) + " numbers: 4 for each contact are due");
  for (std::size_t k = 0; k < keys.size(); ++k)
    if (k % 4 >= 2 && keys[k] != std::int32_t(keys[k]))
      wrong(place + "/keys holds " + std::to_string(keys[k]) + ", which is no number that it can have");
  const auto contacts = std::int64_t(keys.size()) / 4;
  for (const auto& [name, components] : {std::pair{"impulses", impulses}, {"states", states}}) {
    const auto values = reals(memory, name, place);
    if (std::int64_t(values.size()) != contacts * components)
      wrong(place + "/" + name + " holds " + std::to_string(values.size()) + " numbers: " + std::to_string(contacts) +
            " contacts need " + std::to_string(contacts * components));
    if (name == std::string("impulses")) finite(place + "/" + name, values);
  }
  if (memory.find("anchors")) {
    const auto anchors = reals(memory, "anchors", place);
    constexpr auto each = std::int64_t(sizeof(Anchor) / sizeof(double));
    if (std::int64_t(anchors.size()) != each * contacts)
      wrong(place + "/anchors holds " + std::to_string(anchors.size()) + " numbers: " + std::to_string(contacts) +
            " contacts need " + std::to_string(each * contacts));
    finite(place + "/anchors", anchors);
  }
  if (memory.find("forces"))
    if (const auto forces = reals(memory, "forces", place); contacts > 0 && std::int64_t(forces.size()) % contacts != 0)
      wrong(place + "/forces holds " + std::to_string(forces.size()) + " numbers, no multiple of " +
            std::to_string(contacts) + " contacts");
}

} // namespace

void check_state(const StoredValue& state, std::int64_t species, const Simulation& now) {
  if (const auto as_now = state_as_now(state, now.scene)) return check_state(*as_now, species, now);
  const StoredValue& scene = state.tree("scene");
  const int dim = now.scene.dim;
  Scene empty(dim);
  const StoredValue &bodies = scene.tree("bodies"), &contactors = scene.tree("contactors");
  check_fields("bodies", bodies, empty.bodies);
  check_fields("contactors", contactors, empty.contactors);
  check_bodies(dim, bodies, scene.whole("next_body_id"), now.scene.bodies);
  const std::vector<MeshParts> parts = parts_of(scene);
  if (!parts.empty()) {
    if (parts.back().first + parts.back().count > scene.whole("next_body_id"))
      wrong("parts name a number that no body or part has yet");
    check_nodes(scene, parts, empty.nodes);
  }
  std::int64_t hulls = 0;
  if (const StoredValue* given = scene.find("hulls")) {
    if (!given->is_tree()) wrong("hulls holds no names");
    hulls = check_hulls(dim, *given);
    check_same_hulls(now.scene.contactors.hulls, *given);
  }
  const auto count = std::int64_t(wholes(bodies, "id", "bodies").size());
  check_contactors(contactors, count, scene.whole("next_contactor_id"), species, hulls, parts);
  check_cell(scene.tree("cell"));
  for (const char* name : {"memory", "projection_memory"})
    check_memory(name, state.tree(name), scene.whole("next_contactor_id"));
  const StoredValue& energy = state.tree("energy");
  for (const EnergyTerm& term : energy_terms())
    finite(std::string("energy/") + term.name, {energy_term(energy, term.name)});
  if (const StoredValue* networks = state.find("networks"))
    for (const char* name : {"electrical", "thermal"})
      if (const StoredValue* one = networks->find(name)) {
        NetworkBalance balance;
        each_term(balance,
                  [&](const char* term, double&) { finite(std::string(name) + "/" + term, {one->real(term)}); });
        if (wholes(*one, "broken", name).size() % 4) wrong(std::string(name) + "/broken holds no keys of four numbers");
      }
  state.whole("steps");
  finite("time", {state.real("time")});
}

} // namespace cairn
