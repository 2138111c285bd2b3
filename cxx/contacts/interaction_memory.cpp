// Contact memory between steps: impulses and states of laws, found by the keys of their contacts.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../contactors/shapes.hpp"
#include "../detection/key_search.hpp"
#include "body_axes.hpp"
#include "interaction_state.hpp"

namespace cairn {

void Interactions::State::find_places(int threads) {
  const auto n = std::int64_t(system.candidate.size());
  place = scratch.take<std::int32_t>(n);
  const Scratch::Mark searching = scratch.mark();
  const auto key_of = [&](std::int64_t c) { // dummies have none
    return system.candidate[c] < 0 ? ContactKey{-1, -1, 0, 0} : key(system.candidate[c]);
  };
  const bool followed = follow_order();
  number_places(n, followed);
  if (followed)
    find_others(n, key_of);
  else
    find_keys(memory.keys, n, key_of, threads, scratch, place);
  if (dim() == 3 && !memory.keys.empty() && contactors->hulls.first_vertex.size() > 1) {
    follow_across_facets();
    follow_bonds_across_sides();
  }
  if (dim() == 2 && !memory.keys.empty() && meshes) follow_bonds_across_sides();
  if (!anchor_of.empty()) hand_on_broken();
  scratch.release(searching);
}

// Candidates come in one order in every step: kind by kind, and in that by their contactors. Both steps are gone
// through side by side, and a candidate of the last one tells where the memory has it. False where contactors were
// numbered otherwise, or others wrote into the memory.
bool Interactions::State::follow_order() {
  const Candidates& c = *candidates;
  const Array<std::int64_t>& id = contactors->id.values;
  names_of_last.swap(names);
  fit(names, std::size_t(c.count));
  for (std::int64_t i = 0; i < c.count; ++i) {
    const auto word = [](std::int32_t high, std::int32_t low) {
      return std::uint64_t(std::uint32_t(high)) << 32 | std::uint32_t(low);
    };
    names[std::size_t(i)] = {word(c.contactor_a[i], c.contactor_b[i]), word(c.feature[i], c.image[i])};
  }
  const bool same = in_order && memory.keys.size() == keys_in_order && names_of_last.size() == kept_at.size() &&
                    id.size() == ids_in_order.size() && std::equal(id.begin(), id.end(), ids_in_order.begin());
  in_order = false;
  if (!same) return false;
  const Array<CandidateName>& before = names_of_last;
  const auto last = std::int64_t(before.size());
  fit(found_at, std::size_t(c.count));
  fit(left_over, std::size_t(last));
  std::size_t passed = 0;
  std::int64_t next = 0;
  bool same_run = last > 0; // pairs rise in a run of candidates of one kind, and `next` is in that of this candidate
  const auto advance = [&] {
    ++next;
    same_run = next < last && before[std::size_t(next)].pair >= before[std::size_t(next - 1)].pair;
  };
  const auto pass = [&] {
    left_over[passed++] = kept_at[std::size_t(next)];
    advance();
  };
  for (std::int64_t i = 0; i < c.count; ++i) {
    const CandidateName& name = names[std::size_t(i)];
    if (i > 0 && name.pair < names[std::size_t(i - 1)].pair) {
      while (same_run) pass();
      same_run = next < last;
    }
    while (same_run && before[std::size_t(next)].pair < name.pair) pass();
    std::int64_t at = same_run ? next : last;
    while (at < last && before[std::size_t(at)].pair == name.pair && !(before[std::size_t(at)] == name)) ++at;
    found_at[std::size_t(i)] = -1;
    if (at == last || !(before[std::size_t(at)] == name)) continue;
    while (next < at) pass();
    found_at[std::size_t(i)] = kept_at[std::size_t(at)];
    advance();
  }
  while (next < last) pass();
  left_over.resize(passed);
  kept_at.swap(found_at);
  return true;
}

// Where `remember` will keep the contact of each candidate; in the place of where the memory has it now, if that is
// known, which goes to `place`.
void Interactions::State::number_places(std::int64_t places, bool known) {
  const std::int64_t count = candidates->count;
  if (!known) {
    fit(kept_at, std::size_t(count));
    std::fill(kept_at.begin(), kept_at.end(), -1);
  }
  std::int32_t to = 0;
  for (std::int64_t k = 0; k < places; ++k) {
    const std::int32_t i = system.candidate[std::size_t(k)];
    place[k] = i < 0 ? -1 : kept_at[std::size_t(i)];
    if (i >= 0) kept_at[std::size_t(i)] = to++;
  }
  for (std::int64_t i = 0; i < count && to < count; ++i)
    if (!moves(i)) kept_at[std::size_t(i)] = -1; // it is in no batch
}

// Contacts that stood elsewhere in the order of the last step, by their keys.
template <class KeyOf>
void Interactions::State::find_others(std::int64_t places, const KeyOf& key_of) {
  if (left_over.empty()) return;
  const auto is_missing = [&](std::int64_t k) { return place[k] < 0 && system.candidate[std::size_t(k)] >= 0; };
  std::int64_t missing = 0;
  for (std::int64_t k = 0; k < places; ++k) missing += is_missing(k);
  if (missing == 0) return;
  KeyTable table(missing, scratch);
  for (std::int64_t k = 0; k < places; ++k)
    if (is_missing(k)) table.insert(key_of(k), k);
  for (const std::int32_t at : left_over) {
    if (at < 0) continue; // it was in no batch
    const std::int32_t to = table.find(memory.keys[std::size_t(at)], key_of);
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
void Interactions::State::follow_across_facets() {
  const auto n = std::int64_t(system.candidate.size());
  const auto is_lost = [&](std::int64_t c) {
    const std::int64_t i = system.candidate[c];
    return place[c] < 0 && i >= 0 && candidates->feature[i] < names_of_facets &&
           *contactors->shape[candidates->contactor_b[i]] == std::int16_t(Shape::facet);
  };
  std::int64_t lost = 0;
  for (std::int64_t c = 0; c < n; ++c) lost += is_lost(c);
  if (lost == 0) return;
  const auto on_body = [&](std::int64_t c) { // the key with the body in place of the triangle
    ContactKey k = key(system.candidate[c]);
    k.contactor_b = body(candidates->contactor_b[system.candidate[c]]);
    return k;
  };
  KeyTable table(lost, scratch);
  for (std::int64_t c = 0; c < n; ++c)
    if (is_lost(c)) table.insert(on_body(c), c);
  const std::int64_t known = end_of_seen(memory);
  auto* owner = scratch.take<std::int32_t>(known);
  std::fill_n(owner, known, -1);
  for (std::int64_t c = 0; c < contactors->count; ++c)
    if (*contactors->shape[c] == std::int16_t(Shape::facet) && memory.has_seen(*contactors->id[c]))
      owner[*contactors->id[c]] = body(std::int32_t(c));
  auto* taken = scratch.take<std::uint8_t>(std::int64_t(memory.keys.size()));
  std::fill_n(taken, memory.keys.size(), 0);
  for (std::int64_t c = 0; c < n; ++c)
    if (place[c] >= 0) taken[place[c]] = 1;
  for (std::size_t i = 0; i < memory.keys.size(); ++i) {
    ContactKey k = memory.keys[i];
    if (taken[i] || k.feature >= names_of_facets || owner[k.contactor_b] < 0) continue;
    k.contactor_b = owner[k.contactor_b];
    const std::int32_t c = table.find(k, on_body);
    if (c < 0 || place[c] >= 0) continue;
    const double *p = &memory.impulses[i * memory.impulse_components],
                 *m = &candidates->normal[3 * std::int64_t(system.candidate[c])];
    const double along = p[0] * m[0] + p[1] * m[1] + p[2] * m[2];
    if (along > 0 && 4 * along * along > p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) place[c] = std::int32_t(i);
  }
}

// Unit, outward: of a triangle, or of an edge of a mesh in the plane, whose body is on the left.
void Interactions::State::normal_of_side(std::int32_t side, double* m) const {
  if (dim() == 3) {
    const Hulls& hulls = contactors->hulls;
    std::copy_n(&hulls.normal[3 * std::size_t(hulls.first_face[*contactors->hull[side]])], 3, m);
    if (body(side) >= 0) to_space_axes(*bodies, 3, body(side), m, m);
    return;
  }
  const MeshSet::Middle& ends = meshes->middle(side);
  const double *one = nodes->position[ends.node[0]], *two = nodes->position[ends.node[1]];
  const double length = std::hypot(two[0] - one[0], two[1] - one[1]);
  m[0] = (two[1] - one[1]) / length;
  m[1] = (one[0] - two[0]) / length;
  m[2] = 0;
}

// Hands on the bond of a round body or of a point of a mesh that passes from one side to another (triangles of a body
// or mesh, in 2D edges of a mesh): to the contact of the same law with the most similar normal.
void Interactions::State::follow_bonds_across_sides() {
  if (memory.state_components == 0) return;
  const auto n = std::int64_t(system.candidate.size());
  const auto is_side = [&](std::int64_t contactor) {
    const auto shape = Shape(*contactors->shape[contactor]);
    return dim() == 3 ? shape == Shape::facet : shape == Shape::segment && body(std::int32_t(contactor)) < 0;
  };
  const auto holds = [&](std::int64_t at) { return memory.states[at * std::int64_t(memory.state_components)] > 0; };
  auto* taken = scratch.take<std::uint8_t>(std::int64_t(memory.keys.size()));
  std::fill_n(taken, memory.keys.size(), 0);
  for (std::int64_t c = 0; c < n; ++c)
    if (place[c] >= 0) taken[place[c]] = 1;
  bool any = false;
  for (std::size_t i = 0; i < memory.keys.size() && !any; ++i) any = !taken[i] && holds(std::int64_t(i));
  if (!any) return;
  const auto is_loose = [&](std::int64_t c) { // one that touched there before it, without a bond, goes on as the bond
    const std::int64_t i = system.candidate[c];
    return !(place[c] >= 0 && holds(place[c])) && i >= 0 && entry[i] >= 0 &&
           law_infos()[std::size_t(laws->entry(entry[i]).law)].keeps && is_side(candidates->contactor_b[i]);
  };
  std::int64_t loose = 0;
  for (std::int64_t c = 0; c < n; ++c) loose += is_loose(c);
  if (loose == 0) return;
  const auto on_surface = [&](std::int64_t c) { // the key with the carrier in the place of the side
    ContactKey k = key(system.candidate[c]);
    k.contactor_b = unit_of(candidates->contactor_b[system.candidate[c]]);
    return k;
  };
  KeyTable table(loose, scratch);
  for (std::int64_t c = 0; c < n; ++c)
    if (is_loose(c)) table.insert(on_surface(c), c);
  const std::int64_t known = end_of_seen(memory);
  auto* side_of = scratch.take<std::int32_t>(known);
  std::fill_n(side_of, known, -1);
  for (std::int64_t c = 0; c < contactors->count; ++c)
    if (is_side(c) && memory.has_seen(*contactors->id[c])) side_of[*contactors->id[c]] = std::int32_t(c);
  for (std::size_t i = 0; i < memory.keys.size(); ++i) {
    ContactKey k = memory.keys[i];
    if (taken[i] || !holds(std::int64_t(i)) || k.feature < 0 || k.feature >= names_of_facets ||
        side_of[k.contactor_b] < 0)
      continue;
    const std::int32_t side = side_of[k.contactor_b];
    k.contactor_b = unit_of(side);
    double was[3], most = 0.5;
    normal_of_side(side, was);
    std::int32_t heir = -1;
    table.find(k, [&](std::int32_t c) { // goes through all that may be it
      const std::int64_t at = system.candidate[c];
      const std::int32_t a = candidates->contactor_a[at], b = candidates->contactor_b[at];
      if (!is_loose(c) || !(on_surface(c) == k) ||
          laws->find(*contactors->material[a], *contactors->material[side]) != entry[at])
        return ContactKey{-1, -1, 0, 0};
      double is[3];
      normal_of_side(b, is);
      const double alike = was[0] * is[0] + was[1] * is[1] + was[2] * is[2];
      if (alike > most) most = alike, heir = c;
      return ContactKey{-1, -1, 0, 0};
    });
    if (heir >= 0) place[heir] = std::int32_t(i);
  }
}

void Interactions::State::remember() {
  ContactMemory& m = memory;
  m.h = h;
  m.impulse_components = impulse_components;
  m.state_components = state_components;
  std::size_t kept = 0; // without an impulse, too: the order is what finds the others
  for (const cairn_batch& b : system.batches) kept += std::size_t(b.contacts);
  fit(m.keys, kept);
  fit(m.impulses, kept * impulse_components);
  fit(m.states, kept * state_components);
  fit(m.forces, given ? kept * dim() : 0);
  std::int64_t to = 0;
  for (const cairn_batch& b : system.batches) {
    if (b.pack && state_components == 0 && impulse_components == dim() && !given)
      to = dim() == 2 ? remember_packed<2>(b, to) : remember_packed<3>(b, to);
    else
      to = remember(b, to);
  }
  for (std::int64_t c = 0; c < contactors->count; ++c)
    m.contactors_seen = std::max(m.contactors_seen, *contactors->id[c] + 1);
  m.seen_besides.clear();
  m.seats.clear();
  for (const RimSeat& seat : candidates->seats)
    m.seats.push_back({*contactors->id[seat.node], *contactors->id[seat.side], seat.face});
  ids_in_order = contactors->id.values;
  keys_in_order = kept;
  in_order = true;
  keep_anchors();
}

template <int d>
std::int64_t Interactions::State::remember_packed(const cairn_batch& b, std::int64_t to) {
  const int lines = 8 * b.pack;
  for (int first = 0; first < b.contacts; first += 8) {
    const double* pack = b.frame + first / 8 * lines;
    const double* r = pack + 8 * (d + 4);
    double p[d][8];
    for (int i = 0; i < 8; ++i) {
      if constexpr (d == 2) {
        p[0][i] = r[i];
        p[1][i] = r[8 + i];
      } else {
        const double n[3] = {pack[i], pack[8 + i], pack[16 + i]};
        double t[3];
        tangent_of(n, t);
        for (int k = 0; k < 3; ++k) {
          const double s = n[(k + 1) % 3] * t[(k + 2) % 3] - n[(k + 2) % 3] * t[(k + 1) % 3];
          p[k][i] = n[k] * r[i] + t[k] * r[8 + i] + s * r[16 + i];
        }
      }
    }
    const int some = std::min(8, b.contacts - first);
    for (int i = 0; i < some; ++i) {
      memory.keys[to] = key(system.candidate[b.first + first + i]);
      for (int k = 0; k < d; ++k) memory.impulses[d * to + k] = p[k][i];
      ++to;
    }
  }
  return to;
}

// States of a contact, vectors in space axes, of an anchored one in those of B; huge where it has none.
void Interactions::State::keep_states(const cairn_batch& b, int lane, double* to) const {
  const LawInfo& law = law_infos()[b.law];
  const double *from = b.state ? b.state + lane : nullptr, *end = to + state_components;
  for (const std::string& name : law.state) {
    if (!from) break; // a law without states
    if (name.back() != '*' || dim() == 2) {
      *to++ = *from;
      from += b.count;
      continue;
    }
    double axes[3][3];
    axes_of(b, 3, lane, axes);
    double x[3];
    for (int k = 0; k < 3; ++k) x[k] = axes[1][k] * from[0] + axes[2][k] * from[b.count];
    if (!b.mapped_b && is_anchored(system.candidate[b.first + lane])) to_body_axes(*bodies, 3, b.body_b[lane], x, x);
    to = std::copy_n(x, 3, to);
    from += 2 * b.count;
  }
  while (to < end) *to++ = std::numeric_limits<double>::max();
}

std::int64_t Interactions::State::remember(const cairn_batch& b, std::int64_t to) {
  const int n = b.count;
  for (int lane = 0; lane < b.contacts; ++lane) {
    memory.keys[to] = key(system.candidate[b.first + lane]);
    double p[6] = {};
    if (dim() == 2)
      for (int k = 0; k < b.components; ++k) p[k] = at(b, b.r, lane, k);
    else
      space_impulse(b, lane, p, p + 3);
    for (int k = 0; k < impulse_components; ++k) memory.impulses[to * impulse_components + k] = p[k];
    if (given) { // the solver's unknown is h theta times the force at the end
      double f[6] = {};
      cairn_batch of_force = b;
      of_force.components = dim();
      double force[3 * 128];
      for (int k = 0; k < dim(); ++k)
        force[k * n + lane] = (b.r[k * n + lane] - given_of(b)[k * n + lane]) / (h * theta);
      of_force.r = force;
      if (dim() == 2)
        for (int k = 0; k < 2; ++k) f[k] = force[k * n + lane];
      else
        space_impulse(of_force, lane, f, f + 3);
      std::copy_n(f, dim(), &memory.forces[to * dim()]);
    }
    if (state_components > 0) keep_states(b, lane, &memory.states[to * state_components]);
    ++to;
  }
  return to;
}

} // namespace cairn
