#include "simulation_state.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string_view>

#include "../base/call.hpp"
#include "../fluid/fluid.hpp"
#include "../networks/balance_terms.hpp"
#include "../simulation/report.hpp"
#include "checksums.hpp"
#include "file_error.hpp"
#include "older_states.hpp"

namespace cairn {

namespace {

// Calls f(name, array) for every array of the hulls.
template <class H, class F>
void each_hull_array(H& h, F&& f) {
  f("first_vertex", h.first_vertex);
  f("first_face", h.first_face);
  f("first_edge", h.first_edge);
  f("first_corner", h.first_corner);
  f("corner_vertex", h.corner_vertex);
  f("corner_edge", h.corner_edge);
  f("edge", h.edge);
  f("vertex", h.vertex);
  f("normal", h.normal);
  f("offset", h.offset);
  f("inner", h.inner);
  f("radius", h.radius);
}

template <class Holder>
StoredValue fields_of(Holder& holder) {
  StoredValue out;
  holder.for_each_field([&](auto& f) {
    if (!f.active) return;
    std::vector<std::int64_t> shape = {holder.count};
    if (f.components != 1) shape.push_back(f.components);
    out.add_array(std::string(f.name), f.values.data(), std::move(shape));
  });
  return out;
}

// Rows are cell vectors, columns are stored; the gradient by rows.
StoredValue cell_of(const Cell& cell) {
  double vectors[9], gradient[9];
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      vectors[3 * k + i] = cell.vectors[i + 3 * k];
      gradient[3 * i + k] = cell.velocity_gradient[i + 3 * k];
    }
  StoredValue out;
  out.add_flags("periodic", {cell.periodic[0], cell.periodic[1], cell.periodic[2]});
  out.add_array("vectors", vectors, {3, 3});
  out.add_array("corner", cell.corner, {3});
  out.add_array("velocity_gradient", gradient, {3, 3});
  return out;
}

void take_cell(Cell& cell, const StoredValue& tree) {
  const auto periodic = tree.flags("periodic");
  const auto vectors = numbers_of<double>(tree.at("vectors").array, "cell/vectors");
  const auto corner = numbers_of<double>(tree.at("corner").array, "cell/corner");
  const auto gradient = numbers_of<double>(tree.at("velocity_gradient").array, "cell/velocity_gradient");
  for (std::size_t i = 0; i < 3; ++i) {
    cell.periodic[i] = periodic[i];
    cell.corner[i] = corner[i];
    for (std::size_t k = 0; k < 3; ++k) {
      cell.vectors[i + 3 * k] = vectors[3 * k + i];
      cell.velocity_gradient[i + 3 * k] = gradient[3 * i + k];
    }
  }
}

template <class Vector>
void add_vector(StoredValue& out, const char* name, const Vector& values) {
  out.add_array(name, values.data(), {std::int64_t(values.size())});
}

constexpr std::int64_t numbers_of_anchor = sizeof(Anchor) / sizeof(double);

StoredValue memory_of(const ContactMemory& m) {
  std::vector<std::int64_t> keys;
  for (const ContactKey& k : m.keys) keys.insert(keys.end(), {k.contactor_a, k.contactor_b, k.feature, k.image});
  StoredValue out;
  out.add_real("h", m.h);
  out.add_whole("contactors_seen", m.contactors_seen);
  if (m.joints_came) out.add_whole("joints_came", 1);
  if (!m.seen_besides.empty())
    out.add_array("seen_besides", m.seen_besides.data(), {std::int64_t(m.seen_besides.size())});
  out.add_whole("impulse_components", m.impulse_components);
  out.add_whole("state_components", m.state_components);
  out.add_array("keys", keys.data(), {std::int64_t(m.keys.size()), 4});
  add_vector(out, "impulses", m.impulses);
  add_vector(out, "states", m.states);
  out.add_whole("first_state_holds", 1);
  if (const RefinementMemory& r = m.refinement; r.amplification > 0 || r.share > 0 || r.failures > 0 || r.idle > 0) {
    const double values[] = {r.amplification, r.share, double(r.failures), double(r.idle)};
    out.add_array("refinement", values, {4});
  }
  if (m.rest.attempts > 0 || m.rest.idle > 0) {
    const std::int64_t values[] = {m.rest.attempts, m.rest.idle};
    out.add_array("rest", values, {2});
  }
  if (!m.forces.empty()) add_vector(out, "forces", m.forces);
  if (!m.seats.empty()) {
    std::vector<std::int64_t> seats;
    for (const RimSeat& seat : m.seats) seats.insert(seats.end(), {seat.node, seat.side, seat.face});
    out.add_array("seats", seats.data(), {std::int64_t(m.seats.size()), 3});
  }
  if (!m.anchors.empty()) {
    const auto* first = reinterpret_cast<const double*>(m.anchors.data());
    out.add_array("anchors", first, {std::int64_t(m.anchors.size()), numbers_of_anchor});
  }
  return out;
}

ContactMemory memory_from(const StoredValue& tree) {
  ContactMemory m;
  m.h = tree.real("h");
  m.contactors_seen = tree.whole("contactors_seen");
  m.joints_came = tree.find("joints_came") != nullptr;
  if (const StoredValue* seen = tree.find("seen_besides")) {
    m.seen_besides = numbers_of<std::int64_t>(seen->array, "seen_besides");
    std::sort(m.seen_besides.begin(), m.seen_besides.end());
  }
  m.impulse_components = int(tree.whole("impulse_components"));
  m.state_components = int(tree.whole("state_components"));
  const auto keys = numbers_of<std::int64_t>(tree.at("keys").array, "keys");
  for (std::size_t i = 0; i + 3 < keys.size(); i += 4)
    m.keys.push_back({keys[i], keys[i + 1], std::int32_t(keys[i + 2]), std::int32_t(keys[i + 3])});
  m.impulses = numbers_of<double>(tree.at("impulses").array, "impulses");
  m.states = numbers_of<double>(tree.at("states").array, "states");
  m.gaps_of_bonds = !tree.find("first_state_holds");
  if (const StoredValue* refinement = tree.find("refinement")) {
    const auto values = numbers_of<double>(refinement->array, "refinement");
    const auto whole = [](double value) { return value >= 0 && value < 1e6 ? int(value) : 0; };
    if (values.size() == 4) m.refinement = {values[0], values[1], whole(values[2]), whole(values[3])};
  }
  if (const StoredValue* rest = tree.find("rest")) {
    const auto values = numbers_of<std::int64_t>(rest->array, "rest");
    const auto whole = [](std::int64_t value) { return int(std::clamp<std::int64_t>(value, 0, 1 << 20)); };
    if (values.size() == 2) m.rest = {whole(values[0]), whole(values[1])};
  }
  if (const StoredValue* forces = tree.find("forces")) m.forces = numbers_of<double>(forces->array, "forces");
  if (const StoredValue* stored = tree.find("seats")) {
    const auto seats = numbers_of<std::int64_t>(stored->array, "seats");
    for (std::size_t i = 0; i + 2 < seats.size(); i += 3)
      m.seats.push_back({seats[i], seats[i + 1], std::int32_t(seats[i + 2])});
  }
  if (const StoredValue* anchors = tree.find("anchors")) {
    const auto values = numbers_of<double>(anchors->array, "anchors");
    m.anchors.resize(values.size() / numbers_of_anchor);
    std::copy(values.begin(), values.end(), reinterpret_cast<double*>(m.anchors.data()));
  }
  return m;
}

// Balances of the networks, and contacts whose film is gone.
StoredValue networks_of(const Networks& networks) {
  StoredValue out;
  for (const auto& [name, network] : {std::pair{"electrical", &networks.electrical}, {"thermal", &networks.thermal}}) {
    if (!*network) continue;
    StoredValue one;
    each_term((*network)->balance, [&](const char* term, double value) { one.add_real(term, value); });
    std::vector<std::int64_t> keys;
    for (const ContactKey& k : (*network)->broken_keys)
      keys.insert(keys.end(), {k.contactor_a, k.contactor_b, k.feature, k.image});
    one.add_array("broken", keys.data(), {std::int64_t(keys.size()) / 4, 4});
    out.add(name, std::move(one));
  }
  return out;
}

void take_networks(Networks& networks, const StoredValue& tree) {
  for (const auto& [name, network] : {std::pair{"electrical", &networks.electrical}, {"thermal", &networks.thermal}}) {
    const StoredValue* one = tree.find(name);
    if (!*network || !one) continue;
    each_term((*network)->balance, [&](const char* term, double& value) { value = one->real(term); });
    const auto keys = numbers_of<std::int64_t>(one->at("broken").array, "broken");
    (*network)->broken_keys.clear();
    for (std::size_t i = 0; i + 3 < keys.size(); i += 4)
      (*network)->broken_keys.push_back({keys[i], keys[i + 1], std::int32_t(keys[i + 2]), std::int32_t(keys[i + 3])});
  }
}

StoredValue fluid_of(Fluid& fluid) {
  StoredValue out;
  fluid.each_state_array([&](const char* name, const auto& values) { add_vector(out, name, values); });
  return out;
}

// Numbers of a particle in an array of the state, 0: the array is no array of particles.
std::size_t of_a_particle(std::string_view name) {
  if (name == "position" || name == "velocity" || name == "acceleration") return 3;
  return name == "density" || name == "number" || name == "open" || name == "end" ? 1 : 0;
}

void take_fluid(Fluid& fluid, const StoredValue& tree) {
  std::size_t particles = 0; // of the state: with open ends it may have more or less than there are now
  fluid.each_state_array([&](const char* name, auto& values) {
    using T = typename std::decay_t<decltype(values)>::value_type;
    const std::string_view of = name;
    if (of == "volume_begin" && !tree.find(name)) return; // a file of before it was kept
    std::vector<T> stored = numbers_of<T>(tree.at(name).array, name);
    if (of == "position") particles = stored.size() / 3;
    const std::size_t due = fluid.has_ends() && of_a_particle(of) > 0 ? of_a_particle(of) * particles : values.size();
    if (stored.size() != due && of != "listed" && !(of == "volume_begin" && stored.size() <= 1))
      throw std::invalid_argument("the fluid has " + std::to_string(stored.size()) + " numbers of " + name + ", and " +
                                  std::to_string(due) + " are due");
    values = std::move(stored);
  });
  fluid.state_restored();
}

template <class Holder>
void take_fields(Holder& holder, const StoredValue& tree) {
  holder.for_each_field([&](auto& f) {
    using T = typename std::decay_t<decltype(f)>::value_type;
    const StoredValue* given = tree.find(std::string(f.name));
    f.active = given != nullptr;
    if (!given) return;
    const std::vector<T> values = numbers_of<T>(given->array, std::string(f.name));
    f.values.assign(values.begin(), values.end());
  });
}

std::string number_of(std::size_t mesh) {
  char text[24];
  std::snprintf(text, sizeof text, "%06zu", mesh);
  return text;
}

const char* const untold_history =
    "is of a code that keeps a history and does not give it: a checkpoint needs its state_size, save and load";

// State of meshes. With stresses of a material: states of its points, and initial values of the next step; linear ones:
// the order in which nodes came to touch, where numbers depend on it.
StoredValue meshes_of(Simulation& s) {
  StoredValue out;
  for (std::size_t k = 0; k < s.meshes.meshes.size(); ++k) {
    const MeshBody& mesh = s.meshes.meshes[k];
    StoredValue of;
    if (mesh.linear()) {
      const std::vector<double> touched = mesh.touched();
      if (touched.empty()) continue;
      of.add_array("touched", touched.data(), {std::int64_t(touched.size())});
      out.add(number_of(k), std::move(of));
      continue;
    }
    if (!mesh.model.bulk->tells_history())
      throw Error("the mesh '" + mesh.model.name + "' " + std::string(untold_history));
    const std::vector<double> state = mesh.model.bulk->history(), memory = mesh.memory();
    of.add_array("state", state.data(), {std::int64_t(state.size())});
    of.add_array("memory", memory.data(), {std::int64_t(memory.size())});
    out.add(number_of(k), std::move(of));
  }
  return out;
}

void take_meshes(Simulation& s, const StoredValue* from) {
  for (std::size_t k = 0; k < s.meshes.meshes.size(); ++k) {
    MeshBody& mesh = s.meshes.meshes[k];
    const StoredValue* of = from ? from->find(number_of(k)) : nullptr;
    if (mesh.linear())
      mesh.restore_touched(of ? numbers_of<double>(of->at("touched").array, "touched") : std::vector<double>());
    else if (of)
      mesh.restore(numbers_of<double>(of->at("state").array, "state"),
                   numbers_of<double>(of->at("memory").array, "memory"));
    else
      mesh.forget();
  }
}

// Digest of the rest positions of all meshes, since states of nodes are displacements from there. A body made
// deformable in the run takes them from its position at that time.
std::string rest_of(const Simulation& s) {
  Blake2b digest(16);
  for (const MeshBody& mesh : s.meshes.meshes) {
    digest.update(std::to_string(mesh.model.nodes()) + "|");
    digest.update(mesh.model.reference.data(), mesh.model.reference.size() * sizeof(double));
  }
  return digest.hexdigest();
}

// Bodies are deformable in both, and were made so where they stood in both.
void check_meshes(const StoredValue& content, const Simulation& s, const std::string& path) {
  if (!content.find("meshes")) return; // older
  const std::int64_t wanted = content.whole("meshes"), there = std::int64_t(s.meshes.meshes.size());
  if (wanted != there)
    throw FileError(
        path, "the checkpoint has " + std::to_string(wanted) + " meshes and the simulation " + std::to_string(there),
        "make the same bodies deformable first, or rigid");
  if (content.text("rest") != rest_of(s))
    throw FileError(path, "meshes of the checkpoint are at rest elsewhere than those of the simulation",
                    "restart from a checkpoint of before bodies were made deformable, make them deformable where they "
                    "were, and restart from this one");
}

} // namespace

// Reads a term of the energy from files of any version. The dissipation of the integrator was named after the
// theta-method at first; old files lack the terms of later features, which are 0.
double energy_term(const StoredValue& energy, const std::string& term) {
  const bool later = term == "released" || term == "dissipated_material" || term == "dissipated_reshaping" ||
                     term == "work_growth" || term == "absorbed";
  if (later && !energy.find(term)) return 0;
  return energy.real(term == "dissipated_integrator" && !energy.find(term) ? "dissipated_theta" : term);
}

StoredValue state_of(Simulation& s) {
  StoredValue scene, energy, out;
  StoredValue memory = memory_of(s.strategy().memory(s)); // over ranks, it makes the arrays of all bodies known
  scene.add("bodies", fields_of(s.scene.bodies));
  if (s.scene.nodes.count > 0) scene.add("nodes", fields_of(s.scene.nodes));
  scene.add("contactors", fields_of(s.scene.contactors));
  scene.add("parts", stored_parts(s.scene));
  scene.add_whole("next_body_id", s.scene.next_body_id);
  scene.add_whole("next_contactor_id", s.scene.next_contactor_id);
  if (s.scene.contactors.hulls.count() > 0) {
    StoredValue hulls;
    each_hull_array(s.scene.contactors.hulls, [&](const char* name, const auto& v) { add_vector(hulls, name, v); });
    scene.add("hulls", std::move(hulls));
  }
  scene.add("cell", cell_of(s.scene.cell));
  for (const auto& [name, member] : energy_terms()) energy.add_real(name, s.energy.*member);
  out.add("scene", std::move(scene));
  out.add("memory", std::move(memory));
  out.add("projection_memory", memory_of(s.strategy().projection_memory()));
  out.add("energy", std::move(energy));
  if (StoredValue meshes = meshes_of(s); !meshes.members.empty()) out.add("meshes", std::move(meshes));
  out.add_whole("steps", s.steps);
  out.add_real("time", s.time);
  if (s.networks) out.add("networks", networks_of(*s.networks));
  if (s.fluid) out.add("fluid", fluid_of(*s.fluid));
  return out;
}

void take_state(Simulation& s, const StoredValue& state) {
  if (const auto as_now = state_as_now(state, s.scene)) return take_state(s, *as_now);
  const StoredValue* liquid = state.find("fluid");
  if ((liquid != nullptr) != (s.fluid != nullptr))
    throw std::invalid_argument(liquid ? "it has a fluid, and this scene has none: give the scene its fluid"
                                       : "it has no fluid, and this scene has one: restart the scene without it");
  const StoredValue &scene = state.tree("scene"), &energy = state.tree("energy");
  take_fields(s.scene.bodies, scene.tree("bodies"));
  Bodies& bodies = s.scene.bodies; // files of before the last step but one was kept
  if (bodies.stretch.active && !bodies.stretch_before.active)
    bodies.stretch_before.activate(std::int64_t(bodies.id.values.size()));
  if (bodies.bend.active && !bodies.bend_before.active)
    bodies.bend_before.activate(std::int64_t(bodies.id.values.size()));
  if (const StoredValue* nodes = scene.find("nodes"))
    take_fields(s.scene.nodes, *nodes);
  else
    s.scene.nodes.for_each_field([&](auto& f) {
      f.active = s.scene.has(f.need);
      f.values.clear();
    });
  take_fields(s.scene.contactors, scene.tree("contactors"));
  if (const StoredValue* hulls = scene.find("hulls"))
    each_hull_array(s.scene.contactors.hulls, [&](const char* name, auto& v) {
      v = numbers_of<typename std::decay_t<decltype(v)>::value_type>(hulls->at(name).array, name);
    });
  s.scene.next_body_id = scene.whole("next_body_id");
  s.scene.next_contactor_id = scene.whole("next_contactor_id");
  s.scene.fields_restored(parts_of(scene));
  take_cell(s.scene.cell, scene.tree("cell"));
  s.strategy().restore(s, memory_from(state.tree("memory")));
  s.strategy().restore_projection(s, memory_from(state.tree("projection_memory")));
  s.forget_contacts();
  for (const auto& [name, member] : energy_terms()) s.energy.*member = energy_term(energy, name);
  s.steps = state.whole("steps");
  s.time = state.real("time");
  take_meshes(s, state.find("meshes"));
  if (const StoredValue* given = state.find("networks"); given && s.networks) take_networks(*s.networks, *given);
  if (liquid) take_fluid(*s.fluid, *liquid);
}

std::string fingerprint(const Scene& scene) {
  Blake2b digest(16);
  const auto take = [&](const auto& field, const std::vector<std::int32_t>& order) {
    if (!field.active) return;
    digest.update(std::string(field.name) + "|");
    for (const std::int32_t i : order) digest.update(field[i], std::size_t(field.components) * sizeof *field[i]);
  };
  const Bodies& b = scene.bodies;
  const Nodes& nodes = scene.nodes;
  const Contactors& c = scene.contactors;
  const auto &bodies = scene.insertion_order(), &contactors = scene.contactor_insertion_order();
  digest.update(std::to_string(scene.dim) + "|" + std::to_string(b.count) + "|" + std::to_string(c.count) + "|");
  take(b.mass, bodies);
  take(b.inertia, bodies);
  if (nodes.count > 0) take(nodes.mass, scene.node_insertion_order());
  take(c.radius, contactors);
  take(c.shape, contactors);
  for (const std::int32_t i : contactors) {
    const std::int64_t id = carrier_id(b, c, i);
    digest.update(&id, sizeof id);
  }
  return digest.hexdigest();
}

void write_checkpoint(Simulation& s, const std::string& scene, std::int64_t species, const std::string& path) {
  StoredValue content;
  content.add_text("kind", "checkpoint");
  content.add_whole("dim", s.scene.dim);
  content.add_text("core_scene", scene);
  content.add_whole("materials", species);
  content.add_whole("meshes", std::int64_t(s.meshes.meshes.size()));
  content.add_text("rest", rest_of(s));
  content.add("state", state_of(s));
  save_tree(path, content);
}

void restart(Simulation& s, const std::string& scene, std::int64_t species, const std::string& path) {
  const StoredValue content = load_tree(path, "a checkpoint", ".checkpoint.h5");
  const std::string remedy = "restart from an earlier checkpoint";
  const auto damaged = [&](const std::string& why) {
    return FileError(path, "the checkpoint is damaged: " + why, remedy);
  };
  StoredValue before;
  try {
    if (!content.find("kind") || content.text("kind") != "checkpoint")
      throw FileError(path, "this file holds no checkpoint", "give a file that was written as one");
    if (!content.find("core_scene") ||
        (content.text("core_scene") != scene && !is_older_state_of(content.tree("state"), s.scene)))
      throw FileError(path, "the checkpoint belongs to another scene", "build the simulation from the same scene");
    check_meshes(content, s, path);
    check_state(content.tree("state"), species, s);
    before = state_of(s);
  } catch (const std::invalid_argument& e) { throw damaged(e.what()); }
  try {
    take_state(s, content.tree("state"));
    s.follow_meshes();
  } catch (const std::exception& e) {
    take_state(s, before);
    throw damaged(e.what());
  }
}

} // namespace cairn
