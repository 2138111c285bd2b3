#include "packed_batches.hpp"

#include <algorithm>
#include <cmath>

#include "../laws/law_info.hpp"
#include "../solvers/sweeps/batch.hpp"

namespace cairn {

namespace {

// change_of_round for a batch, in eights like the normals of its pack; 0 for lanes without motion. Its roots and
// quotients take a fifth of the time in vectors.
template <int d>
void changes_of_round(int n, const double* pack, int lines, const double (&speed)[d][128], const double* apart,
                      double h, double* change) {
  for (int first = 0; first < n; first += 8) {
    const double* normal = pack + first / 8 * lines;
#pragma omp simd
    for (int i = 0; i < 8; ++i) {
      const int lane = first + i;
      const double reach = h / apart[lane];
      double along = 0, square = 0;
      for (int k = 0; k < d; ++k) along += speed[k][lane] * normal[8 * k + i];
      for (int k = 0; k < d; ++k) {
        const double across = (speed[k][lane] - along * normal[8 * k + i]) * reach;
        square += across * across;
      }
      const double bounded = square < 1 ? square : 1, gain = bounded / (reach * (1 + std::sqrt(1 - bounded)));
      change[lane] = square > 0 && apart[lane] > 0 ? gain : 0;
    }
  }
}

} // namespace

// Keeps columns for `commit` of a packed batch: changes of velocity along the normal (null: none), geometry, fields.
void PackedBatches::keep_for_commit(const cairn_batch& b, const double* change, int d) const {
  const BatchStorage::LawColumns& own = storage_.columns_of(b);
  if (!own.flight) return;
  const int n = b.count;
  const std::int32_t* who = &system_.candidate[b.first];
  std::fill_n(own.flight, n * d, 0.0);
  std::copy_n(change, change ? n : 0, own.flight);
  for (int lane = 0; lane < b.contacts; ++lane) {
    own.geometry[lane] = areas_.area_of(who[lane]);
    own.geometry[n + lane] = curvature_.effective_radius(who[lane]);
    own.geometry[2 * n + lane] = b.rho[lane];
    if (own.fields) in_.fields_of(who[lane], n, own.fields + lane);
  }
  if (own.fields) repeat_last(b, own.fields, 4);
  repeat_last(b, own.flight, d);
  repeat_last(b, own.geometry, 3);
}

// Two round bodies that move, a bias along the normal: everything at once.
template <int d>
void PackedBatches::fill(cairn_batch& b, double& deepest) const {
  const AssemblyInput& in = in_; // a local: stores to the batch cannot change it
  const Candidates& c = *in.candidates;
  const LawInfo& law = law_infos()[b.law];
  const int n = b.count, lines = 8 * b.pack, parameters = int(law.parameters.size());
  alignas(64) double gap[128], params[LawTable::max_parameters * 128], bias[3 * 128], compliance[3 * 128], mu[128];
  alignas(64) double change[128], speed[d][128], apart[128], mass[128], smaller[128];
  std::fill_n(mass, n, 1.0);
  const bool moves = motion_.applies_to_balls(), one_rule = in.laws->entries() == 1 && !in.temperature;
  const double gap_share = in.gap_share();
  const auto& radius = in.contactors->radius.values;
  const auto& record = system_.record;
  if (one_rule)
    for (int k = 0; k < parameters; ++k) std::fill_n(params + k * n, n, in.laws->entry(0).params[k]);
  const std::int32_t* who = &system_.candidate[b.first];
  for (int lane = 0; lane < b.contacts; ++lane) {
    const std::int64_t i = who[lane];
    if (lane + 24 < b.contacts) { // contacts, then their bodies, lie far apart
      const std::int64_t far = who[lane + 24], near = who[lane + 12];
      __builtin_prefetch(&c.contactor_a[far]);
      __builtin_prefetch(&c.contactor_b[far]);
      __builtin_prefetch(&c.gap[far]);
      __builtin_prefetch(&c.normal[d * far]);
      __builtin_prefetch(&record[std::size_t(in.body(c.contactor_a[near]))]);
      __builtin_prefetch(&record[std::size_t(in.body(c.contactor_b[near]))]);
    }
    const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i], A = in.body(ca), B = in.body(cb);
    double* to = b.frame + lane / 8 * lines + lane % 8;
    const double *normal = &c.normal[std::size_t(d * i)], now = c.gap[std::size_t(i)];
    const double ra = radius[std::size_t(ca)], rb = radius[std::size_t(cb)];
    const cairn_record &of_a = record[std::size_t(A)], &of_b = record[std::size_t(B)];
    for (int k = 0; k < d; ++k) to[8 * k] = normal[k];
    to[8 * d] = -(ra + gap_share * now);
    to[8 * d + 8] = rb + gap_share * now;
    gap[lane] = now;
    smaller[lane] = std::min(ra, rb);
    b.body_a[lane] = A;
    b.body_b[lane] = B;
    mass[lane] = of_a.x[d == 2 ? 3 : 6] + of_b.x[d == 2 ? 3 : 6];
    for (int k = 0; k < d; ++k) speed[k][lane] = of_a.x[k] - of_b.x[k];
    apart[lane] = ra + rb + std::min(now, 0.0);
    if (one_rule) continue;
    const double* given = classes_.rule(i).params;
    for (int k = 0; k < parameters; ++k) params[k * n + lane] = given[k];
    if (in.temperature) classes_.vary(i, n, params + lane);
  }
  for (int lane = b.contacts; lane < n; ++lane) {
    double* to = b.frame + lane / 8 * lines + lane % 8;
    for (int k = 0; k < d + 2; ++k) to[8 * k] = 0;
    for (int k = 0; k < d; ++k) speed[k][lane] = 0;
    apart[lane] = smaller[lane] = 1;
    gap[lane] = 0;
    b.body_a[lane] = b.body_b[lane] = std::int32_t(system_.bodies);
  }
  double deep = deepest;
#pragma omp simd reduction(max : deep)
  for (int lane = 0; lane < n; ++lane) {
    b.rho[lane] = 1 / mass[lane];
    const double overlap = gap[lane] < 0 ? -gap[lane] / smaller[lane] : 0;
    deep = overlap > deep ? overlap : deep;
  }
  deepest = deep;
  if (moves) changes_of_round<d>(n, b.frame, lines, speed, apart, in.h, change);
  repeat_last(b, gap, 1);
  if (!one_rule) repeat_last(b, params, parameters);
  keep_for_commit(b, moves ? change : nullptr, d);
  const cairn_law_context context{in.h, in.theta, nullptr, nullptr, 0};
  law.prepare(n, d, &context, gap, nullptr, params, nullptr, bias, compliance, mu);
  std::fill(bias + b.contacts, bias + n, 0.0);
  std::fill(mu + b.contacts, mu + n, 0.0);
  if (law.plugged()) plugged_.check_prepared(b, bias, compliance, mu);
  if (in.bodies->stretch.active) growth_.add(b, gap, bias);
  for (int lane = 0; moves && lane < b.contacts; ++lane) bias[lane] += change[lane];
  warm_start_.fill_packed<d>(b);
  for (int first = 0; first < n; first += 8) {
    double* to = b.frame + first / 8 * lines + 8 * (d + 2);
    std::copy_n(bias + first, 8, to);
    std::copy_n(mu + first, 8, to + 8);
  }
}

// From columns to a pack, in the same memory: for this step the law is as good as one with a bias along the normal
// alone.
template <int d>
void PackedBatches::pack_columns(cairn_batch& b) const {
  constexpr int lines = 2 * d + 4;
  const int n = b.count;
  alignas(64) double old[(d + 4) * 128];
  for (int k = 0; k < d; ++k) std::copy_n(b.frame + k * n, n, old + k * n);
  std::copy_n(b.lever_a, n, old + d * n);
  std::copy_n(b.lever_b, n, old + (d + 1) * n);
  std::copy_n(b.bias, n, old + (d + 2) * n);
  std::copy_n(b.params, n, old + (d + 3) * n);
  for (int lane = 0; lane < n; ++lane) {
    double* to = b.frame + lane / 8 * 8 * lines + lane % 8;
    for (int k = 0; k < d + 4; ++k) to[8 * k] = old[k * n + lane];
    constexpr int mass = d == 2 ? 3 : 6; // equal to the bit to batches packed from the start
    if (lane < b.contacts)
      b.rho[lane] = 1 / (system_.record[b.body_a[lane]].x[mass] + system_.record[b.body_b[lane]].x[mass]);
  }
  b.delassus = nullptr;
  place_pack(b, d);
  warm_start_.fill_packed<d>(b);
}

template void PackedBatches::fill<2>(cairn_batch&, double&) const;
template void PackedBatches::fill<3>(cairn_batch&, double&) const;
template void PackedBatches::pack_columns<2>(cairn_batch&) const;
template void PackedBatches::pack_columns<3>(cairn_batch&) const;

} // namespace cairn
