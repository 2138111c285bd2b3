// Newton's method over the bodies of a step with laws of local solutions: where bonds join many bodies to a solid,
// sweeps carry an impulse only from one body to the next, and factors of the whole carry it at once. Whole steps
// converge soon where most contacts in pressure and tension are known. Otherwise they stray, and proximal points are
// found one after the other, each by steps cut where the energy along them begins to rise (Rockafellar 1976; like
// Coulomb's cones in ppa_newton.cpp).
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "../../soe/soe.hpp"
#include "../refinement_memory.hpp"
#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "contact_system.hpp"
#include "refinement.hpp"

namespace cairn {

// Matrix and factors kept for the next solve, so that an unchanged pattern is analysed once.
struct SolidMemory {
  static SolidMemory& of(ContactSystem&);
  SparseMatrix matrix; // of the bodies: masses and what contacts answer
  std::unique_ptr<Soe> soe;
  std::vector<double> start; // impulses of the last step: see solid_zones.cpp
};

class SolidCorrection {
public:
  // Empty, or what keeps these contacts from it.
  static std::string obstacle(const ContactSystem&);
  SolidCorrection(ContactSystem&, const cairn_schedule&, const Velocities& velocity_free);
  // False: a body cannot be written as a matrix, or nothing moves.
  bool possible() const { return possible_; }
  // Approximate cost of one pass, in operations at the rate of factors; known before lists are made.
  static double operations(const ContactSystem&);
  // Impulses of a smaller error, in a few passes; records up to date before and after.
  // measure: square of the error of the impulses at hand. Returns how many passes led to it, 0: none did.
  int improve(double error_square, double wanted_square, const std::function<double()>& measure);
  // True if bonds, or springs too, join bodies so that passes can tell the accuracy of velocities.
  static bool makes_solid(const ContactSystem&, bool springs, double tolerance);
  // How far velocities may be off, |dv|_M over the error of the impulses at hand: see solid_refinement.cpp.
  static double amplification(const ContactSystem&);
  // Limits biases of bonds in rings to those that some velocities can satisfy; see solid_self_stress.cpp.
  void ask_for_what_rings_can();
  static bool has_bonds(const ContactSystem&);
  // The smallest impulses of bonds, if their error is within the tolerance.
  void drop_self_stress_within(double tolerance, const std::function<double()>& measure);
  // Passes until velocities change by no more than `wanted` of the speed of all, to impulses whose error is within the
  // tolerance; else these are as they were. Records up to date before and after.
  Refinement refine(double error, double wanted, double tolerance, const std::function<double()>& measure);

  // Passes until velocities change by little beside the tolerance; kept if the error stays within it.
  void settle_joints(double tolerance, const std::function<double()>& measure);

  // True if all contacts are cohesive zones, or cones beside them; see solid_zones.cpp.
  static bool zones_alone(const ContactSystem&);
  static void keep_start(ContactSystem&); // impulses before a sweep changes them
  // Impulses of such contacts, from those of the last step, if their error is smaller; returns after how many passes.
  int solve_zones(double error_square, double wanted_square, const std::function<double()>& measure);

private:
  struct Contact {
    std::int32_t batch, lane, components, unknowns;
    std::size_t rows, answer, known; // where these begin
  };
  void number_unknowns();
  std::int32_t number_rigid(std::int32_t body);
  void number_condensed(std::int32_t body);
  void add_clique(const std::int32_t* unknown, int count);
  void place_contacts();
  int add_side(const cairn_batch& b, int lane, int side, int components);
  int add_rope(const cairn_batch& b, int lane, int components, std::size_t begin);
  // Arguments of a law.
  struct Question {
    const double *block, *velocity, *begun, *bias, *params; // (n, c, c), (n, c), (n, c), (n, c), (n)
  };
  void size_columns();
  void linearise();
  void ask(const cairn_batch& b, const Question& with, double* r) const;
  void respond(std::int32_t batch, Question with, double speed, const double* eliminated, double proximal);
  double fastest();
  void open_batch(std::int32_t batch, double share);
  bool factor();
  bool take_pass();
  double size_of_step() const;
  void change_impulses();
  void copy_impulses(bool back);
  void refresh();

  // See solid_self_stress.cpp.
  bool bonds_close_rings() const;
  void drop_self_stress();
  bool find_smallest();
  void velocities_at_contacts(std::vector<double>& u) const;
  void answers_to(const std::vector<double>& u, std::vector<double>& impulse) const;
  void answer_by_blocks(double share);
  void add_momentum(const std::vector<double>& impulse, double sign, std::vector<double>& momentum) const;

  // See solid_proximal.cpp.
  struct Proximal {
    struct Place {
      std::size_t contact = 0, value = 0, block = 0;
    };
    std::vector<Place> places; // where the columns of each batch begin, dummies counted
    std::vector<double> block, free, begun, moved, moving, bias, params; // columns
    std::vector<double> way, mass_way, mass_step;                        // of unknowns
    double speed = 0;                                                    // the largest where it begins
  };
  int improve_by_proximal_points(double& error_square, double wanted_square, const std::function<double()>& measure);
  int find_proximal_point(double share, int most);
  void begin_proximal(double share);
  Question question(std::size_t batch, const double* velocity) const;
  void linearise_proximal();
  double slope(double step);
  double step_length(bool cut);
  void velocities_of_contacts();
  void mass_times(const std::vector<double>& x, std::vector<double>& y) const;

  // See solid_zones.cpp.
  struct Zones {
    std::vector<std::size_t> place; // where the columns of each batch begin
    std::vector<double> velocity, moving, bears, change, multiplier, presses, pressed, shift; // columns
    std::vector<double> stiffness; // of contacts, as answers stand
    double slack = 0;              // of velocities that count as none, times the root of the mass of a contact
    double stays[36];
    double spring[6 * 128], pull[6 * 128], fall[6 * 128], rise[6 * 128], still[6 * 128], mu[128],
        beta[128]; // of a batch
  };
  void read_zones(const cairn_batch& b, const double* u);
  void begin_zones();
  void velocities_of_zones();
  void bear_contact(const double* u, const double* multiplier, int n, int c, double rho, double shift, double mu,
                    bool begins, double* bears, double* answer) const;
  void bear_springs(std::size_t k, const double* u, bool begins, bool softens, double* bears, double* answer);
  void linearise_zones(bool begins, bool softens);
  void follow_zones();
  double slope_of_zones(double step);
  double length_of_zones(double begin);
  void move_zones(double step);
  void multiply_zones();
  void renew_multipliers();

  ContactSystem& system_;
  const cairn_schedule& schedule_;
  const Velocities& velocity_free_;
  SolidMemory& memory_;
  double stressed_ = 0; // size of impulses before self-stress was last dropped, like `borne` of the refinement
  double proximal_;
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
  Proximal proximal_point_;
  Zones zones_;
  std::vector<double> rows_, answer_, known_, velocity_, kept_;
  std::vector<double> w_, w_true_, u_, q_, r_, bias_, params_, target_, nudged_, nudges_, found_, begun_, told_;
  std::vector<std::int32_t> held_; // of a batch, as those before
};

} // namespace cairn
