// Wall clock that passes while it lives, added to a sum of seconds; to none where that is null.
#pragma once
#include <chrono>

namespace cairn {

class Stopwatch {
public:
  explicit Stopwatch(double* sum) : sum_(sum), start_(std::chrono::steady_clock::now()) {}
  ~Stopwatch() {
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    if (sum_) *sum_ += spent.count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

private:
  double* sum_;
  std::chrono::steady_clock::time_point start_;
};

} // namespace cairn
