#include "../networks/network_unknowns.hpp"

#include <algorithm>

#include "../laws/law_info.hpp"
#include "../networks/unknowns.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

void NetworkUnknowns::place(const Simulation& s, NetworkInput& in) {
  const Bodies& b = s.scene.bodies;
  const Contactors& k = s.scene.contactors;
  if (order == s.scene.order_version()) return;
  order = s.scene.order_version();
  const auto n = std::size_t(unknowns(s.scene));
  for (std::int64_t c = 0; c < k.count; ++c)
    if (std::size_t(*k.material[c]) >= in.materials.size()) in.materials.resize(std::size_t(*k.material[c]) + 1);
  for (std::size_t m = 0; m < in.materials.size(); ++m) {
    const int entry = s.laws.find(int(m), int(m));
    in.materials[m].joint |= entry >= 0 && law_infos()[std::size_t(s.laws.entry(entry).law)].joins;
  }
  material.assign(n, -1);
  for (std::int64_t c = k.count - 1; c >= 0; --c)
    if (*k.body[c] >= 0 && !in.materials[*k.material[c]].joint) material[*k.body[c]] = *k.material[c];
  capacity.assign(n, 0.0);
  mass.assign(b.mass.values.begin(), b.mass.values.end());
  mass.resize(n, 0.0); // nodes have the heat of their elements
  const auto row = [&](std::int64_t id) { return unknown_of_id(s.scene, id); };
  for (std::size_t i = 0; i < in.node.size(); ++i)
    if (const std::int32_t at = row(in.node[i]); at >= 0) capacity[at] += in.node_capacity[i];
  fixed_a.resize(in.branch_a.size());
  fixed_b.resize(in.branch_b.size());
  for (std::size_t i = 0; i < in.branch_a.size(); ++i) {
    fixed_a[i] = row(in.branch_a[i]);
    fixed_b[i] = row(in.branch_b[i]);
  }
  source_body.resize(in.sources.size());
  for (std::size_t j = 0; j < in.sources.size(); ++j) {
    source_body[j].resize(in.sources[j].ids.size());
    std::transform(in.sources[j].ids.begin(), in.sources[j].ids.end(), source_body[j].begin(), row);
  }
}

void take_source(const NetworkSource& from, const std::vector<std::int32_t>& body, std::uint8_t* held, double* value,
                 double* flow) {
  bool first = true;
  for (std::size_t i = 0; i < from.ids.size(); ++i) {
    if (body[i] < 0) continue;
    if (from.kind == NetworkSource::held) {
      held[body[i]] = 1;
      value[body[i]] = from.value[i];
    } else if (from.kind == NetworkSource::flow && (!from.electrode || first)) {
      flow[body[i]] += from.value[i];
    }
    first = false;
  }
}

std::int64_t NetworkUnknowns::bytes() const {
  std::int64_t sum = 0;
  for (const auto* v : {&capacity, &mass}) sum += std::int64_t(8 * v->capacity());
  for (const auto* v : {&material, &fixed_a, &fixed_b}) sum += std::int64_t(4 * v->capacity());
  return sum;
}

} // namespace cairn
