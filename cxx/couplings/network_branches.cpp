#include "../networks/network_branches.hpp"

#include <algorithm>
#include <limits>

#include "../networks/unknowns.hpp"
#include "../simulation/simulation.hpp"

namespace cairn {

// Branches of contacts. One on a mesh goes to the nodes that carry its point, each by its weight.
void NetworkBranches::lay(const Simulation& s) {
  const Candidates& c = s.candidates;
  const Contactors& k = s.scene.contactors;
  a.clear();
  b.clear();
  of_contact.clear();
  weight.clear();
  struct Carried {
    std::int32_t body[4];
    double weight[4];
    int count = 0;
  };
  const auto carry = [&](std::int32_t contactor, std::int64_t i, bool other) {
    Carried out;
    if (const std::int32_t body = *k.body[contactor]; body >= 0) {
      out.body[0] = body;
      out.weight[0] = 1;
      out.count = 1;
      return out;
    }
    double shift[3] = {0, 0, 0}, point[3] = {0, 0, 0}, sum = 0;
    if (s.scene.cell.any() && other) image_shift(s.scene.cell, c.image[i], shift);
    for (int d = 0; d < std::min(s.scene.dim, 3); ++d) point[d] = c.point[s.scene.dim * i + d] - shift[d];
    const Mapping m = s.meshes.mapping(s.scene.nodes, contactor, point, other ? c.contactor_a[i] : c.contactor_b[i]);
    for (int j = 0; j < 4; ++j) {
      if (m.node[j] < 0 || !(m.weight[j] > 0)) continue;
      out.body[out.count] = std::int32_t(unknown_of_node(s.scene, s.meshes.meshes[m.mesh].node(m.node[j])));
      sum += out.weight[out.count++] = m.weight[j];
    }
    for (int j = 0; j < out.count; ++j) out.weight[j] /= sum;
    return out;
  };
  for (std::int64_t i = 0; i < c.count; ++i) {
    const Carried one = carry(c.contactor_a[i], i, false), other = carry(c.contactor_b[i], i, true);
    for (int p = 0; p < one.count; ++p)
      for (int q = 0; q < other.count; ++q) {
        a.push_back(one.body[p]);
        b.push_back(other.body[q]);
        of_contact.push_back(std::int32_t(i));
        weight.push_back(one.weight[p] * other.weight[q]);
      }
  }
  of_contacts = std::int64_t(a.size());
  for (std::size_t j = 0; j < rows_.fixed_a.size(); ++j) {
    const bool there = rows_.fixed_a[j] >= 0 && rows_.fixed_b[j] >= 0;
    a.push_back(there ? rows_.fixed_a[j] : 0);
    b.push_back(there ? rows_.fixed_b[j] : 0);
  }
  value.resize(a.size());
}

void NetworkBranches::weigh(const std::vector<double>& conductance, const NetworkInput& in) {
  for (std::int64_t e = 0; e < of_contacts; ++e) value[e] = weight[e] * conductance[of_contact[e]];
  for (std::size_t j = 0; j < rows_.fixed_a.size(); ++j) value[of_contacts + j] = in.branch_conductance[j];
}

// Bodies of an electrode one after the other, joined perfectly.
void NetworkBranches::join_electrodes(const NetworkInput& in) {
  for (std::size_t j = 0; j < in.sources.size(); ++j) {
    if (!in.sources[j].electrode) continue;
    std::int32_t before = -1;
    for (const std::int32_t i : rows_.source_body[j]) {
      if (i < 0) continue;
      if (before >= 0) {
        a.push_back(before);
        b.push_back(i);
        value.push_back(std::numeric_limits<double>::infinity());
      }
      before = i;
    }
  }
}

ConductionReport NetworkBranches::solve(const NetworkInput& in, const std::vector<double>& source,
                                        const std::vector<double>& leak, const std::vector<std::uint8_t>& held,
                                        double* x, NetworkReport& report) {
  through.resize(a.size());
  ConductionGraph g;
  g.n = std::int64_t(source.size());
  g.branches = std::int64_t(a.size());
  g.a = a.data();
  g.b = b.data();
  g.conductance = value.data();
  g.leak = leak.data();
  g.held = held.data();
  const ConductionReport r = conduction_.solve(g, source.data(), x, through.data(), in.options);
  report.factorisations += r.factorisations;
  report.iterations += r.iterations;
  return r;
}

std::int64_t NetworkBranches::bytes() const {
  std::int64_t sum = conduction_.bytes();
  for (const auto* v : {&weight, &value, &through}) sum += std::int64_t(8 * v->capacity());
  for (const auto* v : {&a, &b, &of_contact}) sum += std::int64_t(4 * v->capacity());
  return sum;
}

} // namespace cairn
