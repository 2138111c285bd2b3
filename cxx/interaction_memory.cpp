// What the next step inherits: impulses and states of laws, found again by the keys of their contacts.
#include <algorithm>
#include <bit>
#include <limits>

#include "interaction_state.hpp"

namespace cairn {

void KeyIndex::build(const std::vector<ContactKey>& keys, Scratch& scratch) {
  const auto size = std::bit_ceil(std::max<std::uint64_t>(16, keys.size() + keys.size() / 2));
  mask_ = size - 1;
  shift_ = 64 - std::countr_zero(size);
  slots_ = scratch.take<std::int32_t>(std::int64_t(size));
  std::fill_n(slots_, size, -1);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    std::uint64_t s = hash(keys[i]);
    while (slots_[s] >= 0) s = (s + 1) & mask_;
    slots_[s] = std::int32_t(i);
  }
}

void Interactions::State::find_places(const cairn_batch& b, std::int32_t* place) const {
  std::int32_t near = 0;
  for (int lane = 0; lane < b.contacts; ++lane) {
    place[lane] = index.find(key(system.candidate[b.first + lane]), memory.keys, near);
    if (place[lane] >= 0) near = place[lane] + 1;
  }
}

namespace {

bool acts(const cairn_batch& b, int lane) {
  bool any = false;
  for (int k = 0; k < b.components; ++k) any |= at(b, b.r, lane, k) != 0;
  return any;
}

} // namespace

// Contacts with an impulse or a state.
std::int64_t Interactions::State::count_kept() const {
  std::int64_t kept = 0;
  for (const cairn_batch& b : system.batches) {
    if (b.state) {
      kept += b.contacts;
    } else if (b.pack) { // dummies have no impulse
      for (int first = 0; first < b.count; first += 8) {
        const double* r = b.r + first * b.pack;
        for (int i = 0; i < 8; ++i) {
          bool any = false;
          for (int k = 0; k < b.components; ++k) any |= r[8 * k + i] != 0;
          kept += any;
        }
      }
    } else {
      for (int lane = 0; lane < b.contacts; ++lane) kept += acts(b, lane);
    }
  }
  return kept;
}

void Interactions::State::remember() {
  ContactMemory& m = memory;
  m.h = h;
  m.impulse_components = impulse_components;
  m.state_components = state_components;
  // one more than are kept: each is written before it is known whether it is
  const auto kept = std::size_t(count_kept());
  fit(m.keys, kept + 1);
  fit(m.impulses, (kept + 1) * impulse_components);
  fit(m.states, (kept + 1) * state_components);
  std::int64_t to = 0;
  for (const cairn_batch& b : system.batches) {
    if (b.pack && state_components == 0 && impulse_components == dim())
      to = dim() == 2 ? remember_packed<2>(b, to) : remember_packed<3>(b, to);
    else
      to = remember(b, to);
  }
  m.keys.resize(kept);
  m.impulses.resize(kept * impulse_components);
  m.states.resize(kept * state_components);
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
      bool any = false;
      for (int k = 0; k < d; ++k) any |= r[8 * k + i] != 0;
      to += any;
    }
  }
  return to;
}

std::int64_t Interactions::State::remember(const cairn_batch& b, std::int64_t to) {
  const int n = b.count, states = int(law_infos()[b.law].state.size());
  for (int lane = 0; lane < b.contacts; ++lane) {
    if (!b.state && !acts(b, lane)) continue;
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
