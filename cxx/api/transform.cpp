// The C API of rigid bodies made deformable in a run, and back.
#include <cmath>

#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

namespace {

void check_own_materials(const cairn_simulation& s, std::int32_t material, std::int32_t side_material) {
  for (const auto& [what, given] : {std::pair{"material", material}, std::pair{"side_material", side_material}})
    if (given < -1 || given >= std::int64_t(s.matter.materials.size()))
      throw Error(std::string(what) + " is " + std::to_string(given) + "; there are " +
                  std::to_string(s.matter.materials.size()) + ", counted from 0, and -1 is that of the body");
}

} // namespace

extern "C" {

int32_t cairn_simulation_deform(cairn_simulation* simulation, int64_t body, const cairn_mesh* mesh, const char* name,
                                int32_t material, int32_t side_material, int32_t* number, cairn_error* error) {
  return guarded(error, [&] {
    cairn_simulation& s = between_steps(simulation, "cairn_simulation_deform");
    require(mesh, "mesh");
    check_own_materials(s, material, side_material);
    const AtWork work(s, cairn_simulation::step); // which other bodies of the program are asked about
    const std::string named = name && *name ? name : "body " + std::to_string(body);
    const std::size_t made = s.transforms.deform(s.simulation, body, mesh->draft, named, material, side_material);
    if (number) *number = int32_t(made);
  });
}

int32_t cairn_simulation_rigidify(cairn_simulation* simulation, int32_t mesh, int64_t* body, cairn_error* error) {
  return guarded(error, [&] {
    cairn_simulation& s = between_steps(simulation, "cairn_simulation_rigidify");
    (void)mesh_of(s, mesh);
    const AtWork work(s, cairn_simulation::step);
    const std::int64_t id = s.transforms.rigidify(s.simulation, std::size_t(mesh));
    if (body) *body = id;
  });
}

int32_t cairn_simulation_rigidify_as(cairn_simulation* simulation, int32_t mesh, const double* rotation, double mass,
                                     const double* inertia, const char* shape, int64_t n, const int32_t* material,
                                     const double* radius, const double* offset, const double* direction,
                                     const int32_t* hull, int64_t* body, cairn_error* error) {
  return guarded(error, [&] {
    cairn_simulation& s = between_steps(simulation, "cairn_simulation_rigidify_as");
    (void)mesh_of(s, mesh);
    require(inertia, "inertia");
    require(shape, "shape");
    require(material, "material");
    check_materials(n, material, s.matter.materials.size());
    const int dim = s.simulation.scene.dim;
    cairn::OtherShape other;
    other.mass = mass;
    other.inertia.assign(inertia, inertia + (dim == 2 ? 1 : 3));
    if (rotation) {
      double turned[4] = {rotation[0], 0, 0, 0}, size = 1;
      check_finite("rotation", rotation, dim == 2 ? 1 : 4);
      if (dim == 3) size = std::hypot(std::hypot(rotation[0], rotation[1]), std::hypot(rotation[2], rotation[3]));
      if (!(size > 0)) throw Error("rotation is nought; give a quaternion w x y z");
      for (int k = 0; k < (dim == 2 ? 1 : 4); ++k) turned[k] = rotation[k] / size;
      other.axes = cairn::rotation_of(dim, turned);
    }
    other.add_contactors = [&](cairn::Scene& scene, std::int64_t id) {
      const std::vector<std::int64_t> owner(std::size_t(n), id);
      add_contactors(scene, shape, n, owner.data(), material, radius, offset, direction, hull);
    };
    const AtWork work(s, cairn_simulation::step);
    const std::int64_t id = s.transforms.rigidify(s.simulation, std::size_t(mesh), &other);
    if (body) *body = id;
  });
}

int32_t cairn_simulation_reshape_when(cairn_simulation* simulation, int64_t n, const int64_t* bodies,
                                      const cairn_mesh* mesh, double force, double stress, double back,
                                      int32_t material, int32_t side_material, cairn_error* error) {
  return guarded(error, [&] {
    cairn_simulation& s = between_steps(simulation, "cairn_simulation_reshape_when");
    require(bodies, "bodies");
    require(mesh, "mesh");
    check_own_materials(s, material, side_material);
    cairn::ReshapeWatch watch{{bodies, bodies + counted(n)}, mesh->draft, material, side_material, force, stress, back};
    const AtWork work(s, cairn_simulation::step);
    s.watches.add(s.simulation, s.transforms, std::move(watch));
  });
}

int32_t cairn_simulation_mesh_of_body(const cairn_simulation* simulation, int64_t body, int32_t* mesh,
                                      cairn_error* error) {
  return guarded(error, [&] {
    require(simulation, "simulation");
    require(mesh, "mesh");
    const std::int64_t found = cairn::mesh_of_body(simulation->simulation, simulation->transforms, body);
    if (found < 0) (void)simulation->simulation.scene.internal(body); // refuses one that is not there
    *mesh = std::int32_t(found);
  });
}

} // extern "C"
