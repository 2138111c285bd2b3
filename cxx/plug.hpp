// Routines from users' shared libraries.
#pragma once
#include <string>

#include "interaction.hpp"

namespace cairn {

struct PlugOptions {
  bool replace = false; // a law of that name
  bool serial = false;  // never call it from two threads at once, whatever the library says
};
// Adds the law `name` that the library describes by cairn_describe_NAME (cairn/plug.h); the library stays loaded.
// Throws std::invalid_argument naming library, law, what disagrees and the remedy.
Law plug_law(const std::string& library, const std::string& name, const PlugOptions& options = {});

} // namespace cairn
