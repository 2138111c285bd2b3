// The ranks of an exchange share the sums over the particles of a liquid.
#pragma once
#include <memory>
#include <utility>

#include "../fluid/particle_shares.hpp"
#include "exchange.hpp"

namespace cairn {

class LiquidShares final : public ParticleShares {
public:
  explicit LiquidShares(std::shared_ptr<Exchange> exchange) : exchange_(std::move(exchange)) {}
  int ranks() const override { return exchange_->ranks(); }
  int first_local() const override { return exchange_->local().front(); }
  int last_local() const override { return exchange_->local().back() + 1; }
  void share(void* items, std::size_t size, std::span<const std::int64_t> first) override {
    const Traffic before = exchange_->traffic;
    exchange_->share(items, size, first);
    told_ += exchange_->traffic - before;
  }
  // What was told since the last call.
  Traffic take_told() { return std::exchange(told_, Traffic{}); }

private:
  std::shared_ptr<Exchange> exchange_;
  Traffic told_;
};

} // namespace cairn
