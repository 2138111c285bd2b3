// Entries of the inverse at some unknowns, by the part of the factors that these reach.
#include <omp.h>

#include <algorithm>
#include <string>

#include "../base/call.hpp"
#include "factors.hpp"
#include "unit_fronts.hpp"

namespace cairn {

namespace {

constexpr std::int64_t units_at_once = 8;

} // namespace

std::vector<Soe::Wanted> Soe::wanted_of(std::span<const std::int32_t> indices) const {
  if (!factorised_) throw Error("there are no factors to solve with: give values that can be factorised first");
  std::vector<Wanted> wanted;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < 0 || indices[i] >= n_)
      throw Error("index " + std::to_string(i) + " names unknown " + std::to_string(indices[i]) + " of " +
                  std::to_string(n_) + ": they count from 0");
    if (const std::int32_t e = equation_[indices[i]]; e >= 0) wanted.push_back({std::int64_t(i), e, place_[e]});
  }
  std::stable_sort(wanted.begin(), wanted.end(), [](const Wanted& a, const Wanted& b) { return a.place < b.place; });
  return wanted;
}

void Soe::add_fronts(UnitFronts& units, std::span<const std::int32_t> indices, std::int64_t known, double* out,
                     std::int64_t leading, int threads) const {
  const std::int64_t m = std::int64_t(indices.size());
  std::vector<UnitFronts::Wanted> fresh;
  for (const Wanted& w : wanted_of(indices))
    if (w.index >= known) fresh.push_back({w.index, w.place, right_[w.equation], left_[w.equation]});
  for (std::int64_t c = known; c < m; ++c) // held unknowns keep zeros
    for (std::int64_t r = 0; r < m; ++r) out[leading * c + r] = out[leading * r + c] = 0;
  units.add(*factors_, fresh, out, leading, threads);
}

void Soe::add_units(std::span<const std::int32_t> indices, std::int64_t known, double* out, std::int64_t leading,
                    int threads) {
  if (!symmetric_) throw Error("entries are added to those of the inverse of a symmetric matrix alone");
  if (factors_->diagonal() != nullptr) return take_diagonal(indices, out, leading);
  if (factors_->tree() == nullptr) return solve_columns(indices, out, leading, threads);
  if (known == 0 || known != units_known_ || !units_) {
    units_ = std::make_unique<UnitFronts>();
    known = 0;
  }
  add_fronts(*units_, indices, known, out, leading, threads);
  units_known_ = std::int64_t(indices.size());
}

void Soe::solve_units(std::span<const std::int32_t> indices, double* out, int threads) const {
  const std::int64_t m = std::int64_t(indices.size());
  if (factors_->diagonal() != nullptr) return take_diagonal(indices, out, m);
  if (!symmetric_ || factors_->tree() == nullptr) return solve_columns(indices, out, m, threads);
  UnitFronts once;
  add_fronts(once, indices, 0, out, m, threads);
}

void Soe::take_diagonal(std::span<const std::int32_t> indices, double* out, std::int64_t leading) const {
  const std::int64_t m = std::int64_t(indices.size());
  for (std::int64_t c = 0; c < m; ++c) std::fill_n(out + leading * c, m, 0.0);
  const std::vector<Wanted> wanted = wanted_of(indices);
  for (std::size_t k = 0; k < wanted.size(); ++k) // more than one where an unknown is named twice
    for (std::size_t i = k; i < wanted.size() && wanted[i].place == wanted[k].place; ++i)
      out[leading * wanted[i].index + wanted[k].index] = out[leading * wanted[k].index + wanted[i].index] =
          right_[wanted[k].equation] * (left_[wanted[k].equation] / factors_->diagonal()[wanted[k].place]);
}

// Solves for whole columns where factors have no tree. For a symmetric matrix the column of the lower place counts, in
// any request.
void Soe::solve_columns(std::span<const std::int32_t> indices, double* out, std::int64_t leading, int threads) const {
  const std::int64_t m = std::int64_t(indices.size()), equations = scaled_.n, size = work_size();
  const std::vector<Wanted> wanted = wanted_of(indices);
  for (std::int64_t c = 0; c < m; ++c) std::fill_n(out + leading * c, m, 0.0);
  const std::int64_t count = std::int64_t(wanted.size()), groups = (count + units_at_once - 1) / units_at_once;
  const int team = int(std::clamp<std::int64_t>(groups, 1, std::max(threads, 1)));
#pragma omp parallel num_threads(team) if (team > 1)
  {
    std::vector<double> y(size);
#pragma omp for schedule(dynamic)
    for (std::int64_t g = 0; g < groups; ++g) {
      const std::int64_t begin = g * units_at_once, end = std::min(begin + units_at_once, count);
      std::fill(y.begin(), y.begin() + equations * units_at_once, 0.0);
      for (std::int64_t k = begin; k < end; ++k)
        y[wanted[k].place * units_at_once + (k - begin)] = left_[wanted[k].equation];
      factors_->solve(int(units_at_once), y.data(), y.data() + equations * units_at_once);
      for (std::int64_t i = symmetric_ ? begin : 0; i < count; ++i)
        for (std::int64_t k = begin; k < end; ++k) {
          const double x = right_[wanted[i].equation] * y[wanted[i].place * units_at_once + (k - begin)];
          const std::int64_t row = wanted[i].index, column = wanted[k].index;
          if (!symmetric_ || i >= k) out[row * leading + column] = x;
          if (symmetric_ && i > k) out[column * leading + row] = x;
        }
    }
  }
}

} // namespace cairn
