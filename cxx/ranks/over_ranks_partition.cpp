// Bodies to ranks: owners by the curve and counted costs, ghosts by places, memory of contacts to who owns them now.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "../base/call.hpp"
#include "../base/held_bytes.hpp"
#include "../contactors/shapes.hpp"
#include "memory_rows.hpp"
#include "over_ranks.hpp"

namespace cairn {
namespace {

// True if the scene needs neighbours of ghosts too: detection leaves out contacts of faces by their other neighbours.
// Those of meshes are left out by other parts of the mesh, or by rigid faces.
bool asks_for_neighbours(const Simulation& s, const std::vector<std::uint8_t>& everywhere) {
  const Contactors& c = s.scene.contactors;
  for (std::int64_t k = 0; k < c.count; ++k)
    if (*c.body[k] >= 0 && !everywhere[std::size_t(*c.body[k])] && !info(Shape(*c.shape[k])).ball()) return true;
  return false;
}

// 1: a joint holds the body, and contacts move it.
std::vector<std::uint8_t> jointed_bodies(const Simulation& s, const std::vector<std::uint8_t>& fixed) {
  std::vector<std::uint8_t> jointed(fixed.size(), 0);
  const Contactors& c = s.scene.contactors;
  for (std::int64_t k = 0; k < c.count; ++k) {
    const int material = *c.material[k], entry = s.laws.find(material, material);
    if (entry < 0 || !law_infos()[std::size_t(s.laws.entry(entry).law)].joins) continue;
    if (*c.body[k] < 0) continue; // meshes are on the same rank
    const auto body = std::size_t(*c.body[k]);
    jointed[body] = !fixed[body];
  }
  return jointed;
}

} // namespace

bool OverRanks::must_partition(const Simulation& s) const {
  constexpr double most_imbalance = 1.2;
  constexpr std::int64_t least_steps = 50;
  if (anew_ || parts_.empty() || s.scene.order_version() != order_seen_ || !knows_meshes(s)) return true;
  if (s.scene.contactors.hulls.count() != hulls_seen_) return true;
  return exchange_->ranks() > 1 && imbalance_ > most_imbalance && since_partition_ >= least_steps;
}

// Costs of bodies, with those of the contacts of the last step on them, then of all meshes together.
std::vector<std::int64_t> OverRanks::costs(const Simulation& s) const {
  const auto n = std::size_t(s.scene.bodies.count);
  std::vector<std::int64_t> cost(n + 1, 0);
  for (const Part& part : parts_) {
    const ContactMemory m = own_memory(part);
    for (const ContactKey& key : m.keys)
      for (const std::int64_t id : {key.contactor_a, key.contactor_b})
        if (const std::int32_t contactor = s.contactor(id); contactor >= 0) {
          const std::int32_t body = *s.scene.contactors.body[contactor];
          cost[body < 0 ? n : std::size_t(body)] += cost_of_contact / 2;
        }
  }
  exchange_->sum(cost);
  for (std::size_t i = 0; i < n; ++i) cost[i] += cost_of_body;
  cost[n] += cost_of_body * s.scene.nodes.count;
  return cost;
}

void OverRanks::partition(Simulation& s, double margin) {
  const bool apart = numbers_are_apart(s);
  if (!apart) fetch(s);
  if (partitions_ == 0) return_freed_memory(); // of the insertion of bodies, which parts would come on top of
  Outline all = outline(s);
  const std::vector<std::int32_t> owner_before = std::move(owner_);
  fixed_ = std::move(all.fixed);
  choose_owners(s, all.radius);
  const MeshBalls meshes = balls_of_meshes(s);
  const double widest = choose_reach(s, all.radius, meshes, margin);

  Surroundings around;
  around.dim = s.scene.dim;
  around.count = s.scene.bodies.count;
  around.position = all.position;
  around.radius = all.radius.data();
  around.everywhere = everywhere_.data();
  around.owner = owner_.data();
  around.cell = s.scene.cell;
  around.reach = asks_for_neighbours(s, everywhere_) ? 2 * (reach_ + widest) : reach_;
  auto bodies = exchange_->ranks() > 1 ? ghosts_of(around, meshes) : std::vector<std::vector<std::int32_t>>(1);

  std::vector<ContactMemory> memory;
  for (const Part& part : parts_) memory.push_back(own_memory(part));
  add_held(s, around, memory, bodies);
  for (std::size_t l = 0; l < bodies.size(); ++l) { // beside ghosts those of the ranks
    for (std::int64_t i = 0; i < s.scene.bodies.count; ++i)
      if (owner_[std::size_t(i)] == exchange_->local()[l] || everywhere_[std::size_t(i)])
        bodies[l].push_back(std::int32_t(i));
    std::sort(bodies[l].begin(), bodies[l].end());
  }
  make_parts(s, all.radius, bodies, apart ? pass_rows(s, owner_before, bodies) : std::vector<Arrived>{});
  release_workspace(s.scene);
  workspace_known_ = false;
  give_memory(s, memory);
  ghosts_.link(parts_, *exchange_);
  order_seen_ = s.scene.order_version();
  hulls_seen_ = s.scene.contactors.hulls.count();
  meshes_seen_.clear();
  for (const MeshBody& mesh : s.meshes.meshes) meshes_seen_.push_back(&mesh);
  anew_ = false;
  cell_then_ = s.scene.cell;
  since_partition_ = 0;
  imbalance_ = 1;
  if (partitions_ == 0 && !apart && !reads_state(s) && !held_) { // nobody is to read it before the end of the step
    release(s, s.controls != nullptr || loads_written_);
    known_ = false;
    unread_ = true;
  }
  ++partitions_;
}

// Owners of bodies by the curve and counted costs, the ranks of joints and of meshes.
void OverRanks::choose_owners(Simulation& s, const std::vector<double>& radius) {
  std::vector<std::int64_t> cost = costs(s);
  const std::int64_t of_meshes = cost.back();
  cost.pop_back();
  everywhere_ = bodies_everywhere(radius, fixed_);
  for (std::size_t i = 0; i < cost.size(); ++i) // their contacts are where the others are
    if (everywhere_[i]) cost[i] = cost_of_body;
  const std::int64_t beside = body_beside_meshes(s); // meshes come with it
  if (beside >= 0) cost[std::size_t(beside)] += of_meshes;
  owner_ = cut_curve(cost, exchange_->ranks());
  keep_joints_together(s, radius);
  choose_mesh_rank(s, beside);
}

// Gap up to which bodies are ghosts of each other, by their sizes and speeds; returns the largest radius [m].
double OverRanks::choose_reach(const Simulation& s, const std::vector<double>& radius, const MeshBalls& meshes,
                               double margin) {
  double widest = 0, middle = 0;
  std::int64_t roaming = 0;
  for (std::int64_t i = 0; i < s.scene.bodies.count; ++i) {
    if (everywhere_[std::size_t(i)]) continue;
    widest = std::max(widest, radius[std::size_t(i)]);
    middle += radius[std::size_t(i)];
    ++roaming;
  }
  const double fastest = std::max(meshes.fastest, fastest_square(s));
  const double h = s.report.h > 0 ? s.report.h : 0;
  const double size = std::max(widest, meshes.widest); // margins are shares of it
  reach_ = 2 * (margin + 0.05 * size +
                reach_factor_ * (0.25 * (roaming > 0 ? middle / double(roaming) : size) + 2 * h * std::sqrt(fastest)));
  return widest;
}

// arrived: rows of the bodies of each part, where they came from other ranks; else empty.
void OverRanks::make_parts(Simulation& s, const std::vector<double>& radius,
                           std::vector<std::vector<std::int32_t>>& bodies, std::vector<Arrived> arrived) {
  parts_.clear();
  taken_ = false;
  for (std::size_t l = 0; l < exchange_->local().size(); ++l) {
    const int rank = exchange_->local()[l];
    Part& part = parts_.emplace_back(
        make_part(s, *model_, rank, std::move(bodies[l]), share_of_meshes(l), arrived.empty() ? nullptr : &arrived[l]));
    if (!arrived.empty()) arrived[l] = {};
    for (const std::int32_t body : part.bodies) {
      part.own.push_back(owner_[std::size_t(body)] == rank);
      part.owner.push_back(owner_[std::size_t(body)]);
      part.fixed.push_back(fixed_[std::size_t(body)]);
      part.radius_then.push_back(radius[std::size_t(body)]);
    }
    find_runs(part);
    part.has_joints = rank == joint_rank_;
  }
}

void OverRanks::add_growth(std::vector<std::vector<double>>& more) const {
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    const std::vector<double>& then = parts_[l].radius_then;
    if (!parts_[l].simulation->scene.has(Need::growing)) continue;
    const std::vector<double> now = radii_of(*parts_[l].simulation);
    for (std::size_t i = 0; i < then.size(); ++i)
      if (std::isfinite(then[i])) more[l][i] += std::max(0.0, now[i] - then[i]);
  }
}

// Bodies that joints hold, and their contacts, are on one rank, which projects joints and stiffens their bodies as a
// whole.
void OverRanks::keep_joints_together(const Simulation& s, const std::vector<double>& radius) {
  jointed_ = jointed_bodies(s, fixed_);
  const auto first = std::find(jointed_.begin(), jointed_.end(), 1);
  joint_rank_ = first == jointed_.end() ? -1 : owner_[std::size_t(first - jointed_.begin())];
  for (std::size_t i = 0; i < jointed_.size() && joint_rank_ >= 0; ++i) {
    if (!jointed_[i]) continue;
    if (!std::isfinite(radius[i]))
      refuse("a joint holds body " + std::to_string(*s.scene.bodies.id[std::int64_t(i)]) + ", which has no bound");
    owner_[i] = joint_rank_;
    everywhere_[i] = 0;
  }
}

// Bodies that a law holds together meet however far apart they are: each is a ghost where the other one is. ghosts: of
// the local ranks, rising. All ranks call it.
void OverRanks::add_held(const Simulation& s, const Surroundings& around, const std::vector<ContactMemory>& memory,
                         std::vector<std::vector<std::int32_t>>& ghosts) {
  if (!s.laws_keep()) return;
  constexpr std::int64_t of_mesh = -1;
  std::vector<std::array<std::int64_t, 2>> apart; // ids of bodies
  const auto look = [&](const ContactMemory& m) {
    const auto held = [&](std::size_t row) {
      return m.state_components > 0 && m.states[row * std::size_t(m.state_components)] > 0 &&
             m.states[row * std::size_t(m.state_components)] < no_state;
    };
    for (std::size_t row = 0; row < m.keys.size(); ++row) {
      const std::int32_t one = s.contactor(m.keys[row].contactor_a), two = s.contactor(m.keys[row].contactor_b);
      if (!held(row) || one < 0 || two < 0) continue;
      const std::int32_t a = *s.scene.contactors.body[one], b = *s.scene.contactors.body[two];
      if (a < 0 || b < 0) { // on the rank of the meshes
        const std::int32_t body = std::max(a, b);
        if (body >= 0 && !everywhere_[std::size_t(body)]) apart.push_back({*s.scene.bodies.id[body], of_mesh});
        continue;
      }
      if (!everywhere_[std::size_t(a)] && !everywhere_[std::size_t(b)] && !near(around, a, b))
        apart.push_back({*s.scene.bodies.id[a], *s.scene.bodies.id[b]});
    }
  };
  for (const ContactMemory& m : memory) look(m);
  Packer mine;
  mine.put_all(std::span<const std::array<std::int64_t, 2>>(apart));
  apart.clear();
  for (const Piece bytes : exchange_->gather(std::move(mine.bytes))) {
    Unpacker from(bytes);
    const auto some = from.get_all<std::array<std::int64_t, 2>>();
    apart.insert(apart.end(), some.begin(), some.end());
  }
  look(pending_); // of a restart: whole on all ranks
  for (const auto& [first, second] : apart) {
    const std::int32_t a = s.scene.internal(first), b = second == of_mesh ? a : s.scene.internal(second);
    for (std::size_t l = 0; l < ghosts.size() && second == of_mesh; ++l)
      if (exchange_->local()[l] == mesh_rank_ && owner_[std::size_t(a)] != mesh_rank_) ghosts[l].push_back(a);
    for (std::size_t l = 0; l < ghosts.size(); ++l)
      for (const auto& [own, other] : {std::pair(a, b), std::pair(b, a)})
        if (owner_[std::size_t(own)] == exchange_->local()[l] && owner_[std::size_t(other)] != owner_[std::size_t(own)])
          ghosts[l].push_back(other);
  }
  for (auto& of_rank : ghosts) {
    std::sort(of_rank.begin(), of_rank.end());
    of_rank.erase(std::unique(of_rank.begin(), of_rank.end()), of_rank.end());
  }
}

// Bonds that began between ghosts are those of their owners.
void OverRanks::leave_contacts_of_others(Part& part) {
  const Simulation& s = *part.simulation;
  began_ = s.scene.next_contactor_id;
  if (exchange_->ranks() == 1 || since_partition_ > 0 || !s.laws_keep()) return;
  ContactMemory m = part.strategy->memory(s);
  const auto rows = rows_where(s, m, [&](std::int32_t one, std::int32_t two) { return owns_contact(part, one, two); });
  if (rows.size() < m.keys.size()) part.strategy->restore(*part.simulation, rows_of(m, rows));
}

// The rank that owns the contact of a key now; -1: a contactor is gone.
int OverRanks::heir(const Simulation& s, const ContactKey& key) const {
  const std::int32_t one = s.contactor(key.contactor_a), two = s.contactor(key.contactor_b);
  if (one < 0 || two < 0) return -1;
  if (*s.scene.contactors.body[one] < 0 || *s.scene.contactors.body[two] < 0) return mesh_rank_;
  const auto a = std::size_t(*s.scene.contactors.body[one]), b = std::size_t(*s.scene.contactors.body[two]);
  std::size_t owner = key.contactor_a < key.contactor_b ? a : b;
  if (jointed_[a] != jointed_[b])
    owner = jointed_[a] ? a : b;
  else if (everywhere_[a] != everywhere_[b])
    owner = everywhere_[a] ? b : a;
  else if (fixed_[a] != fixed_[b])
    owner = fixed_[a] ? b : a;
  return owner_[owner];
}

// Moves the memory of contacts to their present owners, or to the ranks of both bodies. Memory that was restored is
// whole on all ranks.
void OverRanks::give_memory(const Simulation& s, const std::vector<ContactMemory>& memory) {
  const auto heirs = [&](const ContactKey& key) {
    std::vector<int> ranks = {heir(s, key)};
    for (const std::int64_t id : {key.contactor_a, key.contactor_b})
      if (const std::int32_t contactor = s.contactor(id);
          both_remember_ && contactor >= 0 && ranks[0] >= 0 && *s.scene.contactors.body[contactor] >= 0)
        ranks.push_back(owner_[std::size_t(*s.scene.contactors.body[contactor])]);
    std::sort(ranks.begin(), ranks.end());
    ranks.erase(std::unique(ranks.begin(), ranks.end()), ranks.end());
    std::erase(ranks, -1);
    return ranks;
  };
  double joints_came[] = {0}; // as the rank that has them knows
  for (const ContactMemory& m : memory)
    if (m.joints_came) joints_came[0] = 1;
  if (!memory.empty()) exchange_->largest(joints_came);
  std::vector<std::vector<Parcel>> out;
  for (const ContactMemory& m : memory) {
    std::map<int, std::vector<std::size_t>> rows;
    for (std::size_t i = 0; i < m.keys.size(); ++i)
      for (const int rank : heirs(m.keys[i])) rows[rank].push_back(i);
    if (!m.seats.empty() && mesh_rank_ >= 0) rows[mesh_rank_]; // seats go there
    auto& parcels = out.emplace_back();
    for (const auto& [rank, of_rank] : rows) {
      Packer packer;
      ContactMemory some = rows_of(m, of_rank);
      if (rank != mesh_rank_) some.seats.clear();
      pack(some, packer);
      parcels.push_back({rank, std::move(packer.bytes)});
    }
  }
  std::vector<std::vector<Parcel>> in(parts_.size());
  if (!memory.empty()) in = exchange_->deliver(std::move(out));
  for (std::size_t l = 0; l < parts_.size(); ++l) {
    ContactMemory own;
    for (const Parcel& parcel : in[l]) add_packed(parcel.bytes, own);
    if (!memory.empty()) {
      own.h = memory[0].h;
      own.contactors_seen = std::max(seen_, began_); // bonds of a step that is cut anew began already
      own.seen_besides = memory[0].seen_besides;
      own.joints_came = joints_came[0] > 0;
    }
    if (!pending_.keys.empty() || !pending_.seats.empty()) {
      std::vector<std::size_t> rows;
      for (std::size_t i = 0; i < pending_.keys.size(); ++i) {
        const std::vector<int> ranks = heirs(pending_.keys[i]);
        if (std::binary_search(ranks.begin(), ranks.end(), parts_[l].rank)) rows.push_back(i);
      }
      own = rows_of(pending_, rows);
      if (parts_[l].rank != mesh_rank_) own.seats.clear();
    }
    put_in_order(own);
    if (!memory.empty() || has_pending_) parts_[l].strategy->restore(*parts_[l].simulation, std::move(own));
  }
  pending_ = {};
  has_pending_ = false;
}

// The memory of all contacts, in the order of their keys: the same whatever the number of ranks, and all arrays of
// bodies, which are kept beside it. All ranks call it.
ContactMemory OverRanks::memory(const Simulation& s) const {
  const_cast<OverRanks*>(this)->fetch(const_cast<Simulation&>(s), true);
  if (parts_.empty() || has_pending_) return pending_;
  share_touched(const_cast<Simulation&>(s)); // a file is written next, by the first process
  return exchange_->together([&] {
    Packer mine;
    for (const Part& part : parts_) pack(own_memory(part), mine);
    ContactMemory all;
    for (const Piece bytes : exchange_->gather(std::move(mine.bytes))) add_packed(bytes, all);
    put_in_order(all);
    return all;
  });
}

void OverRanks::restore(Simulation& s, ContactMemory memory) {
  Interactions check(s.scene.dim); // throws where sizes do not agree
  check.restore(memory);
  pending_ = std::move(memory);
  has_pending_ = true;
  parts_.clear();
  mesh_rank_ = -1;
  known_ = true;
  anew_ = true;
  s.contacts_known = all_shown_ = false;
  shown_.reset();
}

std::vector<std::int32_t> OverRanks::owners(const Simulation& s) const {
  std::vector<std::int32_t> out;
  if (owner_.size() != std::size_t(s.scene.bodies.count) || order_seen_ != s.scene.order_version()) return out;
  for (const std::int32_t i : s.scene.insertion_order()) out.push_back(owner_[std::size_t(i)]);
  return out;
}

std::vector<std::int64_t> OverRanks::bytes_of_ranks() const {
  std::vector<std::int64_t> out;
  for (const Part& part : parts_) {
    const auto [bodies, contacts] = part.simulation->bytes();
    out.push_back(bodies + contacts + std::int64_t(part.simulation->scene.contactors.hulls.bytes()));
  }
  return out;
}

std::int64_t OverRanks::body_bytes() const {
  std::int64_t sum = held_bytes(owner_, everywhere_, fixed_, jointed_);
  for (const Part& part : parts_) sum += part.simulation->bytes().first;
  return sum;
}

std::int64_t OverRanks::contact_bytes() const {
  std::int64_t sum = 0;
  for (const Part& part : parts_) sum += part.simulation->bytes().second;
  return sum;
}

} // namespace cairn
