#include "sweep_exchange.hpp"

#include <algorithm>
#include <map>

namespace cairn {

void SweepExchange::link(const std::vector<ColourShare>& shares, const Exchange& exchange, int numbers) {
  numbers_ = numbers;
  links_.clear();
  followed_.assign(shares.size(), {});
  velocity_.resize(shares.size());
  for (std::size_t l = 0; l < shares.size(); ++l) {
    const ColourShare& s = shares[l];
    const int me = exchange.local()[l];
    std::map<int, std::int32_t> count; // bodies of each link
    for (const auto& ranks : s.sharers)
      for (const std::int32_t rank : ranks) ++count[rank];
    std::map<int, std::int32_t> place;
    auto& links = links_.emplace_back();
    for (auto& [rank, bodies] : count) {
      place[rank] = std::int32_t(links.size());
      Link link;
      link.rank = rank;
      link.out.resize(std::size_t(bodies) * std::size_t(numbers));
      link.in.resize(link.out.size());
      link.out_first = link.in_first = {0, std::int32_t(link.out.size())};
      links.push_back(std::move(link));
      bodies = 0;
    }
    for (std::size_t k = 0; k < s.shared.size(); ++k) { // by rising id, as the other ranks have them
      Followed one{s.shared[k], {}, {}, 0};
      for (const std::int32_t rank : s.sharers[k]) {
        one.place.push_back(place[rank]);
        one.at.push_back(numbers * count[rank]++);
        one.before += rank < me;
      }
      followed_[l].push_back(std::move(one));
    }
  }
  exchange.match(links_);
}

void SweepExchange::begin(std::size_t rank, const Array<cairn_record>& record) {
  Array<double>& v = velocity_[rank];
  v.resize(std::size_t(numbers_) * record.size());
  double* to = v.data();
  for (const cairn_record& r : record) to = std::copy_n(r.x, numbers_, to);
}

void SweepExchange::end(const std::vector<Array<cairn_record>*>& records, Exchange& exchange, double share) {
  const auto n = std::size_t(numbers_);
  const auto before = [&](std::size_t l, std::int32_t body) { return &velocity_[l][n * std::size_t(body)]; };
  for (std::size_t l = 0; l < records.size(); ++l)
    for (const Followed& one : followed_[l])
      for (std::size_t j = 0; j < one.place.size(); ++j)
        for (std::size_t k = 0; k < n; ++k)
          links_[l][std::size_t(one.place[j])].out[std::size_t(one.at[j]) + k] =
              (*records[l])[std::size_t(one.body)].x[k] - before(l, one.body)[k];
  exchange.pass(links_, 0);
  for (std::size_t l = 0; l < records.size(); ++l) {
    for (const Followed& one : followed_[l]) {
      double* x = (*records[l])[std::size_t(one.body)].x;
      for (std::size_t k = 0; k < n; ++k) {
        const double own = x[k] - before(l, one.body)[k];
        double sum = 0;
        for (std::size_t j = 0; j <= one.place.size(); ++j) {
          if (j == one.before) sum += own;
          if (j < one.place.size()) sum += links_[l][std::size_t(one.place[j])].in[std::size_t(one.at[j]) + k];
        }
        x[k] = before(l, one.body)[k] + sum;
      }
    }
    if (!(share < 1)) continue;
    const double* was = velocity_[l].data();
    for (cairn_record& r : *records[l])
      for (std::size_t k = 0; k < n; ++k, ++was) r.x[k] = *was + share * (r.x[k] - *was);
  }
}

// Less where the error did not fall: with the share 1/m of bodies that m ranks share it falls for certain.
void SweepExchange::follow(double square) {
  constexpr double least = 0.25;
  if (!(square < last_)) share_ = std::max(least, 0.75 * share_);
  last_ = std::min(last_, square);
}

} // namespace cairn
