// Delassus blocks that driven dofs make singular, made fit for the local solvers.
#pragma once
#include <functional>

#include "../solvers/sweeps/contact_system.hpp"

namespace cairn {

// Regularises singular blocks before a batch stores them: w is (n, c, c) with its compliance; rho and bias of the batch
// are written where needed. A normal without motion carries no impulse: its contact is kept open. A tangent without
// motion would take any impulse: its block gets a small part of the normal's, which slows that impulse down and leaves
// the solution as it is, since solvers take back with the same block. The same holds for the normal of a pair whose law
// has springs. opening (lane) is its velocity without impulse, bias included; held (lane) is the inverse mass of
// deformable bodies, held or not, the scale of smallness where no direction moves. Bonds that hold fast and joints
// treat singular blocks themselves.
void settle_singular_blocks(const cairn_batch& batch, int dim, double* w, const std::function<double(int)>& opening,
                            const std::function<double(int)>& held);

} // namespace cairn
