// The C API of deformable bodies beyond matrices and cells: rigid parts, ties, pressures that follow, results of cells.
#include <algorithm>
#include <cmath>

#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

extern "C" {

int32_t cairn_mesh_set_rigid(cairn_mesh* mesh, int64_t n, const int32_t* node, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(node, "node");
    cairn::MeshDraft& d = mesh->draft;
    for (std::int64_t i = 0; i < counted(n); ++i) d.check_node(node[i]);
    if (n < d.dim)
      throw Error("a rigid part has " + std::to_string(n) + " nodes, which leave a spin free: give " +
                  (d.dim == 2 ? "two apart" : "three off a line"));
    d.ties.rigid_node.insert(d.ties.rigid_node.end(), node, node + n);
    d.ties.rigid_first.push_back(std::int64_t(d.ties.rigid_node.size()));
  });
}

int32_t cairn_mesh_tie_node(cairn_mesh* mesh, int32_t node, int64_t n, const int32_t* leader, const double* weight,
                            cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(leader, "leader");
    require(weight, "weight");
    cairn::MeshDraft& d = mesh->draft;
    d.check_node(node);
    for (std::int64_t i = 0; i < counted(n); ++i) d.check_node(leader[i]);
    check_finite("weight", weight, n);
    for (int k = 0; k < d.dim; ++k) {
      d.ties.dof.push_back(d.dim * node + k);
      for (std::int64_t i = 0; i < n; ++i) d.ties.master.push_back(d.dim * leader[i] + k);
      d.ties.weight.insert(d.ties.weight.end(), weight, weight + n);
      d.ties.first.push_back(std::int64_t(d.ties.master.size()));
    }
  });
}

int32_t cairn_mesh_set_contact(cairn_mesh* mesh, int32_t self_contact, int32_t mortar, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    mesh->draft.self_contact = self_contact != 0;
    mesh->draft.mortar = mortar != 0;
  });
}

int32_t cairn_simulation_press_mesh(cairn_simulation* simulation, int32_t mesh, int32_t nodes, int64_t n,
                                    const int32_t* node, int32_t* set, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_press_mesh");
    require(node, "node");
    cairn::MeshBody& m = mesh_of(*simulation, mesh);
    const int dim = m.model.dim;
    if (m.linear())
      throw Error("the mesh '" + m.model.name +
                  "' is linear: give the forces of a pressure to cairn_simulation_load_mesh, or cells of a material");
    if (nodes != dim && nodes != dim + 1 && !(dim == 3 && (nodes == 6 || nodes == 8 || nodes == 9)))
      throw Error("nodes of a side is " + std::to_string(nodes) + "; give " +
                  (dim == 2 ? "2 or 3" : "3, 4, 6, 8 or 9"));
    for (std::int64_t i = 0; i < nodes * counted(n); ++i)
      if (node[i] < 0 || node[i] >= m.model.nodes())
        throw Error("node[" + std::to_string(i) + "] is " + std::to_string(node[i]) + "; the mesh has " +
                    std::to_string(m.model.nodes()) + " nodes, counted from 0");
    cairn::PressedSides sides;
    sides.nodes = nodes;
    sides.node.assign(node, node + nodes * n);
    sides.ring = m.model.ring;
    sides.thickness = m.model.thickness;
    sides.axis = -simulation->simulation.scene.origin[0];
    if (set) *set = std::int32_t(m.loads.pressed.size());
    m.loads.pressed.push_back(std::move(sides));
  });
}

int32_t cairn_simulation_set_pressure(cairn_simulation* simulation, int32_t mesh, int32_t set, double begin, double end,
                                      cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_set_pressure", true);
    cairn::MeshBody& m = mesh_of(*simulation, mesh);
    if (set < 0 || std::size_t(set) >= m.loads.pressed.size())
      throw Error("there is no set " + std::to_string(set) + " of pressed sides; there are " +
                  std::to_string(m.loads.pressed.size()) + ", counted from 0");
    for (const double p : {begin, end})
      if (!std::isfinite(p)) throw Error("the pressure is " + std::to_string(p) + "; give a finite number [Pa]");
    m.loads.pressed[std::size_t(set)].begin = begin;
    m.loads.pressed[std::size_t(set)].end = end;
  });
}

int32_t cairn_simulation_mesh_cells(cairn_simulation* simulation, int32_t mesh, const char* name, int64_t capacity,
                                    double* values, int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    const cairn::MeshBody& m = mesh_of(*simulation, mesh);
    const cairn::BulkModel* solid = m.linear() ? nullptr : m.model.bulk->solid();
    if (!solid)
      throw Error("the mesh '" + m.model.name + "' has no cells of a material of solids, whose stresses are known");
    const std::string field = name;
    const bool stress = field == "stress";
    std::string known = "stress";
    std::int64_t cells = 0;
    bool found = stress;
    for (const cairn::BulkCells& c : solid->cells()) {
      cells += c.count();
      for (const std::string& state : c.material->state) {
        found = found || state == field;
        known += ", " + state;
      }
    }
    if (!found) throw Error("the cells have no field '" + field + "'; they have " + known);
    const std::int64_t numbers = (stress ? 6 : 1) * cells;
    if (count) *count = numbers;
    if (numbers > capacity) return;
    require(values, "values");
    std::vector<double> states;
    for (std::size_t b = 0; b < solid->cells().size(); ++b) {
      const cairn::BulkCells& c = solid->cells()[b];
      if (stress) {
        solid->cell_stress(b, values);
        values += 6 * c.count();
        continue;
      }
      const auto& names = c.material->state;
      const auto at = std::find(names.begin(), names.end(), field) - names.begin();
      states.resize(names.size() * std::size_t(c.count()));
      solid->cell_state(b, states.data());
      for (std::int64_t cell = 0; cell < c.count(); ++cell)
        *values++ = std::size_t(at) < names.size() ? states[std::size_t(cell) * names.size() + std::size_t(at)] : 0;
    }
  });
}

} // extern "C"
