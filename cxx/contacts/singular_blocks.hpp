// Delassus blocks that driven dofs make singular, made fit for the local solvers.
#pragma once
#include <functional>

#include "../solvers/sweeps/contact_system.hpp"

namespace cairn {

// Before the blocks of a batch are stored: w is (n, c, c) with its compliance; rho and bias of the batch are written
// where needed. A normal along which nothing moves carries no impulse: its contact is kept open. A tangent along which
// nothing moves would take any impulse: its block gets a little of the normal's, which slows that impulse down and
// leaves the solution as it is, since solvers take back with the same block what they put in. So does the normal of a
// pair whose law has springs; opening (lane) is its velocity with no impulse, bias included, held (lane) the inverse
// mass of deformable bodies, held or not, which tells how little is little where no direction moves. Bonds that hold
// fast and joints find their own way round singular blocks.
void settle_singular_blocks(const cairn_batch& batch, int dim, double* w, const std::function<double(int)>& opening,
                            const std::function<double(int)>& held);

} // namespace cairn
