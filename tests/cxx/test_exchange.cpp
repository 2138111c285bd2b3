// Errors of one rank within the work of all end all processes; those that all ranks throw alike do not.
#include <gtest/gtest.h>

#include "ranks/exchange.hpp"

namespace {

class Watched final : public cairn::Exchange {
public:
  std::string name() const override { return "watched"; }
  int ranks() const override { return 2; }
  std::vector<std::vector<cairn::Parcel>> deliver(std::vector<std::vector<cairn::Parcel>> out) override { return out; }
  void pass(cairn::Links&, int) override {}
  void sum(std::span<std::int64_t>) override {}
  void largest(std::span<double>) override {}
  void share(void*, std::size_t, std::span<const std::int64_t>) override {}
  cairn::Gathered gather(cairn::Bytes mine) override { return {std::move(mine), {}}; }
  void lose(std::string_view error) override { lost = error; }
  [[noreturn]] void abort(int code) override { std::exit(code); }
  std::string lost;
};

} // namespace

TEST(Exchange, an_error_of_one_rank_alone_ends_all) {
  Watched exchange;
  EXPECT_THROW(exchange.together([]() -> int { throw std::bad_alloc(); }), std::bad_alloc);
  EXPECT_FALSE(exchange.lost.empty());
  exchange.lost.clear();
  EXPECT_THROW(exchange.together([] { throw cairn::Disagreement("of contacts"); }), cairn::Disagreement);
  EXPECT_EQ(exchange.lost, "of contacts");
}

TEST(Exchange, an_error_of_all_ranks_passes) {
  Watched exchange;
  EXPECT_THROW(exchange.together([] { throw cairn::Error("lower dt"); }), cairn::Error);
  EXPECT_TRUE(exchange.lost.empty());
  EXPECT_EQ(exchange.together([] { return 3; }), 3);
}

TEST(Exchange, pieces_are_those_that_were_given) {
  const auto exchange = cairn::virtual_ranks(3);
  cairn::Packer packer;
  packer.put(std::int32_t(7));
  const cairn::Gathered found = exchange->gather(std::move(packer.bytes));
  ASSERT_EQ(found.pieces.size(), 1u);
  EXPECT_EQ(cairn::Unpacker(found.pieces[0]).get<std::int32_t>(), 7);
}
