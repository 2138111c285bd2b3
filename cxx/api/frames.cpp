// The C API of bars and beams.
#include "../scene/frames.hpp"
#include "objects.hpp"

using namespace cairn::api;

namespace {

void require_sections(const cairn_mesh* mesh, const std::int32_t* node, const cairn::Sections& s) {
  require(mesh, "mesh");
  require(node, "node");
  require(s.young, "young");
  require(s.area, "area");
  require(s.density, "density");
}

} // namespace

extern "C" {

int32_t cairn_mesh_set_bars(cairn_mesh* mesh, int64_t n, const int32_t* node, const double* young, const double* area,
                            const double* density, const double* initial_stress, cairn_error* error) {
  return guarded(error, [&] {
    const cairn::Sections sections{young, area, density, initial_stress};
    require_sections(mesh, node, sections);
    cairn::take_bars(mesh->draft, counted(n), node, sections);
  });
}

int32_t cairn_mesh_set_beams(cairn_mesh* mesh, int64_t n, const int32_t* node, const double* young, const double* area,
                             const double* density, const double* initial_stress, const double* inertia,
                             const double* shear_area, const double* torsion, double poisson, const double* up,
                             int64_t clamped, const int32_t* clamped_node, cairn_error* error) {
  return guarded(error, [&] {
    const cairn::Sections sections{young, area, density, initial_stress};
    require_sections(mesh, node, sections);
    require(inertia, "inertia");
    if (counted(clamped) > 0) require(clamped_node, "clamped_node");
    cairn::Beams beams{inertia, shear_area, torsion, poisson, {0, 0, 1}, span_of(clamped_node, clamped)};
    if (up) std::copy_n(up, 3, beams.up);
    cairn::take_beams(mesh->draft, counted(n), node, sections, beams);
  });
}

int32_t cairn_mesh_set_kinematics(cairn_mesh* mesh, const char* kinematics, cairn_error* error) {
  return guarded(error, [&] {
    require(mesh, "mesh");
    require(kinematics, "kinematics");
    cairn::take_kinematics(mesh->draft, kinematics);
  });
}

} // extern "C"
