// What the next step inherits: impulses and states of laws, found again by the keys of their contacts.
#include <algorithm>
#include <limits>

#include "interaction_state.hpp"
#include "key_search.hpp"

namespace cairn {

void Interactions::State::find_places(int threads) {
  const auto n = std::int64_t(system.candidate.size());
  place = scratch.take<std::int32_t>(n);
  const auto key_of = [&](std::int64_t c) { // dummies have none
    return system.candidate[c] < 0 ? ContactKey{-1, -1, 0, 0} : key(system.candidate[c]);
  };
  find_keys(memory.keys, n, key_of, threads, scratch, place);
}

void Interactions::State::remember() {
  ContactMemory& m = memory;
  m.h = h;
  m.impulse_components = impulse_components;
  m.state_components = state_components;
  std::size_t kept = 0; // without an impulse, too: the order is what finds the others
  for (const cairn_batch& b : system.batches) kept += std::size_t(b.contacts);
  fit(m.keys, kept);
  fit(m.impulses, kept * impulse_components);
  fit(m.states, kept * state_components);
  std::int64_t to = 0;
  for (const cairn_batch& b : system.batches) {
    if (b.pack && state_components == 0 && impulse_components == dim())
      to = dim() == 2 ? remember_packed<2>(b, to) : remember_packed<3>(b, to);
    else
      to = remember(b, to);
  }
  for (std::int64_t c = 0; c < contactors->count; ++c)
    m.contactors_seen = std::max(m.contactors_seen, *contactors->id[c] + 1);
}

template <int d>
std::int64_t Interactions::State::remember_packed(const cairn_batch& b, std::int64_t to) {
  const int lines = 8 * b.pack;
  for (int first = 0; first < b.contacts; first += 8) {
    const double* pack = b.frame + first / 8 * lines;
    const double* r = pack + 8 * (d + 4);
    double p[d][8];
    for (int i = 0; i < 8; ++i) {
      if constexpr (d == 2) {
        p[0][i] = r[i];
        p[1][i] = r[8 + i];
      } else {
        const double n[3] = {pack[i], pack[8 + i], pack[16 + i]};
        double t[3];
        tangent_of(n, t);
        for (int k = 0; k < 3; ++k) {
          const double s = n[(k + 1) % 3] * t[(k + 2) % 3] - n[(k + 2) % 3] * t[(k + 1) % 3];
          p[k][i] = n[k] * r[i] + t[k] * r[8 + i] + s * r[16 + i];
        }
      }
    }
    const int some = std::min(8, b.contacts - first);
    for (int i = 0; i < some; ++i) {
      memory.keys[to] = key(system.candidate[b.first + first + i]);
      for (int k = 0; k < d; ++k) memory.impulses[d * to + k] = p[k][i];
      ++to;
    }
  }
  return to;
}

std::int64_t Interactions::State::remember(const cairn_batch& b, std::int64_t to) {
  const int n = b.count, states = int(law_infos()[b.law].state.size());
  for (int lane = 0; lane < b.contacts; ++lane) {
    memory.keys[to] = key(system.candidate[b.first + lane]);
    double p[6] = {};
    if (dim() == 2)
      for (int k = 0; k < b.components; ++k) p[k] = at(b, b.r, lane, k);
    else
      space_impulse(b, lane, p, p + 3);
    for (int k = 0; k < impulse_components; ++k) memory.impulses[to * impulse_components + k] = p[k];
    for (int k = 0; k < state_components; ++k)
      memory.states[to * state_components + k] =
          k < states ? b.state[k * n + lane] : std::numeric_limits<double>::max();
    ++to;
  }
  return to;
}

} // namespace cairn
