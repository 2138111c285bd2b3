// Smooth DEM over ranks: each finds the forces on its own bodies, those of pairs with ghosts too, and adds them up in
// the order of the other contactors' ids.
#pragma once
#include <array>

#include "../strategies/smooth/smooth_dem.hpp"
#include "over_ranks.hpp"

namespace cairn {

class RankedSmooth final : public OverRanks {
public:
  RankedSmooth(std::unique_ptr<Strategy> model, std::shared_ptr<Exchange> exchange)
      : OverRanks(std::move(model), std::move(exchange)) {
    both_remember_ = true;
  }
  const StepReport& step(Simulation& s, double h) override;
  std::vector<std::string_view> stages(const Simulation& s) const override;
  std::unique_ptr<Strategy> fresh() const override {
    return std::make_unique<RankedSmooth>(model_->fresh(), exchange_);
  }
  void check_scene(const Simulation& s) const override;
  void changed(Simulation& s, bool places) override;
  void restore(Simulation& s, ContactMemory memory) override;
  double stable_step(Simulation& s) override { return s.report.stable_step; }

private:
  const StepReport& step_of_all(Simulation& s, double h);
  // Order in which forces of the pairs of a list are added up.
  struct Order {
    std::int64_t list = -1;          // that this is of
    bool known = false;              // and stays until the next list
    std::vector<std::int64_t> first; // of each own body
    std::vector<std::int32_t> push;  // of them
    std::vector<std::int8_t> acts;   // of each push of the list: its pair is in contact
    struct OnAll {
      std::int32_t push, body;
    };
    std::vector<OnAll> on_all; // of own pairs on bodies that are everywhere
    struct Pairs {
      std::int32_t first, last;
    };
    std::vector<Pairs> owned; // from `first`, before `last`
  };
  struct Push { // on a body, by the ids of the contactor that it meets and of its own
    std::int64_t other, own;
    std::int32_t image, push, body;
  };
  const SmoothDemOptions& settings() const { return static_cast<const SmoothDem&>(*model_).settings; }
  static SmoothDem& of(Part& part) { return static_cast<SmoothDem&>(*part.strategy); }
  std::int64_t own_contacts(const Part& part) const override { return contacts_[std::size_t(part.rank)]; }
  double next_way(const Part& part, std::int64_t body, double h) const;
  void undo() override;
  void keep_state(Part& part);
  void begin_step(Part& part, double h);
  bool pushes_own(const Part& part, std::int32_t one, std::int32_t two) const;
  void put_in_order(const Part& part, const NeighbourList& list, Order& order) const;
  static void find_acting(const NeighbourList& list, Order& order);
  static void add_stress(const Simulation& s, const NeighbourList& list, const Order& order, ExactSum* sums);
  void add_forces(Part& part, std::array<Order, 2>& orders, std::vector<ExactSum>& on_all,
                  const std::vector<std::int32_t>& place);
  void total_forces(Simulation& s, bool damped);

  bool forces_known_ = false;
  bool kept_ = false;                        // parts have the state of the begin of the step at hand
  std::vector<std::int64_t> contacts_;       // that act, by rank
  std::vector<std::array<Order, 2>> orders_; // of each part: of its list, and of contacts of shapes
  std::int64_t orders_of_ = -1;              // the partition that they were made in
};

} // namespace cairn
