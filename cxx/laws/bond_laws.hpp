// Which laws hold bodies together, asked without the list of all laws: sources that include that are compiled anew with
// each row.
#pragma once
#include <cstdint>

namespace cairn {

enum class Law : std::int16_t;

// True if a law can bond two bodies at their contact, along the tangents too; it does so while its first state variable
// is above 0.
bool can_bond(Law law);

} // namespace cairn
