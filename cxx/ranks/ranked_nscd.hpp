// NSCD by NLGS over ranks: sweeps go colour by colour.
#pragma once
#include "../strategies/nscd/nscd.hpp"
#include "colouring.hpp"
#include "over_ranks.hpp"
#include "ranked_help.hpp"
#include "ranked_liquid.hpp"
#include "sweep_exchange.hpp"

namespace cairn {

class RankedNscd final : public OverRanks {
public:
  using OverRanks::OverRanks;
  const StepReport& step(Simulation& s, double h) override;
  std::vector<std::string_view> stages(const Simulation& s) const override;
  std::unique_ptr<Strategy> fresh() const override {
    return std::make_unique<RankedNscd>(model_->fresh(), exchange_, rhythm_);
  }
  void check_scene(const Simulation& s) const override;
  std::vector<std::pair<std::string_view, double>> figures(Simulation& s) override;
  std::int64_t body_bytes() const override { return OverRanks::body_bytes() + liquid_.bytes(); }

private:
  const StepReport& step_of_all(Simulation& s, double h);
  const NscdOptions& settings() const { return static_cast<const Nscd&>(*model_).settings; }
  static Nscd& of(Part& part) { return static_cast<Nscd&>(*part.strategy); }
  // From the state of the step's begin to the candidates of all ranks.
  void find_contacts(Simulation& s, double h);
  void choose_hint(Simulation& s);
  bool attempt(Simulation& s, double h);
  void undo() override;
  bool reaches_far_enough();
  void keep_own_contacts(const Part& part, Candidates& c) const;
  void choose_colours();
  void colour_anew();
  void look_for_zones();
  SolveReport solve(const SolverOptions& options, double h = 0);
  void seat_joints(Simulation& s);
  void hold_joints(Simulation& s, double h);
  bool any_rank(bool value);
  friend class ContactsOfRanks;
  friend class PassesOfRanks;
  friend class LiquidContactsOfRanks;
  void solve_step(Simulation& s, const SolverOptions& options, double h);
  Part* mesh_part();
  double way_of_meshes();
  void give_meshes();
  void push_meshes();
  void newton_passes(Simulation& s, Part& mesh, double h);
  void add_energy_of_nodes(const cairn_scheme& scheme, double h, std::span<ExactSum> sums);
  void collect_meshes(Simulation& s);
  void end_velocities(Simulation& s);
  template <class F>
  void with_liquid(Simulation& s, const char* stage, F&& f);
  void press_fluid(Simulation& s, double h);
  void press_fluid_again(Simulation& s);
  void fluid_passes(Simulation& s, const SolverOptions& options, double h);
  void finish_fluid(Simulation& s);
  bool find_partings(); // see ranked_overlap.cpp
  void part_overlaps(Simulation& s, double h);
  // begin: the cell at the begin of the step
  void add_contact_sums(const Cell& begin, std::span<ExactSum> sums);
  void add_reactions(Simulation& s);
  void add_work_of_cell(Simulation& s);
  void add_energy_of_bodies(const cairn_scheme& scheme, double h, std::span<ExactSum> sums);
  void add_energy_of_laws(std::span<ExactSum> beside, std::span<ExactSum> told);
  void account(Simulation& s, double h, std::span<ExactSum> work);
  static constexpr std::size_t body_terms = 8, contact_terms = 6, beside_terms = 2, law_terms = 8; // of energy

  RankedLiquid liquid_; // incompressible
  std::vector<ColourShare> shares_;
  ColourLinks links_;
  std::unique_ptr<GatheredMemory> gathered_; // of the other solver; made by the first step that has one
  SweepExchange once_;                       // a sweep, in the place of these
  std::int64_t colours_of_ = -1;             // the partition that they were chosen in
};

} // namespace cairn
