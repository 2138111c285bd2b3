// The impulses of the smallest error that was measured: given back where sweeps end without a solution, or where
// extrapolated ones lead to impulses that are no numbers.
#include <algorithm>
#include <limits>

#include "nlgs_part.hpp"

namespace cairn {

namespace {

// f(impulses, their number, place of the first) for every row of impulses there is, those of dummies too
template <class F>
void each_row(const ContactSystem& system, F&& f) {
  std::size_t place = 0;
  const auto row = [&](double* r, std::size_t n) {
    f(r, n, place);
    place += n;
  };
  for (const cairn_batch& b : system.batches) {
    const std::size_t lanes = std::size_t(b.count), components = std::size_t(b.components);
    if (!b.pack) row(b.r, lanes * components);
    for (std::size_t first = 0; b.pack && first < lanes; first += 8)
      row(b.r + first * std::size_t(b.pack), 8 * components); // they stand at the end of a pack
  }
}

class BestImpulses final : public NlgsPart {
public:
  explicit BestImpulses(NlgsState& s) : s_(s) {}

  bool follow(const StepError& error, double) override {
    if (!(error.square < least_)) return false;
    const bool last = s_.report.iterations >= s_.options.max_iterations; // the impulses at hand
    least_ = last ? none : error.square;
    if (!last) keep();
    return false;
  }

  bool recover(const StepError& error) override {
    if (!s_.taken_over || !give_back(error.square)) return false;
    s_.extrapolates = false;
    return true;
  }

  void end(StepError& end, SolverOptions&) override {
    if (s_.report.iterations >= s_.options.max_iterations && end.square > s_.wanted && !s_.proven &&
        give_back(end.square))
      end = s_.measure(true);
  }

private:
  static constexpr double none = std::numeric_limits<double>::infinity();

  void keep() {
    std::size_t numbers = 0;
    for (const cairn_batch& b : s_.system.batches) numbers += std::size_t(b.count) * b.components;
    Array<double>& best = s_.system.best;
    fit(best, numbers);
    each_row(s_.system, [&](double* r, std::size_t n, std::size_t place) { std::copy_n(r, n, &best[place]); });
  }

  // Restores the best impulses and records where those at hand are worse. False: nothing changed.
  bool give_back(double error_square) {
    if (!(least_ < none) || error_square <= least_) return false;
    const Array<double>& best = s_.system.best;
    each_row(s_.system, [&](double* r, std::size_t n, std::size_t place) { std::copy_n(&best[place], n, r); });
    s_.system.load(s_.velocity_free);
    cairn_add_impulses(&s_.schedule);
    return true;
  }

  NlgsState& s_;
  double least_ = none;
};

} // namespace

void add_best_impulses(NlgsState& s, NlgsParts& parts) { parts.add<BestImpulses>(s); }

} // namespace cairn
