// The contacts of a step as a problem on their own, for solvers of problems, and the way back.
#pragma once
#include "../problems/friction_problem.hpp"
#include "contact_system.hpp"

namespace cairn {

class StepProblem {
public:
  // Empty, or what keeps these contacts from being a problem: laws with a local solution of their own.
  static std::string obstacle(const ContactSystem&);
  // records: hold the free velocity afterwards. Contacts where nothing can move, and those that
  // their law holds open, are left out.
  StepProblem(ContactSystem&, const cairn_schedule&, const Velocities& velocity_free);

  // Initially the problem has its bodies, and of W the diagonal blocks.
  FrictionProblem& problem() { return problem_; }
  const FrictionProblem& problem() const { return problem_; }
  // Bytes of W in blocks.
  double bytes() const;
  // W as blocks instead; the bodies are forgotten.
  void form_blocks();
  // Impulses of the contacts (dim, contacts), as the step has them; and given back to it.
  void read(double* r) const;
  void write(const double* r);
  // To records: free velocities and their changes (dofs, bodies) by a solver; if it gave none, they stay.
  void write_velocities(const Velocities& velocity_free, const Array<double>& change);

private:
  struct Place {
    std::int32_t batch, lane;
  };
  void choose_contacts();
  void number_bodies();
  void fill_rows();
  void fill_velocities(const cairn_schedule&);
  void keep_diagonal();
  std::vector<std::vector<std::int32_t>> contacts_of_bodies() const; // then those of condensed bodies
  std::int32_t group(std::int64_t contact, int side) const;          // among these; -1: nothing moves there
  void add_condensed(); // to the blocks of W what contacts of a condensed body give each other
  ContactSystem& system_;
  std::vector<Place> places_;
  std::vector<std::int32_t> number_; // of bodies of the system; -1: not in the problem
  FrictionProblem problem_;
};

} // namespace cairn
