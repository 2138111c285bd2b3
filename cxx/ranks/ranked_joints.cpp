// Joints over ranks: one rank has all of them. It seats them, finds their drift and stiffens their bodies. All ranks
// then solve again with the corrected biases.
#include <algorithm>

#include "../solvers/sweeps/contact_system.hpp"
#include "ranked_nscd.hpp"

namespace cairn {

bool RankedNscd::any_rank(bool value) {
  double any[] = {value ? 1.0 : 0.0};
  exchange_->largest(any);
  return any[0] > 0;
}

// Contacts of jointed bodies may be others once these are seated; they are planned without colours until then.
void RankedNscd::seat_joints(Simulation& s) {
  on_ranks(s, "prepare_contacts", [&](Part& part) {
    if (!part.has_joints) return;
    part.simulation->interactions.system().colours = 0;
    of(part).prepare_contacts(*part.simulation);
  });
}

namespace {

// Velocities of a part are those of all ranks; joints find theirs by the impulses of the part alone, which are all that
// act on their bodies.
class KeptVelocities {
public:
  explicit KeptVelocities(Part& part)
      : system_(part.simulation->interactions.system()), record_(system_.record), nodes_(system_.condensed_velocity) {}
  KeptVelocities(const KeptVelocities&) = delete;
  KeptVelocities& operator=(const KeptVelocities&) = delete;
  ~KeptVelocities() {
    std::copy(record_.begin(), record_.end(), system_.record.begin());
    std::copy(nodes_.begin(), nodes_.end(), system_.condensed_velocity.begin());
  }

private:
  ContactSystem& system_;
  Array<cairn_record> record_;
  Array<double> nodes_;
};

} // namespace

class ContactsOfRanks final : public JointedContacts {
public:
  explicit ContactsOfRanks(RankedNscd& ranks) : ranks_(ranks) {
    for (Part& part : ranks.parts_)
      if (part.has_joints) part_ = &part;
  }
  SolveReport solve(const SolverOptions& options) override { return ranks_.solve(options); }
  JointMiss miss(double least) override {
    double told[] = {0, 0, 0, 0, -1}; // others tell the least that there is
    if (part_) {
      const KeptVelocities kept(*part_);
      const JointMiss own = part_->simulation->interactions.joints().miss(part_->simulation->scene.bodies, least);
      told[0] = own.gap;
      told[1] = own.error;
      told[2] = own.swing;
      told[3] = own.small;
      told[4] = double(own.contact);
    }
    ranks_.exchange_->largest(told);
    return {told[0], told[1], std::int64_t(told[4]), told[2], told[3] > 0};
  }
  void keep() override {
    if (part_) part_->simulation->interactions.joints().keep();
  }
  void correct(double share) override {
    if (part_) part_->simulation->interactions.joints().correct(share);
  }
  bool ease(bool settled) override {
    bool eased = false;
    if (part_) {
      const KeptVelocities kept(*part_);
      eased = part_->simulation->interactions.joints().ease(part_->simulation->scene.bodies, settled);
    }
    return ranks_.any_rank(eased);
  }
  std::string name(std::int64_t contact) override {
    Packer mine;
    const std::string own = part_ ? part_->simulation->interactions.joints().name(contact) : std::string();
    if (part_) mine.put_all(std::span<const char>(own.data(), own.size()));
    std::string found;
    for (const Piece bytes : ranks_.exchange_->gather(std::move(mine.bytes))) {
      if (bytes.empty()) continue;
      const std::vector<char> text = Unpacker(bytes).get_all<char>();
      found.assign(text.begin(), text.end());
    }
    return found;
  }
  Part* part() const { return part_; } // null: another process has it

private:
  RankedNscd& ranks_;
  Part* part_ = nullptr;
};

// The rest of Nscd::solve_contacts, once contacts are solved.
void RankedNscd::hold_joints(Simulation& s, double h) {
  constexpr int most = 3;
  ContactsOfRanks contacts(*this);
  const SolverOptions& given = settings().solver;
  SolveReport& report = s.report.solve;
  cairn::hold_joints(contacts, report, given, h);
  const auto swings = [&] {
    return any_rank(contacts.part() && of(*contacts.part()).swings(*contacts.part()->simulation));
  };
  if (swings()) {
    ContactMemory at_begin;
    if (contacts.part()) at_begin = contacts.part()->simulation->interactions.memory();
    for (int pass = 0; pass < most && report.status != SolveStatus::diverged && swings(); ++pass) {
      const int before = report.iterations;
      SolverOptions options = given;
      options.max_iterations -= before;
      if (options.max_iterations < std::max(options.min_iterations, 1)) break;
      if (contacts.part()) of(*contacts.part()).stiffen_again(*contacts.part()->simulation);
      report = solve(options);
      cairn::hold_joints(contacts, report, given, h, before);
      report.iterations += before;
    }
    if (contacts.part()) contacts.part()->simulation->interactions.restore(at_begin);
  }
  report.joint_contact = -1; // it is among the contacts of a rank, which have another order
}

} // namespace cairn
