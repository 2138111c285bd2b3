// Sweeps over ranks beside another solver.
#include "ranked_sweeps.hpp"

#include <cmath>
#include <cstdio>

#include "../base/call.hpp"
#include "../solvers/problems/friction_problem.hpp"

namespace cairn {

void RankedSweeps::ask_help(const std::vector<ColourShare>& colours, GatheredMemory& memory) {
  const bool exact = std::isfinite(options_.accuracy);
  std::string obstacle = "the cell follows a stress between sweeps";
  if (!cell_.follows()) {
    help_.emplace(parts_, colours, exchange_, options_, mass_ratio_, memory);
    obstacle = help_->obstacle();
  }
  if (options_.solver != "nlgs" && options_.solver != "auto" && !obstacle.empty())
    throw cairn::Error("the contact solver " + options_.solver + " takes gathered contacts over ranks: " + obstacle +
                       "; take cairn.NLGS or cairn.Auto");
  if (exact && !obstacle.empty())
    throw cairn::Error("accuracy is " + std::to_string(options_.accuracy) +
                       ", and over ranks that of gathered contacts: " + obstacle +
                       "; leave accuracy out, or run without ranks");
}

// By a solver of problems alone.
void RankedSweeps::solve_elsewhere(SolveReport& report) {
  const RankedHelp::Outcome outcome = help_->improve(0, false);
  iterations_ = outcome.iterations;
  hint_of_help_ = outcome.hint;
  for (const ProblemSolverInfo& row : problem_solvers())
    if (row.name == options_.solver) report.solver = row.name.c_str();
}

// small: the error is small enough, and that of light bodies is in the report. True if the other solver's impulses were
// taken.
bool RankedSweeps::get_help(bool small, double square, SolveReport& report) {
  const bool calls =
      small ? !help_->accepts(iterations_, report.light_error) : help_->pays(iterations_, std::sqrt(square));
  if (!calls) return false;
  const RankedHelp::Outcome outcome = help_->improve(iterations_, small);
  if (std::isfinite(options_.accuracy) && (small || outcome.proven)) {
    report.velocity_error = outcome.velocity_error;
    proven_ = outcome.proven;
  }
  if (!outcome.taken) return false;
  iterations_ += outcome.iterations;
  report.solver = outcome.solver;
  sequence_.restart(); // from impulses and velocities as they are
  change_ = free_energy_;
  return true;
}

std::string RankedSweeps::hint_of(const SolveReport& report, double tolerance) const {
  if (!hint_of_help_.empty()) return "gathered contacts: " + hint_of_help_;
  char text[500];
  const std::string obstacle = help_ ? help_->obstacle() : "";
  const char* remedy =
      options_.solver == "auto" ? "let masses differ less, or lower dt" : "take cairn.Auto, or let masses differ less";
  if (report.error <= tolerance && report.light_error > tolerance)
    std::snprintf(text, sizeof text,
                  "light bodies under heavy ones are not solved: light_error %.2e after %d iterations over %d ranks, "
                  "tol is %.2e: %s%s%s",
                  report.light_error, report.iterations, exchange_.ranks(), options_.tolerance, obstacle.c_str(),
                  obstacle.empty() ? "" : "; ", remedy);
  else
    std::snprintf(text, sizeof text,
                  "error %.2e after %d iterations over %d ranks, tol is %.2e: %s%sallow more iterations, a larger tol "
                  "or a smaller dt",
                  report.error, report.iterations, exchange_.ranks(), options_.tolerance, obstacle.c_str(),
                  obstacle.empty() ? "" : "; ");
  return text;
}

} // namespace cairn
