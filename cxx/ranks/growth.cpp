#include "growth.hpp"

#include <algorithm>
#include <numeric>

#include "../base/call.hpp"
#include "../detection/interaction_handler.hpp"
#include "colouring.hpp"
#include "partition.hpp"

namespace cairn {

RankCounts count_over_ranks(int dim, std::span<const double> position, std::span<const double> radius,
                            std::span<const std::int64_t> contacts, double reach, int ranks) {
  const auto n = std::int64_t(radius.size());
  const auto wide = std::size_t(dim);
  if ((dim != 2 && dim != 3) || position.size() != wide * radius.size() || contacts.size() % 2 != 0)
    throw Error("give positions (dim, n), radii (n) and contacts (2, m)");
  const std::vector<std::int32_t> order = space_filling_order(dim, n, position.data());
  std::vector<std::int32_t> place(order.size());
  std::vector<double> x(position.size()), r(radius.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    place[std::size_t(order[i])] = std::int32_t(i);
    std::copy_n(position.begin() + std::ptrdiff_t(wide) * order[i], dim, x.begin() + std::ptrdiff_t(wide * i));
    r[i] = radius[std::size_t(order[i])];
  }
  std::vector<std::int64_t> cost(order.size(), cost_of_body);
  for (const std::int64_t body : contacts) cost[std::size_t(place[std::size_t(body)])] += cost_of_contact / 2;
  const std::vector<std::int32_t> owner = cut_curve(cost, ranks);
  const std::vector<std::uint8_t> everywhere(order.size(), 0);
  std::vector<int> all(static_cast<std::size_t>(ranks));
  std::iota(all.begin(), all.end(), 0);
  const auto ghosts = find_ghosts({dim, n, x.data(), r.data(), everywhere.data(), owner.data(), Cell{}, reach}, all);

  std::vector<std::vector<std::int64_t>> own(all.size()); // contacts
  for (std::size_t k = 0; k + 1 < contacts.size(); k += 2)
    own[std::size_t(owner[std::size_t(place[std::size_t(std::min(contacts[k], contacts[k + 1]))])])].push_back(
        std::int64_t(k));
  RankCounts found;
  std::vector<ColourShare> shares(all.size());
  std::vector<std::int32_t> local(order.size(), -1);
  for (std::size_t rank = 0; rank < all.size(); ++rank) {
    ColourShare& share = shares[rank];
    const auto number = [&](std::int64_t body) {
      std::int32_t& at = local[std::size_t(place[std::size_t(body)])];
      if (at < 0) {
        at = std::int32_t(share.id.size());
        share.id.push_back(place[std::size_t(body)]);
        share.owner.push_back(owner[std::size_t(place[std::size_t(body)])]);
      }
      return at;
    };
    std::int64_t bodies = 0;
    const auto from = std::lower_bound(owner.begin(), owner.end(), std::int32_t(rank));
    for (auto i = from; i != owner.end() && *i == std::int32_t(rank); ++i) {
      number(order[std::size_t(i - owner.begin())]);
      ++bodies;
    }
    for (const std::int64_t k : own[rank]) {
      const std::int64_t a = std::min(contacts[std::size_t(k)], contacts[std::size_t(k) + 1]),
                         b = std::max(contacts[std::size_t(k)], contacts[std::size_t(k) + 1]);
      share.key.push_back({a, b, 0, own_image});
      share.body.push_back({number(a), number(b)});
    }
    for (const std::int64_t id : share.id) local[std::size_t(id)] = -1;
    found.bodies.push_back(bodies);
    found.ghosts.push_back(std::int64_t(ghosts[rank].size()));
    found.contacts.push_back(std::int64_t(own[rank].size()));
    found.ghost_bytes.push_back(found.ghosts.back() * 8 * (dim == 2 ? 3 : 6));
  }
  const auto exchange = virtual_ranks(ranks);
  found.colours = colour_contacts(shares, *exchange);
  const ColourLinks links = link_colours(shares, *exchange, found.colours, dim == 2 ? 3 : 6);
  for (const auto& of_rank : links.links) {
    std::int64_t messages = 0, bytes = 0;
    for (const Link& link : of_rank) {
      for (std::size_t c = 0; c + 1 < link.out_first.size(); ++c) messages += link.out_first[c] < link.out_first[c + 1];
      bytes += 8 * std::int64_t(link.out.size());
    }
    found.neighbours.push_back(std::int64_t(of_rank.size()));
    found.messages.push_back(messages);
    found.bytes.push_back(bytes);
  }
  return found;
}

} // namespace cairn
