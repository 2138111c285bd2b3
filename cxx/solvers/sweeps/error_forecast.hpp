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
    const Seen& half = seen_[middle_];
    const double fall = std::log(half.error / best_) / double(std::max<std::int64_t>(1, iterations - half.iterations));
    return fall > 0 ? std::log(best_ / tolerance_) / fall : std::numeric_limits<double>::infinity();
  }

private:
  struct Seen {
    std::int64_t iterations;
    double error;
  };
  double tolerance_, best_ = std::numeric_limits<double>::infinity();
  std::vector<Seen> seen_;
  std::size_t middle_ = 0;
};

} // namespace cairn
