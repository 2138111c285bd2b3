// Relative velocity at contacts that the velocities of bodies do not tell: of surfaces that move along their bodies, as
// belts do, and of the images of a cell that changes its shape.
#pragma once
#include <cstdint>

#include "assembly_input.hpp"

namespace cairn {

// Tangential velocity of the surface of a body relative to the body, at a lever from its centre of mass, in space axes;
// n is the normal. False: the body has none, and `out` is untouched.
bool belt_velocity(const Bodies& bodies, int dim, std::int32_t body, const double* lever, const double* n, double* out);

// True if the contacts of a list, n of them, may need add_jump.
bool has_jumps(const AssemblyInput& in, const std::int32_t* contacts, int n);

// Adds the velocities of surfaces and of the image of B to the relative velocity of a contact [m/s]. Joints and sound
// bonds hold bodies, not surfaces, so that no belt acts on them.
void add_jump(const AssemblyInput& in, const ContactSystem& system, const cairn_batch& b, int lane, double* u);

} // namespace cairn
