// The matrix H' of a contact, side by side, and the masses of the bodies that it moves.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_system.hpp"

namespace cairn {

// Biases above it belong to contacts that nothing moves, see singular_blocks.cpp, or that their law holds open in this
// step.
inline double never() { return 0.5 * std::sqrt(std::numeric_limits<double>::max()); }
// True if a side of a batch is a rigid body that moves; false for nodes of a condensed body.
inline bool moves_rigid(const cairn_batch& b, int side) {
  return side ? b.moves_b != 0 && b.mapped_b == 0 : b.moves_a != 0 && b.mapped_a == 0;
}
// True if a rope moves the body at its far end (0), or that of its pulley (1), by its far part.
inline bool moves_by_rope(const cairn_batch& b, int lane, int end) {
  const double* answer = b.rope + 26 * lane + 8 + 12 * end;
  return std::any_of(answer, answer + 6, [](double x) { return x < 0 || x > 0; });
}
inline bool is_mapped(const cairn_batch& b, int side) { return (side ? b.mapped_b : b.mapped_a) != 0; }

// Mass matrix of a body of the records and its inverse (dofs, dofs), dofs 3 in 2D and 6 in 3D. A driven dof has no
// inverse mass; it gets a mass that no row touches: see rigid_rows.
void body_mass(const ContactSystem&, std::int32_t body, double* mass, double* inverse);
// rows (components, dofs): what the velocity and spin of the rigid body on that side of a contact add to its relative
// velocity, the sign of the side in it; zero for driven dofs, of which inverse (dofs, dofs) has none.
void rigid_rows(const ContactSystem&, const cairn_batch&, int lane, int side, int components, const double* inverse,
                double* rows);

} // namespace cairn
