// Sweeps of NLGS over ranks: colour by colour, with the velocities of shared bodies told after each. All that decides
// how they go on is a sum over contacts or bodies that is exact, so that no bit depends on which rank has which.
#pragma once
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "../solvers/solve_report.hpp"
#include "../solvers/solver_options.hpp"
#include "../solvers/sweeps/contact_system.hpp"
#include "../solvers/sweeps/nesterov_sequence.hpp"
#include "colouring.hpp"
#include "exact_sum.hpp"
#include "part.hpp"
#include "ranked_cell.hpp"
#include "ranked_help.hpp"
#include "sweep_exchange.hpp"

namespace cairn {

// Totals over all ranks of sums that each part adds to.
void add_over_ranks(std::span<ExactSum> sums, Exchange& exchange);

class RankedSweeps {
public:
  RankedSweeps(std::vector<Part>& parts, ColourLinks& links, int colours, Exchange& exchange,
               const SolverOptions& options, SweepExchange* once_a_sweep);
  // The shape of the periodic cell of the parts is driven: its rates and its stress follow the impulses.
  void drive_cell(double h);
  // Another solver takes over where sweeps would take long.
  void ask_help(const std::vector<ColourShare>& colours, GatheredMemory& memory);
  // Leaves impulses in the batches and velocities in the records of each part: of bodies that it owns or has contacts
  // on.
  SolveReport solve();
  // f(schedule, contacts) of each colour and part, with velocities told after each colour.
  void each_colour(const std::function<void(const cairn_schedule&, const ContactSystem&)>& f);

private:
  struct Share { // of a part
    ContactSystem* system = nullptr;
    const Bodies* bodies = nullptr;
    const Nodes* nodes = nullptr; // of meshes
    cairn_schedule schedule{};
    Velocities free() const { return {bodies->velocity_free, &nodes->velocity_free}; }
    Array<double> before;                  // velocities when the last sweep began [m/s]
    std::vector<double> condensed_before;  // of contact nodes, likewise
    std::vector<double> r_before, r_start; // impulses when the last sweep began, and this one [N s]
    Array<std::int64_t> change, along;     // by batch: see ranked_sweep.h [units]
    std::int32_t stride = 1;               // components of a contact, at most
    std::vector<double> best;              // impulses of the smallest error
    std::vector<double> r_sweep,
        v_sweep; // impulses, and velocities of contact nodes, when a sweep with one exchange began
  };
  struct Error {
    double square = 0;
    bool finite = true;
  };

  template <class Kernel>
  void by_colours(Kernel&& kernel, double share = 1);
  void tell(int colour);
  template <class Kernel>
  void sweep_once(Kernel&& kernel);
  void give_impulses();
  void leave_stale_start();
  void sweep();
  template <int n>
  static void extrapolate_bodies(Share& share, double factor);
  static void extrapolate_nodes(Share& share, double factor);
  void extrapolate_velocities(double factor);
  void extrapolate_impulses(double factor);
  void follow_sweep();
  void sweep_extrapolated();
  static double reciprocal_unit(double scale);
  void measure_free();
  Error measure(SolveReport* last = nullptr);
  void measure_light(SolveReport& report);
  bool worth_measuring(double wanted) const;
  int sweeps_to_check(double square, double wanted);
  void damp();
  void relax(double square);
  void keep_best(double square);
  bool give_back(double square);
  bool persists();
  void tell_depth(SolveReport& report);
  void look_further(Error& error, double& wanted, SolveReport& report);
  bool falls_back(const Error& error, SolveReport& report);
  void solve_elsewhere(SolveReport& report);
  bool get_help(bool small, double square, SolveReport& report);
  std::string hint_of(const SolveReport& report, double tolerance) const;
  void finish(double wanted, SolveReport& report);
  template <class F>
  void each_row(Share& share, F&& f) const;

  std::vector<Share> shares_;
  std::vector<Part>& parts_;
  ColourLinks& links_;
  int colours_;
  Exchange& exchange_;
  const SolverOptions& options_;
  SweepExchange* once_; // a sweep; null: ranks tell each other after each colour
  std::int64_t contacts_ = 0;
  double free_energy_ = 0, rounding_ = 0, mass_ratio_ = 1;
  double relaxation_ = 1;
  double relaxed_square_ = std::numeric_limits<double>::infinity(); // the smallest that was measured
  double least_square_ = std::numeric_limits<double>::infinity();   // that of the impulses that were kept
  bool relaxes_ = false, extrapolates_ = true, clumps_ = false, cycles_ = false;
  RankedCell cell_;
  std::optional<RankedHelp> help_;
  std::string hint_of_help_;   // of a solver of problems
  bool proven_ = true;         // velocities are as exact as was asked
  bool uneven_ = false;        // masses differ so much that light bodies have an error of their own
  bool helped_astray_ = false; // the impulses of another solver have no error that is a number
  NesterovSequence sequence_;
  double change_ = 0;    // of the last extrapolated sweep, or what comes near it [J]
  double ratio_ = 0;     // square of the error over that change, where it was measured; 0: not known [1/J]
  bool counted_ = false; // the last sweep was one whose change is known
  int iterations_ = 0, checks_ = 0, last_check_ = 0, next_check_ = 0;
  double last_square_ = 0;
};

} // namespace cairn
