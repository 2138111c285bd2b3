// The C API of materials of the program's own, as Abaqus calls them.
#include "../fe/umat.hpp"
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

static int32_t plug(const char* library, const char* material, const char* routine, int32_t state, bool plane_stress,
                    cairn_error* error) {
  return guarded(error, [&] {
    require(library, "library");
    require(material, "material");
    cairn::plug_umat(library, routine && *routine ? routine : "umat", material, state, plane_stress);
  });
}

static int32_t give(const char* material, cairn_umat* routine, int32_t state, bool plane_stress, cairn_error* error) {
  return guarded(error, [&] {
    require(material, "material");
    if (!routine) throw Error("routine is NULL; give a subroutine UMAT, in Fortran c_funloc(umat)");
    cairn::register_umat(material, reinterpret_cast<cairn::UmatRoutine*>(routine), state, "the program", plane_stress);
  });
}

extern "C" {

int32_t cairn_plug_material(const char* library, const char* material, const char* routine, int32_t state,
                            cairn_error* error) {
  return plug(library, material, routine, state, false, error);
}

int32_t cairn_plug_plane_stress_material(const char* library, const char* material, const char* routine, int32_t state,
                                         cairn_error* error) {
  return plug(library, material, routine, state, true, error);
}

int32_t cairn_give_material(const char* material, cairn_umat* routine, int32_t state, cairn_error* error) {
  return give(material, routine, state, false, error);
}

int32_t cairn_give_plane_stress_material(const char* material, cairn_umat* routine, int32_t state, cairn_error* error) {
  return give(material, routine, state, true, error);
}

} // extern "C"
