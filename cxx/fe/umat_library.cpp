// UMATs of shared libraries.
#include <dlfcn.h>

#include "../base/call.hpp"
#include "umat.hpp"

namespace cairn {

void plug_umat(const std::string& library, const std::string& symbol, const std::string& name, int states,
               bool plane_stress, double time_limit) {
  Dl_info here{}; // makes the utility routines that UMATs call visible to the library opened next
  if (dladdr(reinterpret_cast<const void*>(&bulk_material_named), &here) && here.dli_fname)
    dlopen(here.dli_fname, RTLD_NOW | RTLD_GLOBAL | RTLD_NOLOAD);
  void* opened = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!opened) {
    const char* why = dlerror();
    throw Error(library + " cannot be loaded: " + (why ? why : "no reason given"));
  }
  void* found = nullptr;
  for (const std::string& spelling : {symbol, symbol + "_"})
    if (!found) found = dlsym(opened, spelling.c_str());
  if (!found) throw Error(library + " has no routine " + symbol + ": give the name that the library exports");
  register_umat(name, reinterpret_cast<UmatRoutine*>(found), states, library, plane_stress, time_limit);
}

} // namespace cairn
