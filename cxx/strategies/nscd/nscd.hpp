// Non-Smooth Contact Dynamics (Moreau 1988, Jean 1999): its settings and its stages. The step is a page, nscd.cpp;
// Carpenter's scheme and the granular element method are the same step with another pose.
#pragma once
#include <cmath>
#include <optional>

#include "../../simulation/simulation.hpp"
#include "../../simulation/strategy.hpp"
#include "nscd_options.hpp"

namespace cairn {

class Nscd final : public Strategy {
public:
  Nscd();
  explicit Nscd(const NscdOptions& options);

  NscdOptions settings;
  std::vector<std::string> accepted; // integrators that may move bodies; none: any

  // One step of length h, in parts if `cut_back` allows. On failure throws and restores bodies, time, contact memory
  // and the views of the last step; fields of contacts only in scenes where steps are likely to be undone, see
  // shown.cpp: elsewhere they can no longer be read.
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
  void update_velocity(Simulation& s);
  void update_configuration(Simulation& s);
  void commit_contacts(Simulation& s);
  void project_positions(Simulation& s);
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
  double stable_step(Simulation& s) override; // of meshes under an explicit integrator
  std::vector<std::pair<std::string_view, double>> figures(Simulation& s) override; // of the sweeps of the last step
  std::int64_t body_bytes() const override {
    return std::int64_t(
        (margins_.capacity() + change_.capacity() + way_.capacity() + node_change_.capacity() + node_way_.capacity()) *
        sizeof(double));
  }

private:
  // Views of the last step, kept while the next is tried; see shown.cpp.
  struct Shown {
    Array<double> reaction; // of bodies
    std::vector<MeshBody::Results> meshes;
    bool contacts_known = false;
    Candidates contacts;
    std::vector<std::int64_t> contactors; // ids (2, contacts)
    std::vector<std::vector<double>> fields;
    std::vector<std::int32_t> status;
  };
  void keep_shown(Simulation& s);
  void show_again(Simulation& s, const Shown& from);
  void read_known(Simulation& s, std::string_view field, double* out) const;
  struct Whole; // a step that is taken in parts; see cut_back.cpp
  void make_step(Simulation& s, double h);
  const StepReport& step_in_parts(Simulation& s, double h);
  void take_part(Simulation& s, double from, double share, int cuts, Whole& whole);
  void start_histories(Simulation& s);
  void measure_histories(Simulation& s);
  // Where the laws take the way of a step from: the end velocity of this one, or that of the next.
  double law_share() const { return scheme_.share > 0 ? scheme_.share : 1; }
  double flight_to_detection(const Simulation& s) const;
  void save_begin(Simulation& s);
  void make_bonds(Simulation& s);
  void find_bonds(Simulation& s);
  // Where the next step detects them, after so many iterations of other solutions; joints.cpp.
  void hold_joints(Simulation& s, int spent = 0);
  void declare_joints(Simulation& s); // those that came in since the last step
  void seat_joints(Simulation& s);    // where contacts are detected; seat_joints.cpp
  void move_bodies(Simulation& s, const Array<double>& velocity) const;
  bool stiffen_joints(Simulation& s); // bodies against turns under the loads of joints; stiff_joints.cpp
  bool joints_swing(Simulation& s);   // by the loads found, faster than the step was stiffened for
  void stiffen_further(Simulation& s);
  void unstiffen(Simulation& s);
  void assemble_contacts(Simulation& s);
  double energy_of_stiffened(const Simulation& s) const;
  void measure_anchored(Simulation& s); // contacts of bonds, at the points that hold them
  double measure_margins(Simulation& s);
  static std::vector<RimSeat> seats_of_contactors(const Simulation& s); // by internal numbers
  double margin_of_mapped(const Simulation& s, std::int32_t contactor) const;
  void look_at_meshes(Simulation& s);         // see mesh_contacts.cpp
  void look_for_nested_meshes(Simulation& s); // see nested_meshes.cpp
  void check_free_velocity(const Simulation& s) const;
  void add_plugged_forces(Simulation& s);
  void leave_plugged_forces(Simulation& s);
  void account(Simulation& s, const ContactEnergy& contacts);
  const LawTable& projection_laws(const Simulation& s);

  double h_ = 0;
  double ahead_ = 0;                     // from the start of the step to the detection of contacts [s]
  cairn_scheme scheme_{};                // of the step at hand
  Array<double> change_, way_;           // of velocities by forces, without contacts; displacement of the history
  Array<double> node_change_, node_way_; // of nodes
  bool begun_ = false, started_ = false; // a step, histories in it
  bool in_parts_ = false;                // a step that Newton's method does not close is made again in halves
  Shown shown_;                          // as the step at hand began
  bool shows_kept_ = false;              // contacts that are read are those of shown_
  Cell cell_begin_;
  double cell_rate_[9] = {};
  Array<double> margins_, force_given_;
  std::vector<std::int32_t> anchored_;          // contactors of the keys of the memory, two each
  std::vector<double> temperature_, potential_; // of bodies and nodes, that laws see
  // A body that the loads of its joints stiffen: its numbers without them, and the inertia that they add.
  struct Stiffened {
    std::int32_t body;
    double spin[3], inverse_mass[3], inverse_inertia[6], added[6];
  };
  std::vector<Stiffened> stiffened_;
  std::vector<JointLoad> loads_;
  Array<double> parting_;                 // velocities that take back overlap
  Array<double> seat_;                    // velocities that seat joints
  bool seated_ = false;                   // in this step
  double seated_work_ = 0;                // of weight, when they were [J]
  std::optional<Interactions> projector_; // of project_positions, with a memory of its own
  Candidates projection_candidates_;
  std::optional<LawTable> projection_laws_;
  Array<double> reaction_kept_;
  std::int64_t nested_seen_ = 0, nested_step_ = -1; // ids below which were looked at, in which step
  std::string nested_hint_;
  std::string unjoined_;
  std::int64_t unjoined_step_ = -1;
};

// In bonds.cpp: memories of files in which the state of a bond was its gap alone.
void read_gaps_of_bonds(const Simulation& s, ContactMemory& m);

// The stages of a simulation that NSCD moves; throws Error where another strategy does.
Nscd& stages_of(Simulation& s);

} // namespace cairn
