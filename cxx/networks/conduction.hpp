// Flow through a graph: branches with conductances between unknowns, leaks from unknowns to a ground at zero, values
// that are given. What flows keeps its digits whatever the conductances: differences along branches are formed from
// values in two parts, and residuals from differences.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "../soe/soe.hpp"
#include "multigrid.hpp"

namespace cairn {

struct ConductionOptions {
  enum class Method { automatic, direct, multigrid };
  Method method = Method::automatic; // direct up to `direct_most` equations or where a conductance is negative
  double tolerance = 1e-12;          // on the residual at an unknown, relative to the flow in its component
  int max_iterations = 1000;         // of conjugate gradients in all
  std::int64_t direct_most = 2000;
};

// n unknowns. Conductances may be zero (no branch), infinite (both ends have one value) and, off a mesh's elements,
// negative; leak (n) >= 0 or null; held (n) or null: 1 where x is given.
struct ConductionGraph {
  std::int64_t n = 0, branches = 0;
  const std::int32_t *a = nullptr, *b = nullptr;
  const double* conductance = nullptr;
  const double* leak = nullptr;
  const std::uint8_t* held = nullptr;
};

struct ConductionReport {
  enum Status { converged, iteration_limit, not_finite, indefinite };
  Status status = converged;
  std::int64_t unknowns = 0;   // that were solved for
  std::int64_t components = 0; // that something flows in or is held in
  std::int64_t floating = 0;   // unknowns of components without source, leak or given value: nothing flows there
  std::int64_t open = 0;       // unknowns of components whose sources have nowhere to go: nothing flows there either
  std::int64_t factorisations = 0, iterations = 0;
  double residual = 0; // largest that is left over / largest flow through an unknown of its component
  const char* method = "none";
  bool reused = false; // the analysis of the last graph
};

class Conduction {
public:
  // x (n): given where held, elsewhere a first guess, which is not used where it is no number; solved for, the ground
  // of a component that nothing anchors at its first unknown's zero; no number where nothing is known (floating, open).
  // flow (branches) from a to b. Infinite branches carry what their ends ask for, shared as if they were equal.
  ConductionReport solve(const ConductionGraph& graph, const double* source, double* x, double* flow,
                         const ConductionOptions& options);
  std::int64_t bytes() const;

private:
  void merge(const ConductionGraph& g);
  void find_components(const ConductionGraph& g, const double* source, const double* x, ConductionReport& report);
  void lay_out(const ConductionGraph& g);
  double residual(const ConductionGraph& g, const double* source);
  bool refine_direct(const ConductionGraph& g, const double* source, const ConductionOptions& o,
                     ConductionReport& report);
  bool refine_multigrid(const ConductionGraph& g, const double* source, const ConductionOptions& o,
                        ConductionReport& report);
  bool factorise(ConductionReport& report);
  void add(const double* change);
  void flows(const ConductionGraph& g, double* flow) const;
  void share(const ConductionGraph& g, const double* source, double* flow);
  double difference(std::int32_t a, std::int32_t b) const { return (high_[a] - high_[b]) + (low_[a] - low_[b]); }
  bool joins(const ConductionGraph& g, std::int64_t k) const;

  bool merged_ = false, negative_ = false;
  std::vector<std::int32_t> parent_, of_, component_, equation_, place_; // of each unknown
  std::vector<std::int32_t> row_unknown_;                                // of each equation
  std::vector<double> high_, low_, left_, through_, source_, given_;     // of each merged unknown
  std::vector<double> total_, size_, scale_;                             // of each component
  std::vector<std::uint8_t> kind_;                                       // of each component
  std::vector<double> rest_, change_;                                    // of each equation
  LaplacianMatrix matrix_;
  SparseMatrix pattern_;
  std::unique_ptr<Soe> soe_;
  Multigrid multigrid_;
  std::unique_ptr<Conduction> perfect_; // of infinite branches
};

} // namespace cairn
