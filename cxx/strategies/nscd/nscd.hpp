// Non-Smooth Contact Dynamics (Moreau 1988, Jean 1999): its settings and its stages. The step is a page, nscd.cpp;
// Carpenter's scheme and the granular element method are the same step with another pose.
#pragma once
#include <cmath>
#include <functional>

#include "../../simulation/strategy.hpp"
#include "bonds.hpp"
#include "histories.hpp"
#include "joints.hpp"
#include "last_views.hpp"
#include "mesh_contacts.hpp"
#include "nscd_options.hpp"
#include "plugged_body_forces.hpp"
#include "projection.hpp"
#include "search_margins.hpp"
#include "step_begin.hpp"
#include "step_energy.hpp"
#include "step_scheme.hpp"
#include "stiff_joints.hpp"

namespace cairn {

class ContactPasses;       // see newton.hpp
class ContactsBesideFluid; // see contacts_beside_fluid.hpp

class Nscd final : public Strategy {
public:
  Nscd();
  explicit Nscd(const NscdOptions& options);

  NscdOptions settings;
  std::vector<std::string> accepted; // integrators that may move bodies; none: any
  // Leaves out contacts that another rank has, before bonds and joints are measured; empty: there are no ranks.
  std::function<void(Candidates&)> leave_out;

  // One step of length h, in parts if `cut_back` allows. On failure throws and restores bodies, time, contact memory
  // and the views of the last step; fields of contacts only in scenes where steps are likely to be undone, see
  // last_views.hpp: elsewhere they can no longer be read.
  const StepReport& step(Simulation& s, double h) override;

  // The stages of step(), in its order.
  void begin_step(Simulation& s, double h);
  void predict_configuration(Simulation& s);
  void compute_free_velocity(Simulation& s);
  void detect_contacts(Simulation& s);
  void prepare_contacts(Simulation& s);
  void solve_contacts(Simulation& s);
  // Further ones, where stresses of a mesh are not linear: Newton's method round the solution; see newton.cpp.
  void newton_passes(Simulation& s);
  void newton_passes(Simulation& s, ContactPasses& contacts);
  // Pressure of an incompressible liquid and contacts in turn, until both see the same velocities; see
  // fluid_passes.cpp.
  void press_fluid(Simulation& s);
  void fluid_passes(Simulation& s);
  void fluid_passes(Simulation& s, ContactsBesideFluid& contacts);
  void update_velocity(Simulation& s);
  void update_configuration(Simulation& s);
  void commit_contacts(Simulation& s);
  void project_positions(Simulation& s);
  const Array<double>& margins() const { return margins_.each(); } // of contactors, in the last detection [m]
  // Where ranks hold joints: see stiff_joints.hpp.
  bool swings(Simulation& s) { return stiff_.swing(s, step_.h); }
  void stiffen_again(Simulation& s); // with the impulses at hand
  WorkBeside work_beside(const Simulation& s) const { return {seats_.work(), stiff_.energy(s)}; }
  bool parts_overlaps() const { return std::isfinite(settings.overlap); }
  void part_overlaps(Simulation& s); // see overlap_limit.cpp of contacts; nothing to do after most steps
  void undo_step(Simulation& s);

  std::vector<std::string_view> stages(const Simulation& s) const override;
  std::vector<Option> options() override;
  void check_options() const override;
  std::vector<std::string> texts_of(std::string_view option) const override;
  std::unique_ptr<Strategy> fresh() const override;
  bool take_settings(Simulation& s, const Strategy& other) override;
  void check_scene(const Simulation& s) const override;
  void check_laws(const Simulation& s) const override;
  std::string dropped(const LawTable::Entry& entry) const;
  std::string not_by_springs(const LawInfo& law) const; // why a law is none of these; empty: it is
  bool serves(const LawInfo& law) const override { return law.prepare != nullptr; }
  ContactMemory memory(const Simulation& s) const override;
  void restore(Simulation& s, ContactMemory memory) override;
  ContactMemory projection_memory() const override;
  void restore_projection(const Simulation& s, const ContactMemory& memory) override;
  void move_images(const Simulation& s, const std::vector<std::array<int, 3>>& moved) override;
  void lean_images(int k, int i, int cells) override;
  void read(Simulation& s, std::string_view field, int components, double* out) override;
  void status(Simulation& s, std::int32_t* out) override;
  void changed(Simulation& s, bool places) override;
  bool scheme_beside_fluid(double h, cairn_scheme& out) const override;
  double end_share(double h) const override { return settings.integrator.scheme(h).end_share; }
  double stable_step(Simulation& s) override; // of meshes under an explicit integrator
  std::vector<std::pair<std::string_view, double>> figures(Simulation& s) override; // of the sweeps of the last step
  std::int64_t body_bytes() const override { return margins_.bytes() + histories_.bytes(); }

private:
  enum class Phase { none, begun, begun_with_new_histories }; // of the step at hand
  enum class Attempt { whole, in_parts };                     // a step that fails is made again in halves
  struct Whole;                                               // a step that is taken in parts; see cut_back.cpp
  void make_step(Simulation& s, double h);
  const StepReport& step_in_parts(Simulation& s, double h);
  void take_part(Simulation& s, double from, double share, int cuts, Whole& whole);
  double flight_to_detection(const Simulation& s) const;
  void assemble_contacts(Simulation& s);
  void stiffen_further(Simulation& s);
  bool by_theta() const { return settings.integrator.name == "theta"; }

  Phase phase_ = Phase::none;
  Attempt attempt_ = Attempt::whole;
  StepScheme step_;
  StepBegin begin_;
  LastViews views_;
  Histories histories_;
  SearchMargins margins_;
  PluggedBodyForces forces_;
  std::vector<double> temperature_, potential_; // of bodies and nodes, that laws see
  BondSearch bonds_;
  BondGaps anchored_;
  NestedMeshLook nested_;
  JointSeats seats_;
  StiffJoints stiff_;
  OverlapProjection projection_;
  OverlapParting parting_;
};

// The stages of a simulation that NSCD moves; throws Error that names `call` where another strategy does.
Nscd& stages_of(Simulation& s, const std::string& call);

} // namespace cairn
