#include "batch_storage.hpp"

#include <algorithm>
#include <limits>

#include "../laws/law_geometry.hpp"
#include "../solvers/sweeps/batch.hpp"

namespace cairn {

void BatchStorage::lay_out_mapping(const cairn_batch& b, std::int32_t*& node, std::int32_t*& dof, double*& response,
                                   std::int32_t stride) {
  node = scratch_.take<std::int32_t>(4 * std::int64_t(b.count));
  dof = scratch_.take<std::int32_t>(6 * std::int64_t(b.count));
  response =
      stride ? scratch_.take<double>(std::int64_t(stride) * (b.turns ? b.components : in_.dim()) * b.count) : nullptr;
}

// Shared block of parameters, for batches of equal size with a single pair of materials and a law whose parameters
// depend on pair and step alone: a sweep over many batches then finds it in cache. Null: the batch has its own.
double* BatchStorage::params_of_pair(const cairn_batch& b) {
  const LawInfo& law = law_infos()[b.law];
  const std::int32_t pair = classes_.entry[system_.candidate[b.first]];
  if (!law.keeps_area || law.plugged() || in_.temperature) return nullptr;
  for (int lane = 1; lane < b.contacts; ++lane)
    if (classes_.entry[system_.candidate[b.first + lane]] != pair) return nullptr;
  constexpr std::size_t most = 64; // of a scene with more pairs the last ones are looked at: batches come pair by pair
  const auto known = [&](const PairParams& shared) { return shared.entry == pair && shared.count == b.count; };
  const auto oldest = params_of_pairs_.rbegin() + std::ptrdiff_t(std::min(most, params_of_pairs_.size()));
  const auto found = std::find_if(params_of_pairs_.rbegin(), oldest, known);
  if (found != oldest) return found->params;
  const std::size_t n = std::size_t(b.count), parameters = law.parameters.size();
  double* params = scratch_.take<double>(std::int64_t((parameters + 4) * n));
  for (std::size_t k = 0; k < parameters; ++k)
    std::fill_n(params + k * n, n, std::min(in_.laws->entry(pair).params[k], std::numeric_limits<double>::max()));
  std::fill_n(params + parameters * n, n, in_.h);
  std::fill_n(params + (parameters + 1) * n, 3 * n, 0.0);
  params_of_pairs_.push_back({pair, b.count, params});
  return params;
}

// Blocks of numbers in the order in which a sweep reads them.
void BatchStorage::lay_out(std::int32_t* place) {
  const std::size_t places = system_.candidate.size();
  auto* body_a = scratch_.take<std::int32_t>(places);
  auto* body_b = scratch_.take<std::int32_t>(places);
  // where nothing grows places are read until batches are filled, before a solver writes a status; growth reads them
  // after it
  auto* status = in_.bodies->stretch.active ? scratch_.take<std::int32_t>(places) : place;
  std::size_t doubles = 0;
  const auto block = [](const cairn_batch& b) { return b.block ? b.components * b.components : 2; };
  params_of_pairs_.clear();
  for (cairn_batch& b : system_.batches) b.params = b.pack ? nullptr : params_of_pair(b);
  const auto params = [](const cairn_batch& b) {
    const LawInfo& law = law_infos()[b.law];
    if (b.params) return 0;
    return law.has_solve ? int(law.parameters.size()) + 1 + geometry_columns(law) : 1;
  };
  const auto states = [&](const cairn_batch& b) { return law_infos()[b.law].state_columns(in_.dim()); };
  const int frame = in_.dim() == 2 ? 2 : 6;
  system_.compliant = false;
  given = in_.options.pose.kernel ? scratch_.take<double>(std::int64_t(places) * (3 * in_.dim() - 3)) : nullptr;
  parted = in_.bodies->stretch.active ? scratch_.take<double>(std::int64_t(places)) : nullptr;
  for (const cairn_batch& b : system_.batches)
    doubles += std::size_t(b.count) * (2 + (b.pack ? b.pack
                                                   : frame + sides()[b.side_a].lever + sides()[b.side_b].lever +
                                                         block(b) + 3 * b.components + params(b) + states(b)));
  double* next = scratch_.take<double>(doubles);
  own_numbers_ = {next, doubles};
  fit(of_law, system_.batches.size());
  // numbers that sweeps do not read, kept apart
  double* apart = next + doubles - 2 * places;
  for (cairn_batch& b : system_.batches) {
    b.rho = apart;
    b.scale = apart + b.count;
    apart += 2 * b.count;
    b.body_a = body_a + b.first;
    b.body_b = body_b + b.first;
    b.status = status + b.first;
    const LawInfo& law = law_infos()[b.law];
    const bool asks = law.has_solve || law.commit || law.energy;
    LawColumns& own = of_law[std::size_t(&b - system_.batches.data())];
    own.geometry = asks ? scratch_.take<double>(geometry_columns(law) * std::int64_t(b.count)) : nullptr;
    own.flight = asks ? scratch_.take<double>(b.components * std::int64_t(b.count)) : nullptr;
    own.energy = law.energy ? scratch_.take<double>(4 * std::int64_t(b.count)) : nullptr;
    own.fields = asks && in_.has_fields() ? scratch_.take<double>(4 * std::int64_t(b.count)) : nullptr;
    own.context = {in_.h, in_.theta_of(law), own.geometry, own.fields, 0};
    b.context = &own.context;
    const auto take = [&](int components) {
      double* here = next;
      next += std::size_t(components) * b.count;
      return here;
    };
    if (b.pack) {
      b.frame = take(b.pack);
      place_pack(b, in_.dim());
      continue;
    }
    b.frame = take(frame);
    b.lever_a = take(sides()[b.side_a].lever);
    b.lever_b = take(sides()[b.side_b].lever);
    lay_out_spins(b);
    if (b.mapped_a) lay_out_mapping(b, b.node_a, b.dof_a, b.response_a, b.stride_a);
    if (b.mapped_b) lay_out_mapping(b, b.node_b, b.dof_b, b.response_b, b.stride_b);
    if (b.contacts == 1 && ropes_.is_rope(system_.candidate[b.first])) {
      b.rope_body = scratch_.take<std::int32_t>(2 * std::int64_t(b.count));
      b.rope = scratch_.take<double>(rope_numbers * std::int64_t(b.count));
    }
    b.bias = take(b.components);
    const bool may_yield = in_.options.pose.kernel || law.yields;
    b.compliance = may_yield ? take(b.components) : nullptr;
    system_.compliant = system_.compliant || may_yield;
    b.delassus = take(block(b));
    b.r = take(b.components);
    if (!b.params) b.params = take(params(b));
    b.state = states(b) ? take(states(b)) : nullptr;
  }
}

// Lays out the spins of sides: a rigid body turns against the face of a mesh, while between meshes several points carry
// moments. Bonds that hold fast have none: near a node bonded to one side, the next side would turn the body about that
// node with almost no lever, and load the bond as much as that takes.
void BatchStorage::lay_out_spins(cairn_batch& b) {
  if (b.components == in_.dim() || b.mapped_a == b.mapped_b || law_infos()[b.law].holds) return;
  const auto numbers = 4 * in_.dim() * (b.components - in_.dim()) * std::int64_t(b.count);
  b.turns = scratch_.take<std::int32_t>(b.count);
  (b.mapped_a ? b.spin_a : b.spin_b) = scratch_.take<double>(numbers);
}

} // namespace cairn
