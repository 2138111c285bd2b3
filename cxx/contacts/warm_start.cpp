#include "warm_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/vectors.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"

namespace cairn {

// Impulses of the last step, from space axes to those of the contacts.
template <int d>
void WarmStart::fill_packed(cairn_batch& b) const {
  const double scale = memory_.h > 0 ? in_.h / memory_.h : 1;
  const int n = b.count, lines = 8 * b.pack, kept = memory_.impulse_components;
  const std::int32_t* found = matcher_.place + b.first;
  for (int first = 0; first < n; first += 8) {
    double *pack = b.frame + first / 8 * lines, *r = pack + 8 * (d + 4), p[d][8] = {};
    for (int i = 0; i < 8; ++i) {
      const std::int32_t where = first + i < b.contacts ? found[first + i] : -1;
      if (where < 0) continue;
      const double* from = &memory_.impulses[std::size_t(where) * kept];
      for (int k = 0; k < d; ++k) p[k][i] = scale * from[k];
    }
    for (int i = 0; i < 8; ++i) {
      if constexpr (d == 2) {
        r[i] = p[0][i];
        r[8 + i] = p[1][i];
      } else {
        const double normal[3] = {pack[i], pack[8 + i], pack[16 + i]};
        double t[3], sum[3] = {0, 0, 0};
        tangent_of(normal, t);
        for (int k = 0; k < 3; ++k) {
          const int l = (k + 1) % 3, m = (k + 2) % 3;
          sum[0] += normal[k] * p[k][i];
          sum[1] += t[k] * p[k][i];
          sum[2] += (normal[l] * t[m] - normal[m] * t[l]) * p[k][i];
        }
        for (int k = 0; k < 3; ++k) r[8 * k + i] = sum[k];
      }
    }
  }
}

void WarmStart::fill(cairn_batch& b) const {
  const int n = b.count, d = in_.dim(), kept = memory_.impulse_components, rotations = b.components - d;
  std::fill(b.r, b.r + std::size_t(n) * b.components, 0.0);
  const double scale = memory_.h > 0 ? in_.h / memory_.h : 1;
  if (b.state) fill_states(b);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int32_t where = matcher_.place[b.first + lane];
    if (where < 0) continue;
    const double* p = &memory_.impulses[std::size_t(where) * kept];
    if (d == 2) {
      for (int c = 0; c < std::min(kept, b.components); ++c) b.r[c * n + lane] = scale * p[c];
      continue;
    }
    double axes[3][3];
    for (int c = 0; c < 3; ++c) {
      axes[0][c] = b.frame[c * n + lane];
      axes[1][c] = b.frame[(3 + c) * n + lane];
    }
    cross(axes[0], axes[1], axes[2]);
    for (int c = 0; c < 3; ++c) {
      b.r[c * n + lane] = scale * (axes[c][0] * p[0] + axes[c][1] * p[1] + axes[c][2] * p[2]);
      if (rotations && kept == 6)
        b.r[(3 + c) * n + lane] = scale * (axes[c][0] * p[3] + axes[c][1] * p[4] + axes[c][2] * p[5]);
    }
  }
}

// States from the last step, or the initial values of the law. Contacts without a state have huge values in the memory.
// Vectors in the tangent plane keep their length where the plane turns.
void WarmStart::fill_states(const cairn_batch& b) const {
  const LawInfo& law = law_infos()[b.law];
  const int n = b.count, columns = law.state_columns(in_.dim());
  constexpr double huge = std::numeric_limits<double>::max();
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int32_t where = matcher_.place[b.first + lane];
    const double* found = where < 0 ? nullptr : &memory_.states[std::size_t(where) * memory_.state_components];
    int from = 0, to = 0;
    const auto known = [&](int numbers) {
      return found && from + numbers <= memory_.state_components && !(std::abs(found[from]) >= huge);
    };
    for (std::size_t s = 0; s < law.state.size(); ++s) {
      if (law.state[s].back() != '*' || in_.dim() == 2) {
        double value = law.state_begin[s];
        if (known(1))
          value = found[from];
        else if (s == 0 && law.keeps && new_bonds_.came_in_touching(system_.candidate[b.first + lane]))
          value = 1;
        b.state[to++ * n + lane] = value;
        ++from;
        continue;
      }
      double t[2] = {law.state_begin[s], law.state_begin[s]};
      if (known(3)) {
        double x[3];
        std::copy_n(found + from, 3, x);
        lay_into_plane(b, lane, where, x, t);
      }
      b.state[to++ * n + lane] = t[0];
      b.state[to++ * n + lane] = t[1];
      from += 3;
    }
  }
  repeat_last(b, b.state, columns);
}

// Turns a state vector from the tangent plane of the last detection into that of the present one, at constant length.
// Anchored states are given in axes of B; without anchors, or in a sliding contact, the vector also turns about the
// normal with the mean spin of both bodies. x: the vector, in space axes afterwards; where: index of the contact in the
// memory.
void WarmStart::lay_into_plane(const cairn_batch& b, int lane, std::int32_t where, double x[3], double t[2]) const {
  double axes[3][3], whole = 0;
  axes_of(b, 3, lane, axes);
  t[0] = t[1] = 0;
  const bool anchored = !b.mapped_b && !memory_.anchors.empty() && memory_.anchors[std::size_t(where)].reach >= 0;
  if (anchored) to_space_axes(*in_.bodies, 3, b.body_b[lane], x, x);
  for (int k = 0; k < 3; ++k) {
    whole += x[k] * x[k];
    t[0] += axes[1][k] * x[k];
    t[1] += axes[2][k] * x[k];
  }
  const double left = t[0] * t[0] + t[1] * t[1], scale = left > 0 ? std::sqrt(whole / left) : 1;
  t[0] *= scale;
  t[1] *= scale;
  if (anchored || b.mapped_a || b.mapped_b || (law_infos()[b.law].keeps && !motion_.is_sound_bond(b, lane))) return;
  const double twist = twist_since_last(b, lane, axes[0]), c = std::cos(twist), s = std::sin(twist), along = t[0];
  t[0] = c * along - s * t[1];
  t[1] = s * along + c * t[1];
}

// Mean rotation of two bodies about the normal, by their velocities between the two detections [rad].
double WarmStart::twist_since_last(const cairn_batch& b, int lane, const double* normal) const {
  const double time = in_.options.time_left * memory_.h + (1 - in_.options.time_left) * in_.h;
  double spin = 0;
  for (int k = 0; k < 3; ++k)
    spin += normal[k] * (system_.record[b.body_a[lane]].x[3 + k] + system_.record[b.body_b[lane]].x[3 + k]) / 2;
  return spin * time;
}

template void WarmStart::fill_packed<2>(cairn_batch&) const;
template void WarmStart::fill_packed<3>(cairn_batch&) const;

} // namespace cairn
