#include "pass_mixing.hpp"

#include <algorithm>
#include <cstdint>

#include "cairn/core.h"

namespace cairn {

void PassMixing::forget() {
  columns_ = stored_ = 0;
  has_last_ = mixed_ = false;
}

void PassMixing::next(const std::vector<double>& weight, const std::vector<double>& from, std::vector<double>& found) {
  constexpr double worse = 4;     // of the squared difference: then the combination was not good
  constexpr double farthest = 30; // beyond what a pass gave, over its difference: of slower passes rounding decides
  const std::size_t n = found.size();
  for (auto* v : {&f_, &f_last_, &g_, &g_last_, &work_}) v->resize(n);
  df_.resize(std::size_t(memory) * n);
  dg_.resize(std::size_t(memory) * n);
  f_.swap(f_last_);
  g_.swap(g_last_);
  double square = 0;
  for (std::size_t i = 0; i < n; ++i) {
    f_[i] = found[i] - from[i];
    square += weight[i] * f_[i] * f_[i];
  }
  g_ = found;
  if (mixed_ && !(square <= worse * square_last_)) forget();
  if (has_last_) {
    const int slot = stored_++ % memory;
    columns_ = std::min(columns_ + 1, memory);
    cairn_anderson_store(std::int64_t(n), columns_, slot, weight.data(), f_.data(), f_last_.data(), g_.data(),
                         g_last_.data(), df_.data(), dg_.data(), gram_.data(), work_.data());
  }
  has_last_ = true;
  square_last_ = square;
  mixed_ = columns_ > 0;
  if (!mixed_) return;
  cairn_anderson_mix(std::int64_t(n), columns_, weight.data(), f_.data(), g_.data(), df_.data(), dg_.data(),
                     gram_.data(), found.data(), work_.data());
  double way = 0;
  for (std::size_t i = 0; i < n; ++i) way += weight[i] * (found[i] - g_[i]) * (found[i] - g_[i]);
  if (way <= farthest * farthest * square) return;
  found = g_;
  forget();
}

} // namespace cairn
