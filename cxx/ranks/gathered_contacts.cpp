#include "gathered_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "../laws/law_geometry.hpp"
#include "../laws/law_info.hpp"
#include "../solvers/sweeps/batch.hpp"

namespace cairn {
namespace gathered { // named, since a member of GatheredContacts has them

// What contacts of a batch have in common.
struct Kind {
  std::int32_t law, components, block, side_a, side_b, moves_a, moves_b, pack, relaxes, bonds;
  std::int32_t compliant, geometry, fields; // columns beside those of all laws, 0: none
  std::int32_t mapped_a, mapped_b, in_turn, nodes_a, nodes_b, stride_a, stride_b, turns; // on deformable bodies
  // NOLINTNEXTLINE(modernize-use-nullptr): the compiler writes it
  auto operator<=>(const Kind&) const = default;
};

struct Contact {
  ContactKey key;
  std::int64_t body_a, body_b; // ids; of a deformable body its place among those condensed
  std::int32_t colour, status;
  Kind kind;
  double h, theta; // of the step, as its law has them
  std::int32_t over_bodies;
};

struct Touched {
  std::int64_t id;
  double record[8], general[8], free[6];
};

} // namespace gathered

namespace {

using gathered::Contact;
using gathered::Kind;
using gathered::Touched;

Kind kind_of(const cairn_batch& b) {
  const int geometry = b.context->geometry ? geometry_columns(law_infos()[std::size_t(b.law)]) : 0;
  return {b.law,
          b.components,
          b.block,
          b.side_a,
          b.side_b,
          b.moves_a,
          b.moves_b,
          b.pack,
          b.relaxes > 0,
          b.bonds,
          b.compliance != nullptr,
          geometry,
          b.context->fields ? 4 : 0,
          b.mapped_a,
          b.mapped_b,
          b.in_turn,
          b.nodes_a,
          b.nodes_b,
          b.stride_a,
          b.stride_b,
          b.turns != nullptr};
}

bool is_mapped(const Kind& kind) { return kind.mapped_a || kind.mapped_b; }

int columns_of_params(const LawInfo& law) {
  if (!law.has_solve) return 1;
  return int(law.parameters.size()) + 1 + (law.keeps_area ? 3 : geometry_columns(law)); // the step, then geometry
}

// f(pointer, columns) for each array of numbers of contacts of a kind, in the order in which they are sent and stored.
template <class F>
void each_array(const Kind& kind, int dim, F&& f) {
  const LawInfo& law = law_infos()[std::size_t(kind.law)];
  if (kind.pack) {
    f(&cairn_batch::frame, kind.pack);
  } else {
    f(&cairn_batch::frame, dim == 2 ? 2 : 6);
    f(&cairn_batch::lever_a, sides()[kind.side_a].lever);
    f(&cairn_batch::lever_b, sides()[kind.side_b].lever);
    if (kind.turns) f(kind.mapped_a ? &cairn_batch::spin_a : &cairn_batch::spin_b, 4 * dim * (kind.components - dim));
    f(&cairn_batch::bias, kind.components);
    if (kind.compliant) f(&cairn_batch::compliance, kind.components);
    f(&cairn_batch::delassus, kind.block ? kind.components * kind.components : 2);
    f(&cairn_batch::r, kind.components);
    f(&cairn_batch::params, columns_of_params(law));
    if (const int states = law.state_columns(dim)) f(&cairn_batch::state, states);
  }
  f(&cairn_batch::rho, 1);
}
template <class F>
void each_array_of_context(const Kind& kind, F&& f) {
  if (kind.geometry) f(&cairn_law_context::geometry, kind.geometry);
  if (kind.fields) f(&cairn_law_context::fields, kind.fields);
}

// f(pointer, columns) for each array of whole numbers of contacts of a kind.
template <class F>
void each_index(const Kind& kind, F&& f) {
  if (kind.mapped_a) f(&cairn_batch::node_a, 4), f(&cairn_batch::dof_a, 6);
  if (kind.mapped_b) f(&cairn_batch::node_b, 4), f(&cairn_batch::dof_b, 6);
  if (kind.turns) f(&cairn_batch::turns, 1);
}

// f(field, columns, packed) for the numbers of a batch, where its pointers are set.
template <class F>
void each_block(const cairn_batch& b, const Kind& kind, int dim, F&& f) {
  each_array(kind, dim,
             [&](auto array, int columns) { f(b.*array, columns, kind.pack != 0 && array == &cairn_batch::frame); });
  each_array_of_context(kind,
                        [&](auto array, int columns) { f(const_cast<double*>(b.context->*array), columns, false); });
}

// Pointers of a batch into the numbers from `next` on, in the order of each_block; then its scale.
double* place_blocks(cairn_batch& b, cairn_law_context& context, const Kind& kind, int dim, double* next) {
  const auto take = [&](int columns) {
    double* here = next;
    next += std::ptrdiff_t(columns) * b.count;
    return here;
  };
  each_array(kind, dim, [&](auto array, int columns) {
    b.*array = take(columns);
    if (kind.pack != 0 && array == &cairn_batch::frame) place_pack(b, dim);
  });
  each_array_of_context(kind, [&](auto array, int columns) { context.*array = take(columns); });
  b.scale = take(1);
  b.context = &context;
  const int pushes = kind.turns ? kind.components : dim;
  if (kind.stride_a) b.response_a = take(kind.stride_a * pushes);
  if (kind.stride_b) b.response_b = take(kind.stride_b * pushes);
  return next;
}

std::size_t indices_of(const Kind& kind) {
  std::size_t sum = 0;
  each_index(kind, [&](auto, int columns) { sum += std::size_t(columns); });
  return sum;
}

std::size_t numbers_of(const Kind& kind, int dim) {
  std::size_t sum = 0;
  const auto add = [&](auto, int columns) { sum += std::size_t(columns); };
  each_array(kind, dim, add);
  each_array_of_context(kind, add);
  return sum;
}

// Columns of place_blocks.
std::size_t columns_of(const Kind& kind, int dim) {
  const int pushes = kind.turns ? kind.components : dim;
  return numbers_of(kind, dim) + 1 + std::size_t((kind.stride_a + kind.stride_b) * pushes);
}

cairn_batch batch_of(const Kind& kind, int contacts, std::int64_t first, int dim) {
  const LawInfo& law = law_infos()[std::size_t(kind.law)];
  cairn_batch b{};
  b.contacts = contacts;
  b.count = (contacts + 7) / 8 * 8;
  b.law = kind.law;
  b.components = kind.components;
  b.block = kind.block;
  b.side_a = kind.side_a;
  b.side_b = kind.side_b;
  b.moves_a = kind.moves_a;
  b.moves_b = kind.moves_b;
  b.pack = kind.pack;
  b.relaxes = kind.relaxes;
  b.bonds = kind.bonds;
  b.mapped_a = kind.mapped_a;
  b.mapped_b = kind.mapped_b;
  b.in_turn = kind.in_turn;
  b.nodes_a = kind.nodes_a;
  b.nodes_b = kind.nodes_b;
  b.stride_a = kind.stride_a;
  b.stride_b = kind.stride_b;
  b.residual = law.residual;
  b.group = 1;
  b.velocities = dim == 2 ? 3 : 6;
  b.first = std::int32_t(first);
  b.solve = local_solver(b, dim);
  b.repeats = law.has_solve && b.contacts < b.count;
  return b;
}

// Lanes without a contact rest on the spare record and touch nothing; a law with its own solution is handed the last
// contact again.
void fill_dummies(const cairn_batch& b, const Kind& kind, int dim) {
  const int c = b.components;
  each_block(b, kind, dim, [&](double* field, int columns, bool packed) {
    const bool of_law =
        law_infos()[std::size_t(b.law)].has_solve && (field == b.delassus || field == b.params || field == b.state ||
                                                      field == b.context->geometry || field == b.context->fields);
    for (int lane = b.contacts; lane < b.count; ++lane)
      for (int k = 0; k < columns; ++k)
        (packed ? at(b, field, lane, k) : field[k * b.count + lane]) =
            of_law ? field[k * b.count + b.contacts - 1] : 0.0;
  });
  for (int lane = b.contacts; lane < b.count; ++lane) {
    b.rho[lane] = 1;
    for (int k = 0; k < c && b.delassus && !law_infos()[std::size_t(b.law)].has_solve; ++k)
      if (b.block)
        b.delassus[(k * c + k) * b.count + lane] = 1;
      else
        b.delassus[std::min(k, 1) * b.count + lane] = 1;
  }
}

} // namespace

ContactParcel::ContactParcel(ContactSystem& system, const Bodies& bodies, const ColourShare& colours,
                             const std::vector<std::uint8_t>& own)
    : system_(system), bodies_(bodies), colours_(colours) {
  std::vector<std::uint8_t> has(std::size_t(bodies.count), 0);
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      if (!b.mapped_a) has[std::size_t(b.body_a[lane])] = 1;
      if (!b.mapped_b) has[std::size_t(b.body_b[lane])] = 1;
    }
  for (std::size_t i = 0; i < has.size(); ++i)
    if (has[i])
      touched_.push_back(std::int32_t(i));
    else if (own[i])
      others_.push_back(std::int32_t(i));
}

double ContactParcel::bytes_of(const ContactSystem& system) {
  double sum = 0;
  for (const cairn_batch& b : system.batches)
    sum += double(b.contacts) * double(sizeof(Contact) + sizeof(double) * numbers_of(kind_of(b), system.dim) +
                                       sizeof(std::int32_t) * indices_of(kind_of(b)));
  return sum;
}

Bytes ContactParcel::pack(std::span<const double> start) const {
  Packer out;
  std::vector<Contact> contacts;
  std::vector<double> numbers;
  std::vector<std::int32_t> indices;
  const auto name = [&](bool mapped, std::int32_t body) { return mapped ? body : *bodies_.id[body]; };
  for (const cairn_batch& b : system_.batches) {
    const Kind kind = kind_of(b);
    for (int lane = 0; lane < b.contacts; ++lane) {
      const auto candidate = std::size_t(system_.candidate[std::size_t(b.first + lane)]);
      contacts.push_back({colours_.key[candidate], name(b.mapped_a, b.body_a[lane]), name(b.mapped_b, b.body_b[lane]),
                          colours_.colour[candidate], b.status[lane], kind, b.context->h, b.context->theta,
                          b.context->over_bodies});
      each_index(kind, [&](auto array, int columns) {
        for (int k = 0; k < columns; ++k) indices.push_back((b.*array)[k * b.count + lane]);
      });
      each_block(b, kind, system_.dim, [&](double* field, int columns, bool packed) {
        for (int k = 0; k < columns; ++k) numbers.push_back(packed ? at(b, field, lane, k) : field[k * b.count + lane]);
      });
    }
  }
  std::vector<Touched> touched;
  const int n = bodies_.dofs();
  for (const std::int32_t i : touched_) {
    Touched body{*bodies_.id[i], {}, {}, {}};
    std::copy_n(system_.record[std::size_t(i)].x, 8, body.record);
    const double* m = bodies_.inverse_mass[i];
    if (n == 6) {
      double* to = body.general;
      to[0] = m[1], to[1] = m[2];
      std::copy_n(m + 3, 3, to + 2);
      if (bodies_.inverse_inertia.active) std::copy_n(bodies_.inverse_inertia[i], 6, to + 2);
    }
    std::copy_n(bodies_.velocity_free[i], n, body.free);
    touched.push_back(body);
  }
  std::vector<std::int64_t> others;
  for (const std::int32_t i : others_) others.push_back(*bodies_.id[i]);
  out.put(std::int32_t(!system_.general.empty()));
  out.put_all(std::span<const Contact>(contacts));
  out.put_all(std::span<const double>(numbers));
  out.put_all(std::span<const std::int32_t>(indices));
  out.put_all(start);
  out.put_all(std::span<const Touched>(touched));
  out.put_all(std::span<const std::int64_t>(others));
  return std::move(out.bytes);
}

void ContactParcel::unpack(Unpacker& answer) {
  const std::vector<double> impulses = answer.get_all<double>();
  const std::vector<std::int32_t> which = answer.get_all<std::int32_t>();
  const std::vector<double> velocities = answer.get_all<double>();
  const double* r = impulses.data();
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int k = 0; k < b.components; ++k) {
        at(b, b.r, lane, k) = *r++;
        if (!b.pack) at(b, b.bias, lane, k) = *r++;
      }
  system_.load({bodies_.velocity_free});
  const double* v = velocities.data();
  const int n = bodies_.dofs();
  for (const std::int32_t k : which) {
    const bool touched = std::size_t(k) < touched_.size();
    const std::int32_t body = touched ? touched_[std::size_t(k)] : others_[std::size_t(k) - touched_.size()];
    std::copy_n(v, n, system_.record[std::size_t(body)].x);
    v += n;
  }
}

struct GatheredContacts::Given {
  bool wide = false;
  std::vector<Contact> contacts;
  std::vector<double> numbers;
  std::vector<std::int32_t> indices;
  std::vector<double> start;
  std::vector<std::size_t> first, first_index, first_impulse; // (contacts) of its numbers
  std::vector<Touched> touched;
  std::vector<std::int64_t> others;
};

GatheredContacts::GatheredContacts(int dim) {
  system_.dim = dim;
  velocity_free_.components = dim == 2 ? 3 : 6;
  velocity_free_.active = true;
}

void GatheredContacts::lay_out(const std::vector<Bytes>& parcels) {
  std::vector<Given> given;
  asked_.clear();
  for (const Bytes& bytes : parcels) {
    Unpacker from(bytes);
    Given& one = given.emplace_back();
    one.wide = from.get<std::int32_t>() != 0;
    one.contacts = from.get_all<Contact>();
    one.numbers = from.get_all<double>();
    one.indices = from.get_all<std::int32_t>();
    one.start = from.get_all<double>();
    one.touched = from.get_all<Touched>();
    one.others = from.get_all<std::int64_t>();
    std::size_t first = 0, first_index = 0, first_impulse = 0;
    for (const Contact& contact : one.contacts) {
      one.first.push_back(first);
      one.first_index.push_back(first_index);
      one.first_impulse.push_back(first_impulse);
      first += numbers_of(contact.kind, system_.dim);
      first_index += indices_of(contact.kind);
      first_impulse += std::size_t(contact.kind.components);
    }
    std::vector<std::int64_t>& asked = asked_.emplace_back();
    for (const Touched& body : one.touched) asked.push_back(body.id);
    asked.insert(asked.end(), one.others.begin(), one.others.end());
  }
  number_bodies(given);
  plan(given);
  lay_out_numbers(given);
  fill(given);
}

std::int32_t GatheredContacts::number_of(std::int64_t id) const {
  const auto found = std::lower_bound(id_.begin(), id_.end(), id);
  return found != id_.end() && *found == id ? std::int32_t(found - id_.begin()) : -1;
}

void GatheredContacts::number_bodies(const std::vector<Given>& given) {
  std::vector<const Touched*> bodies;
  bool wide = false;
  for (const Given& one : given) {
    wide = wide || one.wide;
    for (const Touched& body : one.touched) bodies.push_back(&body);
  }
  std::sort(bodies.begin(), bodies.end(), [](const Touched* a, const Touched* b) { return a->id < b->id; });
  const auto last =
      std::unique(bodies.begin(), bodies.end(), [](const Touched* a, const Touched* b) { return a->id == b->id; });
  bodies.erase(last, bodies.end());
  id_.clear();
  system_.bodies = std::int64_t(bodies.size());
  system_.record.assign(bodies.size() + 1, cairn_record{});
  system_.general.assign(wide ? bodies.size() + 1 : 0, cairn_record{});
  const auto n = std::size_t(velocity_free_.components);
  velocity_free_.values.resize(n * bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    id_.push_back(bodies[i]->id);
    std::copy_n(bodies[i]->record, 8, system_.record[i].x);
    if (wide) std::copy_n(bodies[i]->general, 8, system_.general[i].x);
    std::copy_n(bodies[i]->free, n, velocity_free_.values.data() + n * i);
  }
}

// Batches of a colour and a kind, in one task: it is swept by one thread. Contacts of deformable bodies, which have a
// colour in common, are swept one after the other: by their batch, or in batches of their own.
void GatheredContacts::plan(const std::vector<Given>& given) {
  place_.clear();
  for (std::size_t p = 0; p < given.size(); ++p)
    for (std::size_t k = 0; k < given[p].contacts.size(); ++k)
      place_.push_back({std::int32_t(p), std::int32_t(k), 0, 0});
  const auto of = [&](const Place& place) -> const Contact& {
    return given[std::size_t(place.parcel)].contacts[std::size_t(place.contact)];
  };
  std::sort(place_.begin(), place_.end(), [&](const Place& one, const Place& other) {
    const Contact &a = of(one), &b = of(other);
    return std::tie(a.colour, a.kind, a.key) < std::tie(b.colour, b.kind, b.key);
  });
  system_.batches.clear();
  system_.candidate.clear();
  std::int64_t first = 0;
  for (std::size_t k = 0, end; k < place_.size(); k = end) {
    const Contact& begin = of(place_[k]);
    const std::size_t most = is_mapped(begin.kind) && !begin.kind.in_turn ? 1 : std::size_t(batch_size);
    for (end = k + 1; end < place_.size() && end - k < most; ++end)
      if (of(place_[end]).colour != begin.colour || of(place_[end]).kind != begin.kind) break;
    for (std::size_t j = k; j < end; ++j) {
      place_[j].batch = std::int32_t(system_.batches.size());
      place_[j].lane = std::int32_t(j - k);
      system_.candidate.push_back(std::int32_t(j));
    }
    system_.batches.push_back(batch_of(begin.kind, int(end - k), first, system_.dim));
    system_.batches.back().condensed = system_.condensed_dofs.data();
    system_.batches.back().condensed_velocity = system_.condensed_velocity.data();
    first += system_.batches.back().count;
    system_.candidate.resize(std::size_t(first), -1);
  }
  system_.first_batch = {0, std::int32_t(system_.batches.size())};
  system_.first_task = {0, 1};
}

void GatheredContacts::lay_out_numbers(const std::vector<Given>& given) {
  const int dim = system_.dim;
  std::vector<Kind> kinds(system_.batches.size());
  std::size_t numbers = 0, indices = 0;
  context_.assign(system_.batches.size(), {});
  for (const Place& place : place_) {
    const Contact& contact = given[std::size_t(place.parcel)].contacts[std::size_t(place.contact)];
    kinds[std::size_t(place.batch)] = contact.kind;
    context_[std::size_t(place.batch)].h = contact.h;
    context_[std::size_t(place.batch)].theta = contact.theta;
    context_[std::size_t(place.batch)].over_bodies = contact.over_bodies;
  }
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    numbers += columns_of(kinds[k], dim) * std::size_t(system_.batches[k].count);
    indices += indices_of(kinds[k]) * std::size_t(system_.batches[k].count);
  }
  number_.assign(numbers, 0.0);
  index_.assign(indices, 0);
  body_a_.assign(std::size_t(system_.places()), std::int32_t(system_.bodies));
  body_b_.assign(body_a_.size(), std::int32_t(system_.bodies));
  status_.assign(body_a_.size(), cairn_open);
  system_.compliant = false;
  double* next = number_.data();
  std::int32_t* index = index_.data();
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    cairn_batch& b = system_.batches[k];
    b.body_a = body_a_.data() + b.first;
    b.body_b = body_b_.data() + b.first;
    if (b.mapped_a) std::fill_n(b.body_a, b.count, 0);
    if (b.mapped_b) std::fill_n(b.body_b, b.count, 0);
    each_index(kinds[k], [&](auto array, int columns) {
      b.*array = index;
      index += std::ptrdiff_t(columns) * b.count;
    });
    b.status = status_.data() + b.first;
    next = place_blocks(b, context_[k], kinds[k], dim, next);
    system_.compliant = system_.compliant || b.compliance;
  }
}

void GatheredContacts::fill(const std::vector<Given>& given) {
  start_.clear();
  for (const Place& place : place_) {
    const Given& from = given[std::size_t(place.parcel)];
    const Contact& contact = from.contacts[std::size_t(place.contact)];
    const cairn_batch& b = system_.batches[std::size_t(place.batch)];
    b.body_a[place.lane] = b.mapped_a ? std::int32_t(contact.body_a) : number_of(contact.body_a);
    b.body_b[place.lane] = b.mapped_b ? std::int32_t(contact.body_b) : number_of(contact.body_b);
    b.status[place.lane] = contact.status;
    const double* next = from.numbers.data() + from.first[std::size_t(place.contact)];
    each_block(b, contact.kind, system_.dim, [&](double* field, int columns, bool packed) {
      for (int k = 0; k < columns; ++k)
        (packed ? at(b, field, place.lane, k) : field[k * b.count + place.lane]) = *next++;
    });
    if (!from.start.empty()) {
      const double* start = from.start.data() + from.first_impulse[std::size_t(place.contact)];
      start_.insert(start_.end(), start, start + contact.kind.components);
    }
    const std::int32_t* index = from.indices.data() + from.first_index[std::size_t(place.contact)];
    each_index(contact.kind, [&](auto array, int columns) {
      for (int k = 0; k < columns; ++k) (b.*array)[k * b.count + place.lane] = *index++;
    });
    if (place.lane < b.contacts - 1) continue;
    fill_dummies(b, contact.kind, system_.dim);
    if (b.stride_a || b.stride_b) cairn_mapped_responses(&b, system_.dim);
  }
}

std::vector<Bytes> GatheredContacts::answers() const {
  std::vector<std::vector<const Place*>> by_contact(asked_.size());
  for (const Place& place : place_) {
    auto& of_parcel = by_contact[std::size_t(place.parcel)];
    of_parcel.resize(std::max(of_parcel.size(), std::size_t(place.contact) + 1));
    of_parcel[std::size_t(place.contact)] = &place;
  }
  std::vector<Bytes> all;
  for (std::size_t p = 0; p < asked_.size(); ++p) {
    std::vector<double> impulses, velocities;
    std::vector<std::int32_t> which;
    for (const Place* place : by_contact[p]) {
      const cairn_batch& b = system_.batches[std::size_t(place->batch)];
      for (int k = 0; k < b.components; ++k) {
        impulses.push_back(at(b, b.r, place->lane, k));
        if (!b.pack) impulses.push_back(at(b, b.bias, place->lane, k));
      }
    }
    for (std::size_t k = 0; k < asked_[p].size(); ++k) {
      const std::int32_t body = number_of(asked_[p][k]);
      if (body < 0) continue;
      which.push_back(std::int32_t(k));
      const double* v = system_.record[std::size_t(body)].x;
      velocities.insert(velocities.end(), v, v + velocity_free_.components);
    }
    Packer out;
    out.put_all(std::span<const double>(impulses));
    out.put_all(std::span<const std::int32_t>(which));
    out.put_all(std::span<const double>(velocities));
    all.push_back(std::move(out.bytes));
  }
  return all;
}

} // namespace cairn
