// Contents of a run file: the scene, once, and bodies and contacts of each output.
#pragma once
#include <deque>

#include "../simulation/simulation.hpp"
#include "run_writer.hpp"

namespace cairn {

struct RunSnapshot {
  std::vector<RunField> bodies, contacts, nodes;
  std::deque<StoredArray> values; // that fields point into

  explicit RunSnapshot(Simulation& s);

private:
  void keep(std::vector<RunField>& to, const char* name, StoredArray array);
};

// materials: their names by number; mark: the fingerprint of the scene that the simulation was made of.
void write_scene(Group& scene, Simulation& s, const std::vector<std::string>& materials, const std::string& mark);
// Numbers of the last step, as run files have them in their history.
std::vector<RunNumber> numbers_of_step(const Simulation& s);
// From now on rotations are followed where no contact needs them: readers of a run look at them.
void keep_rotations(Scene& scene);
const char* status_name(const StepReport& report);

// Ids of the nodes that each contactor is mapped from, in the order of insertion, four each, -1 where there are fewer.
std::vector<std::int64_t> nodes_of_contactors(Simulation& s);

} // namespace cairn
