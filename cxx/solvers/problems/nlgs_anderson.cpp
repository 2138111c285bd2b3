#include "nlgs_anderson.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "cairn/core.h"

namespace cairn {

Anderson::Anderson(const FrictionProblem& p, const Array<double>& w_nn, int memory)
    : problem_(p), size_(p.unknowns()), memory_(memory), weight_(size_), f_(size_), f_last_(size_), g_(size_),
      g_last_(size_), df_(size_ * memory), dg_(size_ * memory), work_(size_), gram_(32 * memory) {
  for (std::int64_t i = 0; i < size_; ++i) weight_[i] = w_nn[i / p.dim];
}

void Anderson::forget() {
  columns_ = stored_ = 0;
  has_last_ = false;
}

void Anderson::next(const double* g, double change, double* r) {
  constexpr double worse = 4; // of the squared residual: then the combination was not good
  if (mixed_ && !(change <= worse * change_last_)) {
    std::copy(g_.begin(), g_.end(), r);
    mixed_ = false;
    forget();
    return;
  }
  f_.swap(f_last_);
  g_.swap(g_last_);
  for (std::int64_t i = 0; i < size_; ++i) f_[i] = g[i] - r[i];
  std::copy_n(g, size_, g_.begin());
  if (has_last_) {
    const int slot = stored_++ % memory_;
    columns_ = std::min(columns_ + 1, memory_);
    cairn_anderson_store(size_, columns_, slot, weight_.data(), f_.data(), f_last_.data(), g_.data(), g_last_.data(),
                         df_.data(), dg_.data(), gram_.data(), work_.data());
  }
  has_last_ = true;
  change_last_ = change;
  mixed_ = columns_ > 0;
  if (mixed_) {
    cairn_anderson_mix(size_, columns_, weight_.data(), f_.data(), g_.data(), df_.data(), dg_.data(), gram_.data(), r,
                       work_.data());
    cairn_project_disks(problem_.dim, problem_.contacts, problem_.mu.data(), r);
  } else {
    std::copy_n(g, size_, r);
  }
}

std::int64_t sweep_with_memory(const FrictionProblem& p, const ProblemOptions& options, ProblemMonitor& monitor,
                               const double* start, std::int64_t iterations, const GivesUp& gives_up) {
  Sweeper sweeper(p);
  constexpr double quick = 0.05; // of the squared change that a sweep alone leaves: no memory is needed
  std::optional<Anderson> anderson;
  Array<double> r(start, start + p.unknowns()), g(p.unknowns()), before(p.unknowns());
  std::int64_t next_check = iterations + 1;
  const std::int64_t begin = iterations;
  double last_change = std::numeric_limits<double>::infinity();
  double ratio = 0; // of the squared error to the change of a sweep: both fall together
  const double wanted = options.tolerance * options.tolerance * monitor.scale();
  while (!monitor.ended(iterations)) {
    g = r;
    const double change = sweeper.sweep(g.data(), options.relaxation);
    ++iterations;
    const bool promising = ratio > 0 && change * ratio <= wanted;
    if (promising || iterations >= next_check || iterations >= options.max_iterations || !std::isfinite(change)) {
      const double error = monitor.error_of(g.data());
      ratio = change > 0 ? error * error * monitor.scale() / change : 0;
      next_check = iterations + std::max<std::int64_t>(2, (iterations - begin) / 8);
      if (monitor.ended(iterations) || (gives_up && gives_up(iterations, error))) break;
      if (change == 0)
        monitor.give_up(ProblemStatus::stalled, "a sweep changes nothing any more: only rounding is left");
    }
    if (!anderson && change <= quick * last_change) {
      before.swap(r);
      r.swap(g);
    } else {
      if (!anderson) {
        anderson.emplace(p, monitor.w_nn(), 10);
        anderson->next(r.data(), last_change, before.data()); // r came of it
      }
      anderson->next(g.data(), change, r.data());
    }
    last_change = change;
  }
  return iterations;
}

ProblemReport solve_nlgs_anderson(const FrictionProblem& p, const ProblemOptions& options, double* r) {
  ProblemMonitor monitor(p, options, r);
  monitor.start_error();
  const Array<double> start(r, r + p.unknowns());
  return monitor.finish("nlgs_anderson", sweep_with_memory(p, options, monitor, start.data(), 0, {}));
}

} // namespace cairn
