// Which contact stands in which batch. It depends on the candidates and their order alone.
#include <omp.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "../laws/law_geometry.hpp"
#include "../solvers/sweeps/side_names.hpp"
#include "interaction_state.hpp"

namespace cairn {

void Interactions::State::load_bodies() {
  const Bodies& b = *bodies;
  const std::int64_t n = b.count; // nodes of meshes have no record
  system.bodies = n;
  fit(system.record, n + 1);
  const bool space = dim() == 3, anisotropic = space && b.inverse_inertia.active;
  // scratch of planning alone is taken last, and given back before batches are laid out
  kind = scratch.take<std::uint8_t>(contactors->count);
  entry = scratch.take<std::int32_t>(candidates->count);
  contact_class = scratch.take<std::uint16_t>(candidates->count);
  planning = scratch.mark();
  degree = scratch.take<std::int32_t>(units()); // for the moment: 1 isotropic, 2 moves
  system.record[n] = cairn_record{};
  for (std::int64_t i = 0; i < n; ++i) {
    const double *v = b.velocity[i], *m = b.inverse_mass[i];
    cairn_record& r = system.record[i];
    bool isotropic, moves;
    if (!space) {
      r = cairn_record{{v[0], v[1], v[2], m[0], m[1], m[2], 0, 0}};
      isotropic = m[0] == m[1] && (m[0] > 0 || !(m[2] > 0));
      moves = m[0] > 0 || m[1] > 0 || m[2] > 0;
    } else {
      r = cairn_record{{v[0], v[1], v[2], v[3], v[4], v[5], m[0], m[3]}};
      isotropic = m[0] == m[1] && m[0] == m[2] && m[3] == m[4] && m[3] == m[5] && (m[0] > 0 || !(m[3] > 0));
      moves = m[0] > 0 || m[1] > 0 || m[2] > 0 || m[3] > 0 || m[4] > 0 || m[5] > 0;
      if (anisotropic) {
        const double* j = b.inverse_inertia[i];
        for (int k = 0; k < 6; ++k) isotropic = isotropic && j[k] == (k < 3 ? m[3 + k] : 0);
      }
    }
    degree[i] = (isotropic ? 1 : 0) + (moves ? 2 : 0);
  }
  find_joints();
  find_ropes(*contactors, *laws);
  bool wide = false; // only round bodies centred on their contactor do without their further inertia
  for (std::int64_t c = 0; c < contactors->count; ++c) {
    bool centred = info(Shape(*contactors->shape[c])).ball();
    if (!joint_material.empty()) centred = centred && !joint_material[std::size_t(*contactors->material[c])];
    if (centred && contactors->offset.active)
      for (int k = 0; k < dim(); ++k) centred = centred && !(contactors->offset[c][k] != 0);
    const std::int32_t carrier = body(std::int32_t(c));
    const int of_body = carrier < 0 ? 0 : degree[carrier];
    kind[c] = carrier < 0 ? moving + mapped : std::uint8_t((centred ? of_body & 1 : 0) + (of_body & 2));
    wide = wide || (space && kind[c] == 2);
  }
  load_further_inertia(wide ? n : -1);
  load_meshes();
}

// All contacts of a mesh move it whole.
void Interactions::State::load_meshes() {
  system.condensed_dofs.clear();
  system.reaches = false;
  if (!meshes) return system.condensed.clear(); // the last one may have gone
  const Candidates& c = *candidates;
  const bool images = cell->any();
  meshes->begin_to_want();
  for (std::int64_t i = 0; i < c.count; ++i) {
    const std::int32_t one = c.contactor_a[i], two = c.contactor_b[i];
    const double* point = &c.point[dim() * i];
    if (kind[one] & mapped) meshes->want(meshes->mapping(*nodes, one, point, two));
    if (!(kind[two] & mapped)) continue;
    double shift[3] = {0, 0, 0}, there[3] = {0, 0, 0}; // the point beside B, where B itself is
    if (images) image_shift(*cell, c.image[i], shift);
    for (int k = 0; k < std::min(dim(), 3); ++k) there[k] = point[k] - shift[k];
    meshes->want(meshes->mapping(*nodes, two, there, one));
  }
  meshes->condense(system.condensed, system.condensed_velocity, pose.kernel != nullptr);
  for (const CondensedBody& body : system.condensed) {
    system.condensed_dofs.push_back(body.dofs);
    system.reaches = system.reaches || body.dofs.reach;
  }
  system.load_condensed(nodes->velocity);
}

// For sides that read it; -1: none does.
void Interactions::State::load_further_inertia(std::int64_t n) {
  fit(system.general, std::size_t(n + 1));
  if (n < 0) return;
  const Bodies& b = *bodies;
  system.general[n] = cairn_record{};
  for (std::int64_t i = 0; i < n; ++i) {
    const double* m = b.inverse_mass[i];
    double inertia[6] = {m[3], m[4], m[5], 0, 0, 0};
    if (b.inverse_inertia.active) std::copy_n(b.inverse_inertia[i], 6, inertia);
    system.general[i] =
        cairn_record{{m[1], m[2], inertia[0], inertia[1], inertia[2], inertia[3], inertia[4], inertia[5]}};
  }
}

void Interactions::State::classify() {
  const Candidates& c = *candidates;
  const std::int64_t n = c.count;
  std::fill_n(degree, units(), 0);
  impulse_components = dim();
  state_components = 0;
  int known_a = -1, known_b = -1, e = -1, law = 0; // many contacts in a row are of the same materials
  bool resists = false;
  const auto& material = contactors->material.values;
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    const int ma = material[std::size_t(a)], mb = material[std::size_t(b)];
    if (ma != known_a || mb != known_b) {
      e = laws->find(ma, mb);
      law = e < 0 ? 0 : laws->entry(e).place;
      resists = e >= 0 && meshes && resists_turning(laws->entry(e));
      known_a = ma;
      known_b = mb;
    }
    if (e < 0)
      throw std::invalid_argument("no law for contacts between materials '" + laws->name(ma) + "' and '" +
                                  laws->name(mb) + "': declare one for this pair, or a default");
    const int kind_of_a = kind[a], kind_of_b = kind[b];
    entry[i] = e;
    if (resists && ((kind_of_a | kind_of_b) & mapped)) refuse_moment(i);
    contact_class[i] = std::uint16_t((law * kinds + kind_of_a) * kinds + kind_of_b);
    if (kind_of_a & moving) ++degree[unit_of(a)];
    if (kind_of_b & moving) ++degree[unit_of(b)];
  }
  system.serial = false;
  bool asked = laws_commit = false;
  for (Law law : laws->laws()) {
    const LawInfo& info = law_infos()[std::size_t(law)];
    impulse_components = std::max(impulse_components, info.components(dim()));
    state_components = std::max(state_components, info.state_kept(dim()));
    laws_commit |= info.commit || info.energy;
    asked |= info.has_solve || info.commit || info.energy || info.plugged();
    system.serial |= !info.thread_safe;
    if (info.components(dim()) == 0)
      throw std::invalid_argument("law " + info.name + (info.plugged() ? " of " + info.library : std::string()) +
                                  " has no form in " + std::to_string(dim()) + "D" +
                                  (info.plugged() ? ": give it components" + std::to_string(dim()) : std::string()));
  }
  if (asked) find_mesh_areas();
}

void Interactions::State::plan() {
  system.first_task.assign(1, 0);
  system.first_batch.assign(1, 0);
  system.candidate.clear();
  system.candidate.reserve(candidates->count + candidates->count / 8);
  hub_contacts.clear();
  late_contacts.clear();
  ropes.clear();
  plan_tiles();
  plan_hubs();
  plan_late();
  scratch.release(planning);
  find_places(system.schedule(omp_get_max_threads()).threads);
  lay_out();
}

// Contacts in runs of the candidates' order: tiles. Tiles that share no body that moves make a stage; within a tile
// contacts are coloured, and swept colour by colour while its bodies stay in the cache.
void Interactions::State::plan_tiles() {
  const Candidates& c = *candidates;
  colours = scratch.take<std::uint64_t>(units());
  tile_colours = scratch.take<std::uint64_t>(units());
  std::fill_n(colours, units(), 0);
  std::fill_n(tile_colours, units(), 0);
  order = scratch.take<std::int32_t>(c.count);
  std::size_t ordered = 0;
  order_start.assign(1, 0);
  tile_stage.clear();
  const auto simple = [&](std::int64_t i) { return !is_hub(c.contactor_a[i]) && !is_hub(c.contactor_b[i]); };
  const auto size = std::size_t(std::clamp<std::int64_t>(c.count / tiles, smallest_tile, largest_tile));
  const int least = meshes ? mesh_hub_degree : hub_degree;
  const bool hubs = std::any_of(degree, degree + units(), [&](std::int32_t d) { return d > least; });
  for (std::int64_t i = 0; i < c.count;) {
    const auto start = ordered;
    std::uint64_t taken = 0;
    for (; i < c.count && ordered - start < size; ++i) {
      if (!moves(i)) continue;
      if (is_rope(i)) {
        ropes.push_back(std::int32_t(i));
        continue;
      }
      if (hubs && !simple(i)) {
        hub_contacts.push_back(std::int32_t(i));
        continue;
      }
      order[ordered++] = std::int32_t(i);
      if (moves_a(i)) taken |= tile_colours[unit_of(c.contactor_a[i])];
      if (moves_b(i)) taken |= tile_colours[unit_of(c.contactor_b[i])];
    }
    if (ordered == start) continue;
    const int stage = std::countr_one(taken);
    tile_stage.push_back(stage);
    order_start.push_back(std::int32_t(ordered));
    const std::uint64_t bit = stage < 64 ? std::uint64_t(1) << stage : 0;
    for (auto k = start; k < ordered; ++k) {
      if (moves_a(order[k])) tile_colours[unit_of(c.contactor_a[order[k]])] |= bit;
      if (moves_b(order[k])) tile_colours[unit_of(c.contactor_b[order[k]])] |= bit;
    }
  }
  const int stages = tile_stage.empty() ? 0 : 1 + *std::max_element(tile_stage.begin(), tile_stage.end());
  std::vector<std::int32_t>& tile = late_contacts; // scratch
  for (int stage = 0; stage < stages; ++stage) {
    for (std::size_t t = 0; t < tile_stage.size(); ++t) {
      if (tile_stage[t] != stage) continue;
      tile.assign(order + order_start[t], order + order_start[t + 1]);
      emit_sorted(tile, batch_size, 0);
      system.first_batch.push_back(std::int32_t(system.batches.size()));
      // tiles for which no stage was left stand alone
      if (stage == 64) system.first_task.push_back(std::int32_t(system.first_batch.size()) - 1);
    }
    if (stage < 64) system.first_task.push_back(std::int32_t(system.first_batch.size()) - 1);
  }
  tile.clear();
}

// Colours contacts so that those of one colour share no body but the hub, sorts them by colour and class, cuts them
// into batches.
void Interactions::State::emit_sorted(const std::vector<std::int32_t>& contacts, int largest, int hub) {
  const Candidates& c = *candidates;
  for (std::int32_t i : contacts) colours[unit_of(c.contactor_a[i])] = colours[unit_of(c.contactor_b[i])] = 0;
  const int n = int(contacts.size());
  key_of_order.resize(std::max(key_of_order.size(), std::size_t(n)));
  const std::size_t rows = laws->laws().size() * kinds * kinds;
  std::vector<std::int32_t>& count = order_count;
  if (count.size() < 64 * rows + 1) count.assign(64 * rows + 1, 0);
  int most = 0;
  for (int k = 0; k < n; ++k) {
    const std::int32_t i = contacts[k];
    const int cls = contact_class[i];
    const std::int32_t a = unit_of(c.contactor_a[i]), b = unit_of(c.contactor_b[i]);
    std::uint64_t taken = 0;
    if (moves_a(i) && hub != 1) taken |= colours[a];
    if (moves_b(i) && hub != 2) taken |= colours[b];
    const int colour = std::min(std::countr_one(taken), 63);
    const std::uint64_t bit = std::uint64_t(1) << colour;
    if (moves_a(i)) colours[a] |= bit;
    if (moves_b(i)) colours[b] |= bit;
    most = std::max(most, colour);
    key_of_order[k] = std::uint32_t(colour * rows + cls);
    ++count[key_of_order[k] + 1];
  }
  const std::size_t keys = std::size_t(most + 1) * rows;
  for (std::size_t k = 0; k < keys; ++k) count[k + 1] += count[k];
  sorted.resize(std::max(sorted.size(), std::size_t(n)));
  for (int k = 0; k < n; ++k) sorted[count[key_of_order[k]]++] = contacts[k];
  std::int32_t start = 0;
  for (std::size_t k = 0; k < keys; ++k) {
    const std::int32_t end = count[k];
    for (; start < end; start += largest) emit(&sorted[start], std::min(largest, end - start), hub);
    start = end;
  }
  std::fill(count.begin(), count.begin() + keys + 1, 0);
}

// Rows that contacts keep for their bodies on a side; 0: a body is too large.
std::int32_t Interactions::State::response_rows(const std::int32_t* contacts, int n,
                                                const std::int32_t* contactor) const {
  std::int64_t most = 0;
  for (int k = 0; k < n; ++k)
    most = std::max(most, system.condensed_dofs[meshes->mesh_of(contactor[contacts[k]])].dofs);
  return most <= small_condensed ? std::int32_t(condensed_rows(most)) : 0;
}

void Interactions::State::emit(const std::int32_t* contacts, int n, int hub) {
  cairn_batch b{};
  const int cls = contact_class[contacts[0]];
  b.contacts = n;
  b.count = (n + 7) / 8 * 8;
  b.law = std::int32_t(laws->laws()[std::size_t(cls / (kinds * kinds))]);
  const LawInfo& law = law_infos()[b.law];
  b.components = law.components(dim());
  const bool radial_a = kind_a(cls) & radial, radial_b = kind_b(cls) & radial;
  const auto side = [&](int of) {
    if (of & mapped) return dim() == 2 ? mapped2 : mapped3;
    return of & radial ? (dim() == 2 ? radial2 : radial3) : (dim() == 2 ? rigid2 : rigid3);
  };
  b.side_a = side(kind_a(cls));
  b.side_b = side(kind_b(cls));
  const auto mapping = [&](int of) { return (of & mapped) == 0 ? 0 : system.reaches ? 2 : 1; };
  b.mapped_a = mapping(kind_a(cls));
  b.mapped_b = mapping(kind_b(cls));
  b.condensed = system.condensed_dofs.data();
  b.condensed_velocity = system.condensed_velocity.data();
  b.stride_a = b.mapped_a ? response_rows(contacts, n, candidates->contactor_a.data()) : 0;
  b.stride_b = b.mapped_b ? response_rows(contacts, n, candidates->contactor_b.data()) : 0;
  b.moves_a = (kind_a(cls) & moving) != 0;
  b.moves_b = (kind_b(cls) & moving) != 0;
  const bool diagonal = (radial_a || !b.moves_a) && (radial_b || !b.moves_b);
  b.block = law.has_solve || !diagonal;
  b.hub = hub;
  b.relaxes = !law.has_solve;
  b.bonds = law.holds;
  b.residual = law.residual;
  b.pack = packable(b) && law.normal_bias && !sheared && !pose.kernel ? 2 * dim() + 4 : 0;
  b.group = hub ? n : 1;
  b.velocities = system.velocities();
  b.first = std::int32_t(system.candidate.size());
  system.candidate.insert(system.candidate.end(), contacts, contacts + n);
  system.candidate.resize(b.first + b.count, -1);
  system.batches.push_back(b);
}

// Contacts of a body that has too many of them. They come hub by hub; each batch sees the hub as it stands, with its
// inverse mass times the number of contacts of the batch (mass splitting: the fixed point stays, the iteration cannot
// overshoot). A batch is as long as that leaves the block of the other side the greater part, and no longer than a
// batch.
void Interactions::State::plan_hubs() {
  if (hub_contacts.empty()) return;
  const Candidates& c = *candidates;
  // an impulse on a contact of a mesh moves all its other contacts: these are solved one after the other
  const auto is_mesh_hub = [&](std::int32_t contactor) { return (kind[contactor] & mapped) && is_hub(contactor); };
  by_hub.clear();
  for (std::int32_t i : hub_contacts) {
    const std::int32_t a = c.contactor_a[i], b = c.contactor_b[i];
    if ((is_hub(a) && is_hub(b)) || is_mesh_hub(a) || is_mesh_hub(b))
      late_contacts.push_back(i);
    else
      by_hub.emplace_back(is_hub(a) ? 2 * std::int64_t(body(a)) : 2 * std::int64_t(body(b)) + 1, i);
  }
  std::sort(by_hub.begin(), by_hub.end());
  const auto largest_inverse = [&](std::int32_t b) {
    const double* m = bodies->inverse_mass[b];
    return *std::max_element(m, m + dim());
  };
  std::vector<std::int32_t>& mine = of_hub;
  for (std::size_t k = 0; k < by_hub.size();) {
    const std::int64_t hub = by_hub[k].first;
    mine.clear();
    double lightest = 0;
    for (; k < by_hub.size() && by_hub[k].first == hub; ++k) {
      const std::int32_t i = by_hub[k].second;
      const std::int32_t other = hub % 2 ? c.contactor_a[i] : c.contactor_b[i];
      if (const std::int32_t carrier = body(other); carrier >= 0)
        lightest = std::max(lightest, largest_inverse(carrier));
      else
        for (const std::int32_t node : meshes->middle(other).node)
          if (node >= 0) lightest = std::max(lightest, 1 / *nodes->mass[node]);
      mine.push_back(i);
    }
    const double mine_inverse = largest_inverse(std::int32_t(hub / 2));
    const double ratio = mine_inverse > 0 ? lightest / mine_inverse : batch_size;
    emit_sorted(mine, int(std::clamp(ratio, 8.0, double(batch_size))), hub % 2 ? 2 : 1);
  }
  system.first_batch.push_back(std::int32_t(system.batches.size()));
  system.first_task.push_back(std::int32_t(system.first_batch.size()) - 1);
}

// Plans contacts between hubs and ropes over pulleys, singly, and contacts of meshes, one after the other in batches of
// a kind; in the order of their keys, since numbers of bodies change.
void Interactions::State::plan_late() {
  late_contacts.insert(late_contacts.end(), ropes.begin(), ropes.end());
  if (late_contacts.empty()) return;
  std::sort(late_contacts.begin(), late_contacts.end(), [&](std::int32_t i, std::int32_t j) {
    const ContactKey a = key(i), b = key(j);
    return std::tie(a.contactor_a, a.contactor_b, a.feature, a.image) <
           std::tie(b.contactor_a, b.contactor_b, b.feature, b.image);
  });
  const auto in_turn = [&](std::int32_t i) {
    const int cls = contact_class[i];
    const Law law = laws->laws()[std::size_t(cls / (kinds * kinds))];
    return ((kind_a(cls) | kind_b(cls)) & mapped) && !law_infos()[std::int32_t(law)].has_solve;
  };
  for (std::size_t k = 0, end; k < late_contacts.size(); k = end) {
    const std::int32_t first = late_contacts[k];
    end = k + 1;
    while (in_turn(first) && end < late_contacts.size() && end - k < std::size_t(batch_size) &&
           contact_class[late_contacts[end]] == contact_class[first])
      ++end;
    emit(&late_contacts[k], int(end - k), 0);
    system.batches.back().in_turn = in_turn(first);
  }
  system.first_batch.push_back(std::int32_t(system.batches.size()));
  system.first_task.push_back(std::int32_t(system.first_batch.size()) - 1);
}

void Interactions::State::lay_out_mapping(const cairn_batch& b, std::int32_t*& node, std::int32_t*& dof,
                                          double*& response, std::int32_t stride) {
  node = scratch.take<std::int32_t>(4 * std::int64_t(b.count));
  dof = scratch.take<std::int32_t>(6 * std::int64_t(b.count));
  response = stride ? scratch.take<double>(std::int64_t(stride) * (b.turns ? b.components : dim()) * b.count) : nullptr;
}

// Shared block of parameters, for batches of equal size with a single pair of materials and a law whose parameters
// depend on pair and step alone: a sweep over many batches then finds it in cache. Null: the batch has its own.
double* Interactions::State::params_of_pair(const cairn_batch& b) {
  const LawInfo& law = law_infos()[b.law];
  const std::int32_t pair = entry[system.candidate[b.first]];
  if (!law.keeps_area || law.plugged() || temperature) return nullptr;
  for (int lane = 1; lane < b.contacts; ++lane)
    if (entry[system.candidate[b.first + lane]] != pair) return nullptr;
  constexpr std::size_t most = 64; // of a scene with more pairs the last ones are looked at: batches come pair by pair
  const auto known = [&](const PairParams& shared) { return shared.entry == pair && shared.count == b.count; };
  const auto oldest = params_of_pairs.rbegin() + std::ptrdiff_t(std::min(most, params_of_pairs.size()));
  const auto found = std::find_if(params_of_pairs.rbegin(), oldest, known);
  if (found != oldest) return found->params;
  const std::size_t n = std::size_t(b.count), parameters = law.parameters.size();
  double* params = scratch.take<double>(std::int64_t((parameters + 4) * n));
  for (std::size_t k = 0; k < parameters; ++k)
    std::fill_n(params + k * n, n, std::min(laws->entry(pair).params[k], std::numeric_limits<double>::max()));
  std::fill_n(params + parameters * n, n, h);
  std::fill_n(params + (parameters + 1) * n, 3 * n, 0.0);
  params_of_pairs.push_back({pair, b.count, params});
  return params;
}

// Blocks of numbers in the order in which a sweep reads them.
void Interactions::State::lay_out() {
  const std::size_t places = system.candidate.size();
  auto* body_a = scratch.take<std::int32_t>(places);
  auto* body_b = scratch.take<std::int32_t>(places);
  // where nothing grows places are read until batches are filled, before a solver writes a status; growth reads them
  // after it
  auto* status = bodies->stretch.active ? scratch.take<std::int32_t>(places) : place;
  std::size_t doubles = 0;
  const auto block = [](const cairn_batch& b) { return b.block ? b.components * b.components : 2; };
  params_of_pairs.clear();
  for (cairn_batch& b : system.batches) b.params = b.pack ? nullptr : params_of_pair(b);
  const auto params = [](const cairn_batch& b) {
    const LawInfo& law = law_infos()[b.law];
    if (b.params) return 0;
    return law.has_solve ? int(law.parameters.size()) + 1 + geometry_columns(law) : 1;
  };
  const auto states = [&](const cairn_batch& b) { return law_infos()[b.law].state_columns(dim()); };
  const int frame = dim() == 2 ? 2 : 6;
  system.compliant = false;
  given = pose.kernel ? scratch.take<double>(std::int64_t(places) * (3 * dim() - 3)) : nullptr;
  parted = bodies->stretch.active ? scratch.take<double>(std::int64_t(places)) : nullptr;
  for (const cairn_batch& b : system.batches)
    doubles += std::size_t(b.count) * (2 + (b.pack ? b.pack
                                                   : frame + sides()[b.side_a].lever + sides()[b.side_b].lever +
                                                         block(b) + 3 * b.components + params(b) + states(b)));
  double* next = scratch.take<double>(doubles);
  own_numbers = {next, doubles};
  fit(of_law, system.batches.size());
  // numbers that sweeps do not read, kept apart
  double* apart = next + doubles - 2 * places;
  for (cairn_batch& b : system.batches) {
    b.rho = apart;
    b.scale = apart + b.count;
    apart += 2 * b.count;
    b.body_a = body_a + b.first;
    b.body_b = body_b + b.first;
    b.status = status + b.first;
    const LawInfo& law = law_infos()[b.law];
    const bool asks = law.has_solve || law.commit || law.energy;
    LawColumns& own = of_law[std::size_t(&b - system.batches.data())];
    own.geometry = asks ? scratch.take<double>(geometry_columns(law) * std::int64_t(b.count)) : nullptr;
    own.flight = asks ? scratch.take<double>(b.components * std::int64_t(b.count)) : nullptr;
    own.energy = law.energy ? scratch.take<double>(4 * std::int64_t(b.count)) : nullptr;
    own.fields = asks && has_fields() ? scratch.take<double>(4 * std::int64_t(b.count)) : nullptr;
    own.context = {h, theta_of(law), own.geometry, own.fields};
    b.context = &own.context;
    const auto take = [&](int components) {
      double* here = next;
      next += std::size_t(components) * b.count;
      return here;
    };
    if (b.pack) {
      b.frame = take(b.pack);
      place_pack(b, dim());
      continue;
    }
    b.frame = take(frame);
    b.lever_a = take(sides()[b.side_a].lever);
    b.lever_b = take(sides()[b.side_b].lever);
    lay_out_spins(b);
    if (b.mapped_a) lay_out_mapping(b, b.node_a, b.dof_a, b.response_a, b.stride_a);
    if (b.mapped_b) lay_out_mapping(b, b.node_b, b.dof_b, b.response_b, b.stride_b);
    if (b.contacts == 1 && is_rope(system.candidate[b.first])) {
      b.rope_body = scratch.take<std::int32_t>(2 * std::int64_t(b.count));
      b.rope = scratch.take<double>(rope_numbers * std::int64_t(b.count));
    }
    b.bias = take(b.components);
    const bool may_yield = pose.kernel || law.yields;
    b.compliance = may_yield ? take(b.components) : nullptr;
    system.compliant = system.compliant || may_yield;
    b.delassus = take(block(b));
    b.r = take(b.components);
    if (!b.params) b.params = take(params(b));
    b.state = states(b) ? take(states(b)) : nullptr;
  }
}

} // namespace cairn
