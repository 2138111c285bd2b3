// Smooth DEM over ranks: each finds the forces on its own bodies, those of pairs with ghosts too. Bodies keep the
// tiles of the whole scene, so that their forces are added up in one order on each rank.
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
  // Pairs of a list that are added up over ranks.
  struct Counted {
    std::int64_t list = -1; // that this is of
    struct OnAll {
      std::int32_t pair, kept, sum; // number of the pair, of its kept force, and of the sums of the body
    };
    std::vector<OnAll> on_all, on_fixed; // of own pairs, on bodies that are everywhere: those that move, and others
    struct Pairs {
      std::int32_t first, last;
    };
    std::vector<Pairs> owned; // from `first`, before `last`
  };
  // Why the ways of bodies in a step can be bounded by the last one: all that moves them is as it was.
  struct Motion {
    bool known = false;
    double h = 0;
    std::array<double, 3> gravity{};
  };
  const SmoothDemOptions& settings() const { return static_cast<const SmoothDem&>(*model_).settings; }
  static SmoothDem& of(Part& part) { return static_cast<SmoothDem&>(*part.strategy); }
  std::int64_t own_contacts(const Part& part) const override { return contacts_[std::size_t(part.rank)]; }
  void undo() override;
  void complete_state(Simulation& s) override;
  void keep_state(Part& part);
  void begin_step(Part& part, bool heats, double h);
  // Partitions, and makes anew what follows from a cut.
  void cut(Simulation& s);
  void find_reach_and_risk(const Simulation& s);
  static double reach_of_laws(const Simulation& s, double radius);
  static bool lacks_laws(const Simulation& s);
  void share(Part& part) const;
  // Cuts where ghosts do not reach as far as bodies go in the step.
  void reach_ghosts(Simulation& s, double h);
  double next_way(const Part& part, std::int64_t body, double h) const;
  bool ways_are_short(const Simulation& s, double h);
  bool moves_plainly(const Part& part) const;
  // Forces over ranks.
  bool pushes_own(const Part& part, std::int32_t one, std::int32_t two) const;
  void count_pairs(const Part& part, const NeighbourList& list, Counted& counted) const;
  static void add_stress(const Simulation& s, const NeighbourList& list, const Counted& counted, ExactSum* sums);
  void add_forces(Part& part);
  void total_forces(Simulation& s, bool damped);
  void add_fixed();
  void total_fixed();
  static void add_kept(const NeighbourList& list, const std::vector<Counted::OnAll>& pairs, int dofs,
                       std::vector<ExactSum>& sums);
  // Forces on fixed bodies that nobody has asked for: of pairs, or their sums over the pairs of this process.
  enum class Fixed { known, of_pairs, added };
  void write_sums(std::vector<ExactSum>& sums, bool fixed);

  double law_reach_ = 0; // gap up to which laws act [m]
  bool forces_known_ = false;
  // A step may, after bodies have moved: two materials meet without a law, bodies of unequal moments turn too fast for
  // their step, or images are too far apart to be numbered.
  bool may_fail_ = false;
  bool kept_ = false; // parts have the state of the begin of the step at hand
  Fixed fixed_forces_ = Fixed::known;
  Motion motion_;
  double way_ = 0;                     // of bodies of this process since the partition, at most [m]
  bool way_has_step_ = false;          // the one of the step at hand is in it
  std::vector<std::int64_t> contacts_; // that act, by rank
  std::vector<std::int32_t> sum_of_;   // (bodies of the whole) number of its sums, -1: its forces are with its owner
  // (dofs, bodies that are everywhere and move), then those of the cell; (dofs, fixed bodies), for who reads them
  std::vector<ExactSum> sums_, fixed_sums_;
  std::vector<std::array<Counted, 2>> counted_; // of each part: of its list, and of contacts of shapes
  struct Summed {
    std::int32_t body, sum; // number in the part, which a new order of the whole leaves, and that of its sums
  };
  std::vector<std::vector<Summed>> on_all_; // of each part: bodies that are everywhere
};

} // namespace cairn
