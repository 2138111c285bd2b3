#include "contacts_of_nodes.hpp"

#include <algorithm>

namespace cairn::detection {

void ContactsOfNodes::fill(const PlacedScene& scene, const Candidates& out) {
  if (!of_nodes_.empty()) return;
  for (std::int64_t i = 0; i < out.count; ++i)
    if (scene.is_mapped_point(out.contactor_a[i])) of_nodes_.emplace_back(out.contactor_a[i], i);
  std::sort(of_nodes_.begin(), of_nodes_.end());
  on_sides_.clear();
  for (const auto& [node, i] : of_nodes_) on_sides_.emplace_back(out.contactor_b[i], i);
  std::sort(on_sides_.begin(), on_sides_.end());
}

std::span<const ContactsOfNodes::Entry> ContactsOfNodes::equal(const std::vector<Entry>& list, std::int32_t contactor) {
  const auto first = std::lower_bound(list.begin(), list.end(), Entry(contactor, 0));
  auto last = first;
  while (last != list.end() && last->first == contactor) ++last;
  return {first, last};
}

} // namespace cairn::detection
