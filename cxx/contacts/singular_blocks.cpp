#include "singular_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "interaction.hpp"

namespace cairn {

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double rounding = 256 * epsilon * epsilon; // axes are known to some epsilons, and enter blocks squared

// Smallest eigenvalue of the tangential block that is left when the normal is eliminated.
double least_tangential(const double* w, int n, int c, int dim, int lane) {
  const auto at = [&](int p, int q) { return w[n * (q * c + p) + lane]; };
  const auto left = [&](int p, int q) { return at(p, q) - at(p, 0) * (at(0, q) / at(0, 0)); };
  const double tt = left(1, 1);
  if (dim == 2) return tt;
  const double ss = left(2, 2), ts = 0.5 * (left(1, 2) + left(2, 1)), half = 0.5 * (tt - ss);
  return 0.5 * (tt + ss) - std::sqrt(half * half + ts * ts);
}

// Zeroes rows of W of a joint along directions that move only by rounding: these carry no impulse.
void leave_out_unmoved(int n, int c, int dim, double sum, int lane, double* w) {
  for (int k = 0; k < dim; ++k) {
    if (w[n * (k * c + k) + lane] > rounding * sum) continue;
    for (int l = 0; l < c; ++l) w[n * (l * c + k) + lane] = w[n * (k * c + l) + lane] = 0;
  }
}

// True if springs or strengths respond to an opening drive, so that the impulse needs no motion.
bool answers_drives(const LawInfo& law, const cairn_batch& batch, int lane) {
  return law.has_solve && (law.energy || law.keeps) && batch.state[lane] > 0;
}

} // namespace

void settle_singular_blocks(const cairn_batch& batch, int dim, double* w, const std::function<double(int)>& opening,
                            const std::function<double(int)>& held) {
  const int n = batch.count, c = batch.components;
  const LawInfo& law = law_infos()[std::size_t(batch.law)];
  for (int lane = 0; lane < batch.contacts; ++lane) {
    double sum = 0;
    for (int k = 0; k < dim; ++k) sum += w[n * (k * c + k) + lane];
    if (batch.bonds && batch.state[lane] > 0) {
      if (w[lane] > rounding * sum) continue;
      const double unit = sum > 0 ? sum : held(lane); // a weight without bound would hide the error of all contacts
      batch.rho[lane] = 1 / (unit > 0 ? unit : 1);
      continue;
    }
    if (const double free = answers_drives(law, batch, lane) ? held(lane) : 0; !(sum > rounding * free))
      sum = free; // no direction moves but by rounding
    // Less than springs give way. By far less, what velocities round off would press.
    const double little = std::sqrt(epsilon) * sum;
    const bool moves = w[lane] > rounding * sum;
    if (law.joins) {
      leave_out_unmoved(n, c, dim, sum, lane, w);
      if (!moves) batch.rho[lane] = 1 / (sum > 0 ? sum : 1);
      continue;
    }
    if (!moves && sum > 0 && answers_drives(law, batch, lane)) {
      // A closing drive adds no impulse: the law sees no motion. Its former impulse would act against velocities that
      // do not respond, and stay.
      batch.bias[lane] -= std::min(opening(lane), 0.0);
      for (int k = 0; k < c; ++k) batch.r[k * n + lane] = 0;
      w[lane] += little;
      batch.rho[lane] = 1 / sum;
    } else if (!moves) {
      const double unit = sum > 0 ? sum : 1;
      for (int k = 0; k < c; ++k)
        for (int l = 0; l < c; ++l) w[n * (l * c + k) + lane] = k == l ? unit : 0;
      for (int k = 0; k < c; ++k) batch.bias[k * n + lane] = k ? 0 : std::sqrt(std::numeric_limits<double>::max());
      batch.rho[lane] = 1 / unit;
      continue;
    }
    if (least_tangential(w, n, c, dim, lane) <= little)
      for (int k = 1; k < dim; ++k) w[n * (k * c + k) + lane] += little;
  }
}

} // namespace cairn
