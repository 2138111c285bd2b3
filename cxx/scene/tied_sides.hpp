// Mortar ties: slave sides of a mesh follow master sides weakly, by dual multipliers on their overlap.
#pragma once
#include <cstdint>
#include <span>

#include "mesh_parts.hpp"

namespace cairn {

// Ties the nodes of slave sides `follow` (4, n), -1 where fewer, to those of the master sides `lead`, by the weights M
// / D: D_j = int N_j, M_jl = int psi_j N_l, with the dual basis psi = diag(D) (int B B')^-1 B of each side (Wohlmuth
// 2000) and integrals over the overlap. A uniform stress passes through sides of any sizes to rounding; quadratic sides
// use their own shape functions, and all of their nodes must be on slave pieces. within: largest distance of a slave
// side from the masters, and largest width of the strip by which it may protrude beyond their end, both relative to its
// length or the root of its area, at most a half. Adds the ties to the draft. Throws Error naming an edge or face
// without a master.
void tie_sides(MeshDraft& draft, std::span<const std::int32_t> follow, std::span<const std::int32_t> lead,
               double within);

} // namespace cairn
