#include "run_snapshot.hpp"

#include <algorithm>
#include <cmath>

#include "../simulation/contact_fields.hpp"
#include "../simulation/report.hpp"

namespace cairn {

namespace {

// A field in the order of insertion, shape (n) or (n, components).
template <class T>
StoredArray ordered(const Field<T>& field, const std::vector<std::int32_t>& order, const double* origin = nullptr) {
  std::vector<T> out;
  out.reserve(order.size() * std::size_t(field.components));
  for (const std::int32_t i : order)
    for (int c = 0; c < field.components; ++c) out.push_back(T(field[i][c] + (origin ? T(origin[c]) : T(0))));
  std::vector<std::int64_t> shape = {std::int64_t(order.size())};
  if (field.components != 1) shape.push_back(field.components);
  return StoredArray::of(out.data(), std::move(shape));
}

// Internal numbers to their place in the order of insertion.
std::vector<std::int32_t> places(const std::vector<std::int32_t>& order) {
  std::vector<std::int32_t> out(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) out[std::size_t(order[k])] = std::int32_t(k);
  return out;
}

// About the centre of mass [m]: 0 for walls.
StoredArray radii(const Scene& scene) {
  const Contactors& c = scene.contactors;
  std::vector<double> out(std::size_t(scene.bodies.count), 0.0);
  const std::vector<std::int32_t> place = places(scene.insertion_order());
  for (std::int64_t i = 0; i < c.count; ++i) {
    if (*c.body[i] < 0 || !info(Shape(*c.shape[i])).ball()) continue;
    double square = 0;
    if (c.offset.active)
      for (int k = 0; k < scene.dim; ++k) square += c.offset[i][k] * c.offset[i][k];
    double& r = out[std::size_t(place[std::size_t(*c.body[i])])];
    r = std::max(r, *c.radius[i] + std::sqrt(square));
  }
  return StoredArray::of(out.data(), {scene.bodies.count});
}

// Material of the first contactor of each body, or of each node; -1: none.
StoredArray materials(const Scene& scene, bool of_nodes) {
  const Contactors& c = scene.contactors;
  const std::int64_t n = of_nodes ? scene.nodes.count : scene.bodies.count;
  std::vector<std::int32_t> out(std::size_t(n), -1);
  const std::vector<std::int32_t> place = places(of_nodes ? scene.node_insertion_order() : scene.insertion_order());
  for (const std::int32_t i : scene.contactor_insertion_order()) {
    std::int32_t at = *c.body[i];
    if ((at < 0) != of_nodes) continue;
    if (of_nodes) { // a node with a contactor
      const MeshParts* of = scene.part(*c.part[i]);
      if (!of || !of->nodes) continue;
      at = scene.node(*c.part[i]);
    }
    std::int32_t& m = out[std::size_t(place[std::size_t(at)])];
    if (m < 0) m = *c.material[i];
  }
  return StoredArray::of(out.data(), {n});
}

template <class T>
StoredArray contacts(Simulation& s, const char* name) {
  const ContactFieldInfo& field = contact_field_info(name);
  const std::int64_t n = s.candidates.count;
  const int components = field.components(s.scene.dim);
  std::vector<T> out(std::size_t(n * components));
  read_contact_field(s, field, out.data());
  return StoredArray::of(out.data(),
                         components == 1 ? std::vector<std::int64_t>{n} : std::vector<std::int64_t>{n, components});
}

} // namespace

std::vector<std::int64_t> nodes_of_contactors(Simulation& s) {
  s.place_meshes();
  std::vector<std::int64_t> out;
  for (const std::int32_t i : s.scene.contactor_insertion_order())
    for (int j = 0; j < 4; ++j) {
      const std::int32_t node = *s.scene.contactors.body[i] < 0 ? s.meshes.middle(i).node[j] : -1;
      out.push_back(node < 0 ? -1 : *s.scene.nodes.id[node]);
    }
  return out;
}

void RunSnapshot::keep(std::vector<RunField>& to, const char* name, StoredArray array) {
  values.push_back(std::move(array));
  const StoredArray& a = values.back();
  to.push_back({name, a.type, {a.shape.begin() + 1, a.shape.end()}, a.shape[0], a.bytes.data()});
}

RunSnapshot::RunSnapshot(Simulation& s) {
  const Bodies& b = s.scene.bodies;
  const auto& order = s.scene.insertion_order();
  keep(bodies, "position", ordered(b.position, order, s.scene.origin.data()));
  keep(bodies, "velocity", ordered(b.velocity, order));
  keep(bodies, "radius", radii(s.scene));
  keep(bodies, "id", ordered(b.id, order));
  keep(bodies, "mass", ordered(b.mass, order));
  keep(bodies, "material", materials(s.scene, false));
  if (b.rotation.active) keep(bodies, "rotation", ordered(b.rotation, order));
  if (b.temperature.active) keep(bodies, "temperature", ordered(b.temperature, order));
  if (b.potential.active) keep(bodies, "potential", ordered(b.potential, order));
  if (const Nodes& n = s.scene.nodes; n.count > 0) {
    const auto& own = s.scene.node_insertion_order();
    keep(nodes, "position", ordered(n.position, own, s.scene.origin.data()));
    keep(nodes, "velocity", ordered(n.velocity, own));
    keep(nodes, "id", ordered(n.id, own));
    keep(nodes, "mass", ordered(n.mass, own));
    keep(nodes, "material", materials(s.scene, true));
    if (n.temperature.active) keep(nodes, "temperature", ordered(n.temperature, own));
    if (n.potential.active) keep(nodes, "potential", ordered(n.potential, own));
  }
  contacts_to_read(s); // places those of a smooth strategy
  for (const char* name : {"point", "normal", "gap", "impulse"}) keep(contacts, name, cairn::contacts<double>(s, name));
  for (const char* name : {"electrical_conductance", "current", "joule_heat", "thermal_conductance", "heat_flux"})
    if (has_contact_field(s, name)) keep(contacts, name, cairn::contacts<double>(s, name));
  const std::int64_t n = s.candidates.count;
  const auto whole = [&](const char* name) {
    std::vector<std::int64_t> out(std::size_t(n * contact_field_info(name).components(s.scene.dim)));
    read_contact_field(s, contact_field_info(name), out.data());
    return out;
  };
  const std::vector<std::int64_t> status = whole("status"), pairs = whole("bodies");
  const std::vector<std::int32_t> narrow(status.begin(), status.end());
  keep(contacts, "status", StoredArray::of(narrow.data(), {n}));
  for (const int side : {0, 1}) {
    std::vector<std::int64_t> ids;
    for (std::int64_t i = 0; i < n; ++i) ids.push_back(pairs[std::size_t(2 * i + side)]);
    keep(contacts, side == 0 ? "body_a" : "body_b", StoredArray::of(ids.data(), {n}));
  }
  if (s.laws_keep())
    for (const char* name : {"beta", "stored", "released"}) keep(contacts, name, cairn::contacts<double>(s, name));
}

void write_scene(Group& scene, Simulation& s, const std::vector<std::string>& names, const std::string& mark) {
  const auto texts = [](const std::vector<std::string>& list) {
    std::size_t longest = 1;
    for (const std::string& text : list) longest = std::max(longest, text.size());
    StoredArray out{{'S', std::uint32_t(longest)}, {std::int64_t(list.size())}, {}};
    for (std::string text : list) {
      text.resize(longest);
      out.bytes.insert(out.bytes.end(), text.begin(), text.end());
    }
    return out;
  };
  std::vector<std::string> all;
  for (const ShapeInfo& shape : shape_infos()) all.emplace_back(shape.name);
  scene.array("materials", texts(names));
  scene.array("shapes", texts(all));
  scene.array("core_mark", StoredArray::text(mark));
  scene.array("gravity", StoredArray::of(s.scene.gravity.data(), {s.scene.dim}));
  Group& table = scene.group("contactors");
  const Contactors& c = s.scene.contactors;
  const auto& order = s.scene.contactor_insertion_order();
  std::vector<std::int64_t> bodies;
  bodies.reserve(order.size());
  for (const std::int32_t i : order) bodies.push_back(carrier_id(s.scene.bodies, c, i));
  table.array("shape_number", ordered(c.shape, order));
  table.array("body", StoredArray::of(bodies.data(), {std::int64_t(bodies.size())}));
  if (c.part.active) table.array("nodes", StoredArray::of(nodes_of_contactors(s).data(), {c.count, 4}));
  table.array("radius", ordered(c.radius, order));
  if (c.offset.active) table.array("offset", ordered(c.offset, order));
  if (c.direction.active) table.array("direction", ordered(c.direction, order));
  if (!c.hull.active) return;
  table.array("hull", ordered(c.hull, order));
  Group& hulls = table.group("hulls");
  const Hulls& h = c.hulls;
  const auto add = [&](const char* name, const auto& v) {
    hulls.array(name, StoredArray::of(v.data(), {std::int64_t(v.size())}));
  };
  add("first_vertex", h.first_vertex);
  add("first_face", h.first_face);
  add("first_corner", h.first_corner);
  add("corner_vertex", h.corner_vertex);
  add("vertex", h.vertex);
  add("offset", h.offset);
}

const char* status_name(const StepReport& report) {
  if (report.stable_step > 0) return "explicit";
  switch (report.solve.status) {
  case SolveStatus::converged: return "converged";
  case SolveStatus::iteration_limit: return "iteration_limit";
  case SolveStatus::newton_limit: return "newton_limit";
  default: return "diverged";
  }
}

std::vector<RunNumber> numbers_of_step(const Simulation& s) {
  std::vector<RunNumber> out;
  const StepReport& r = s.report;
  for (const auto& [name, number] : report_numbers(r))
    if (name != std::string("step") && name != std::string("time")) out.emplace_back(name, number);
  for (const auto& [name, member] : energy_terms()) out.emplace_back(std::string("energy_") + name, s.energy.*member);
  out.emplace_back("status", std::string(status_name(r)));
  out.emplace_back("solver", std::string(r.solve.solver));
  return out;
}

void keep_rotations(Scene& scene) {
  auto& rotation = scene.bodies.rotation;
  if (scene.bodies.count + scene.nodes.count == 0 || rotation.active) return;
  scene.activate(rotation.need);
  for (std::int64_t i = 0; i < scene.bodies.count; ++i)
    for (int c = 0; c < rotation.components; ++c) rotation[i][c] = scene.dim == 3 && c == 0 ? 1.0 : 0.0;
  scene.state_assigned();
}

} // namespace cairn
