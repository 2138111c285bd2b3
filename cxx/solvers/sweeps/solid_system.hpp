// Matrix of the bodies of a step with the responses of their contacts, and its factors: A + H K H', A the masses, K the
// response of each contact, H' its rows.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "../../soe/soe.hpp"
#include "contact_system.hpp"

namespace cairn {

// Matrix and factors kept for the next solve, so that an unchanged pattern is analysed once.
struct SolidMemory {
  static SolidMemory& of(ContactSystem&);
  SparseMatrix matrix; // of the bodies: masses and responses of contacts
  std::unique_ptr<Soe> soe;
  std::vector<double> start; // impulses of the last step: see solid_zones.cpp
};

class SolidSystem {
public:
  static constexpr std::int64_t most_dofs = 96; // of a condensed body, whose matrix is full
  static constexpr int most_components = 6;
  struct Contact {
    std::int32_t batch, lane, components, unknowns;
    std::size_t rows, answer, known, clique; // where these begin
  };
  SolidSystem(ContactSystem&, const cairn_schedule&, const Velocities& velocity_free);
  // False: a body cannot be written as a matrix, or nothing moves.
  bool possible() const { return possible_; }

  ContactSystem& system;
  const cairn_schedule& schedule;
  std::vector<double> answer; // (c, c) of each contact: change of its impulse over that of its velocity, reversed [kg]
  std::vector<double> known;  // (c) of each contact: change of its impulse at unchanged velocities [N s]
  std::vector<double> velocity; // of the unknowns: momentum before factor() or solve(), changes of velocity after
  const std::vector<Contact>& contacts() const { return contacts_; }
  // First unknown of a rigid body, -1: none.
  std::int32_t unknown_of(std::int32_t body) const { return rigid_[std::size_t(body)]; }

  // Factors of the matrix with the responses at hand, and the solution with `known` beside `velocity`; false: none.
  bool factor();
  void solve() { memory_.soe->solve(velocity.data()); } // with these factors
  // du (c): change of the relative velocity of a contact by `velocity`.
  void relative_velocity(const Contact& contact, double* du) const {
    const std::size_t c = std::size_t(contact.components);
    for (std::size_t k = 0; k < c; ++k) du[k] = 0;
    for (std::size_t j = 0; j < std::size_t(contact.unknowns); ++j)
      for (std::size_t k = 0; k < c; ++k)
        du[k] += rows_[contact.rows + c * j + k] * velocity[std::size_t(clique_[contact.clique + j])];
  }
  // False if no unknown changes the normal velocity of a contact: its nodes are driven, or both of its sides have them.
  bool moves(const Contact& contact) const;
  // Momentum of bodies by impulses, as long as `known`, times `sign`, is added to `momentum`.
  void add_momentum(const std::vector<double>& impulse, double sign, std::vector<double>& momentum) const;
  void mass_times(const std::vector<double>& x, std::vector<double>& y) const;
  double size_of_step() const; // |velocity|_M of rigid bodies

  void change_impulses(); // by known - answer H' velocity
  void refresh();         // velocities of the records by the impulses
  void keep_impulses();
  void restore_impulses(); // those kept last

private:
  void number_unknowns();
  std::int32_t number_rigid(std::int32_t body);
  void number_condensed(std::int32_t body);
  void add_clique(const std::int32_t* unknown, int count);
  void place_contacts();
  int add_side(const cairn_batch& b, int lane, int side, int components);
  int add_rope(const cairn_batch& b, int lane, int components, std::size_t begin);
  void place_entries();

  const Velocities& velocity_free_;
  SolidMemory& memory_;
  bool possible_ = true;
  std::int32_t unknowns_ = 0;
  std::vector<std::int32_t> rigid_, condensed_; // first unknown of each body, -1: none
  std::vector<std::int32_t> dof_unknown_;       // of each dof of condensed bodies, from first_dof_ on; -1: held
  std::vector<std::size_t> first_dof_;
  std::vector<double> inverse_; // (dofs, dofs) of each rigid body that is numbered, in their order
  std::vector<std::int64_t> clique_start_{0};
  std::vector<std::int32_t> clique_;
  std::vector<double> clique_matrix_; // matrices of bodies, then of contacts
  std::size_t contacts_begin_ = 0;    // in clique_matrix_
  std::vector<std::int64_t> entry_;   // place in the matrix of each entry of clique_matrix_; -1: above the diagonal
  std::vector<Contact> contacts_;
  std::vector<double> rows_, kept_;
};

} // namespace cairn
