// Ranks in turns in one process: messages are copied, and counted as if they were sent.
#include <algorithm>
#include <cstdlib>

#include "../base/call.hpp"
#include "exchange.hpp"

namespace cairn {

std::string Exchange::agree(const std::vector<std::string>& fault) {
  double any[] = {0};
  for (const std::string& text : fault)
    if (!text.empty()) any[0] = 1;
  largest(any);
  if (!(any[0] > 0)) return {};
  Packer mine;
  for (std::size_t l = 0; l < fault.size(); ++l) {
    if (fault[l].empty()) continue;
    mine.put(std::int32_t(local_[l]));
    mine.put_all(std::span<const char>(fault[l].data(), fault[l].size()));
    break;
  }
  for (const Piece of_process : gather(std::move(mine.bytes))) {
    if (of_process.empty()) continue;
    Unpacker from(of_process);
    const auto rank = from.get<std::int32_t>();
    const std::vector<char> text = from.get_all<char>();
    return "rank " + std::to_string(rank) + " of " + std::to_string(ranks()) + ": " +
           std::string(text.begin(), text.end());
  }
  return "a rank failed without a message";
}

void Exchange::match(Links& links) const {
  for (std::size_t l = 0; l < links.size(); ++l)
    for (Link& link : links[l]) {
      const auto other = std::lower_bound(local_.begin(), local_.end(), link.rank);
      if (other == local_.end() || *other != link.rank) continue;
      const std::vector<Link>& there = links[std::size_t(other - local_.begin())];
      const auto back = std::find_if(there.begin(), there.end(), [&](const Link& b) { return b.rank == local_[l]; });
      if (back == there.end()) throw Disagreement("ranks disagree about what they tell each other");
      link.mirror = int(back - there.begin());
    }
}

namespace {

class VirtualRanks final : public Exchange {
public:
  explicit VirtualRanks(int ranks) {
    if (ranks < 1 || ranks > most) throw Error("ranks is " + std::to_string(ranks) + ": give 1 to 100000");
    for (int r = 0; r < ranks; ++r) local_.push_back(r);
  }
  std::string name() const override { return ranks() == 1 ? "serial" : "virtual"; }
  int ranks() const override { return int(local_.size()); }

  std::vector<std::vector<Parcel>> deliver(std::vector<std::vector<Parcel>> out) override {
    std::vector<std::vector<Parcel>> in(local_.size());
    for (std::size_t from = 0; from < out.size(); ++from)
      for (Parcel& parcel : out[from]) {
        if (std::size_t(parcel.rank) != from) count(std::int64_t(parcel.bytes.size()));
        in[std::size_t(parcel.rank)].push_back({int(from), std::move(parcel.bytes)});
      }
    return in;
  }

  void pass(Links& links, int part) override {
    const auto k = std::size_t(part);
    for (auto& of_rank : links)
      for (Link& link : of_rank) {
        const std::int32_t first = link.in_first[k], last = link.in_first[k + 1];
        if (first == last) continue;
        const Link& back = links[std::size_t(link.rank)][std::size_t(link.mirror)];
        std::copy_n(back.out.begin() + back.out_first[k], last - first, link.in.begin() + first);
        count(8 * std::int64_t(last - first));
      }
  }

  void sum(std::span<std::int64_t>) override { ++traffic.sums; }
  void largest(std::span<double>) override { ++traffic.sums; }
  void share(void*, std::size_t size, std::span<const std::int64_t> first) override {
    ++traffic.sums;
    for (std::size_t rank = 0; rank < local_.size(); ++rank)
      for (std::size_t other = 1; other < local_.size() && first[rank] < first[rank + 1]; ++other)
        count(std::int64_t(size) * (first[rank + 1] - first[rank]));
  }
  Gathered gather(Bytes mine) override {
    Gathered found{std::move(mine), {}};
    found.pieces.emplace_back(found.all);
    return found;
  }
  [[noreturn]] void abort(int code) override { std::exit(code); }

private:
  static constexpr int most = 100000;
  void count(std::int64_t bytes) {
    ++traffic.messages;
    traffic.bytes += bytes;
  }
};

} // namespace

std::unique_ptr<Exchange> virtual_ranks(int ranks) { return std::make_unique<VirtualRanks>(ranks); }

} // namespace cairn
