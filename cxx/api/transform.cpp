// The C API of rigid bodies made deformable in a run, and back.
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

extern "C" {

int32_t cairn_simulation_deform(cairn_simulation* simulation, int64_t body, const cairn_mesh* mesh, const char* name,
                                int32_t material, int32_t side_material, int32_t* number, cairn_error* error) {
  return guarded(error, [&] {
    cairn_simulation& s = between_steps(simulation, "cairn_simulation_deform");
    require(mesh, "mesh");
    for (const auto& [what, given] : {std::pair{"material", material}, std::pair{"side_material", side_material}})
      if (given < -1 || given >= std::int64_t(s.matter.materials.size()))
        throw Error(std::string(what) + " is " + std::to_string(given) + "; there are " +
                    std::to_string(s.matter.materials.size()) + ", counted from 0, and -1 is that of the body");
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

} // extern "C"
