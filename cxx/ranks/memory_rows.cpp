#include "memory_rows.hpp"

#include <algorithm>
#include <numeric>

namespace cairn {

ContactMemory rows_of(const ContactMemory& m, const std::vector<std::size_t>& rows) {
  ContactMemory some;
  some.h = m.h;
  some.contactors_seen = m.contactors_seen;
  some.seen_besides = m.seen_besides;
  some.joints_came = m.joints_came;
  some.impulse_components = m.impulse_components;
  some.state_components = m.state_components;
  some.seats = m.seats;
  for (const std::size_t i : rows) {
    some.keys.push_back(m.keys[i]);
    const auto copy = [i](const std::vector<double>& from, int n, std::vector<double>& to) {
      to.insert(to.end(), from.begin() + std::ptrdiff_t(i) * n, from.begin() + std::ptrdiff_t(i + 1) * n);
    };
    copy(m.impulses, m.impulse_components, some.impulses);
    copy(m.states, m.state_components, some.states);
    if (!m.anchors.empty()) some.anchors.push_back(m.anchors[i]);
  }
  return some;
}

ContactMemory own_memory(const Part& part) {
  const Simulation& s = *part.simulation;
  const auto own = [&](std::int32_t contactor) { // parts with contactors of meshes have all of their contacts
    const std::int32_t body = *s.scene.contactors.body[contactor];
    return body < 0 || part.own[std::size_t(body)] != 0;
  };
  const ContactMemory m = part.strategy->memory(s);
  ContactMemory of_own =
      rows_of(m, rows_where(s, m, [&](std::int32_t one, std::int32_t two) { return own(one) || own(two); }));
  of_own.joints_came = m.joints_came && part.has_joints; // joints between ghosts came, too
  return of_own;
}

void pack(const ContactMemory& m, Packer& packer) {
  packer.put(m.h);
  packer.put(m.contactors_seen);
  packer.put(std::int32_t(m.joints_came));
  packer.put(m.impulse_components);
  packer.put(m.state_components);
  packer.put_all(std::span<const std::int64_t>(m.seen_besides));
  packer.put_all(std::span<const RimSeat>(m.seats));
  packer.put_all(std::span<const ContactKey>(m.keys));
  packer.put_all(std::span<const double>(m.impulses));
  packer.put_all(std::span<const double>(m.states));
  packer.put_all(std::span<const Anchor>(m.anchors));
}

void add_packed(Piece bytes, ContactMemory& to) {
  Unpacker from(bytes);
  const auto append = [](auto& all, const auto& some) { all.insert(all.end(), some.begin(), some.end()); };
  while (from.more()) {
    to.h = from.get<double>();
    to.contactors_seen = std::max(to.contactors_seen, from.get<std::int64_t>());
    to.joints_came = from.get<std::int32_t>() != 0 || to.joints_came;
    const int impulses = from.get<int>(), states = from.get<int>();
    if (const auto besides = from.get_all<std::int64_t>(); !besides.empty()) to.seen_besides = besides;
    append(to.seats, from.get_all<RimSeat>());
    const auto keys = from.get_all<ContactKey>();
    const auto r = from.get_all<double>(), x = from.get_all<double>();
    const auto anchors = from.get_all<Anchor>();
    if (to.keys.empty()) to.impulse_components = impulses, to.state_components = states;
    if (keys.empty()) continue;
    if (impulses != to.impulse_components || states != to.state_components)
      throw Disagreement("ranks disagree about what contacts remember");
    const bool anchored = !to.anchors.empty() || !anchors.empty(); // ranks without a bond have none
    if (anchored) to.anchors.resize(to.keys.size());
    append(to.keys, keys);
    append(to.impulses, r);
    append(to.states, x);
    append(to.anchors, anchors);
    if (anchored) to.anchors.resize(to.keys.size());
  }
}

void put_in_order(ContactMemory& m) {
  std::vector<std::size_t> order(m.keys.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return m.keys[a] < m.keys[b]; });
  const auto same = [&](std::size_t a, std::size_t b) { return m.keys[a] == m.keys[b]; };
  order.erase(std::unique(order.begin(), order.end(), same), order.end()); // ranks that share a body told both
  const ContactMemory sorted = rows_of(m, order);
  m.keys = sorted.keys;
  m.impulses = sorted.impulses;
  m.states = sorted.states;
  m.anchors = sorted.anchors;
}

} // namespace cairn
