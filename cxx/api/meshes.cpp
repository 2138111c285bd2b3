// The C API of deformable bodies (cairn/cairn.h): their matrices or elements, their contact surface, loads, results.
#include <algorithm>
#include <cmath>

#include "../plugs/plug.hpp"
#include "../scene/tied_sides.hpp"
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

namespace {

// The pattern of a lower triangle: every column begins with its diagonal, rows rise.
void check_pattern(std::int64_t n, const std::int64_t* start, const std::int32_t* row) {
  if (start[0] != 0) throw Error("start[0] is " + std::to_string(start[0]) + "; columns count from 0");
  for (std::int64_t c = 0; c < n; ++c) {
    if (start[c + 1] <= start[c] || row[start[c]] != c)
      throw Error("column " + std::to_string(c) +
                  " does not begin with its diagonal: give the lower triangle by "
                  "columns, the diagonal first");
    for (std::int64_t e = start[c] + 1; e < start[c + 1]; ++e)
      if (row[e] <= row[e - 1] || row[e] >= n)
        throw Error("row[" + std::to_string(e) + "] is " + std::to_string(row[e]) + " in column " + std::to_string(c) +
                    "; rows rise in a column and are below " + std::to_string(n));
  }
}

// Nodes (width, n) as (4, n): behind the last, -1.
std::vector<std::int32_t> widened(const cairn::MeshDraft& d, std::int64_t n, int width, int least,
                                  const std::int32_t* node) {
  std::vector<std::int32_t> out(std::size_t(4 * n), -1);
  for (std::int64_t i = 0; i < n; ++i)
    for (int k = 0; k < width; ++k) {
      const std::int32_t number = node[width * i + k];
      if (number >= 0 || k < least) d.check_node(number);
      if (number >= 0 && k > 0 && out[std::size_t(4 * i + k - 1)] < 0)
        throw Error("node[" + std::to_string(width * i + k) + "] stands behind a -1; -1 comes last");
      out[std::size_t(4 * i + k)] = number < 0 ? -1 : number;
    }
  return out;
}

// The pattern of a tangent, by the mesh that is to have it.
cairn::SparseMatrix tangent_of(const cairn::MeshDraft& d, const std::int64_t* start, const std::int32_t* row,
                               const double* mass, const double* node_mass) {
  require(start, "start");
  require(row, "row");
  if (!d.cells.empty() || d.mass.n > 0)
    throw Error("the mesh has cells or matrices: give these, or a code that finds its forces");
  if (!mass == !node_mass) throw Error("mass and node_mass are both given, or both NULL: give one of them");
  cairn::SparseMatrix p;
  p.n = std::int64_t(d.reference.size());
  if (start[p.n] < 0) throw Error("start[" + std::to_string(p.n) + "] is " + std::to_string(start[p.n]));
  p.start.assign(start, start + p.n + 1);
  p.row.assign(row, row + start[p.n]);
  if (mass) check_finite("mass", mass, start[p.n]);
  if (node_mass) check_finite("node_mass", node_mass, d.nodes());
  for (std::int64_t i = 0; i < d.nodes() && node_mass; ++i)
    if (!(node_mass[i] > 0))
      throw Error("node_mass[" + std::to_string(i) + "] is " + std::to_string(node_mass[i]) + "; give a mass > 0 [kg]");
  return p;
}

} // namespace

cairn::MeshBody& cairn::api::mesh_of(cairn_simulation& s, std::int32_t mesh) {
  auto& meshes = s.simulation.meshes.meshes;
  if (mesh < 0 || std::size_t(mesh) >= meshes.size())
    throw Error("there is no mesh " + std::to_string(mesh) + "; there are " + std::to_string(meshes.size()) +
                ", counted from 0");
  return meshes[std::size_t(mesh)];
}

extern "C" {

int32_t cairn_mesh_create(int32_t dim, int64_t nodes, const double* position, cairn_mesh** mesh, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(position, "position");
    if (dim != 2 && dim != 3) throw Error("dim is " + std::to_string(dim) + "; it must be 2 or 3");
    if (nodes < 1 || nodes > std::numeric_limits<std::int32_t>::max() / 8)
      throw Error("nodes is " + std::to_string(nodes) + "; give at least one, and fewer than 2^28");
    check_finite("position", position, dim * nodes);
    auto made = std::unique_ptr<cairn_mesh>(new cairn_mesh);
    made->draft.dim = dim;
    made->draft.reference.assign(position, position + dim * nodes);
    made->draft.held.assign(std::size_t(dim * nodes), 0);
    *mesh = made.release();
  });
}

void cairn_mesh_destroy(cairn_mesh* mesh) { delete mesh; }

int32_t cairn_mesh_add_elastic_cells(cairn_mesh* mesh, const char* element, int64_t n, const int32_t* node,
                                     double young, double poisson, double density, int32_t plane_stress,
                                     double thickness, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(element, "element");
    require(node, "node");
    if (mesh->draft.mass.n > 0) throw Error("the mesh has matrices of its own: give cells or matrices");
    mesh->draft.add_elastic(element, counted(n), node, young, poisson, density, plane_stress != 0, thickness);
  });
}

int32_t cairn_mesh_add_solid_cells(cairn_mesh* mesh, const char* element, int64_t n, const int32_t* node,
                                   const char* material, int32_t count, const char* const* names, const double* values,
                                   double density, const char* kinematics, const char* plane, int32_t mean_dilatation,
                                   double thickness, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(element, "element");
    require(node, "node");
    require(material, "material");
    require(kinematics, "kinematics");
    require(plane, "plane");
    std::vector<std::string> given;
    for (int32_t k = 0; k < count; ++k) {
      require(values, "values");
      if (!names && cairn::bulk_material_named(material).umat) { // it has PROPS by their places
        given.push_back("props" + std::to_string(k + 1));
        continue;
      }
      require(names, "names");
      require(names[k], "names");
      given.emplace_back(names[k]);
    }
    if (mesh->draft.mass.n > 0) throw Error("the mesh has matrices of its own: give cells or matrices");
    const auto cells = mesh->draft.cells.size();
    try {
      mesh->draft.add_solid(element, counted(n), node, material, given, {values, given.size()}, density, kinematics,
                            plane, mean_dilatation != 0, thickness);
      mesh->draft.bulk(); // throws Error if the cells contradict each other
    } catch (...) {
      mesh->draft.cells.resize(cells);
      throw;
    }
  });
}

int32_t cairn_mesh_stress_points(const cairn_mesh* mesh, int64_t capacity, double* position, int64_t* count,
                                 cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    const std::vector<double> places = mesh->draft.stress_points();
    if (count) *count = std::int64_t(places.size());
    if (places.empty() || std::int64_t(places.size()) > capacity) return;
    require(position, "position");
    std::copy(places.begin(), places.end(), position);
  });
}

int32_t cairn_mesh_set_initial_stress(cairn_mesh* mesh, int64_t n, const double* stress, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(stress, "stress");
    check_finite("stress", stress, 6 * counted(n));
    cairn::MeshDraft& d = mesh->draft;
    const auto before = d.cells;
    try {
      d.set_initial_stress(n, stress);
      std::vector<double> force;
      if (!d.bulk()) d.initial_force(force); // throws Error if the material cannot have this stress
    } catch (...) {
      d.cells = before;
      throw;
    }
  });
}

int32_t cairn_mesh_set_damping(cairn_mesh* mesh, double by_mass, double by_stiffness, int32_t lumped,
                               cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    for (const double a : {by_mass, by_stiffness})
      if (!(a >= 0) || !std::isfinite(a)) throw Error("damping is " + std::to_string(a) + "; give finite numbers >= 0");
    mesh->draft.by_mass = by_mass;
    mesh->draft.by_stiffness = by_stiffness;
    mesh->draft.lumped = lumped != 0;
  });
}

int32_t cairn_mesh_set_matrices(cairn_mesh* mesh, const int64_t* start, const int32_t* row, const double* mass,
                                const double* stiffness, const double* damping, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(start, "start");
    require(row, "row");
    require(mass, "mass");
    require(stiffness, "stiffness");
    cairn::MeshDraft& d = mesh->draft;
    if (!d.cells.empty()) throw Error("the mesh has cells: give cells or matrices");
    if (d.called) throw Error("the mesh has the forces of a code: give these or matrices");
    if (d.frame) throw Error("the mesh has bars or beams: give these or matrices");
    const std::int64_t n = std::int64_t(d.reference.size());
    check_pattern(n, start, row);
    const std::pair<const char*, const double*> given[] = {
        {"mass", mass}, {"stiffness", stiffness}, {"damping", damping}};
    for (const auto& [name, values] : given)
      if (values) check_finite(name, values, start[n]);
    cairn::SparseMatrix pattern;
    pattern.n = n;
    pattern.start.assign(start, start + n + 1);
    pattern.row.assign(row, row + start[n]);
    pattern.value.assign(std::size_t(start[n]), 0.0);
    d.mass = d.stiffness = d.damping = std::move(pattern);
    d.mass.value.assign(mass, mass + start[n]);
    d.stiffness.value.assign(stiffness, stiffness + start[n]);
    if (damping) d.damping.value.assign(damping, damping + start[n]);
  });
}

int32_t cairn_mesh_set_calls(cairn_mesh* mesh, const int64_t* start, const int32_t* row, const double* mass,
                             const double* node_mass, const cairn_body_calls* calls, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(calls, "calls");
    cairn::MeshDraft& d = mesh->draft;
    d.take_called(cairn::CalledForces::make("the calls", d.dim, tangent_of(d, start, row, mass, node_mass), *calls),
                  mass, node_mass);
  });
}

int32_t cairn_mesh_plug_body(cairn_mesh* mesh, const char* library, const char* body, int32_t count,
                             const double* params, const int64_t* start, const int32_t* row, const double* mass,
                             const double* node_mass, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(library, "library");
    require(body, "body");
    if (counted(count) > 0) require(params, "params");
    cairn::MeshDraft& d = mesh->draft;
    const auto routine = cairn::open_routine(library, body, cairn_plug_body);
    d.take_called(cairn::plug_body(routine, {params, params + count}, d.dim, d.reference,
                                   tangent_of(d, start, row, mass, node_mass)),
                  mass, node_mass);
  });
}

int32_t cairn_mesh_touch_nodes(cairn_mesh* mesh, int64_t n, const int32_t* node, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(node, "node");
    for (std::int64_t i = 0; i < counted(n); ++i) mesh->draft.check_node(node[i]);
    mesh->draft.contact_nodes.insert(mesh->draft.contact_nodes.end(), node, node + n);
  });
}

int32_t cairn_mesh_touch_points(cairn_mesh* mesh, int64_t n, const int32_t* node, const double* weight,
                                cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(node, "node");
    require(weight, "weight");
    cairn::MeshDraft& d = mesh->draft;
    const auto nodes = widened(d, counted(n), 4, 1, node);
    check_finite("weight", weight, 4 * n);
    d.point_nodes.insert(d.point_nodes.end(), nodes.begin(), nodes.end());
    d.point_weights.insert(d.point_weights.end(), weight, weight + 4 * n);
  });
}

int32_t cairn_mesh_touch_sides(cairn_mesh* mesh, int64_t n, const int32_t* node, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(node, "node");
    cairn::MeshDraft& d = mesh->draft;
    const auto nodes = widened(d, counted(n), d.dim == 2 ? 2 : 4, d.dim, node);
    d.side_nodes.insert(d.side_nodes.end(), nodes.begin(), nodes.end());
  });
}

int32_t cairn_mesh_set_sides(cairn_mesh* mesh, int64_t n, const int32_t* node, const char* plane, double thickness,
                             cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(node, "node");
    require(plane, "plane");
    cairn::MeshDraft& d = mesh->draft;
    d.take_sides(widened(d, counted(n), d.dim == 2 ? 2 : 4, d.dim, node), plane, thickness);
  });
}

int32_t cairn_mesh_tie_sides(cairn_mesh* mesh, int64_t followers, const int32_t* follow, int64_t leaders,
                             const int32_t* lead, double within, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(follow, "follow");
    require(lead, "lead");
    cairn::MeshDraft& d = mesh->draft;
    const int width = d.dim == 2 ? 2 : 4;
    const auto own = widened(d, counted(followers), width, d.dim, follow);
    cairn::tie_sides(d, own, widened(d, counted(leaders), width, d.dim, lead), within);
  });
}

int32_t cairn_mesh_boundary(const cairn_mesh* mesh, int64_t capacity, int32_t* node, int64_t* count,
                            cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    const std::vector<std::int32_t> sides = mesh->draft.boundary();
    const int width = mesh->draft.dim == 2 ? 2 : 4;
    const std::int64_t n = std::int64_t(sides.size()) / 4;
    if (count) *count = n * width;
    if (n == 0 || n * width > capacity) return;
    require(node, "node");
    for (std::int64_t i = 0; i < n; ++i) std::copy_n(&sides[std::size_t(4 * i)], width, node + width * i);
  });
}

int32_t cairn_mesh_hold(cairn_mesh* mesh, int64_t n, const int32_t* node, uint8_t mask, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(node, "node");
    cairn::MeshDraft& d = mesh->draft;
    if (mask >> d.dim) throw Error("the mask of held dofs names more than " + std::to_string(d.dim) + " axes");
    for (std::int64_t i = 0; i < counted(n); ++i) d.check_node(node[i]);
    for (std::int64_t i = 0; i < n; ++i)
      for (int k = 0; k < d.dim; ++k)
        if (mask >> k & 1) d.held[std::size_t(d.dim * node[i] + k)] = 1;
  });
}

int32_t cairn_mesh_set_motion(cairn_mesh* mesh, const double* displacement, const double* velocity,
                              cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    cairn::MeshDraft& d = mesh->draft;
    const std::int64_t n = std::int64_t(d.reference.size());
    if (displacement) check_finite("displacement", displacement, n);
    if (velocity) check_speed("velocity", velocity, n);
    d.displacement.assign(displacement, displacement + (displacement ? n : 0));
    d.velocity.assign(velocity, velocity + (velocity ? n : 0));
  });
}

int32_t cairn_element_matrices(const char* element, int64_t n, const double* position, double density,
                               const double* elasticity, double* stiffness, double* mass, cairn_error* error) {
  return guarded(error, [&] {
    require(element, "element");
    require(position, "position");
    require(elasticity, "elasticity");
    require(stiffness, "stiffness");
    require(mass, "mass");
    const cairn::ElementInfo& e = cairn::element_named(element);
    const cairn::ElementShape shape(e);
    std::vector<std::int32_t> wrong(std::size_t(counted(n)), 0);
    cairn_elastic_matrices(e.dim, e.nodes, e.points, shape.value.data(), shape.gradient.data(), shape.weight.data(), n,
                           position, density, elasticity, stiffness, mass, wrong.data());
    for (std::int64_t i = 0; i < n; ++i)
      if (wrong[std::size_t(i)])
        throw Error(std::string(e.name) + " cell " + std::to_string(i) +
                    " is flat or inside out: turn its nodes the other way round");
  });
}

int32_t cairn_simulation_load_mesh(cairn_simulation* simulation, int32_t mesh, const double* begin, const double* end,
                                   const double* held_velocity, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_load_mesh", true);
    cairn::MeshBody& m = mesh_of(*simulation, mesh);
    if (!end) end = begin;
    if (!begin) begin = end;
    const std::int64_t n = m.model.dofs();
    const std::pair<const char*, const double*> given[] = {
        {"begin", begin}, {"end", end}, {"held_velocity", held_velocity}};
    for (const auto& [name, values] : given)
      if (values) check_finite(name, values, n);
    m.loads.begin.assign(begin, begin + (begin ? n : 0));
    m.loads.end.assign(end, end + (end ? n : 0));
    m.loads.held_velocity.assign(held_velocity, held_velocity + (held_velocity ? n : 0));
    simulation->transforms.has_loads(m);
  });
}

int32_t cairn_simulation_mesh_field(cairn_simulation* simulation, int32_t mesh, const char* name, int64_t capacity,
                                    double* values, int64_t* count, cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(name, "name");
    cairn::Simulation& s = simulation->simulation;
    const cairn::MeshBody& m = mesh_of(*simulation, mesh);
    const std::string field = name;
    const bool of_step = field == "reaction" || field == "impulse";
    if (field != "displacement" && field != "velocity" && field != "position" && !of_step)
      throw Error("a mesh has no field '" + field + "'; it has position, displacement, velocity, reaction, impulse");
    const std::int64_t n = m.model.dofs();
    if (count) *count = n;
    if (n > capacity) return;
    require(values, "values");
    for (std::int64_t i = 0; i < n && of_step; ++i)
      values[i] = field == "impulse" ? m.impulse[std::size_t(i)]
                                     : (m.model.held[std::size_t(i)] ? m.reaction[std::size_t(i)] : 0.0);
    if (of_step) return;
    const int dim = m.model.dim;
    s.place_meshes();
    for (std::int64_t i = 0; i < n; ++i) {
      const double x = s.scene.nodes.position[m.first_node()][i], v = s.scene.nodes.velocity[m.first_node()][i];
      values[i] = field == "velocity"   ? v
                  : field == "position" ? x + s.scene.origin[std::size_t(i % dim)]
                                        : x - m.model.reference[std::size_t(i)];
    }
  });
}

} // extern "C"
