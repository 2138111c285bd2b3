#include "law_rows.hpp"

#include <algorithm>

#include "../base/call.hpp"
#include "../laws/law_geometry.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "assembly_input.hpp"
#include "batch_storage.hpp"
#include "surface_motion.hpp"

namespace cairn {
namespace {

constexpr std::size_t lanes = 128; // that a batch has at most

// Contacts first to last of a column, and behind them the last again up to n lanes.
void take(const std::vector<double>& from, std::size_t rows, std::size_t first, std::size_t last, std::size_t n,
          std::vector<double>& to) {
  const std::size_t columns = from.size() / rows;
  to.resize(n * columns);
  for (std::size_t k = 0; k < columns; ++k)
    for (std::size_t i = 0; i < n; ++i) to[k * n + i] = from[k * rows + std::min(first + i, last - 1)];
}

void put(const std::vector<double>& from, std::size_t rows, std::size_t first, std::size_t last, std::size_t n,
         std::vector<double>& to) {
  for (std::size_t k = 0; k < from.size() / n; ++k) std::copy_n(&from[k * n], last - first, &to[k * rows + first]);
}

} // namespace

LawRows ContactViews::law_rows(Law law) const {
  const LawInfo& info = law_infos()[std::size_t(law)];
  if (!info.has_solve)
    throw Error("law " + info.name +
                " has no solution of its own, so that it cannot be asked alone: shadow solve_contacts");
  const auto c = std::size_t(info.components(in_.dim()));
  const std::size_t p = info.parameters.size(), states = std::size_t(info.state_columns(in_.dim()));
  const auto geometry = std::size_t(geometry_columns(info));
  LawRows rows;
  rows.components = int(c);
  rows.h = in_.h;
  rows.theta = in_.theta_of(info);
  std::size_t n = 0;
  for (const cairn_batch& b : system_.batches) n += Law(b.law) == law ? std::size_t(b.contacts) : 0;
  for (auto [column, width] : {std::pair{&rows.gap, std::size_t(1)},
                               {&rows.velocity, c},
                               {&rows.velocity_free, c},
                               {&rows.bias, c},
                               {&rows.delassus, c * c},
                               {&rows.impulse, c},
                               {&rows.params, p},
                               {&rows.geometry, geometry},
                               {&rows.state, states}})
    column->resize(n * width);
  if (in_.has_fields()) rows.fields.resize(4 * n);
  const cairn_schedule schedule = system_.schedule(1);
  for (std::size_t which = 0, at = 0; which < system_.batches.size(); ++which) {
    const cairn_batch& b = system_.batches[which];
    if (Law(b.law) != law) continue;
    const BatchStorage::LawColumns& own = storage_.of_law[which];
    rows.over_bodies = own.context.over_bodies;
    alignas(64) double u[6 * lanes];
    cairn_relative_velocities(&schedule, std::int32_t(which), 0, u);
    for (int lane = 0; lane < b.contacts; ++lane, ++at) {
      const std::int64_t i = system_.candidate[std::size_t(b.first + lane)];
      const auto of = [&](const double* from, std::size_t k) {
        return from[k * std::size_t(b.count) + std::size_t(lane)];
      };
      rows.candidate.push_back(i);
      rows.gap[at] = in_.candidates->gap[std::size_t(i)];
      for (std::size_t k = 0; k < c; ++k) {
        double free = of(u, k) + of(b.bias, k) + (b.compliance ? of(b.compliance, k) * of(b.r, k) : 0);
        for (std::size_t l = 0; l < c; ++l) {
          rows.delassus[(l * c + k) * n + at] = of(b.delassus, l * c + k);
          free -= of(b.delassus, l * c + k) * of(b.r, l);
        }
        rows.velocity_free[k * n + at] = free;
        rows.bias[k * n + at] = of(b.bias, k);
        rows.impulse[k * n + at] = of(b.r, k);
      }
      if (in_.has_jumps()) add_jump(in_, system_, b, lane, u);
      for (std::size_t k = 0; k < c; ++k) rows.velocity[k * n + at] = of(u, k) + (own.flight ? of(own.flight, k) : 0);
      for (std::size_t k = 0; k < p; ++k) rows.params[k * n + at] = of(b.params, k);
      for (std::size_t k = 0; k < geometry; ++k) rows.geometry[k * n + at] = of(own.geometry, k);
      for (std::size_t k = 0; k < states; ++k) rows.state[k * n + at] = of(b.state, k);
      for (std::size_t k = 0; k < 4 && !rows.fields.empty(); ++k) rows.fields[k * n + at] = of(own.fields, k);
    }
  }
  return rows;
}

LawAnswer answer_of(Law law, int dim, const LawRows& rows, const std::vector<double>& params,
                    const std::vector<double>& state) {
  const LawInfo& info = law_infos()[std::size_t(law)];
  const std::size_t n = rows.candidate.size(), c = std::size_t(rows.components), p = info.parameters.size();
  if (!info.has_solve)
    throw Error("law " + info.name + " has no solution of its own, so that it cannot be asked alone");
  if (info.components(dim) != rows.components)
    throw Error("law " + info.name + " has " + std::to_string(info.components(dim)) + " components in " +
                std::to_string(dim) + "D, where the contacts have " + std::to_string(rows.components));
  if (params.size() != n * p || state.size() != n * std::size_t(info.state_columns(dim)))
    throw Error("law " + info.name + " takes " + std::to_string(p) + " parameters and " +
                std::to_string(info.state_columns(dim)) + " numbers of its state for each contact");
  LawAnswer answer{rows.impulse, state};
  std::vector<double> gap, u, free, bias, w, r, own, geometry, fields, now, energy;
  for (std::size_t first = 0; first < n; first += lanes) {
    const std::size_t last = std::min(first + lanes, n), count = (last - first + 7) / 8 * 8;
    take(rows.gap, n, first, last, count, gap);
    take(rows.velocity, n, first, last, count, u);
    take(rows.velocity_free, n, first, last, count, free);
    take(rows.bias, n, first, last, count, bias);
    take(rows.delassus, n, first, last, count, w);
    take(rows.impulse, n, first, last, count, r);
    take(rows.geometry, n, first, last, count, geometry);
    take(rows.fields, n, first, last, count, fields);
    take(params, n, first, last, count, own);
    take(state, n, first, last, count, now);
    const std::vector<double> held = r; // commit sees the impulses of the step, as its velocities are theirs
    own.insert(own.end(), count, rows.h);
    own.insert(own.end(), geometry.begin(), geometry.end());
    const cairn_law_context context{rows.h, rows.theta, geometry.data(), fields.empty() ? nullptr : fields.data(),
                                    rows.over_bodies};
    const auto lane_count = std::int32_t(count), components = std::int32_t(c);
    info.solve(lane_count, components, w.data(), free.data(), bias.data(), own.data(), now.data(), r.data(), nullptr);
    const std::vector<double> before = now;
    if (info.commit)
      info.commit(lane_count, components, &context, gap.data(), u.data(), held.data(), own.data(), now.data());
    if (const int released = info.state_column("released", dim); released >= 0 && info.energy) {
      energy.resize(4 * count); // as commit_batch has it
      info.energy(lane_count, components, &context, gap.data(), u.data(), held.data(), own.data(), before.data(),
                  now.data(), energy.data());
      for (std::size_t lane = 0, at = std::size_t(released) * count; lane < count; ++lane, ++at)
        now[at] += energy[3 * count + lane] - (now[at] - before[at]);
    }
    put(r, n, first, last, count, answer.impulse);
    put(now, n, first, last, count, answer.state);
  }
  return answer;
}

} // namespace cairn
