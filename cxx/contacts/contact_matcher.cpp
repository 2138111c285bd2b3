// Contact memory between steps: impulses and states of laws, found by the keys of their contacts.
#include "contact_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/held_bytes.hpp"
#include "../contactors/shapes.hpp"
#include "../detection/key_search.hpp"

namespace cairn {

void ContactMatcher::match(int threads) {
  const auto n = std::int64_t(system_.candidate.size());
  place = scratch_.take<std::int32_t>(n);
  const Scratch::Mark searching = scratch_.mark();
  const auto key_of = [&](std::int64_t c) { // dummies have none
    return system_.candidate[c] < 0 ? ContactKey{-1, -1, 0, 0} : in_.key(system_.candidate[c]);
  };
  const bool followed = follow_order();
  number_places(n, followed);
  if (followed)
    find_others(n, key_of);
  else
    find_keys(memory_.keys, n, key_of, threads, scratch_, place);
  if (in_.dim() == 3 && !memory_.keys.empty() && in_.contactors->hulls.first_vertex.size() > 1) {
    follow_across_facets();
    follow_bonds_across_sides();
  }
  if (in_.dim() == 2 && !memory_.keys.empty() && in_.meshes) follow_bonds_across_sides();
  if (anchors_.any()) hand_on_broken();
  scratch_.release(searching);
}

// Candidates come in one order in every step: kind by kind, and in that by their contactors. Both steps are gone
// through side by side, and a candidate of the last one tells where the memory has it. False where contactors were
// numbered otherwise, or others wrote into the memory.
bool ContactMatcher::follow_order() {
  const Candidates& c = *in_.candidates;
  const Array<std::int64_t>& id = in_.contactors->id.values;
  names_of_last_.swap(names_);
  fit(names_, std::size_t(c.count));
  for (std::int64_t i = 0; i < c.count; ++i) {
    const auto word = [](std::int32_t high, std::int32_t low) {
      return std::uint64_t(std::uint32_t(high)) << 32 | std::uint32_t(low);
    };
    names_[std::size_t(i)] = {word(c.contactor_a[i], c.contactor_b[i]), word(c.feature[i], c.image[i])};
  }
  const bool same = in_order_ && memory_.keys.size() == keys_in_order_ && names_of_last_.size() == kept_at_.size() &&
                    id.size() == ids_in_order_.size() && std::equal(id.begin(), id.end(), ids_in_order_.begin());
  in_order_ = false;
  if (!same) return false;
  const Array<CandidateName>& before = names_of_last_;
  const auto last = std::int64_t(before.size());
  fit(found_at_, std::size_t(c.count));
  fit(left_over_, std::size_t(last));
  std::size_t passed = 0;
  std::int64_t next = 0;
  bool same_run = last > 0; // pairs rise in a run of candidates of one kind, and `next` is in that of this candidate
  const auto advance = [&] {
    ++next;
    same_run = next < last && before[std::size_t(next)].pair >= before[std::size_t(next - 1)].pair;
  };
  const auto pass = [&] {
    left_over_[passed++] = kept_at_[std::size_t(next)];
    advance();
  };
  for (std::int64_t i = 0; i < c.count; ++i) {
    const CandidateName& name = names_[std::size_t(i)];
    if (i > 0 && name.pair < names_[std::size_t(i - 1)].pair) {
      while (same_run) pass();
      same_run = next < last;
    }
    while (same_run && before[std::size_t(next)].pair < name.pair) pass();
    std::int64_t at = same_run ? next : last;
    while (at < last && before[std::size_t(at)].pair == name.pair && !(before[std::size_t(at)] == name)) ++at;
    found_at_[std::size_t(i)] = -1;
    if (at == last || !(before[std::size_t(at)] == name)) continue;
    while (next < at) pass();
    found_at_[std::size_t(i)] = kept_at_[std::size_t(at)];
    advance();
  }
  while (next < last) pass();
  left_over_.resize(passed);
  kept_at_.swap(found_at_);
  return true;
}

// Where `remember` will keep the contact of each candidate; in the place of where the memory has it now, if that is
// known, which goes to `place`.
void ContactMatcher::number_places(std::int64_t places, bool known) {
  const std::int64_t count = in_.candidates->count;
  if (!known) {
    fit(kept_at_, std::size_t(count));
    std::fill(kept_at_.begin(), kept_at_.end(), -1);
  }
  std::int32_t to = 0;
  for (std::int64_t k = 0; k < places; ++k) {
    const std::int32_t i = system_.candidate[std::size_t(k)];
    place[k] = i < 0 ? -1 : kept_at_[std::size_t(i)];
    if (i >= 0) kept_at_[std::size_t(i)] = to++;
  }
  for (std::int64_t i = 0; i < count && to < count; ++i)
    if (!classes_.moves(i)) kept_at_[std::size_t(i)] = -1; // it is in no batch
}

// Contacts that stood elsewhere in the order of the last step, by their keys.
template <class KeyOf>
void ContactMatcher::find_others(std::int64_t places, const KeyOf& key_of) {
  if (left_over_.empty()) return;
  const auto is_missing = [&](std::int64_t k) { return place[k] < 0 && system_.candidate[std::size_t(k)] >= 0; };
  std::int64_t missing = 0;
  for (std::int64_t k = 0; k < places; ++k) missing += is_missing(k);
  if (missing == 0) return;
  KeyTable table(missing, scratch_);
  for (std::int64_t k = 0; k < places; ++k)
    if (is_missing(k)) table.insert(key_of(k), k);
  for (const std::int32_t at : left_over_) {
    if (at < 0) continue; // it was in no batch
    const std::int32_t to = table.find(memory_.keys[std::size_t(at)], key_of);
    if (to >= 0) place[to] = at;
  }
}

namespace {

constexpr std::int32_t names_of_facets = 1 << 27; // and above: see patch_points.f90

std::int64_t end_of_seen(const ContactMemory& memory) { // above all contactors that it may name
  return std::max(memory.contactors_seen, memory.seen_besides.empty() ? 0 : memory.seen_besides.back() + 1);
}

} // namespace

// Hands on the memory of a contact point of a body that passes from one triangle of a surface to another, if its
// impulse points about along the new normal. Points named after edges and vertices of a triangle stay there.
void ContactMatcher::follow_across_facets() {
  const auto n = std::int64_t(system_.candidate.size());
  const auto is_lost = [&](std::int64_t c) {
    const std::int64_t i = system_.candidate[c];
    return place[c] < 0 && i >= 0 && in_.candidates->feature[i] < names_of_facets &&
           info(Shape(*in_.contactors->shape[in_.candidates->contactor_b[i]])).facet();
  };
  std::int64_t lost = 0;
  for (std::int64_t c = 0; c < n; ++c) lost += is_lost(c);
  if (lost == 0) return;
  const auto on_body = [&](std::int64_t c) { // the key with the body in place of the triangle
    ContactKey k = in_.key(system_.candidate[c]);
    k.contactor_b = in_.body(in_.candidates->contactor_b[system_.candidate[c]]);
    return k;
  };
  KeyTable table(lost, scratch_);
  for (std::int64_t c = 0; c < n; ++c)
    if (is_lost(c)) table.insert(on_body(c), c);
  const std::int64_t known = end_of_seen(memory_);
  auto* owner = scratch_.take<std::int32_t>(known);
  std::fill_n(owner, known, -1);
  for (std::int64_t c = 0; c < in_.contactors->count; ++c)
    if (info(Shape(*in_.contactors->shape[c])).facet() && memory_.has_seen(*in_.contactors->id[c]))
      owner[*in_.contactors->id[c]] = in_.body(std::int32_t(c));
  auto* taken = scratch_.take<std::uint8_t>(std::int64_t(memory_.keys.size()));
  std::fill_n(taken, memory_.keys.size(), 0);
  for (std::int64_t c = 0; c < n; ++c)
    if (place[c] >= 0) taken[place[c]] = 1;
  for (std::size_t i = 0; i < memory_.keys.size(); ++i) {
    ContactKey k = memory_.keys[i];
    if (taken[i] || k.feature >= names_of_facets || owner[k.contactor_b] < 0) continue;
    k.contactor_b = owner[k.contactor_b];
    const std::int32_t c = table.find(k, on_body);
    if (c < 0 || place[c] >= 0) continue;
    const double *p = &memory_.impulses[i * memory_.impulse_components],
                 *m = &in_.candidates->normal[3 * std::int64_t(system_.candidate[c])];
    const double along = p[0] * m[0] + p[1] * m[1] + p[2] * m[2];
    if (along > 0 && 4 * along * along > p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) place[c] = std::int32_t(i);
  }
}

// Hands on the bond of a round body or of a point of a mesh that passes from one side to another (triangles of a body
// or mesh, in 2D edges of a mesh): to the contact of the same law with the most similar normal.
void ContactMatcher::follow_bonds_across_sides() {
  if (memory_.state_components == 0) return;
  const auto n = std::int64_t(system_.candidate.size());
  const auto is_side = [&](std::int64_t contactor) {
    const ShapeInfo& shape = info(Shape(*in_.contactors->shape[contactor]));
    return in_.dim() == 3 ? shape.facet() : shape.bar() && in_.body(std::int32_t(contactor)) < 0;
  };
  const auto holds = [&](std::int64_t at) { return memory_.states[at * std::int64_t(memory_.state_components)] > 0; };
  auto* taken = scratch_.take<std::uint8_t>(std::int64_t(memory_.keys.size()));
  std::fill_n(taken, memory_.keys.size(), 0);
  for (std::int64_t c = 0; c < n; ++c)
    if (place[c] >= 0) taken[place[c]] = 1;
  bool any = false;
  for (std::size_t i = 0; i < memory_.keys.size() && !any; ++i) any = !taken[i] && holds(std::int64_t(i));
  if (!any) return;
  const auto is_loose = [&](std::int64_t c) { // one that touched there before it, without a bond, goes on as the bond
    const std::int64_t i = system_.candidate[c];
    return !(place[c] >= 0 && holds(place[c])) && i >= 0 && classes_.entry[i] >= 0 && classes_.law(i).keeps &&
           is_side(in_.candidates->contactor_b[i]);
  };
  std::int64_t loose = 0;
  for (std::int64_t c = 0; c < n; ++c) loose += is_loose(c);
  if (loose == 0) return;
  const auto on_surface = [&](std::int64_t c) { // the key with the carrier in the place of the side
    ContactKey k = in_.key(system_.candidate[c]);
    k.contactor_b = in_.unit_of(in_.candidates->contactor_b[system_.candidate[c]]);
    return k;
  };
  KeyTable table(loose, scratch_);
  for (std::int64_t c = 0; c < n; ++c)
    if (is_loose(c)) table.insert(on_surface(c), c);
  const std::int64_t known = end_of_seen(memory_);
  auto* side_of = scratch_.take<std::int32_t>(known);
  std::fill_n(side_of, known, -1);
  for (std::int64_t c = 0; c < in_.contactors->count; ++c)
    if (is_side(c) && memory_.has_seen(*in_.contactors->id[c])) side_of[*in_.contactors->id[c]] = std::int32_t(c);
  for (std::size_t i = 0; i < memory_.keys.size(); ++i) {
    ContactKey k = memory_.keys[i];
    if (taken[i] || !holds(std::int64_t(i)) || k.feature < 0 || k.feature >= names_of_facets ||
        side_of[k.contactor_b] < 0)
      continue;
    const std::int32_t side = side_of[k.contactor_b];
    k.contactor_b = in_.unit_of(side);
    double was[3], most = 0.5;
    in_.normal_of_side(side, was);
    std::int32_t heir = -1;
    table.find(k, [&](std::int32_t c) { // goes through all that may be it
      const std::int64_t at = system_.candidate[c];
      const std::int32_t a = in_.candidates->contactor_a[at], b = in_.candidates->contactor_b[at];
      if (!is_loose(c) || !(on_surface(c) == k) ||
          in_.laws->find(*in_.contactors->material[a], *in_.contactors->material[side]) != classes_.entry[at])
        return ContactKey{-1, -1, 0, 0};
      double is[3];
      in_.normal_of_side(b, is);
      const double alike = was[0] * is[0] + was[1] * is[1] + was[2] * is[2];
      if (alike > most) most = alike, heir = c;
      return ContactKey{-1, -1, 0, 0};
    });
    if (heir >= 0) place[heir] = std::int32_t(i);
  }
}

void ContactMatcher::hand_on_broken() {
  for (std::size_t c = 0; c < system_.candidate.size(); ++c)
    if (const std::int32_t i = system_.candidate[c]; i >= 0 && place[c] < 0 && anchors_.broken_before(i) >= 0)
      place[c] = anchors_.broken_before(i);
}

void ContactMatcher::note_order(std::size_t keys) {
  ids_in_order_ = in_.contactors->id.values;
  keys_in_order_ = keys;
  in_order_ = true;
}

std::int64_t ContactMatcher::bytes() const {
  return held_bytes(names_, names_of_last_, kept_at_, found_at_, left_over_, ids_in_order_);
}

} // namespace cairn
