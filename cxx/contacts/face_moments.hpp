// Moments of contacts between rigid bodies and meshes.
#pragma once
#include "contact_classes.hpp"

namespace cairn {

// True if a law resists turning where a single contact has nothing else to hold it: bonds at several points need no
// such law.
bool resists_turning(const AssemblyInput& in, const LawTable::Entry& rule);

// Throws std::invalid_argument unless a contact turns with a face.
void refuse_moment(const AssemblyInput& in, const ContactClasses& classes, std::int64_t candidate);

} // namespace cairn
