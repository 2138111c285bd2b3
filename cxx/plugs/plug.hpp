// Routines from users' shared libraries.
#pragma once
#include <string>

#include "../fe/called_forces.hpp"
#include "../laws/law_info.hpp"
#include "cairn/plug.h"

namespace cairn {

struct PlugOptions {
  bool replace = false; // a law of that name
  bool serial = false;  // never call it from two threads at once, whatever the library says
};
// Adds the law `name` that the library describes by cairn_describe_NAME (cairn/plug.h); the library stays loaded.
// Throws std::invalid_argument naming library, law, what disagrees and the remedy.
Law plug_law(const std::string& library, const std::string& name, const PlugOptions& options = {});

// A routine of another kind than law.
struct PluggedRoutine {
  std::string name, library;
  LawInfo declared; // its parameters
  cairn_plug_slot* routine = nullptr;
};
PluggedRoutine open_routine(const std::string& library, const std::string& name, int kind);
// A solver of contact problems under that name, for Nscd and for problems; an equal name is replaced.
void plug_solver(const PluggedRoutine& routine, const std::vector<double>& params);
// The forces of a mesh of nodes at position (dim, nodes) [m]; pattern: of its tangent, see CalledForces.
std::shared_ptr<CalledForces> plug_body(const PluggedRoutine& routine, std::vector<double> params, int dim,
                                        std::vector<double> position, SparseMatrix pattern);
// The kernel of a pair of pairs.def, e.g. disk_disk, from now on; a null routine: the built-in one again.
void plug_pair(const PluggedRoutine& routine, const std::string& pair);

} // namespace cairn
