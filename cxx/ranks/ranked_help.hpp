// Another solver over ranks, where sweeps would take long: the contacts of all ranks are gathered on the first one, or
// on the one that has the contacts of deformable bodies, which solves them as a run without ranks does, and impulses
// and velocities go back. All that decides whether is alike on all ranks, for every number of them.
#pragma once
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "../solvers/solve_report.hpp"
#include "../solvers/solver_options.hpp"
#include "../solvers/sweeps/error_forecast.hpp"
#include "gathered_contacts.hpp"
#include "part.hpp"

namespace cairn {

// Contacts of the last gathering, whose memory stays from step to step.
struct GatheredMemory {
  explicit GatheredMemory(int dim) : contacts(dim) {}
  GatheredContacts contacts;
  int rank = 0;           // that solves
  std::int64_t calls = 0; // so far
  double bytes = 0;       // of the contacts when they were gathered last
};

class RankedHelp {
public:
  RankedHelp(std::vector<Part>& parts, const std::vector<ColourShare>& colours, Exchange& exchange,
             const SolverOptions& options, double mass_ratio, GatheredMemory& memory);
  // Empty if contacts may be gathered; else why not.
  const std::string& obstacle() const { return obstacle_; }
  bool possible() const { return obstacle_.empty(); }
  // A solver of problems was chosen, which makes no sweeps.
  bool alone() const { return alone_; }
  // Told of each error; true: it wants to be called.
  bool pays(int iterations, double error);
  // The error is small enough, that of light bodies is this: whether that is all. False: it wants to be called. Where
  // an accuracy of velocities is asked for, it is called once: the rank that solves measures it, and sweeps until it is
  // met.
  bool accepts(int iterations, double light);
  // True, once a step, if velocities of bonded or jointed bodies may err by much more than impulses, whose error is
  // small enough: that of velocities is `velocities` at most, over their size.
  bool refines(int iterations, double velocities);
  // Sweeps after which the error has to be known, for the last call of a step.
  int last_call() const;
  struct Outcome {
    bool taken = false;  // impulses and records are those of the other solver
    int iterations = 0;  // sweeps that it made besides
    bool proven = false; // velocities are as exact as was asked
    // NaN: neither asked for, nor found to be larger than that of impulses
    double velocity_error = std::numeric_limits<double>::quiet_NaN();
    const char* solver = "nlgs";
    bool diverged = false; // a solver of problems did
    std::string hint;      // of a solver of problems
  };
  // small: the error itself is, and that of light bodies or of velocities was not accepted.
  Outcome improve(int iterations, bool small);

private:
  struct Request;
  struct Answer;
  std::size_t local() const;
  void count();
  void keep_start();
  double sweep_operations() const;
  Answer solve(const std::vector<Bytes>& parcels, const Request& request);
  void learn(const Answer& answer, int iterations);

  std::vector<Part>& parts_;
  const std::vector<ColourShare>& colours_;
  Exchange& exchange_;
  const SolverOptions& options_;
  GatheredMemory& memory_;
  ErrorForecast forecast_;
  std::vector<std::pair<int, double>> errors_; // seen, with the sweeps so far
  std::string obstacle_;
  double mass_ratio_, packed_ = 0, full_ = 0, bytes_ = 0; // contacts of packs, others; of all ranks
  double by_loads_ = 0, at_begin_ = 0, of_nodes_ = 0;     // squares of speeds, see ContactSystem [J]
  double dofs_ = 0, cost_ = 0;
  int dim_ = 2, components_ = 1;
  bool solid_ = false; // laws have a local solution of their own
  bool bends_ = false; // contacts rest on deformable bodies
  bool zones_ = false; // all contacts are cohesive zones, or cones beside them, not yet solved over all bodies at once
  std::vector<std::vector<double>> start_; // (parts) impulses before the sweeps, where zones ask for them
  bool asked_ = false;                     // its cost is known
  bool grows_ = false;                     // bodies change their size
  bool adds_up_ = false, refined_ = false; // errors of contacts do along bonds and joints; see refines()
  double patience_ = 0;
  int failures_ = 0, refinements_ = 0, few_from_ = 0, light_from_ = 0;
  bool called_last_ = false, by_newton_, alone_, exact_; // of Auto; an accuracy is asked for, and not yet looked at
};

} // namespace cairn
