// Which contact stands in which batch. It depends on the candidates and their order alone.
#include "contact_plan.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include "../base/held_bytes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/side_names.hpp"
#include "surface_motion.hpp"

namespace cairn {

namespace {

constexpr int kinds = ContactClasses::kinds, radial = ContactClasses::radial, moving = ContactClasses::moving,
              mapped = ContactClasses::mapped;

int kind_a(int contact_class) { return ContactClasses::kind_a(contact_class); }
int kind_b(int contact_class) { return ContactClasses::kind_b(contact_class); }

} // namespace

bool ContactPlan::is_hub(std::int32_t contactor) const {
  return (classes_.kind[contactor] & moving) &&
         classes_.degree[in_.unit_of(contactor)] > (classes_.is_mapped(contactor) ? mesh_hub_degree : hub_degree);
}

std::int64_t ContactPlan::bytes() const {
  return held_bytes(order_start_, tile_stage_, hub_contacts_, late_contacts_, of_hub_, by_hub_, key_of_order_,
                    order_count_, sorted_);
}

void ContactPlan::plan() {
  system_.first_task.assign(1, 0);
  system_.first_batch.assign(1, 0);
  system_.candidate.clear();
  system_.candidate.reserve(in_.candidates->count + in_.candidates->count / 8);
  hub_contacts_.clear();
  late_contacts_.clear();
  rope_contacts_.clear();
  if (system_.colours > 0) return plan_colours();
  plan_tiles();
  plan_hubs();
  plan_late();
}

// Contacts by colours that were chosen beside: each is a stage, whose batches threads share by some. Those of meshes,
// which all see each other, are the last colour.
void ContactPlan::plan_colours() {
  constexpr std::size_t batches_of_task = 8;
  const std::int64_t n = in_.candidates->count;
  const std::size_t rows = in_.laws->laws().size() * kinds * kinds;
  std::vector<std::int64_t> start(std::size_t(system_.colours) * rows + 1, 0);
  const auto key = [&](std::int64_t i) {
    return std::size_t(system_.colour[std::size_t(i)]) * rows + classes_.contact_class[i];
  };
  const auto in_turn = [&](std::int64_t i) {
    return ((kind_a(classes_.contact_class[i]) | kind_b(classes_.contact_class[i])) & mapped) != 0;
  };
  for (std::int64_t i = 0; i < n; ++i)
    if (in_turn(i))
      late_contacts_.push_back(std::int32_t(i));
    else if (classes_.moves(i))
      ++start[key(i) + 1];
  for (std::size_t k = 1; k < start.size(); ++k) start[k] += start[k - 1];
  sorted_.resize(std::max(sorted_.size(), std::size_t(n)));
  std::vector<std::int64_t> next(start.begin(), start.end() - 1);
  for (std::int64_t i = 0; i < n; ++i)
    if (classes_.moves(i) && !in_turn(i)) sorted_[std::size_t(next[key(i)]++)] = std::int32_t(i);
  const std::size_t colours = std::size_t(system_.colours) - (late_contacts_.empty() ? 0 : 1);
  for (std::size_t colour = 0; colour < colours; ++colour) {
    const std::size_t before = system_.batches.size();
    for (std::size_t k = colour * rows; k < (colour + 1) * rows; ++k)
      for (std::int64_t at = start[k]; at < start[k + 1]; at += batch_size)
        emit(&sorted_[std::size_t(at)], int(std::min<std::int64_t>(batch_size, start[k + 1] - at)), 0);
    for (std::size_t b = before; b < system_.batches.size(); b += batches_of_task)
      system_.first_batch.push_back(std::int32_t(std::min(b + batches_of_task, system_.batches.size())));
    system_.first_task.push_back(std::int32_t(system_.first_batch.size()) - 1);
  }
  plan_late();
}

// Contacts in runs of the candidates' order: tiles. Tiles that share no body that moves make a stage; within a tile
// contacts are coloured, and swept colour by colour while its bodies stay in the cache.
void ContactPlan::plan_tiles() {
  const Candidates& c = *in_.candidates;
  colours_ = scratch_.take<std::uint64_t>(in_.units());
  tile_colours_ = scratch_.take<std::uint64_t>(in_.units());
  std::fill_n(colours_, in_.units(), 0);
  std::fill_n(tile_colours_, in_.units(), 0);
  order_ = scratch_.take<std::int32_t>(c.count);
  std::size_t ordered = 0;
  order_start_.assign(1, 0);
  tile_stage_.clear();
  const auto simple = [&](std::int64_t i) { return !is_hub(c.contactor_a[i]) && !is_hub(c.contactor_b[i]); };
  const auto size = std::size_t(std::clamp<std::int64_t>(c.count / tiles, smallest_tile, largest_tile));
  const int least = in_.meshes ? mesh_hub_degree : hub_degree;
  const bool hubs =
      std::any_of(classes_.degree, classes_.degree + in_.units(), [&](std::int32_t d) { return d > least; });
  for (std::int64_t i = 0; i < c.count;) {
    const auto start = ordered;
    std::uint64_t taken = 0;
    for (; i < c.count && ordered - start < size; ++i) {
      if (!classes_.moves(i)) continue;
      if (ropes_.is_rope(i)) {
        rope_contacts_.push_back(std::int32_t(i));
        continue;
      }
      if (hubs && !simple(i)) {
        hub_contacts_.push_back(std::int32_t(i));
        continue;
      }
      order_[ordered++] = std::int32_t(i);
      if (classes_.moves_a(i)) taken |= tile_colours_[in_.unit_of(c.contactor_a[i])];
      if (classes_.moves_b(i)) taken |= tile_colours_[in_.unit_of(c.contactor_b[i])];
    }
    if (ordered == start) continue;
    const int stage = std::countr_one(taken);
    tile_stage_.push_back(stage);
    order_start_.push_back(std::int32_t(ordered));
    const std::uint64_t bit = stage < 64 ? std::uint64_t(1) << stage : 0;
    for (auto k = start; k < ordered; ++k) {
      if (classes_.moves_a(order_[k])) tile_colours_[in_.unit_of(c.contactor_a[order_[k]])] |= bit;
      if (classes_.moves_b(order_[k])) tile_colours_[in_.unit_of(c.contactor_b[order_[k]])] |= bit;
    }
  }
  const int stages = tile_stage_.empty() ? 0 : 1 + *std::max_element(tile_stage_.begin(), tile_stage_.end());
  std::vector<std::int32_t>& tile = late_contacts_; // scratch
  for (int stage = 0; stage < stages; ++stage) {
    for (std::size_t t = 0; t < tile_stage_.size(); ++t) {
      if (tile_stage_[t] != stage) continue;
      tile.assign(order_ + order_start_[t], order_ + order_start_[t + 1]);
      emit_sorted(tile, batch_size, 0);
      system_.first_batch.push_back(std::int32_t(system_.batches.size()));
      // tiles for which no stage was left stand alone
      if (stage == 64) system_.first_task.push_back(std::int32_t(system_.first_batch.size()) - 1);
    }
    if (stage < 64) system_.first_task.push_back(std::int32_t(system_.first_batch.size()) - 1);
  }
  tile.clear();
}

// Colours contacts so that those of one colour share no body but the hub, sorts them by colour and class, cuts them
// into batches.
void ContactPlan::emit_sorted(const std::vector<std::int32_t>& contacts, int largest, int hub) {
  const Candidates& c = *in_.candidates;
  for (std::int32_t i : contacts) colours_[in_.unit_of(c.contactor_a[i])] = colours_[in_.unit_of(c.contactor_b[i])] = 0;
  const int n = int(contacts.size());
  key_of_order_.resize(std::max(key_of_order_.size(), std::size_t(n)));
  const std::size_t rows = in_.laws->laws().size() * kinds * kinds;
  std::vector<std::int32_t>& count = order_count_;
  if (count.size() < 64 * rows + 1) count.assign(64 * rows + 1, 0);
  int most = 0;
  for (int k = 0; k < n; ++k) {
    const std::int32_t i = contacts[k];
    const int cls = classes_.contact_class[i];
    const std::int32_t a = in_.unit_of(c.contactor_a[i]), b = in_.unit_of(c.contactor_b[i]);
    std::uint64_t taken = 0;
    if (classes_.moves_a(i) && hub != 1) taken |= colours_[a];
    if (classes_.moves_b(i) && hub != 2) taken |= colours_[b];
    const int colour = std::min(std::countr_one(taken), 63);
    const std::uint64_t bit = std::uint64_t(1) << colour;
    if (classes_.moves_a(i)) colours_[a] |= bit;
    if (classes_.moves_b(i)) colours_[b] |= bit;
    most = std::max(most, colour);
    key_of_order_[k] = std::uint32_t(colour * rows + cls);
    ++count[key_of_order_[k] + 1];
  }
  const std::size_t keys = std::size_t(most + 1) * rows;
  for (std::size_t k = 0; k < keys; ++k) count[k + 1] += count[k];
  sorted_.resize(std::max(sorted_.size(), std::size_t(n)));
  for (int k = 0; k < n; ++k) sorted_[count[key_of_order_[k]]++] = contacts[k];
  std::int32_t start = 0;
  for (std::size_t k = 0; k < keys; ++k) {
    const std::int32_t end = count[k];
    for (; start < end; start += largest) emit(&sorted_[start], std::min(largest, end - start), hub);
    start = end;
  }
  std::fill(count.begin(), count.begin() + keys + 1, 0);
}

// Rows that contacts keep for their bodies on a side; 0: a body is too large.
std::int32_t ContactPlan::response_rows(const std::int32_t* contacts, int n, const std::int32_t* contactor) const {
  std::int64_t most = 0;
  for (int k = 0; k < n; ++k)
    most = std::max(most, system_.condensed_dofs[in_.meshes->mesh_of(contactor[contacts[k]])].dofs);
  return most <= small_condensed ? std::int32_t(condensed_rows(most)) : 0;
}

void ContactPlan::emit(const std::int32_t* contacts, int n, int hub) {
  cairn_batch b{};
  const int cls = classes_.contact_class[contacts[0]];
  b.contacts = n;
  b.count = (n + 7) / 8 * 8;
  b.law = std::int32_t(in_.laws->laws()[std::size_t(cls / (kinds * kinds))]);
  const LawInfo& law = law_infos()[b.law];
  b.components = law.components(in_.dim());
  const bool radial_a = kind_a(cls) & radial, radial_b = kind_b(cls) & radial;
  const auto side = [&](int of) {
    if (of & mapped) return in_.dim() == 2 ? mapped2 : mapped3;
    return of & radial ? (in_.dim() == 2 ? radial2 : radial3) : (in_.dim() == 2 ? rigid2 : rigid3);
  };
  b.side_a = side(kind_a(cls));
  b.side_b = side(kind_b(cls));
  const auto mapping = [&](int of) { return (of & mapped) == 0 ? 0 : system_.reaches ? 2 : 1; };
  b.mapped_a = mapping(kind_a(cls));
  b.mapped_b = mapping(kind_b(cls));
  b.condensed = system_.condensed_dofs.data();
  b.condensed_velocity = system_.condensed_velocity.data();
  b.stride_a = b.mapped_a ? response_rows(contacts, n, in_.candidates->contactor_a.data()) : 0;
  b.stride_b = b.mapped_b ? response_rows(contacts, n, in_.candidates->contactor_b.data()) : 0;
  b.moves_a = (kind_a(cls) & moving) != 0;
  b.moves_b = (kind_b(cls) & moving) != 0;
  const bool diagonal = (radial_a || !b.moves_a) && (radial_b || !b.moves_b);
  b.block = law.has_solve || !diagonal;
  b.hub = hub;
  b.relaxes = !law.has_solve;
  b.bonds = law.holds;
  b.residual = law.residual;
  const bool packs = packable(b) && law.normal_bias && !in_.options.pose.kernel && !has_jumps(in_, contacts, n);
  b.pack = packs ? 2 * in_.dim() + 4 : 0;
  b.group = hub ? n : 1;
  b.velocities = system_.velocities();
  b.first = std::int32_t(system_.candidate.size());
  system_.candidate.insert(system_.candidate.end(), contacts, contacts + n);
  system_.candidate.resize(b.first + b.count, -1);
  system_.batches.push_back(b);
}

// Contacts of a body that has too many of them. They come hub by hub; each batch sees the hub as it stands, with its
// inverse mass times the number of contacts of the batch (mass splitting: the fixed point stays, the iteration cannot
// overshoot). A batch is as long as that leaves the block of the other side the greater part, and no longer than a
// batch.
void ContactPlan::plan_hubs() {
  if (hub_contacts_.empty()) return;
  const Candidates& c = *in_.candidates;
  // an impulse on a contact of a mesh moves all its other contacts: these are solved one after the other
  const auto is_mesh_hub = [&](std::int32_t contactor) { return classes_.is_mapped(contactor) && is_hub(contactor); };
  by_hub_.clear();
  for (std::int32_t i : hub_contacts_) {
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    if ((is_hub(a) && is_hub(b)) || is_mesh_hub(a) || is_mesh_hub(b))
      late_contacts_.push_back(i);
    else
      by_hub_.emplace_back(is_hub(a) ? 2 * std::int64_t(in_.body(a)) : 2 * std::int64_t(in_.body(b)) + 1, i);
  }
  std::sort(by_hub_.begin(), by_hub_.end());
  const auto largest_inverse = [&](std::int32_t b) {
    const double* m = in_.bodies->inverse_mass[b];
    return *std::max_element(m, m + in_.dim());
  };
  std::vector<std::int32_t>& mine = of_hub_;
  for (std::size_t k = 0; k < by_hub_.size();) {
    const std::int64_t hub = by_hub_[k].first;
    mine.clear();
    double lightest = 0;
    for (; k < by_hub_.size() && by_hub_[k].first == hub; ++k) {
      const std::int32_t i = by_hub_[k].second;
      const std::int32_t other = hub % 2 ? c.contactor_a[i] : c.contactor_b[i];
      if (const std::int32_t carrier = in_.body(other); carrier >= 0)
        lightest = std::max(lightest, largest_inverse(carrier));
      else
        for (const std::int32_t node : in_.meshes->middle(other).node)
          if (node >= 0) lightest = std::max(lightest, 1 / *in_.nodes->mass[node]);
      mine.push_back(i);
    }
    const double mine_inverse = largest_inverse(std::int32_t(hub / 2));
    const double ratio = mine_inverse > 0 ? lightest / mine_inverse : batch_size;
    emit_sorted(mine, int(std::clamp(ratio, 8.0, double(batch_size))), hub % 2 ? 2 : 1);
  }
  system_.first_batch.push_back(std::int32_t(system_.batches.size()));
  system_.first_task.push_back(std::int32_t(system_.first_batch.size()) - 1);
}

// Plans contacts between hubs and ropes over pulleys, singly, and contacts of meshes, one after the other in batches of
// a kind; in the order of their keys, since numbers of bodies change.
void ContactPlan::plan_late() {
  late_contacts_.insert(late_contacts_.end(), rope_contacts_.begin(), rope_contacts_.end());
  if (late_contacts_.empty()) return;
  std::sort(late_contacts_.begin(), late_contacts_.end(), [&](std::int32_t i, std::int32_t j) {
    const ContactKey a = in_.key(i), b = in_.key(j);
    return std::tie(a.contactor_a, a.contactor_b, a.feature, a.image) <
           std::tie(b.contactor_a, b.contactor_b, b.feature, b.image);
  });
  const auto in_turn = [&](std::int32_t i) {
    const int cls = classes_.contact_class[i];
    const Law law = in_.laws->laws()[std::size_t(cls / (kinds * kinds))];
    return ((kind_a(cls) | kind_b(cls)) & mapped) && !law_infos()[std::int32_t(law)].has_solve;
  };
  for (std::size_t k = 0, end; k < late_contacts_.size(); k = end) {
    const std::int32_t first = late_contacts_[k];
    end = k + 1;
    while (in_turn(first) && end < late_contacts_.size() && end - k < std::size_t(batch_size) &&
           classes_.contact_class[late_contacts_[end]] == classes_.contact_class[first])
      ++end;
    emit(&late_contacts_[k], int(end - k), 0);
    system_.batches.back().in_turn = in_turn(first);
  }
  system_.first_batch.push_back(std::int32_t(system_.batches.size()));
  system_.first_task.push_back(std::int32_t(system_.first_batch.size()) - 1);
}

} // namespace cairn
