// One rank a process of MPI, by the library cairn_mpi.
#include <dlfcn.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "../base/call.hpp"
#include "meetings.hpp"
#include "mpi/cairn_mpi.h"

namespace cairn {
namespace {

const cairn_mpi_calls& load(const std::string& path) {
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (!library) {
    const char* why = dlerror();
    throw Error("ranks over MPI need the library cairn_mpi, and " + path + " cannot be loaded (" +
                std::string(why ? why : "no reason is told") +
                "): build Cairn where MPI is found, or give a number "
                "of ranks in this process");
  }
  using Table = const cairn_mpi_calls* (*)();
  const auto table = reinterpret_cast<Table>(dlsym(library, "cairn_mpi_table"));
  const cairn_mpi_calls* calls = table ? table() : nullptr;
  if (!calls || calls->version != cairn_mpi_version)
    throw Error(path + " is of another version of Cairn: build it anew");
  return *calls;
}

class MpiRanks final : public Exchange {
public:
  MpiRanks(const std::string& path, std::int64_t communicator) : calls_(load(path)) {
    std::int32_t rank = 0;
    if (const std::int32_t code = calls_.open(communicator, &rank, &ranks_))
      throw Error("MPI cannot be opened for ranks, code " + std::to_string(code) +
                  ": give a communicator of it, the same to all simulations of a process");
    local_ = {rank};
    number_ = Meetings::all().add(*this, calls_);
  }
  ~MpiRanks() override { Meetings::all().remove(number_); }
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;
  std::string name() const override { return "mpi"; }
  int ranks() const override { return ranks_; }

  std::vector<std::vector<Parcel>> deliver(std::vector<std::vector<Parcel>> out) override {
    std::vector<std::int64_t> to(std::size_t(ranks_), -1), from(to); // -1: nothing, not even nothing
    std::vector<cairn_mpi_message> sent, received;
    for (Parcel& parcel : out[0]) {
      to[std::size_t(parcel.rank)] = std::int64_t(parcel.bytes.size());
      sent.push_back({parcel.rank, 1, parcel.bytes.data(), std::int64_t(parcel.bytes.size())});
      count(std::int64_t(parcel.bytes.size()));
    }
    ++traffic.sums;
    check(calls_.share_counts(to.data(), from.data()));
    std::vector<std::vector<Parcel>> in(1);
    for (int rank = 0; rank < ranks_; ++rank)
      if (from[std::size_t(rank)] >= 0) in[0].push_back({rank, Bytes(std::size_t(from[std::size_t(rank)]))});
    for (Parcel& parcel : in[0])
      received.push_back({parcel.rank, 1, parcel.bytes.data(), std::int64_t(parcel.bytes.size())});
    check(calls_.exchange(sent.data(), std::int64_t(sent.size()), received.data(), std::int64_t(received.size())));
    return in;
  }

  void pass(Links& links, int part) override {
    const auto k = std::size_t(part);
    sent_.clear();
    received_.clear();
    for (Link& link : links[0]) {
      const std::int32_t out = link.out_first[k], in = link.in_first[k];
      const std::int64_t n_out = 8 * std::int64_t(link.out_first[k + 1] - out),
                         n_in = 8 * std::int64_t(link.in_first[k + 1] - in);
      if (n_out > 0) sent_.push_back({link.rank, 2, link.out.data() + out, n_out});
      if (n_in > 0) received_.push_back({link.rank, 2, link.in.data() + in, n_in});
      if (n_out > 0) count(n_out);
    }
    check(calls_.exchange(sent_.data(), std::int64_t(sent_.size()), received_.data(), std::int64_t(received_.size())));
  }

  void sum(std::span<std::int64_t> values) override {
    ++traffic.sums;
    check(calls_.sum(values.data(), std::int64_t(values.size())));
  }
  void largest(std::span<double> values) override {
    ++traffic.sums;
    check(calls_.largest(values.data(), std::int64_t(values.size())));
  }

  void share(void* items, std::size_t size, std::span<const std::int64_t> first) override {
    ++traffic.sums;
    counts_.resize(std::size_t(ranks_));
    for (std::size_t rank = 0; rank < counts_.size(); ++rank)
      counts_[rank] = std::int64_t(size) * (first[rank + 1] - first[rank]);
    const std::int64_t mine = counts_[std::size_t(local_[0])];
    for (int other = 1; other < ranks_ && mine > 0; ++other) count(mine);
    check(calls_.gather(nullptr, mine, counts_.data(), static_cast<std::byte*>(items) + std::int64_t(size) * first[0]));
  }

  Gathered gather(Bytes mine) override {
    ++traffic.sums;
    std::vector<std::int64_t> counts(std::size_t(ranks_), 0);
    counts[std::size_t(local_[0])] = std::int64_t(mine.size());
    check(calls_.sum(counts.data(), ranks_));
    std::int64_t total = 0;
    for (const std::int64_t n : counts) total += n;
    Gathered found{Bytes(static_cast<std::size_t>(total)), {}};
    const std::byte none{};
    const std::byte* from = mine.empty() ? &none : mine.data();
    check(calls_.gather(from, std::int64_t(mine.size()), counts.data(), found.all.data()));
    const std::byte* at = found.all.data();
    for (const std::int64_t n : counts) {
      found.pieces.emplace_back(at, std::size_t(n));
      at += n;
    }
    return found;
  }

  bool meet(std::string_view call, bool value) override {
    ++traffic.sums;
    return Meetings::all().meet(number_, call, value);
  }
  void fail(std::string_view error) override { Meetings::all().fail(error); }
  void ask(Wish wish) override {
    ++traffic.sums;
    Meetings::all().ask(number_, wish);
  }

  void lose(std::string_view error) override {
    if (ranks_ == 1) return;
    std::fprintf(stderr, "rank %d of %d: %.*s: this rank failed alone in work of all ranks; all processes end\n",
                 local_[0], ranks_, int(error.size()), error.data());
    abort(1);
  }
  [[noreturn]] void abort(int code) override {
    calls_.abort(code);
    std::_Exit(code);
  }

private:
  static void check(std::int32_t code) {
    if (code != 0) throw Disagreement("a call of MPI failed with code " + std::to_string(code));
  }
  void count(std::int64_t bytes) {
    ++traffic.messages;
    traffic.bytes += bytes;
  }

  const cairn_mpi_calls& calls_;
  std::int32_t ranks_ = 1;
  int number_ = 0; // of its simulation
  std::vector<std::int64_t> counts_;
  std::vector<cairn_mpi_message> sent_, received_;
};

} // namespace

std::unique_ptr<Exchange> mpi_ranks(const std::string& path, std::int64_t communicator) {
  return std::make_unique<MpiRanks>(path, communicator);
}

} // namespace cairn
