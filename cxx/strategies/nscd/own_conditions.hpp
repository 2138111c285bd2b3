// Conditions that a law itself imposes along the normal, and that a strategy with conditions of its own would replace.
#pragma once
#include <string>

#include "../../contacts/interaction.hpp"

namespace cairn {

// Beside a contact of rigid surfaces, or of springs without damping, on the gap between them; empty: nothing.
std::string own_condition(const LawTable::Entry&);
// An overlap in which bodies rest; empty: none.
std::string own_overlap(const LawTable::Entry&);

} // namespace cairn
