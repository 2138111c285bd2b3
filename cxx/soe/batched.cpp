#include "batched.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "../base/call.hpp"
#include "cairn/core.h"

namespace cairn {

namespace {

constexpr int lanes = 8, most_unknowns = 24;
constexpr std::int64_t stretch = 16; // groups of bodies at a time

// Numbers of each body, side by side for eight; places without a body get `fill`.
void gather(const double* from, std::int64_t bodies, std::int64_t numbers, std::int64_t group, double fill,
            double* to) {
  for (int lane = 0; lane < lanes; ++lane) {
    const std::int64_t body = group * lanes + lane;
    for (std::int64_t k = 0; k < numbers; ++k) to[k * lanes + lane] = body < bodies ? from[body * numbers + k] : fill;
  }
}

void scatter(const double* from, std::int64_t bodies, std::int64_t numbers, std::int64_t group, double* to) {
  for (int lane = 0; lane < lanes && group * lanes + lane < bodies; ++lane)
    for (std::int64_t k = 0; k < numbers; ++k) to[(group * lanes + lane) * numbers + k] = from[k * lanes + lane];
}

std::int64_t groups_of(std::int64_t bodies) { return (bodies + lanes - 1) / lanes; }

} // namespace

BatchedSoe::BatchedSoe(std::int64_t bodies, int n) : bodies_(bodies), n_(n) {
  if (n < 0 || n > most_unknowns)
    throw Error("a batch of small systems has 0 to 24 unknowns each, not " + std::to_string(n) +
                ": take a Soe for each larger one");
  factor_.resize(std::size_t(groups_of(bodies)) * n * n * lanes);
}

// By columns a lower triangle is an upper one by rows: the matrix goes in transposed.
BatchedSoe::Status BatchedSoe::factor(const double* value, int threads) {
  const std::int64_t groups = groups_of(bodies_), n = n_, size = n * n * lanes;
  std::int64_t first = bodies_;
  SoeStatus first_status;
#pragma omp parallel for num_threads(std::max(threads, 1)) schedule(static) if (threads > 1)
  for (std::int64_t g = 0; g < groups; ++g) {
    double* const a = factor_.data() + g * size;
    for (int lane = 0; lane < lanes; ++lane) {
      const std::int64_t body = g * lanes + lane;
      for (std::int64_t j = 0; j < n; ++j)
        for (std::int64_t i = j; i < n; ++i)
          a[(j * n + i) * lanes + lane] = body < bodies_ ? value[(body * n + i) * n + j] : double(i == j);
    }
    std::int32_t failed[lanes];
    double pivot[lanes];
    cairn_small_factor(1, n_, 8 * 0x1p-52, a, failed, pivot);
    for (int lane = 0; lane < lanes; ++lane) {
      const std::int64_t body = g * lanes + lane;
      if (failed[lane] == 0 || body >= bodies_) continue;
#pragma omp critical(batched_soe_failed)
      if (body < first) {
        first = body;
        const bool none = std::abs(pivot[lane]) <= 8 * 0x1p-52;
        first_status = {none ? SoeStatus::singular : SoeStatus::indefinite, failed[lane] - 1};
      }
    }
  }
  if (first == bodies_) return {};
  for (std::int64_t i = 0; i < n; ++i)
    for (std::int64_t j = 0; j <= i; ++j)
      if (!std::isfinite(value[(first * n + i) * n + j])) return {{SoeStatus::not_finite, i}, first};
  return {first_status, first};
}

void BatchedSoe::solve(double* b, int threads) const {
  if (n_ == 0) return; // no numbers, and no address to hand on
  const std::int64_t groups = groups_of(bodies_), n = n_;
#pragma omp parallel for num_threads(std::max(threads, 1)) schedule(static, stretch) if (threads > 1)
  for (std::int64_t g = 0; g < groups; ++g) {
    double y[most_unknowns * lanes];
    gather(b, bodies_, n, g, 0.0, y);
    cairn_small_solve(1, n_, factor_.data() + g * n * n * lanes, y);
    scatter(y, bodies_, n, g, b);
  }
}

void BatchedSoe::inverse(double* out, int threads) const {
  if (n_ == 0) return;
  const std::int64_t groups = groups_of(bodies_), n = n_;
#pragma omp parallel for num_threads(std::max(threads, 1)) schedule(static, stretch) if (threads > 1)
  for (std::int64_t g = 0; g < groups; ++g) {
    double y[most_unknowns * most_unknowns * lanes];
    cairn_small_inverse(1, n_, factor_.data() + g * n * n * lanes, y);
    scatter(y, bodies_, n * n, g, out);
  }
}

} // namespace cairn
