// NSCD by NLGS over ranks: each has the bodies between two cuts of the space-filling curve, with ghosts of those that
// they may meet, and the contacts on them. The bits of a run are the same for every number of ranks and threads.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "colouring.hpp"
#include "exact_sum.hpp"
#include "exchange.hpp"
#include "part.hpp"
#include "partition.hpp"

namespace cairn {

class RankedNscd final : public Strategy {
public:
  RankedNscd(std::unique_ptr<Nscd> model, std::shared_ptr<Exchange> exchange);

  const StepReport& step(Simulation& s, double h) override;
  std::vector<std::string_view> stages(const Simulation& s) const override;
  std::vector<Option> options() override { return model_->options(); }
  void check_options() const override { model_->check_options(); }
  std::vector<std::string> texts_of(std::string_view option) const override { return model_->texts_of(option); }
  std::unique_ptr<Strategy> fresh() const override;
  bool take_settings(Simulation& s, const Strategy& other) override;
  void check_scene(const Simulation& s) const override; // names all that does not run over ranks
  void check_laws(const Simulation& s) const override;
  bool serves(const LawInfo& law) const override { return model_->serves(law); }
  void changed(Simulation& s, bool places) override;
  ContactMemory memory(const Simulation& s) const override;
  void restore(Simulation& s, ContactMemory memory) override;
  void view(Simulation& s) override;
  bool has(const ContactFieldInfo& field) const override;
  void read(Simulation& s, std::string_view field, int components, double* out) override;
  void status(Simulation& s, std::int32_t* out) override;
  std::vector<std::pair<std::string_view, double>> figures(Simulation& s) override;
  std::int64_t body_bytes() const override;
  std::int64_t contact_bytes() const override;

  // Contacts of all ranks become readable on each, until the next step. All ranks call it.
  void gather(Simulation& s);
  const Exchange& exchange() const { return *exchange_; }
  const std::shared_ptr<Exchange>& shared_exchange() const { return exchange_; }
  std::vector<std::int32_t> owners(const Simulation& s) const; // of bodies, in the order of insertion
  // Bytes that each rank of this process holds.
  std::vector<std::int64_t> bytes_of_ranks() const;

private:
  bool attempt(Simulation& s, double h);
  void partition(Simulation& s);
  std::vector<std::int64_t> costs(const Simulation& s) const;
  void give_memory(const Simulation& s, const std::vector<ContactMemory>& memory);
  void link_ghosts();
  bool must_partition(const Simulation& s) const;
  template <class F>
  void on_ranks(Simulation& s, const char* stage, F&& f);
  void undo();
  bool reaches_far_enough();
  void keep_own_contacts(Part& part) const;
  bool owns_contact(const Part& part, std::int32_t one, std::int32_t two) const;
  void choose_colours();
  void colour_anew();
  void end_velocities(Simulation& s);
  void add_contact_sums(std::span<ExactSum> sums);
  void add_reactions(Simulation& s);
  void account(Simulation& s, double h);
  void follow_ghosts();
  void collect(Simulation& s);
  void show(Simulation& s);

  std::unique_ptr<Nscd> model_; // settings
  std::shared_ptr<Exchange> exchange_;
  std::vector<Part> parts_;
  std::vector<std::int32_t> owner_; // by internal number of the whole
  std::vector<std::uint8_t> everywhere_, fixed_;
  std::int64_t order_seen_ = -1;
  double reach_ = 0, reach_factor_ = 1;
  bool anew_ = true, laws_changed_ = false;
  ContactMemory pending_; // of contacts before the next partition
  std::vector<ColourShare> shares_;
  ColourLinks links_;
  int colours_ = 0;
  std::int64_t colours_of_ = -1; // the partition that they were chosen in
  Links ghost_links_; // from owners to ghosts
  std::vector<std::vector<std::vector<std::int32_t>>> ghosts_out_, ghosts_in_;
  std::int64_t partitions_ = 0, since_partition_ = 0;
  double imbalance_ = 1;
  std::int64_t ghosts_ = 0;
  Traffic before_, last_; // of the last step
  // Contacts that can be read: by the order of their keys.
  struct Shown;
  std::shared_ptr<Shown> shown_;
};

// The strategy over ranks; throws Error naming it if it does not run over them.
std::unique_ptr<Strategy> over_ranks(std::unique_ptr<Strategy> strategy, std::shared_ptr<Exchange> exchange);

} // namespace cairn
