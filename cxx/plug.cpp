#include "plug.hpp"

#include <dlfcn.h>

#include <cstring>
#include <stdexcept>

#include "cairn/plug.h"

namespace cairn {

namespace {

[[noreturn]] void refuse(const std::string& library, const std::string& text) {
  throw std::invalid_argument(library + ": " + text);
}

// A library of a later header may write more than this one knows.
union Descriptor {
  cairn_plug_descriptor known;
  char room[16384];
};

void expect(const std::string& library, const char* what, int have, int want) {
  if (have != want)
    refuse(library, std::string(what) + " is " + std::to_string(have) + ", this Cairn has " + std::to_string(want) +
                        ": compile the library with the cairn_plug.f90 or cairn/plug.h of this Cairn");
}

std::string text_of(const std::string& library, const char* what, const char* text, std::size_t room) {
  if (!std::memchr(text, '\0', room))
    refuse(library, std::string(what) + " has no end: shorten it, and end it with a null");
  return text;
}

void check(const std::string& library, const std::string& name, const cairn_plug_descriptor& d) {
  expect(library, "ABI version of the descriptor", d.abi, CAIRN_PLUG_ABI);
  expect(library, "size of the descriptor", d.size, sizeof(cairn_plug_descriptor));
  expect(library, "size of cairn_law_context", d.context_size, sizeof(cairn_law_context));
  if (d.kind != cairn_plug_law)
    refuse(library, name + " is of kind " + std::to_string(d.kind) + ", not a contact law (" +
                        std::to_string(cairn_plug_law) + ")");
  if (text_of(library, "name", d.name, sizeof d.name) != name)
    refuse(library, "cairn_describe_" + name + " describes '" + d.name + "': its name must be " + name);
  const auto one_of = [&](const char* what, int have, int few, int many) {
    if (have != 0 && have != few && have != many)
      refuse(library, name + ": " + what + " is " + std::to_string(have) + ", must be " + std::to_string(few) + ", " +
                          std::to_string(many) + " (with rotations) or 0 (not in this dimension)");
  };
  one_of("components2", d.components2, 2, 3);
  one_of("components3", d.components3, 3, 6);
  if (d.components2 == 0 && d.components3 == 0) refuse(library, name + " has no components in 2D nor in 3D");
  if (!d.prepare) refuse(library, name + " has no prepare: every law needs one, for bias and friction");
  if (d.normal_bias && (d.solve || d.components2 == 3 || d.components3 == 6))
    refuse(library, name + " says normal_bias, which a law with its own solve or with rotations cannot");
  if (!d.solve && (d.components2 == 3 || d.components3 == 6))
    refuse(library, name + " has rotations among its components and no solve: the cone knows none");
}

} // namespace

Law plug_law(const std::string& library, const std::string& name, const PlugOptions& options) {
  void* handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    const char* why = dlerror();
    refuse(library, std::string("cannot be loaded as a library: ") + (why ? why : "no reason given"));
  }
  const std::string symbol = "cairn_describe_" + name;
  auto* describe = reinterpret_cast<cairn_plug_describe*>(dlsym(handle, symbol.c_str()));
  if (!describe) {
    dlclose(handle);
    refuse(library, "has no " + symbol + ": the library must export a descriptor under that name (Fortran: bind(c))");
  }
  Descriptor filled{};
  describe(&filled.known);
  const cairn_plug_descriptor& d = filled.known;
  check(library, name, d);
  LawInfo law;
  law.name = law.python_name = name;
  law.library = library;
  law.components2 = d.components2;
  law.components3 = d.components3;
  const std::string parameters = text_of(library, "parameters", d.parameters, sizeof d.parameters);
  const std::string state = text_of(library, "state", d.state, sizeof d.state);
  try {
    declare_law(law, parameters, state);
  } catch (const std::invalid_argument& wrong) { refuse(library, name + ": " + wrong.what()); }
  for (std::size_t k = 0; k < law.state.size(); ++k)
    if (!std::isfinite(law.state_begin[k]))
      refuse(library, "state variable '" + law.state[k] + "' of " + name + " has no value for a new contact: write " +
                          law.state[k] + ":0");
  law.has_prepare = true;
  law.has_solve = d.solve != nullptr;
  law.has_commit = d.commit != nullptr;
  law.normal_bias = d.normal_bias != 0 && law.state.empty();
  law.thread_safe = d.thread_unsafe == 0 && !options.serial;
  law.prepare = d.prepare;
  law.solve = d.solve;
  law.commit = d.commit;
  law.complaint = d.complaint;
  return register_law(std::move(law), options.replace);
}

} // namespace cairn
