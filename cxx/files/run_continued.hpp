// Refuses to go on in the file of a run where outputs would be replaced by those of another one.
#pragma once
#include "../simulation/simulation.hpp"

namespace cairn {

// Source of the present state of a simulation.
struct RunOrigin {
  // Its own steps, a state set from memory, a checkpoint restored from a file.
  enum From { steps, state, checkpoint } from = steps;
  std::int64_t last_output = -1; // step of the last output that the simulation itself wrote to the file; -1: none
  // Marks that tell scenes apart, by the names under which files hold theirs.
  std::vector<std::pair<std::string, std::string>> marks{};
};

// Throws FileError, and leaves the file as it is, if its run is of another scene; if the run reaches farther than the
// simulation, unless a checkpoint was restored whose state the run went through; if the simulation is farther, and came
// there by steps alone; or if bodies stand elsewhere in the output of the present step.
void refuse_other_run(const std::string& path, Simulation& s, const RunOrigin& origin);

} // namespace cairn
