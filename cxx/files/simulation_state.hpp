// All that the future of a simulation depends on, besides its laws, strategy and loads, as checkpoints hold it.
#pragma once
#include "../simulation/simulation.hpp"
#include "stored_tree.hpp"

namespace cairn {

// A term of the balance in a checkpoint [J].
double energy_term(const StoredValue& energy, const std::string& term);

StoredValue state_of(Simulation& s);

// Throws std::invalid_argument that names the field and the value of what no simulation of this scene can have. A seal
// tells damage by chance, this what is damaged and sealed again: the core takes numbers of bodies, materials and hulls
// as they come. species: how many materials and groups there are.
void check_state(const StoredValue& state, std::int64_t species, const Simulation& now);

// Of a state that was checked.
void take_state(Simulation& s, const StoredValue& state);

// Tells scenes apart, by what does not change while they move: masses, inertias, contactors. Of a scene as it was made.
std::string fingerprint(const Scene& scene);

// A checkpoint of a program in C or Fortran, and back: FileError if it is damaged or of another scene; a restart that
// is refused leaves the simulation as it was.
void write_checkpoint(Simulation& s, const std::string& scene, std::int64_t species, const std::string& path);
void restart(Simulation& s, const std::string& scene, std::int64_t species, const std::string& path);

} // namespace cairn
