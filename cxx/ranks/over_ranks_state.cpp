// The state of all bodies between the whole and its parts: after each step, or when somebody reads it.
#include <algorithm>

#include "../networks/network.hpp"
#include "../simulation/controls.hpp"
#include "../simulation/probes.hpp"
#include "over_ranks.hpp"

namespace cairn {

// Meshes and a liquid are whole in every process, with the bodies beside them, and so are bodies that grow or grew.
bool OverRanks::reads_state(const Simulation& s) const {
  return !leaves_state_ || s.scene.nodes.count > 0 || s.fluid || s.networks || s.scene.has(Need::growing) ||
         (s.controls && s.controls->reads_state()) || (s.probes && s.probes->reads_bodies(s.steps));
}

OverRanks::~OverRanks() {
  if (serves_) exchange_->serve = nullptr;
}

// All ranks call it together.
void OverRanks::serve(Simulation& s, int wish) {
  exchange_->together([&] {
    gather_state(s, wish == Exchange::workspace);
    if (wish == Exchange::contacts) gather_contacts(s);
  });
}

void OverRanks::ask(Simulation& s, Exchange::Wish wish) {
  exchange_->serve = [this, &s](int asked) { serve(s, asked); };
  serves_ = true;
  exchange_->ask(wish);
}

void OverRanks::fetch(Simulation& s, bool workspace) {
  if (parts_.empty()) {
    if (workspace) arrays_to_fill(s, true, true);
    return;
  }
  if (known_ && (!workspace || workspace_known_)) return;
  ask(s, workspace ? Exchange::workspace : Exchange::state);
}

void OverRanks::write_loads(Simulation& s) {
  if (!loads_written_) fetch(s); // they may be released
  loads_written_ = true;
}

// All ranks call it. Processes exchange arrays that were released one after the other, so that no message holds all.
void OverRanks::gather_state(Simulation& s, bool workspace) {
  if (!known_) complete_state(s);
  // what was set or grew since the step is with the whole alone
  const Arrays all = arrays_to_fill(s, !known_, workspace);
  if (exchange_->whole()) {
    for (const Part& part : parts_) take(part, s, all);
  } else {
    const auto pass = [&](const Arrays& arrays) {
      Packer mine;
      for (const Part& part : parts_) pack_own(part, s, arrays, mine);
      for (const Piece bytes : exchange_->gather(std::move(mine.bytes))) take_packed(bytes, s, arrays);
    };
    if (unread_) {
      Arrays one(all.size(), 0);
      for (std::size_t k = 0; k < all.size(); ++k) {
        if (!all[k]) continue;
        one[k] = 1;
        pass(one);
        one[k] = 0;
      }
    } else {
      pass(all);
    }
  }
  known_ = true;
  workspace_known_ = workspace;
  unread_ = false;
  ++gathers_;
}

void OverRanks::collect(Simulation& s) {
  if (workspace_known_) release_workspace(s.scene);
  known_ = workspace_known_ = false;
  s.scene.cell = parts_[0].simulation->scene.cell;
  std::vector<std::int64_t> load(std::size_t(exchange_->ranks()) + 1, 0);
  double largest[] = {0, 0}; // way, bodies that turned too far
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    const Part& part = parts_[l];
    const StepReport& report = part.simulation->report;
    const auto own = std::int64_t(std::count(part.own.begin(), part.own.end(), 1));
    load[std::size_t(part.rank)] = cost_of_body * own + cost_of_contact * own_contacts(part);
    load.back() += own_contacts(part);
    largest[0] = std::max(largest[0], report.way);
    largest[1] = std::max(largest[1], double(report.unresolved_rotations));
  }
  exchange_->sum(load);
  exchange_->largest(largest);
  const std::int64_t contacts = load.back();
  load.pop_back();
  std::int64_t all = 0;
  for (const std::int64_t of_rank : load) all += of_rank;
  imbalance_ = all > 0 ? double(*std::max_element(load.begin(), load.end())) * double(load.size()) / double(all) : 1;
  s.report.sub_steps = 1;
  s.report.way = largest[0];
  s.report.unresolved_rotations = std::int64_t(largest[1]);
  s.report.step = ++s.steps;
  s.report.h = parts_[0].simulation->report.h;
  s.report.time_detection = parts_[0].simulation->report.time_detection;
  s.report.time = s.time = parts_[0].simulation->time;
  s.report.contacts = contacts;
  s.report.energy = s.energy;
  seen_ = s.scene.next_contactor_id;
  ++since_partition_;
  if (reads_state(s)) {
    gather_state(s, false);
    taken_ = true;
  } else {
    if (unread_ && !held_) release(s, s.controls != nullptr || loads_written_);
    unread_ = true;
  }
  constexpr int growing = 2; // steps after a cut in which contacts and what they remember get their memory
  if (since_partition_ <= growing) return_freed_memory();
  last_ = exchange_->traffic - before_;
  liquid_shares_->take_told();
  if (s.probes && s.probes->reads_contacts()) gather_contacts(s);
}

} // namespace cairn
