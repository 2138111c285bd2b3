// Limits that decide which of the edges around a node of a mesh has a contact.
#pragma once

namespace cairn::detection {

inline constexpr double on_end = 1e-9; // of the edges: distance to their common node within which a point is over it
inline constexpr double nearly_one = 0.75; // cosine between edges over whose common node one of them has a point
inline constexpr double along_it = 0.5;    // cosine to a side from which on a normal points along it

} // namespace cairn::detection
