// The C API of held nodes of deformable bodies that move as functions of time.
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

namespace {

cairn::HeldMotion motion_of(const cairn::MeshBody& m, std::int64_t n, const std::int32_t* node, char axis) {
  const int dim = m.model.dim, k = axis - 'x';
  if (k < 0 || k >= dim)
    throw Error("axis is " + (axis > ' ' ? "'" + std::string(1, axis) + "'" : std::to_string(int(axis))) +
                "; give 'x'" + (dim == 2 ? " or 'y'" : ", 'y' or 'z'"));
  cairn::HeldMotion motion;
  for (std::int64_t i = 0; i < counted(n); ++i) {
    if (node[i] < 0 || node[i] >= m.model.nodes())
      throw Error("node[" + std::to_string(i) + "] is " + std::to_string(node[i]) + "; the mesh has " +
                  std::to_string(m.model.nodes()) + " nodes, counted from 0");
    motion.dof.push_back(std::int32_t(dim * node[i] + k));
  }
  return motion;
}

int32_t by_table(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node, char axis, int64_t rows,
                 const double* time, const double* value, bool displaces, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, displaces ? "cairn_simulation_displace_nodes" : "cairn_simulation_drive_nodes");
    require(node, "node");
    require(time, "time");
    require(value, displaces ? "displacement" : "velocity");
    const cairn::MeshBody& m = mesh_of(*simulation, mesh);
    cairn::HeldMotion motion = motion_of(m, n, node, axis);
    motion.displaces = displaces;
    if (rows < 0) throw Error("rows is " + std::to_string(rows) + "; a table has at least one row");
    motion.value = cairn::table_of(span_of(time, rows), span_of(value, rows));
    cairn::hold_by(simulation->simulation, m, std::move(motion));
  });
}

int32_t by_function(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node, char axis,
                    double (*function)(double time, void* context), void* context, bool displaces, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, displaces ? "cairn_simulation_displace_nodes_by" : "cairn_simulation_drive_nodes_by");
    require(node, "node");
    if (!function) throw Error("function is NULL; it has no default");
    const cairn::MeshBody& m = mesh_of(*simulation, mesh);
    cairn::HeldMotion motion = motion_of(m, n, node, axis);
    motion.displaces = displaces;
    motion.value = [=](double t) { return function(t, context); };
    cairn::hold_by(simulation->simulation, m, std::move(motion));
  });
}

} // namespace

extern "C" {

int32_t cairn_simulation_displace_nodes(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node,
                                        char axis, int64_t rows, const double* time, const double* displacement,
                                        cairn_error* error) {
  return by_table(simulation, mesh, n, node, axis, rows, time, displacement, true, error);
}

int32_t cairn_simulation_displace_nodes_by(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node,
                                           char axis, double (*displacement)(double time, void* context), void* context,
                                           cairn_error* error) {
  return by_function(simulation, mesh, n, node, axis, displacement, context, true, error);
}

int32_t cairn_simulation_drive_nodes(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node,
                                     char axis, int64_t rows, const double* time, const double* velocity,
                                     cairn_error* error) {
  return by_table(simulation, mesh, n, node, axis, rows, time, velocity, false, error);
}

int32_t cairn_simulation_drive_nodes_by(cairn_simulation* simulation, int32_t mesh, int64_t n, const int32_t* node,
                                        char axis, double (*velocity)(double time, void* context), void* context,
                                        cairn_error* error) {
  return by_function(simulation, mesh, n, node, axis, velocity, context, false, error);
}

} // extern "C"
