// Strategies over ranks: each rank has the bodies between two cuts of the space-filling curve, with ghosts of those
// that they may meet, and the contacts on them. The bits of a run are the same for every number of ranks and threads.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "exact_sum.hpp"
#include "exchange.hpp"
#include "ghost_links.hpp"
#include "liquid_shares.hpp"
#include "part.hpp"
#include "partition.hpp"
#include "shown_contacts.hpp"

namespace cairn {

// When ranks tell each other what contacts changed: after each colour, with the same bits for every number of ranks, or
// once a sweep, which is faster where messages are slow.
enum class Rhythm { colour, sweep };

class OverRanks : public Strategy {
public:
  OverRanks(std::unique_ptr<Strategy> model, std::shared_ptr<Exchange> exchange, Rhythm rhythm = Rhythm::colour);
  ~OverRanks() override;

  std::vector<Option> options() override { return model_->options(); }
  void check_options() const override { model_->check_options(); }
  std::vector<std::string> texts_of(std::string_view option) const override { return model_->texts_of(option); }
  bool serves(const LawInfo& law) const override { return model_->serves(law); }
  bool take_settings(Simulation& s, const Strategy& other) override;
  void check_scene(const Simulation& s) const override; // names all that does not run over ranks
  void check_laws(const Simulation& s) const override;
  void changed(Simulation& s, bool places) override;
  bool scheme_beside_fluid(double h, cairn_scheme& out) const override { return model_->scheme_beside_fluid(h, out); }
  double end_share(double h) const override { return model_->end_share(h); }
  std::shared_ptr<ParticleShares> share_particles(Simulation& s, double h) override;
  void together(const std::function<void()>& work) override { exchange_->together(work); }
  void meet(std::string_view call) const override { exchange_->meet(call); }
  ContactMemory memory(const Simulation& s) const override;
  void restore(Simulation& s, ContactMemory memory) override;
  void view(Simulation& s) override;
  bool has(const ContactFieldInfo& field) const override;
  void read(Simulation& s, std::string_view field, int components, double* out) override;
  void status(Simulation& s, std::int32_t* out) override;
  std::vector<std::pair<std::string_view, double>> figures(Simulation& s) override;
  std::int64_t body_bytes() const override;
  std::int64_t contact_bytes() const override;

  // Contacts and bodies of all ranks become readable on each, until the next step. All ranks call it.
  void gather(Simulation& s);
  // From now on steps leave the state of bodies with their ranks until somebody reads it, and its memory in the whole
  // is released meanwhile; false: all ranks receive it after each step.
  void leave_state(bool leave) { leaves_state_ = leave; }
  // The state of all bodies becomes that of the last step, with `workspace` what a step leaves besides. One rank may
  // call it alone: the others serve it in the next call that all make.
  void fetch(Simulation& s, bool workspace = false);
  // Loads and drives of the whole are about to be written: they stay from now on, and need no state. All ranks call it.
  void write_loads(Simulation& s);
  // Somebody holds pointers to arrays of the whole: its memory stays.
  void hold_whole() { held_ = true; }
  // True if a value is true on one rank. All ranks call it, within the call of that name.
  bool any(bool value, std::string_view call) { return exchange_->meet(call, value); }
  std::int64_t gathers() const { return gathers_; } // of the state, so far
  const std::shared_ptr<Exchange>& shared_exchange() const { return exchange_; }
  Rhythm rhythm() const { return rhythm_; }
  std::vector<std::int32_t> owners(const Simulation& s) const; // of bodies, in the order of insertion
  // Bytes that each rank of this process holds.
  std::vector<std::int64_t> bytes_of_ranks() const;

protected:
  void meet_for_step(Simulation& s, double h);
  void begin(Simulation& s, double h, int renumber_every);
  bool must_partition(const Simulation& s) const;
  // margin: what a body adds to the gap up to which it meets others, besides its way [m].
  void partition(Simulation& s, double margin);
  // State, loads and drives of all bodies to the parts.
  void bring_parts(const Simulation& s);
  // Largest way of an own body since the partition, and what `more` adds for it; over all ranks. of_meshes: the same of
  // deformable bodies.
  double farthest(const std::vector<std::vector<double>>& more, double of_meshes = 0);
  // Adds by how much bodies of the parts grew since the partition [m].
  void add_growth(std::vector<std::vector<double>>& more) const;
  // Way of a point of a part since the partition [m].
  static double way_since(const Scene& scene, const double* now, const double* then);
  bool owns_contact(const Part& part, std::int32_t one, std::int32_t two) const;
  void leave_contacts_of_others(Part& part);
  // The field of ghosts from their owners.
  void follow_ghosts(Field<double> Bodies::*field) { ghosts_.follow(parts_, *exchange_, field); }
  // f(part) of each rank of this process. One that fails ends the step on all of them.
  template <class F>
  void on_ranks(Simulation& s, const char* stage, F&& f) {
    std::vector<std::string> fault(parts_.size());
    s.timed(stage, [&] {
      for (std::size_t l = 0; l < parts_.size(); ++l) try {
          f(parts_[l]);
        } catch (const std::exception& e) { fault[l] = e.what(); }
    });
    end_by_fault(fault);
  }
  // fault: of each rank of this process. All ranks throw the first of them.
  void end_by_fault(const std::vector<std::string>& fault);
  virtual void undo() {}
  // What a step leaves to the first reader of its state. All ranks call it.
  virtual void complete_state(Simulation& s) { (void)s; }
  virtual std::int64_t own_contacts(const Part& part) const { return part.simulation->candidates.count; }
  // Networks of heat and current, on all ranks alike: their contacts are gathered first.
  void advance_networks(Simulation& s, double h);
  // The report of the step, and the state of all bodies to the whole unless it is left with the ranks.
  void collect(Simulation& s);
  bool has_parts_of(const Simulation& s) const { return !parts_.empty() && order_seen_ == s.scene.order_version(); }
  bool state_is_left() const { return !known_; } // the parts alone have it
  // True if the whole has no numbers of bodies: a cut passes them from part to part.
  bool numbers_are_apart(const Simulation& s) const { return !known_ && !parts_.empty() && s.scene.nodes.count == 0; }
  [[noreturn]] static void refuse(const std::string& what);

  std::unique_ptr<Strategy> model_; // settings
  std::shared_ptr<Exchange> exchange_;
  std::shared_ptr<LiquidShares> liquid_shares_; // of exchange_
  Rhythm rhythm_ = Rhythm::colour;
  std::vector<Part> parts_;
  std::vector<std::int32_t> owner_; // by internal number of the whole
  std::vector<std::uint8_t> everywhere_, fixed_, jointed_;
  int joint_rank_ = -1; // that has all joints, and contacts of their bodies; -1: there are none
  int mesh_rank_ = -1;  // that has all contacts of deformable bodies, likewise
  double reach_ = 0, reach_factor_ = 1;
  bool taken_ = false;                       // the state of bodies is that of their owners
  bool known_ = true;                        // the whole has the state of all bodies
  bool anew_ = true, both_remember_ = false; // ranks of both bodies need what their contact remembers
  int colours_ = 0;
  std::int64_t partitions_ = 0, since_partition_ = 0;
  Traffic before_, last_; // of the last step

private:
  // What a cut sees of all bodies, in the order of the whole.
  struct Outline {
    const double* position;     // (dim, bodies) [m]
    std::vector<double> radius; // (bodies) of balls about centres that hold contactors, infinite: without bound [m]
    std::vector<std::uint8_t> fixed; // (bodies) 1: contacts do not move it
    std::vector<double> places;      // positions that the whole does not have
  };
  Outline outline(const Simulation& s) const;
  double fastest_square(const Simulation& s) const; // of bodies that are not everywhere [m2/s2]
  void renumber(Simulation& s);
  // Rows of bodies for new parts, from the parts of those who owned them. wanted: bodies of each local rank, rising.
  std::vector<Arrived> pass_rows(Simulation& s, const std::vector<std::int32_t>& owner_before,
                                 const std::vector<std::vector<std::int32_t>>& wanted) const;
  std::vector<std::int64_t> costs(const Simulation& s) const;
  int heir(const Simulation& s, const ContactKey& key) const;
  void give_memory(const Simulation& s, const std::vector<ContactMemory>& memory);
  void add_held(const Simulation& s, const Surroundings& around, const std::vector<ContactMemory>& memory,
                std::vector<std::vector<std::int32_t>>& ghosts);
  void keep_joints_together(const Simulation& s, const std::vector<double>& radius);
  // Contactors of deformable bodies as balls about the nodes that they are mapped from.
  struct MeshBalls {
    std::vector<double> position, radius; // (dim, contactors), (contactors) [m]
    double widest = 0, fastest = 0;       // radius or size of a cell [m], square of a speed [m2/s2]
  };
  static MeshBalls balls_of_meshes(const Simulation& s);
  void choose_owners(Simulation& s, const std::vector<double>& radius);
  double choose_reach(const Simulation& s, const std::vector<double>& radius, const MeshBalls& meshes, double margin);
  void make_parts(Simulation& s, const std::vector<double>& radius, std::vector<std::vector<std::int32_t>>& bodies,
                  std::vector<Arrived> arrived);
  std::int64_t body_beside_meshes(const Simulation& s) const; // -1: none that roams
  void choose_mesh_rank(Simulation& s, std::int64_t beside);
  // Ghosts of local ranks, of bodies near meshes too: these count as owned by their rank.
  std::vector<std::vector<std::int32_t>> ghosts_of(const Surroundings& around, const MeshBalls& meshes) const;
  MeshShare share_of_meshes(std::size_t local) const;
  void share_touched(Simulation& s) const;
  bool knows_meshes(const Simulation& s) const;
  bool lacks_bodies(const Simulation& s) const;
  bool reads_state(const Simulation& s) const; // at the end of a step, or at the begin of the next one
  void gather_state(Simulation& s, bool workspace);
  void gather_contacts(Simulation& s);
  void view_own(Simulation& s);
  void serve(Simulation& s, int wish);
  void ask(Simulation& s, Exchange::Wish wish);

  std::int64_t order_seen_ = -1;
  std::vector<const MeshBody*> meshes_seen_; // at the last partition
  std::int32_t hulls_seen_ = 0;              // likewise: bodies that begin to grow get hulls of their own
  std::int64_t seen_ = 0, began_ = 0;        // ids of contactors below these bond no more, after a step and in it
  Cell cell_then_;                           // when bodies were given to ranks
  ContactMemory pending_;                    // of contacts before the next partition, where it came from elsewhere
  bool has_pending_ = false;
  GhostLinks ghosts_;
  double imbalance_ = 1;
  bool leaves_state_ = false, held_ = false, workspace_known_ = false;
  bool loads_written_ = false;
  bool unread_ = false;                  // nobody read the state of the step before
  std::int64_t gathers_ = 0;             // of the state
  std::unique_ptr<ShownContacts> shown_; // null: they are not known
  bool all_shown_ = false;               // also those of other processes
  bool serves_ = false;                  // what another rank asks for alone
};

// Radius of a ball about the centre of each body that holds its contactors; infinite where one has no bound [m].
std::vector<double> radii_of(const Simulation& s);
// 1: contacts do not move the body in any way.
std::vector<std::uint8_t> fixed_bodies(const Simulation& s);

// The strategy over ranks; throws Error naming it if it does not run over them.
std::unique_ptr<Strategy> over_ranks(std::unique_ptr<Strategy> strategy, std::shared_ptr<Exchange> exchange,
                                     Rhythm rhythm = Rhythm::colour);

} // namespace cairn
