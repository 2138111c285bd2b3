#include "ghost_links.hpp"

#include <algorithm>
#include <array>
#include <map>

namespace cairn {

// Ranks tell owners which of their bodies they follow.
void GhostLinks::link(const std::vector<Part>& parts, Exchange& exchange) {
  links_.clear();
  out_.clear();
  in_.clear();
  std::vector<std::vector<Parcel>> out;
  std::vector<std::map<int, std::vector<std::int32_t>>> wanted;
  for (const Part& part : parts) {
    auto& by_owner = wanted.emplace_back();
    for (std::size_t i = 0; i < part.bodies.size(); ++i)
      if (!part.own[i] && !part.fixed[i]) by_owner[part.owner[i]].push_back(std::int32_t(i));
    auto& parcels = out.emplace_back();
    for (const auto& [rank, bodies] : by_owner) {
      std::vector<std::int64_t> ids;
      for (const std::int32_t i : bodies) ids.push_back(*part.simulation->scene.bodies.id[i]);
      Packer packer;
      packer.put_all(std::span<const std::int64_t>(ids));
      parcels.push_back({rank, std::move(packer.bytes)});
    }
  }
  const auto asked = exchange.deliver(std::move(out));
  for (std::size_t l = 0; l < parts.size(); ++l) {
    const Scene& scene = parts[l].simulation->scene;
    const int n = scene.bodies.dofs();
    std::map<int, std::array<std::vector<std::int32_t>, 2>> by_rank; // out, in
    for (const auto& [rank, bodies] : wanted[l]) by_rank[rank][1] = bodies;
    for (const Parcel& parcel : asked[l]) {
      Unpacker from(parcel.bytes);
      for (const std::int64_t id : from.get_all<std::int64_t>()) by_rank[parcel.rank][0].push_back(scene.internal(id));
    }
    auto& links = links_.emplace_back();
    auto& bodies_out = out_.emplace_back();
    auto& bodies_in = in_.emplace_back();
    for (auto& [rank, bodies] : by_rank) {
      Link link;
      link.rank = rank;
      link.out.resize(bodies[0].size() * std::size_t(n));
      link.in.resize(bodies[1].size() * std::size_t(n));
      link.out_first = {0, std::int32_t(link.out.size())};
      link.in_first = {0, std::int32_t(link.in.size())};
      links.push_back(std::move(link));
      bodies_out.push_back(std::move(bodies[0]));
      bodies_in.push_back(std::move(bodies[1]));
    }
  }
  exchange.match(links_);
}

void GhostLinks::follow(std::vector<Part>& parts, Exchange& exchange, Field<double> Bodies::*field) {
  if (exchange.ranks() == 1) return;
  const auto each = [&](const auto& bodies, auto&& f) {
    for (std::size_t l = 0; l < parts.size(); ++l)
      for (std::size_t j = 0; j < links_[l].size(); ++j) {
        Field<double>& of = parts[l].simulation->scene.bodies.*field;
        std::size_t at = 0;
        for (const std::int32_t body : bodies[l][j]) {
          f(of[body], links_[l][j], at, of.components);
          at += std::size_t(of.components);
        }
      }
  };
  each(out_, [](const double* v, Link& link, std::size_t at, int n) { std::copy_n(v, n, &link.out[at]); });
  exchange.pass(links_, 0);
  each(in_, [](double* v, const Link& link, std::size_t at, int n) { std::copy_n(&link.in[at], n, v); });
}

} // namespace cairn
