// Finds contacts in what a step remembers of the last one. They stand there in the order of then, which changes little
// from step to step: most are found right after the one before, or a few places on. The memory is searched for the
// rest.
#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "../base/scratch.hpp"
#include "candidates.hpp"

namespace cairn {

// Numbers by the hash of a key: multiplicative (Knuth 1973), the upper bits are the good ones.
class KeyTable {
public:
  KeyTable(std::int64_t items, Scratch& scratch) {
    const auto size = std::bit_ceil(std::max<std::uint64_t>(16, items + items / 2));
    mask_ = size - 1;
    shift_ = 64 - std::countr_zero(size);
    slots_ = scratch.take<std::int32_t>(std::int64_t(size));
    std::fill_n(slots_, size, -1);
  }
  void insert(const ContactKey& key, std::int64_t number) {
    std::uint64_t s = hash(key);
    while (slots_[s] >= 0) s = (s + 1) & mask_;
    slots_[s] = std::int32_t(number);
  }
  // -1 if it is not there
  template <class KeyOf>
  std::int32_t find(const ContactKey& key, KeyOf&& key_of) const {
    for (std::uint64_t s = hash(key); slots_[s] >= 0; s = (s + 1) & mask_)
      if (key_of(slots_[s]) == key) return slots_[s];
    return -1;
  }

private:
  std::uint64_t hash(const ContactKey& k) const {
    const std::uint64_t part = std::uint64_t(std::uint32_t(k.feature)) << 32 | std::uint32_t(k.image);
    const std::uint64_t x = std::uint64_t(k.contactor_a) * 0x9e3779b97f4a7c15u +
                            std::uint64_t(k.contactor_b) * 0xbf58476d1ce4e5b9u + part * 0x94d049bb133111ebu;
    return ((x ^ x >> 32) * 0x9e3779b97f4a7c15u) >> shift_;
  }
  std::int32_t* slots_ = nullptr; // in the scratch
  std::uint64_t mask_ = 0;
  int shift_ = 0;
};

// Where the order is lost, a sample of the memory tells where it goes on, and the way back to there is walked.
template <class KeyOf>
void find_in_order(const std::vector<ContactKey>& memory, const KeyTable& sample, std::int64_t first, std::int64_t last,
                   KeyOf&& key_of, std::int32_t* place, std::uint8_t* taken) {
  const auto kept = std::int64_t(memory.size());
  const auto take = [&](std::int64_t c, std::int64_t at) {
    place[c] = std::int32_t(at);
    taken[at] = 1;
  };
  constexpr std::int64_t ahead = 8;
  std::int64_t next = std::min(first, kept), reach = ahead;
  for (std::int64_t c = first; c < last; ++c) {
    const ContactKey key = key_of(c);
    place[c] = -1;
    if (key.contactor_a < 0) continue;
    std::int64_t at = next;
    const std::int64_t end = std::min(next + reach, kept);
    while (at < end && !(memory[at] == key)) ++at;
    if (at == end) at = sample.find(key, [&](std::int32_t i) { return memory[i]; });
    reach = at < 0 ? 1 : ahead;
    if (at < 0) continue;
    take(c, at);
    next = at + 1;
    for (std::int64_t b = c - 1, i = at - 1; b >= first && i >= 0 && place[b] < 0 && memory[i] == key_of(b); --b, --i)
      take(b, i);
  }
}

template <class KeyOf>
void find_missing(const std::vector<ContactKey>& memory, std::int64_t n, KeyOf&& key_of, Scratch& scratch,
                  std::int32_t* place, const std::uint8_t* taken) {
  const std::int64_t missing = std::count(place, place + n, -1);
  if (missing == 0 || memory.empty()) return;
  KeyTable table(missing, scratch);
  for (std::int64_t c = 0; c < n; ++c) {
    if (place[c] >= 0) continue;
    const ContactKey key = key_of(c);
    if (key.contactor_a >= 0) table.insert(key, c);
  }
  for (std::size_t i = 0; i < memory.size(); ++i) {
    if (taken[i]) continue;
    const std::int32_t c = table.find(memory[i], key_of);
    if (c >= 0) place[c] = std::int32_t(i);
  }
}

// place[c]: where key_of(c) stands in the memory, -1 if it does not. A key with a negative contactor_a is none.
template <class KeyOf>
void find_keys(const std::vector<ContactKey>& memory, std::int64_t n, KeyOf&& key_of, int threads, Scratch& scratch,
               std::int32_t* place) {
  auto* taken = scratch.take<std::uint8_t>(std::int64_t(memory.size()));
  std::fill_n(taken, memory.size(), 0);
  constexpr std::int64_t apart = 16;
  KeyTable sample(std::int64_t(memory.size()) / apart + 1, scratch);
  for (std::size_t i = 0; i < memory.size(); i += apart) sample.insert(memory[i], std::int64_t(i));
#pragma omp parallel for num_threads(threads) schedule(static) if (threads > 1)
  for (int t = 0; t < threads; ++t)
    find_in_order(memory, sample, n * t / threads, n * (t + 1) / threads, key_of, place, taken);
  find_missing(memory, n, key_of, scratch, place, taken);
}

} // namespace cairn
