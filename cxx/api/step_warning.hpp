// Warnings of a step that converged (overlap, bodies that passed through), as one text.
#pragma once
#include <string>

namespace cairn {

class Simulation;

// Deep overlaps, bodies that move by more than their size in a step, and shapes without a kernel between them; empty
// where there are none.
std::string warning_of(const Simulation&);

} // namespace cairn
