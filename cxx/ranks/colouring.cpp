#include "colouring.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <numeric>

#include "../base/call.hpp"

namespace cairn {
namespace {

std::uint64_t mixed(std::uint64_t x) { // splitmix64 (Steele et al. 2014)
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
  x = (x ^ x >> 27) * 0x94d049bb133111ebu;
  return x ^ x >> 31;
}

std::uint64_t hash_of(const ContactKey& key) {
  std::uint64_t h = mixed(std::uint64_t(key.contactor_a));
  h = mixed(h ^ std::uint64_t(key.contactor_b));
  return mixed(h ^ (std::uint64_t(std::uint32_t(key.feature)) << 32 | std::uint32_t(key.image)));
}

// A contact on its way between ranks.
struct Told {
  std::int64_t body; // id
  ContactKey key;
  std::int32_t rank, number;
};

bool is_in_turn(const ColourShare& s, std::size_t contact) { return !s.in_turn.empty() && s.in_turn[contact]; }

std::int32_t number_of(const ColourShare& s, std::size_t contact) {
  return is_in_turn(s, contact) ? -1 - std::int32_t(contact) : std::int32_t(contact);
}

bool by_body_and_key(const Told& a, const Told& b) { return a.body != b.body ? a.body < b.body : a.key < b.key; }

std::vector<Told> told_in(const std::vector<Parcel>& parcels) {
  std::vector<Told> all;
  for (const Parcel& parcel : parcels) {
    Unpacker from(parcel.bytes);
    const std::vector<Told> some = from.get_all<Told>();
    all.insert(all.end(), some.begin(), some.end());
  }
  std::sort(all.begin(), all.end(), by_body_and_key);
  return all;
}

std::vector<Parcel> parcels_of(const std::map<int, std::vector<Told>>& by_rank) {
  std::vector<Parcel> out;
  for (const auto& [rank, told] : by_rank) {
    Packer packer;
    packer.put_all(std::span<const Told>(told));
    out.push_back({rank, std::move(packer.bytes)});
  }
  return out;
}

void order_bodies(ColourShare& s) {
  const auto before = [&](std::int32_t a, std::int32_t b) { return s.id[std::size_t(a)] < s.id[std::size_t(b)]; };
  if (s.by_id.size() != s.id.size()) {
    s.by_id.resize(s.id.size());
    std::iota(s.by_id.begin(), s.by_id.end(), 0);
  }
  if (!std::is_sorted(s.by_id.begin(), s.by_id.end(), before)) std::sort(s.by_id.begin(), s.by_id.end(), before);
}

// Local number of a body that another rank speaks of.
std::int32_t body_of(const ColourShare& s, std::int64_t id) {
  const auto at = std::lower_bound(s.by_id.begin(), s.by_id.end(), id,
                                   [&](std::int32_t b, std::int64_t other) { return s.id[std::size_t(b)] < other; });
  if (at == s.by_id.end() || s.id[std::size_t(*at)] != id)
    throw Disagreement("ranks disagree about body " + std::to_string(id));
  return *at;
}

// Bodies that more than one rank has contacts on, by way of their owners.
class Sharing {
public:
  Sharing(std::vector<ColourShare>& shares, Exchange& exchange) : shares_(shares), exchange_(exchange) {}

  void find() {
    for (ColourShare& s : shares_) order_bodies(s);
    std::vector<std::vector<Parcel>> out;
    for (std::size_t l = 0; l < shares_.size(); ++l) out.push_back(to_owners(shares_[l], exchange_.local()[l]));
    const auto arrived = exchange_.deliver(std::move(out));
    out.clear();
    for (std::size_t l = 0; l < shares_.size(); ++l)
      out.push_back(to_sharers(shares_[l], exchange_.local()[l], told_in(arrived[l])));
    const auto lists = exchange_.deliver(std::move(out));
    for (std::size_t l = 0; l < shares_.size(); ++l) take(shares_[l], exchange_.local()[l], told_in(lists[l]));
  }

private:
  static std::vector<Parcel> to_owners(const ColourShare& s, int me) {
    std::map<int, std::vector<Told>> by_rank;
    for (std::size_t i = 0; i < s.key.size(); ++i)
      for (const std::int32_t b : s.body[i])
        if (b >= 0 && s.owner[std::size_t(b)] != me)
          by_rank[s.owner[std::size_t(b)]].push_back({s.id[std::size_t(b)], s.key[i], me, number_of(s, i)});
    return parcels_of(by_rank);
  }

  // The owner of a body tells each rank with contacts on it all contacts, and keeps them too.
  static std::vector<Parcel> to_sharers(const ColourShare& s, int me, std::vector<Told> told) {
    std::vector<std::uint8_t> spoken_of(s.id.size(), 0);
    for (const Told& t : told) spoken_of[std::size_t(body_of(s, t.body))] = 1;
    for (std::size_t i = 0; i < s.key.size(); ++i)
      for (const std::int32_t b : s.body[i])
        if (b >= 0 && spoken_of[std::size_t(b)]) told.push_back({s.id[std::size_t(b)], s.key[i], me, number_of(s, i)});
    std::sort(told.begin(), told.end(), by_body_and_key);
    std::map<int, std::vector<Told>> by_rank;
    for (std::size_t i = 0, end; i < told.size(); i = end) {
      std::vector<std::int32_t> ranks = {me};
      for (end = i; end < told.size() && told[end].body == told[i].body; ++end) ranks.push_back(told[end].rank);
      std::sort(ranks.begin(), ranks.end());
      ranks.erase(std::unique(ranks.begin(), ranks.end()), ranks.end());
      for (const std::int32_t rank : ranks)
        by_rank[rank].insert(by_rank[rank].end(), told.begin() + std::ptrdiff_t(i), told.begin() + std::ptrdiff_t(end));
    }
    return parcels_of(by_rank);
  }

  static void take(ColourShare& s, int me, const std::vector<Told>& told) {
    s.shared.clear();
    s.sharers.clear();
    s.others.clear();
    for (std::size_t i = 0, end; i < told.size(); i = end) {
      const std::int32_t body = body_of(s, told[i].body);
      std::vector<std::int32_t> ranks = {s.owner[std::size_t(body)]};
      for (end = i; end < told.size() && told[end].body == told[i].body; ++end) {
        const Told& t = told[end];
        ranks.push_back(t.rank);
        if (t.rank != me) s.others.push_back({t.key, hash_of(t.key), t.rank, t.number, -1, {body, -1}});
      }
      std::sort(ranks.begin(), ranks.end());
      ranks.erase(std::unique(ranks.begin(), ranks.end()), ranks.end());
      std::erase(ranks, me);
      s.shared.push_back(body);
      s.sharers.push_back(std::move(ranks));
    }
    join_twins(s);
  }

  // A contact with two shared bodies was told twice.
  static void join_twins(ColourShare& s) {
    const auto place = [](const ColourShare::Other& o) { return std::pair(o.rank, o.number); };
    std::stable_sort(s.others.begin(), s.others.end(),
                     [&](const auto& a, const auto& b) { return place(a) < place(b); });
    std::size_t to = 0;
    for (std::size_t i = 0; i < s.others.size(); ++i)
      if (to > 0 && place(s.others[to - 1]) == place(s.others[i]))
        s.others[to - 1].body[1] = s.others[i].body[0];
      else
        s.others[to++] = s.others[i];
    s.others.resize(to);
  }

  std::vector<ColourShare>& shares_;
  Exchange& exchange_;
};

// Colours of one rank, in passes: a pass gives a colour to each contact whose neighbours of higher rank have theirs.
class Greedy {
public:
  Greedy(ColourShare& s, int me) : s_(s), me_(me) {
    s.colour.assign(s.key.size(), -1);
    order_.reserve(s.key.size() + s.others.size());
    for (std::size_t i = 0; i < s.key.size(); ++i)
      if (!is_in_turn(s, i)) order_.push_back({hash_of(s.key[i]), s.body[i], std::int32_t(i)});
    for (std::size_t i = 0; i < s.others.size(); ++i)
      if (s.others[i].number >= 0) order_.push_back({s.others[i].hash, s.others[i].body, -1 - std::int32_t(i)});
    put_in_order();
    sharers_of_.assign(s.id.size(), -1);
    for (std::size_t k = 0; k < s.shared.size(); ++k) sharers_of_[std::size_t(s.shared[k])] = std::int32_t(k);
    taken_.assign(s.id.size(), 0);
    waits_.assign(s.id.size(), 0);
  }

  std::int64_t left() const { return left_; }

  // Parcels with colours that other ranks wait for.
  std::vector<Parcel> pass() {
    std::map<int, std::vector<std::int32_t>> news;
    std::fill(waits_.begin(), waits_.end(), 0);
    std::size_t to = 0;
    left_ = 0;
    for (const Turn& turn : order_) {
      const bool own = turn.which >= 0;
      const std::int32_t* body = turn.body.data();
      std::int32_t colour = own ? -1 : s_.others[std::size_t(-1 - turn.which)].colour;
      if (own && !waits(body[0]) && !waits(body[1])) {
        colour = s_.colour[std::size_t(turn.which)] = first_free(body);
        tell(turn.which, colour, body, news);
      }
      if (colour >= 0) {
        take(body[0], colour);
        take(body[1], colour);
        continue;
      }
      for (int k = 0; k < 2; ++k)
        if (body[k] >= 0) waits_[std::size_t(body[k])] = 1;
      left_ += own;
      order_[to++] = turn;
    }
    order_.resize(to);
    std::vector<Parcel> out;
    for (const auto& [rank, told] : news) {
      Packer packer;
      packer.put_all(std::span<const std::int32_t>(told));
      out.push_back({rank, std::move(packer.bytes)});
    }
    return out;
  }

  void hear(const std::vector<Parcel>& parcels) {
    for (const Parcel& parcel : parcels) {
      Unpacker from(parcel.bytes);
      const std::vector<std::int32_t> told = from.get_all<std::int32_t>();
      for (std::size_t k = 0; k < told.size(); k += 2) {
        const auto place = std::pair(std::int32_t(parcel.rank), told[k]);
        const auto at = std::lower_bound(s_.others.begin(), s_.others.end(), place,
                                         [](const auto& o, const auto& p) { return std::pair(o.rank, o.number) < p; });
        if (at == s_.others.end() || std::pair(at->rank, at->number) != place)
          throw Disagreement("ranks disagree about the contacts of a body that they share");
        at->colour = told[k + 1];
      }
    }
  }

private:
  struct Turn {
    std::uint64_t hash;
    std::array<std::int32_t, 2> body;
    std::int32_t which; // own contact, or -1 - that of another rank
  };
  // By hashes, which are even: first by as many of their bits as count the contacts, then among the few that share
  // these.
  void put_in_order() {
    const int bits = std::max(int(std::bit_width(order_.size())), 1);
    const auto bucket = [bits](const Turn& turn) { return std::size_t(turn.hash >> (64 - bits)); };
    std::vector<std::uint32_t> first((std::size_t(1) << bits) + 1, 0);
    for (const Turn& turn : order_) ++first[bucket(turn) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    std::vector<Turn> sorted(order_.size());
    for (const Turn& turn : order_) sorted[next[bucket(turn)]++] = turn;
    for (std::size_t k = 0; k + 1 < first.size(); ++k)
      if (first[k + 1] - first[k] > 1)
        std::sort(sorted.begin() + first[k], sorted.begin() + first[k + 1], [&](const Turn& a, const Turn& b) {
          return a.hash != b.hash ? a.hash < b.hash : key_of(a) < key_of(b);
        });
    order_ = std::move(sorted);
  }
  const ContactKey& key_of(const Turn& t) const {
    return t.which >= 0 ? s_.key[std::size_t(t.which)] : s_.others[std::size_t(-1 - t.which)].key;
  }
  bool waits(std::int32_t body) const { return body >= 0 && waits_[std::size_t(body)]; }

  // Set of the colours of a body, one bit each: the first 64 in a word, further ones in a list of words.
  std::uint64_t taken(std::int32_t body, std::size_t word) const {
    if (body < 0) return 0;
    if (word == 0) return taken_[std::size_t(body)];
    const auto more = more_.find(body);
    return more == more_.end() || more->second.size() < word ? 0 : more->second[word - 1];
  }
  std::int32_t first_free(const std::int32_t* body) const {
    for (std::size_t word = 0;; ++word)
      if (const std::uint64_t both = taken(body[0], word) | taken(body[1], word); ~both != 0)
        return std::int32_t(64 * word) + std::countr_one(both);
  }
  void take(std::int32_t body, std::int32_t colour) {
    if (body < 0) return;
    const auto word = std::size_t(colour / 64);
    const std::uint64_t bit = std::uint64_t(1) << (colour % 64);
    if (word == 0) {
      taken_[std::size_t(body)] |= bit;
      return;
    }
    std::vector<std::uint64_t>& more = more_[body];
    if (more.size() < word) more.resize(word);
    more[word - 1] |= bit;
  }
  void tell(std::int32_t which, std::int32_t colour, const std::int32_t* body,
            std::map<int, std::vector<std::int32_t>>& news) const {
    const std::vector<std::int32_t>*first = sharers_of(body[0]), *second = sharers_of(body[1]);
    const auto add = [&](std::int32_t rank) {
      std::vector<std::int32_t>& to = news[rank];
      to.push_back(which);
      to.push_back(colour);
    };
    if (first)
      for (const std::int32_t rank : *first) add(rank);
    if (second)
      for (const std::int32_t rank : *second)
        if (!first || !std::binary_search(first->begin(), first->end(), rank)) add(rank);
  }
  const std::vector<std::int32_t>* sharers_of(std::int32_t body) const {
    const std::int32_t at = body < 0 ? -1 : sharers_of_[std::size_t(body)];
    return at < 0 ? nullptr : &s_.sharers[std::size_t(at)];
  }

  ColourShare& s_;
  int me_;
  std::vector<Turn> order_; // of contacts without a colour
  std::vector<std::int32_t> sharers_of_;
  std::vector<std::uint64_t> taken_;
  std::map<std::int32_t, std::vector<std::uint64_t>> more_;
  std::vector<std::uint8_t> waits_;
  std::int64_t left_ = 0;
};

} // namespace

int colour_contacts(std::vector<ColourShare>& shares, Exchange& exchange) {
  if (exchange.ranks() > 1) Sharing(shares, exchange).find();
  std::vector<Greedy> greedy;
  greedy.reserve(shares.size());
  for (std::size_t l = 0; l < shares.size(); ++l) greedy.emplace_back(shares[l], exchange.local()[l]);
  for (double left[1] = {1}; left[0] > 0;) {
    std::vector<std::vector<Parcel>> out;
    left[0] = 0;
    for (Greedy& g : greedy) {
      out.push_back(g.pass());
      left[0] = std::max(left[0], double(g.left()));
    }
    if (exchange.ranks() == 1) break;
    const auto news = exchange.deliver(std::move(out));
    for (std::size_t l = 0; l < greedy.size(); ++l) greedy[l].hear(news[l]);
    exchange.largest(left);
  }
  double most[] = {-1, 0}; // colour, whether contacts are in turn
  for (const ColourShare& s : shares) {
    for (const std::int32_t colour : s.colour) most[0] = std::max(most[0], double(colour));
    if (std::ranges::find(s.in_turn, 1) != s.in_turn.end()) most[1] = 1;
  }
  exchange.largest(most);
  const auto colours = std::int32_t(most[0]) + 1;
  if (!(most[1] > 0)) return colours;
  for (ColourShare& s : shares) {
    for (std::size_t i = 0; i < s.in_turn.size(); ++i)
      if (s.in_turn[i]) s.colour[i] = colours;
    for (ColourShare::Other& other : s.others)
      if (other.number < 0) other.colour = colours;
  }
  return colours + 1;
}

ColourLinks link_colours(const std::vector<ColourShare>& shares, const Exchange& exchange, int colours, int numbers) {
  ColourLinks made;
  for (std::size_t l = 0; l < shares.size(); ++l) {
    const ColourShare& s = shares[l];
    std::vector<std::int32_t> place(s.id.size(), -1);
    for (std::size_t k = 0; k < s.shared.size(); ++k) place[std::size_t(s.shared[k])] = std::int32_t(k);
    struct Row { // a body that follows a contact of a colour
      std::int32_t colour, place;
    };
    std::map<int, std::array<std::vector<Row>, 2>> by_rank; // out, in
    for (std::size_t i = 0; i < s.key.size(); ++i)
      for (const std::int32_t b : s.body[i])
        if (b >= 0 && place[std::size_t(b)] >= 0)
          for (const std::int32_t rank : s.sharers[std::size_t(place[std::size_t(b)])])
            by_rank[rank][0].push_back({s.colour[i], place[std::size_t(b)]});
    for (const ColourShare::Other& other : s.others)
      for (const std::int32_t b : other.body)
        if (b >= 0) by_rank[other.rank][1].push_back({other.colour, place[std::size_t(b)]});
    auto& links = made.links.emplace_back();
    auto& out = made.out.emplace_back();
    auto& in = made.in.emplace_back();
    for (auto& [rank, rows] : by_rank) {
      Link link;
      link.rank = rank;
      for (int way = 0; way < 2; ++way) {
        std::sort(rows[way].begin(), rows[way].end(), [](const Row& a, const Row& b) {
          return a.colour != b.colour ? a.colour < b.colour : a.place < b.place;
        });
        const auto twice = [](const Row& a, const Row& b) { return a.colour == b.colour && a.place == b.place; };
        rows[way].erase(std::unique(rows[way].begin(), rows[way].end(), twice), rows[way].end());
        std::vector<std::int32_t> bodies, first(std::size_t(colours) + 1, 0);
        for (const Row& row : rows[way]) {
          bodies.push_back(s.shared[std::size_t(row.place)]);
          first[std::size_t(row.colour) + 1] += numbers;
        }
        std::partial_sum(first.begin(), first.end(), first.begin());
        (way == 0 ? link.out : link.in).resize(bodies.size() * std::size_t(numbers));
        (way == 0 ? link.out_first : link.in_first) = std::move(first);
        (way == 0 ? out : in).push_back(std::move(bodies));
      }
      links.push_back(std::move(link));
    }
  }
  exchange.match(made.links);
  return made;
}

} // namespace cairn
