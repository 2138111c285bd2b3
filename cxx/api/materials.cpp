// The C API of materials of the program's own, as Abaqus calls them.
#include "../fe/umat.hpp"
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

extern "C" {

int32_t cairn_plug_material(const char* library, const char* material, const char* routine, int32_t state,
                            cairn_error* error) {
  return guarded(error, [&] {
    require(library, "library");
    require(material, "material");
    cairn::plug_umat(library, routine && *routine ? routine : "umat", material, state);
  });
}

int32_t cairn_give_material(const char* material, cairn_umat* routine, int32_t state, cairn_error* error) {
  return guarded(error, [&] {
    require(material, "material");
    if (!routine) throw Error("routine is NULL; give a subroutine UMAT, in Fortran c_funloc(umat)");
    cairn::register_umat(material, reinterpret_cast<cairn::UmatRoutine*>(routine), state, "the program");
  });
}

} // extern "C"
