// A periodic cell whose shape follows the stress: the rates of its shape are unknowns of the step, as the velocities of
// bodies are (Radjai & Voivret 2011, Periodic boundary conditions, in Discrete-element Modeling of Granular Materials).
#pragma once
#include <cstdint>
#include <vector>

#include "../../base/cell.hpp"
#include "contact_system.hpp"

namespace cairn {

// Contact across the boundary: the cell moves its B by L shift.
struct AcrossBoundary {
  std::int32_t batch, lane;
  double shift[3]; // [m]
};

// Takes a change (3, 3) of the velocity gradient [1/s] into the bias of the contact.
void shift_bias(const ContactSystem& system, const AcrossBoundary& place, int dim, const double* change);

// For a velocity gradient L whose image shift is s, the velocity of B at a contact is v_B + L s. Impulses p on A give
//   L_ij+ = L_ij - (h P_ij V + sum p_i s_j) / (m H_jj^2),
// P: pressure, V: volume, H: cell vectors, m: inertia. It is evaluated after each sweep over the contacts, which is
// Jacobi's method on the rates: it converges where m is more than the sum of 1/W_NN over the contacts across the
// boundary, so m is at least twice that sum.
class MovingCell {
public:
  // image: of each candidate
  void begin(const Cell& cell, int dim, double h, const ContactSystem& system, const std::int32_t* image);
  void follow(ContactSystem& system); // rates by the impulses at hand, into the biases of contacts across the boundary
  void end(Cell& cell) const;         // rates and stress of the step

private:
  std::vector<AcrossBoundary> places_;
  double rate_[9] = {}, free_[9] = {}, inverse_[9] = {}, sum_[9] = {};
  double over_ = 0; // 1/(h V)
  int dim_ = 2;
};

} // namespace cairn
