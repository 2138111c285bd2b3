// Sides of a mesh that follow others on average, by dual multipliers on what they have in common.
#pragma once
#include <cstdint>
#include <span>

#include "mesh_parts.hpp"

namespace cairn {

// Nodes of sides (4, n), -1 where fewer, follow those of others by the weights M / D, D_j = int N_j, M_jl =
// int psi_j N_l with psi = diag(D) (int B B')^-1 B of each side (Wohlmuth 2000), the integrals over what is common: a
// uniform stress goes through sides of any sizes to rounding, of second order by the shape functions of their whole,
// all of whose nodes are on pieces that follow. within: distance of a side that follows
// from the others, over its length or the root of its area, and width of the strip by which it may reach beyond their
// end, at most a half. To the ties of the draft. Throws Error naming edge or face where there is nothing to follow.
void tie_sides(MeshDraft& draft, std::span<const std::int32_t> follow, std::span<const std::int32_t> lead,
               double within);

} // namespace cairn
