// Smooth DEM over ranks: each finds the forces on its own bodies, those of pairs with ghosts too, and adds them up in
// the order of the other contactors' ids.
#pragma once
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
  // A pair that acts on a body, by the id of the contactor that it meets.
  struct Push {
    std::int64_t other, own;
    std::int32_t image, pair;
    double sign;
  };
  const SmoothDemOptions& settings() const { return static_cast<const SmoothDem&>(*model_).settings; }
  static SmoothDem& of(Part& part) { return static_cast<SmoothDem&>(*part.strategy); }
  std::int64_t own_contacts(const Part& part) const override { return contacts_[std::size_t(part.rank)]; }
  double next_way(const Part& part, std::int64_t body, double h) const;
  void add_forces(Part& part, std::vector<ExactSum>& on_all, const std::vector<std::int32_t>& place);
  void total_forces(Simulation& s);

  bool forces_known_ = false;
  std::vector<std::int64_t> contacts_; // that act, by rank
};

} // namespace cairn
