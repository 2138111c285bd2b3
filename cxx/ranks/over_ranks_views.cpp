// Refusals by name, settings, and readable contacts of strategies over ranks.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <typeinfo>

#include "../base/call.hpp"
#include "../fluid/fluid.hpp"
#include "../networks/network.hpp"
#include "../simulation/contact_fields.hpp"
#include "../simulation/probes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "ranked_nscd.hpp"
#include "ranked_smooth.hpp"

namespace cairn {

void OverRanks::refuse(const std::string& what) {
  throw Error(what + ", which does not run over ranks: leave that out, or leave out ranks");
}

OverRanks::OverRanks(std::unique_ptr<Strategy> model, std::shared_ptr<Exchange> exchange, Rhythm rhythm)
    : model_(std::move(model)), exchange_(std::move(exchange)),
      liquid_shares_(std::make_shared<LiquidShares>(exchange_)), rhythm_(rhythm) {
  name = model_->name + " over ranks";
}

void OverRanks::check_scene(const Simulation& s) const {
  model_->check_scene(s);
  if (s.networks && s.networks->repeats()) refuse("steps are repeated with the temperatures at their end (coupling)");
  if (!s.forces.empty()) refuse("the plugged force " + s.forces[0].name + " acts on bodies");
  if (s.free_velocity) refuse("the plugged free velocity " + s.free_velocity->name + " moves bodies");
  if (s.scene.has(Need::growing) && s.expands()) refuse("bodies grow with their temperature");
}

void OverRanks::check_laws(const Simulation& s) const {
  model_->check_laws(s);
  for (int e = 0; e < s.laws.entries(); ++e) {
    const LawInfo& law = law_infos()[std::size_t(s.laws.entry(e).law)];
    if (law.joins && s.laws.entry(e).params[joint_pulley] > 0) refuse("the scene has ropes over pulleys");
    if (law.plugged()) refuse("law " + law.name + " is of a user's library");
  }
}

namespace {

// The call of a step with what all ranks have to give it.
std::string told_of_step(const Simulation& s, double h) {
  constexpr int most = 160;
  char text[most];
  const double* g = s.scene.gravity.data();
  std::snprintf(text, most, "step\ndt=%.17g, gravity=(%.17g, %.17g, %.17g)", h, g[0], g[1], g[2]);
  return text;
}

} // namespace

void OverRanks::meet_for_step(Simulation& s, double h) {
  exchange_->serve = [this, &s](int wish) { serve(s, wish); };
  serves_ = true;
  exchange_->meet(exchange_->whole() ? "step" : told_of_step(s, h));
}

std::shared_ptr<ParticleShares> OverRanks::share_particles(Simulation& s, double h) {
  meet_for_step(s, h);
  return liquid_shares_;
}

void OverRanks::begin(Simulation& s, double h, int renumber_every) {
  meet_for_step(s, h);
  check_scene(s);
  check_laws(s);
  s.apply_controls(h, end_share(h), true);
  before_ = exchange_->traffic - liquid_shares_->take_told(); // a liquid may have moved already
  shown_.reset();
  all_shown_ = false;
  s.contacts_known = false;
  s.candidates.count = 0;
  if (s.steps > 0 && s.steps % renumber_every == 0) renumber(s);
}

void OverRanks::end_by_fault(const std::vector<std::string>& fault) {
  const std::string told = exchange_->agree(fault);
  if (told.empty()) return;
  undo();
  throw Error(told);
}

// Contact memory passes on, to another number of ranks too.
bool OverRanks::take_settings(Simulation& s, const Strategy& other) {
  if (typeid(*this) != typeid(other)) return false;
  const auto& same = static_cast<const OverRanks&>(other);
  fetch(s);
  ContactMemory kept = memory(s);
  const bool any = !parts_.empty() || has_pending_;
  model_ = same.model_->fresh();
  name = model_->name + " over ranks";
  if (serves_) exchange_->serve = nullptr;
  serves_ = false;
  exchange_ = same.exchange_;
  liquid_shares_ = same.liquid_shares_;
  rhythm_ = same.rhythm_;
  restore(s, std::move(kept));
  has_pending_ = any;
  return true;
}

void OverRanks::bring_parts(const Simulation& s) {
  for (Part& part : parts_) bring(s, part, !known_ ? Known::parts : taken_ ? Known::by_both : Known::whole);
  taken_ = false; // a step that fails, or is made again, finds it as it was
}

void OverRanks::changed(Simulation& s, bool places) {
  taken_ = false;
  s.contacts_known = all_shown_ = false;
  shown_.reset();
  for (Part& part : parts_) {
    part.simulation->laws = s.laws;
    part.strategy->changed(*part.simulation, places);
  }
}

bool OverRanks::has(const ContactFieldInfo& field) const {
  return model_->has(field) && (std::string_view(field.name) == "status" || field.whole ||
                                std::string_view(field.name) == "gap" || std::string_view(field.name) == "normal" ||
                                std::string_view(field.name) == "point" || ShownContacts::keeps(field.name));
}

// True if bodies or meshes of the last step went: its contacts can be read no more.
bool OverRanks::lacks_bodies(const Simulation& s) const {
  if (s.scene.order_version() == order_seen_ || parts_.empty()) return false;
  if (!knows_meshes(s)) return true;
  for (const Part& part : parts_)
    for (const std::int64_t id : part.simulation->scene.bodies.id.values)
      if (s.scene.find_body(id) < 0) return true;
  return false;
}

void OverRanks::view(Simulation& s) {
  if (exchange_->whole() || parts_.empty()) return view_own(s);
  if (!s.contacts_known || !all_shown_) ask(s, Exchange::contacts);
}

// Contacts of the ranks of this process.
void OverRanks::view_own(Simulation& s) {
  if (s.contacts_known) return;
  if (lacks_bodies(s)) {
    s.candidates.count = 0;
    return;
  }
  if (!shown_) {
    auto shown = std::make_unique<ShownContacts>(s.networks != nullptr);
    for (Part& part : parts_)
      shown->add(part, [&](std::int32_t one, std::int32_t two) { return owns_contact(part, one, two); });
    shown_ = std::move(shown);
  }
  shown_->show(s);
}

void OverRanks::gather(Simulation& s) {
  exchange_->meet("gather");
  fetch(s);
  exchange_->together([&] { gather_contacts(s); });
}

// Makes the contacts of all ranks readable on each.
void OverRanks::gather_contacts(Simulation& s) {
  if (exchange_->whole()) return view_own(s);
  double lacks[] = {lacks_bodies(s) ? 1.0 : 0.0};
  exchange_->largest(lacks);
  s.contacts_known = false;
  s.candidates.count = 0;
  shown_.reset();
  all_shown_ = true;
  if (lacks[0] > 0) return;
  view_own(s);
  Packer mine;
  shown_->pack(s.scene.dim, mine);
  auto all = std::make_unique<ShownContacts>(shown_->networks());
  for (const Piece bytes : exchange_->gather(std::move(mine.bytes))) all->add_packed(bytes, s.scene.dim);
  shown_ = std::move(all);
  shown_->show(s);
}

void OverRanks::advance_networks(Simulation& s, double h) {
  if (!s.networks) return;
  fetch(s);
  gather_contacts(s);
  s.advance_networks(h);
}

void OverRanks::read(Simulation& s, std::string_view field, int components, double* out) {
  if (const auto* numbers = s.contacts_known && shown_ ? shown_->numbers(field) : nullptr)
    std::copy(numbers->begin(), numbers->end(), out);
  else
    std::fill_n(out, components * s.candidates.count, 0.0);
}

void OverRanks::status(Simulation& s, std::int32_t* out) {
  if (s.contacts_known && shown_) std::copy(shown_->status().begin(), shown_->status().end(), out);
}

std::vector<std::pair<std::string_view, double>> OverRanks::figures(Simulation& s) {
  double ghosts = 0;
  for (const Part& part : parts_) ghosts += double(std::count(part.own.begin(), part.own.end(), 0));
  std::vector<std::pair<std::string_view, double>> told = {{"ranks", exchange_->ranks()},
                                                           {"colours", colours_},
                                                           {"ghosts", ghosts},
                                                           {"messages", double(last_.messages)},
                                                           {"message_bytes", double(last_.bytes)},
                                                           {"sums", double(last_.sums)},
                                                           {"imbalance", imbalance_},
                                                           {"partitions", double(partitions_)},
                                                           {"gathers", double(gathers_)}};
  if (s.fluid) told.push_back({"liquid_imbalance", s.fluid->imbalance()});
  return told;
}

double OverRanks::way_since(const Scene& scene, const double* now, const double* then) {
  const int dim = scene.dim;
  double between[3] = {0, 0, 0}, square = 0;
  for (int k = 0; k < dim; ++k) between[k] = now[k] - then[k];
  for (int k = dim - 1; k >= 0; --k) { // a body that left a periodic cell came back on its other side
    if (!scene.cell.periodic[k]) continue;
    const double turns = std::round(between[k] / scene.cell.vectors[4 * k]);
    for (int d = 0; d <= k; ++d) between[d] -= turns * scene.cell.vectors[d + 3 * k];
  }
  for (int k = 0; k < dim; ++k) square += between[k] * between[k];
  return std::sqrt(square);
}

double OverRanks::farthest(const std::vector<std::vector<double>>& more, double of_meshes) {
  double longest[] = {of_meshes};
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    const Part& part = parts_[l];
    const Simulation& s = *part.simulation;
    const int dim = s.scene.dim;
    for (std::size_t i = 0; i < part.bodies.size(); ++i) {
      if (!part.own[i] || everywhere_[std::size_t(part.bodies[i])]) continue;
      const double way =
          way_since(s.scene, s.scene.bodies.position[std::int64_t(i)], &part.position_then[std::size_t(dim) * i]);
      longest[0] = std::max(longest[0], more[l][i] + way);
    }
  }
  exchange_->largest(longest);
  const Cell& cell = parts_[0].simulation->scene.cell; // images come nearer where it changes its shape
  double changed = 0;
  for (int k = 0; k < 3; ++k) {
    double square = 0;
    for (int d = 0; d < 3; ++d) {
      const double change = cell.vectors[d + 3 * k] - cell_then_.vectors[d + 3 * k];
      square += change * change;
    }
    changed += std::sqrt(square);
  }
  return longest[0] + changed / 2;
}

// A contact is owned where the contactor with the smaller id is, or the one that is not everywhere.
bool OverRanks::owns_contact(const Part& part, std::int32_t one, std::int32_t two) const {
  const Contactors& c = part.simulation->scene.contactors;
  const std::int32_t a = *c.body[one], b = *c.body[two];
  if (a < 0 || b < 0) return part.rank == mesh_rank_;
  const auto roams = [&](std::int32_t body) { return !everywhere_[std::size_t(part.bodies[std::size_t(body)])]; };
  const auto fixed = [&](std::int32_t body) { return part.fixed[std::size_t(body)] != 0; };
  const auto jointed = [&](std::int32_t body) { return jointed_[std::size_t(part.bodies[std::size_t(body)])] != 0; };
  std::int32_t owner = *c.id[one] < *c.id[two] ? a : b;
  if (jointed(a) != jointed(b))
    owner = jointed(a) ? a : b;
  else if (roams(a) != roams(b))
    owner = roams(a) ? a : b;
  else if (fixed(a) != fixed(b))
    owner = fixed(a) ? b : a;
  return part.own[std::size_t(owner)] != 0;
}

std::unique_ptr<Strategy> over_ranks(std::unique_ptr<Strategy> strategy, std::shared_ptr<Exchange> exchange,
                                     Rhythm rhythm) {
  if (dynamic_cast<Nscd*>(strategy.get()))
    return std::make_unique<RankedNscd>(std::move(strategy), std::move(exchange), rhythm);
  if (rhythm == Rhythm::sweep)
    throw Error("exchange is 'sweep', and the strategy is " + strategy->name + ", which makes no sweeps: give NSCD");
  if (dynamic_cast<SmoothDem*>(strategy.get()))
    return std::make_unique<RankedSmooth>(std::move(strategy), std::move(exchange));
  throw Error("the strategy is " + strategy->name +
              ", which does not run over ranks: leave that out, or leave out ranks");
}

} // namespace cairn
