// Tells from the errors of sweeps how many are still to come: the rate of the later half of the way.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace cairn {

class ErrorForecast {
public:
  explicit ErrorForecast(double tolerance) : tolerance_(tolerance) {}
  void aim(double tolerance) { tolerance_ = tolerance; }
  double sweeps_to_come(std::int64_t iterations, double error) {
    best_ = std::min(best_, error);
    seen_.push_back({iterations, best_});
    while (middle_ + 1 < seen_.size() && seen_[middle_ + 1].iterations <= iterations / 2) ++middle_;
    return to_come_since(seen_[middle_]);
  }
  // Sweeps to come by the rate of the last quarter, after a call of sweeps_to_come: infinite where errors stand still
  // although they fell earlier in the later half.
  double by_last_quarter() const {
    const std::int64_t begin = seen_.back().iterations - seen_.back().iterations / 4;
    std::size_t k = seen_.size() - 1;
    while (k > 0 && seen_[k].iterations > begin) --k;
    return to_come_since(seen_[k]);
  }

private:
  struct Seen {
    std::int64_t iterations;
    double error;
  };
  double to_come_since(const Seen& seen) const {
    const std::int64_t iterations = std::max<std::int64_t>(1, seen_.back().iterations - seen.iterations);
    const double fall = std::log(seen.error / best_) / double(iterations);
    return fall > 0 ? std::log(best_ / tolerance_) / fall : std::numeric_limits<double>::infinity();
  }
  double tolerance_, best_ = std::numeric_limits<double>::infinity();
  std::vector<Seen> seen_;
  std::size_t middle_ = 0;
};

} // namespace cairn
