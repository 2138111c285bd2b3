// NSCD by NLGS over ranks: sweeps go colour by colour.
#pragma once
#include "../strategies/nscd/nscd.hpp"
#include "colouring.hpp"
#include "over_ranks.hpp"
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

private:
  const StepReport& step_of_all(Simulation& s, double h);
  const NscdOptions& settings() const { return static_cast<const Nscd&>(*model_).settings; }
  static Nscd& of(Part& part) { return static_cast<Nscd&>(*part.strategy); }
  bool attempt(Simulation& s, double h);
  void undo() override;
  bool reaches_far_enough();
  void keep_own_contacts(const Part& part, Candidates& c) const;
  void choose_colours();
  void colour_anew();
  SolveReport solve(const SolverOptions& options, double h = 0);
  void seat_joints(Simulation& s);
  void hold_joints(Simulation& s, double h);
  bool any_rank(bool value);
  friend class ContactsOfRanks;
  friend class PassesOfRanks;
  void solve_step(Simulation& s, const SolverOptions& options, double h);
  Part* mesh_part();
  double way_of_meshes();
  void give_meshes();
  void push_meshes();
  void newton_passes(Simulation& s, Part& mesh, double h);
  void add_energy_of_nodes(const cairn_scheme& scheme, double h, std::span<ExactSum> sums);
  void collect_meshes(Simulation& s);
  void end_velocities(Simulation& s);
  // begin: the cell at the begin of the step
  void add_contact_sums(const Cell& begin, std::span<ExactSum> sums);
  void add_reactions(Simulation& s);
  void add_work_of_cell(Simulation& s);
  double stored_of_contacts(Simulation& s);
  void account(Simulation& s, double h, std::span<ExactSum> work);
  static constexpr int contact_terms = 6, beside_terms = 2;

  std::vector<ColourShare> shares_;
  ColourLinks links_;
  SweepExchange once_;           // a sweep, in the place of these
  std::int64_t colours_of_ = -1; // the partition that they were chosen in
};

} // namespace cairn
