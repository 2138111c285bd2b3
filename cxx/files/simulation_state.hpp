// All that the future of a simulation depends on, besides its laws, strategy and loads, as checkpoints hold it.
#pragma once
#include "../simulation/simulation.hpp"
#include "stored_tree.hpp"

namespace cairn {

// A term of the balance in a checkpoint [J].
double energy_term(const StoredValue& energy, const std::string& term);

StoredValue state_of(Simulation& s);

// Throws std::invalid_argument naming field and value if a state cannot belong to a simulation of this scene. A
// checksum finds accidental damage; this check finds invalid states with a correct checksum, since the core does not
// check indices of bodies, materials and hulls. species: number of materials and groups.
void check_state(const StoredValue& state, std::int64_t species, const Simulation& now);

// Takes over a state that check_state has passed.
void take_state(Simulation& s, const StoredValue& state);

// Digest by which scenes are told apart: masses, inertias and contactors, which stay constant in motion. Taken from the
// scene as it was made.
std::string fingerprint(const Scene& scene);

// A checkpoint of a program in C or Fortran, and back: FileError if it is damaged or of another scene; a restart that
// is refused leaves the simulation as it was.
void write_checkpoint(Simulation& s, const std::string& scene, std::int64_t species, const std::string& path);
void restart(Simulation& s, const std::string& scene, std::int64_t species, const std::string& path);

} // namespace cairn
