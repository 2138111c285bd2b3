#include "part.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <string_view>
#include <type_traits>

#include "../base/zero_pages.hpp"
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace cairn {
namespace {

// f(field of one, same field of the other) for all rows of fields.def of two holders of a kind.
template <class Holder, class F>
void each_pair(Holder& one, Holder& other, F&& f) {
  std::vector<void*> fields;
  one.for_each_field([&](auto& field) { fields.push_back(&field); });
  std::size_t k = 0;
  other.for_each_field([&](auto& field) {
    using Same = std::remove_reference_t<decltype(field)>;
    f(*static_cast<Same*>(fields[k++]), field);
  });
}

// Arrays of drives and of directions of walls hold zeros for most bodies, which take no memory.
template <class T>
void copy_rows(const Field<T>& from, const std::vector<std::int32_t>& rows, Field<T>& to) {
  to.active = from.active;
  if (!from.active) {
    to.values.clear();
    return;
  }
  to.values.resize(rows.size() * std::size_t(from.components));
  for (std::size_t i = 0; i < rows.size(); ++i)
    std::copy_n(from[rows[i]], from.components, to.values.data() + i * std::size_t(from.components));
  give_back_zero_pages(to.values.data(), to.values.size() * sizeof(T));
}

template <class T>
void copy_runs(const Field<T>& from, const std::vector<Run>& runs, bool to_part, Field<T>& to) {
  const auto n = std::size_t(from.components);
  for (const Run& run : runs) {
    const auto whole = std::size_t(run.whole) * n, part = std::size_t(run.part) * n;
    const T* first = from.values.data() + (to_part ? whole : part);
    std::copy(first, first + std::size_t(run.rows) * n, to.values.data() + (to_part ? part : whole));
  }
}

// Workspace of a step, which each part fills by itself.
bool made_in_step(std::string_view name) {
  return name == "velocity_free" || name == "inverse_inertia" || name == "inverse_mass" || name.ends_with("_begin");
}

// State that a step leaves to readers and to the next step.
bool left_by_step(std::string_view name, std::string_view stage) {
  return !made_in_step(name) && stage != "insertion" && stage != "advance_networks"; // networks are of the whole
}

// Fields that change with the state alone.
bool comes_with_body(std::string_view name) { return name == "id" || name == "mass" || name == "inertia"; }

// Numbers of an array are with the parts alone.
template <class T>
bool is_released(const Field<T>& field, std::int64_t count) {
  return field.active && field.values.empty() && count > 0;
}

// Workspace of a part, where its scene needs it.
template <class T>
void make_room(const Scene& scene, Field<T>& field) {
  const std::size_t due = std::size_t(scene.bodies.count) * std::size_t(field.components);
  if (scene.has(field.need) && (!field.active || field.values.size() != due)) field.activate(scene.bodies.count);
}

// What a step changes as a body grows, beside its velocity.
bool changes_with_size(std::string_view name) {
  return name == "mass" || name == "inertia" || name == "angular_momentum";
}

// Sizes of contactors of rigid bodies, which the whole has.
void take_sizes(const Contactors& all, const Simulation& whole, Contactors& own) {
  auto& from = const_cast<Contactors&>(all);
  for (std::int64_t k = 0; k < own.count; ++k) {
    if (*own.body[k] < 0) continue;
    const std::int32_t row = whole.contactor(*own.id[k]);
    *own.radius[k] = *from.radius[row];
    if (own.offset.active) std::copy_n(from.offset[row], own.offset.components, own.offset[k]);
    if (own.direction.active) std::copy_n(from.direction[row], own.direction.components, own.direction[k]);
    if (own.hull.active && *own.hull[k] >= 0) own.hulls.take_lengths(*own.hull[k], all.hulls, *from.hull[row]);
  }
}

// Rows of driven bodies.
template <class T>
void copy_driven(const Field<T>& from, const Bodies& bodies, const std::vector<Run>& runs, Field<T>& to) {
  for (const Run& run : runs)
    for (std::int64_t i = 0; i < run.rows; ++i)
      if (*bodies.driven[run.whole + i]) std::copy_n(from[run.whole + i], from.components, to[run.part + i]);
}

// Hulls of these contactors alone, in their order.
void keep_hulls(const Hulls& all, Contactors& contactors) {
  if (all.count() == 0 || !contactors.hull.active) return;
  std::vector<std::int32_t> place(std::size_t(all.count()), -1);
  for (const std::int32_t hull : contactors.hull.values)
    if (hull >= 0) place[std::size_t(hull)] = 0;
  Hulls& to = contactors.hulls;
  const auto append = [](auto& some, const auto& from, std::int64_t first, std::int64_t last) {
    some.insert(some.end(), from.begin() + first, from.begin() + last);
  };
  const bool corners = all.first_corner.size() == all.offset.size() + 1;
  for (std::int32_t hull = 0; hull < all.count(); ++hull) {
    if (place[std::size_t(hull)] < 0) continue;
    place[std::size_t(hull)] = to.count();
    const auto h = std::size_t(hull);
    const std::int64_t v0 = all.first_vertex[h], v1 = all.first_vertex[h + 1], f0 = all.first_face[h],
                       f1 = all.first_face[h + 1], e0 = all.first_edge[h], e1 = all.first_edge[h + 1];
    append(to.vertex, all.vertex, all.dim * v0, all.dim * v1);
    append(to.normal, all.normal, all.dim * f0, all.dim * f1);
    append(to.offset, all.offset, f0, f1);
    append(to.edge, all.edge, 4 * e0, 4 * e1);
    if (corners) {
      const std::int64_t c0 = all.first_corner[std::size_t(f0)], c1 = all.first_corner[std::size_t(f1)];
      append(to.corner_vertex, all.corner_vertex, c0, c1);
      if (!all.corner_edge.empty()) append(to.corner_edge, all.corner_edge, c0, c1);
      for (std::int64_t f = f0; f < f1; ++f)
        to.first_corner.push_back(to.first_corner.back() + all.first_corner[std::size_t(f) + 1] -
                                  all.first_corner[std::size_t(f)]);
    }
    to.first_vertex.push_back(to.first_vertex.back() + std::int32_t(v1 - v0));
    to.first_face.push_back(to.first_face.back() + std::int32_t(f1 - f0));
    to.first_edge.push_back(to.first_edge.back() + std::int32_t(e1 - e0));
    append(to.inner, all.inner, hull, hull + 1);
    append(to.radius, all.radius, hull, hull + 1);
  }
  for (std::int32_t& hull : contactors.hull.values)
    if (hull >= 0) hull = place[std::size_t(hull)];
}

// An empty part, with a strategy of the settings of the model and all of the whole that is no array.
Part part_without_bodies(const Simulation& whole, Scene scene, const Strategy& model, int rank) {
  Part part;
  part.rank = rank;
  auto strategy = model.fresh();
  part.strategy = strategy.get();
  for (const Option& option : strategy->options()) // the whole is renumbered, and parts with it
    if (option.info.name == "renumber_every") *std::get<int*>(option.member) = std::numeric_limits<int>::max();
  scene.gravity = whole.scene.gravity;
  scene.origin = whole.scene.origin;
  scene.cell = whole.scene.cell;
  scene.next_body_id = whole.scene.next_body_id;
  scene.next_contactor_id = whole.scene.next_contactor_id;
  part.simulation = std::make_unique<Simulation>(std::move(scene), whole.laws, std::move(strategy));
  return part;
}

// Rows of packed bodies and contactors to a holder of both. body(place), contactor(place): their rows there.
template <class OfBody, class OfContactor>
void take_rows(Piece bytes, Scene& to, const Arrays& arrays, OfBody&& body, OfContactor&& contactor) {
  Unpacker from(bytes);
  while (from.more()) {
    std::size_t k = 0;
    std::vector<std::int32_t> rows;
    const auto take = [&](auto& field) {
      using T = typename std::decay_t<decltype(field)>::value_type;
      if (!arrays[k++]) return;
      std::size_t numbers = 0;
      const std::byte* first = from.pass_over(sizeof(T), numbers);
      const std::size_t size = std::size_t(field.components) * sizeof(T);
      for (std::size_t i = 0; i < rows.size() && numbers > 0; ++i) std::memcpy(field[rows[i]], first + i * size, size);
    };
    for (const std::int32_t place : from.get_all<std::int32_t>()) rows.push_back(body(place));
    to.bodies.for_each_field(take);
    rows.clear();
    for (const std::int32_t place : from.get_all<std::int32_t>()) rows.push_back(contactor(place));
    to.contactors.for_each_field(take);
  }
}

// Items `rows` of the whole to a part, but for arrays that arrive; k: number of the first array.
template <class Holder>
void copy_items(Holder& from, const std::vector<std::int32_t>& rows, const Arrived* arrived, std::size_t k,
                Holder& to) {
  each_pair(from, to, [&](auto& of_whole, auto& own) {
    const bool arrives = arrived && arrived->arrays[k];
    ++k;
    if (made_in_step(own.name)) return;
    if (!arrives) return copy_rows(of_whole, rows, own);
    own.activate(std::int64_t(rows.size()));
  });
}

template <class Holder>
std::size_t number_of_arrays(Holder& holder) {
  std::size_t n = 0;
  holder.for_each_field([&](auto&) { ++n; });
  return n;
}

} // namespace

Part make_part(const Simulation& whole, const Strategy& model, int rank, std::vector<std::int32_t> bodies,
               MeshShare meshes, const Arrived* arrived) {
  auto& from = const_cast<Simulation&>(whole); // fields are gone through, and not changed
  Part part = part_without_bodies(whole, Scene(whole.scene.dim), model, rank);
  part.bodies = std::move(bodies);
  Scene& scene = part.simulation->scene;
  scene.bodies.count = std::int64_t(part.bodies.size());
  copy_items(from.scene.bodies, part.bodies, arrived, 0, scene.bodies);
  scene.bodies.for_each_field([&](auto& own) {
    if (made_in_step(own.name)) make_room(scene, own);
  });
  std::vector<std::int32_t> local(std::size_t(whole.scene.bodies.count), -1), contactors;
  for (std::size_t i = 0; i < part.bodies.size(); ++i) local[std::size_t(part.bodies[i])] = std::int32_t(i);
  const Contactors& c = whole.scene.contactors;
  for (std::int64_t k = 0; k < c.count; ++k)
    if (*c.body[k] < 0 ? meshes == MeshShare::all : local[std::size_t(*c.body[k])] >= 0)
      contactors.push_back(std::int32_t(k));
  copy_items(from.scene.contactors, contactors, arrived, number_of_arrays(from.scene.bodies), scene.contactors);
  const auto row_of = [&](std::int32_t contactor) {
    return std::int32_t(std::lower_bound(contactors.begin(), contactors.end(), contactor) - contactors.begin());
  };
  for (std::size_t i = 0; arrived && i < arrived->rows.size(); ++i)
    take_rows(
        arrived->rows[i].bytes, scene, arrived->arrays, [&](std::int32_t body) { return local[std::size_t(body)]; },
        row_of);
  for (std::int32_t& body : scene.contactors.body.values)
    if (body >= 0) body = local[std::size_t(body)];
  keep_hulls(c.hulls, scene.contactors);
  part.has_meshes = meshes != MeshShare::none;
  if (part.has_meshes)
    each_pair(from.scene.nodes, scene.nodes, [](auto& of_whole, auto& own) {
      own.active = of_whole.active;
      own.values = of_whole.values;
    });
  scene.fields_restored(part.has_meshes ? whole.scene.parts() : std::vector<MeshParts>());
  part.node_then.assign(scene.nodes.position.values.begin(), scene.nodes.position.values.end());
  const double* x = scene.bodies.position.values.data();
  part.position_then.assign(x, x + scene.bodies.position.values.size());
  return part;
}

void find_runs(Part& part) {
  part.runs.clear();
  part.own_runs.clear();
  part.ghost_runs.clear();
  const auto add = [](std::vector<Run>& runs, std::int64_t whole, std::int64_t own) {
    if (!runs.empty() && runs.back().whole + runs.back().rows == whole && runs.back().part + runs.back().rows == own)
      ++runs.back().rows;
    else
      runs.push_back({whole, own, 1});
  };
  for (std::size_t i = 0; i < part.bodies.size(); ++i) {
    add(part.runs, part.bodies[i], std::int64_t(i));
    add(part.own[i] ? part.own_runs : part.ghost_runs, part.bodies[i], std::int64_t(i));
  }
}

void bring(const Simulation& whole, Part& part, Known known) {
  auto& from = const_cast<Simulation&>(whole);
  Simulation& s = *part.simulation;
  s.scene.gravity = whole.scene.gravity;
  s.scene.cell = whole.scene.cell;
  s.steps = whole.steps;
  s.time = whole.time;
  const bool grows = whole.scene.has(Need::growing);
  if (grows) take_sizes(whole.scene.contactors, whole, s.scene.contactors);
  each_pair(from.scene.bodies, s.scene.bodies, [&](auto& of_whole, auto& own) {
    if (made_in_step(own.name)) return make_room(s.scene, own);
    if (is_released(of_whole, whole.scene.bodies.count)) return;
    if (own.active != of_whole.active || own.values.size() != part.bodies.size() * std::size_t(own.components))
      copy_rows(of_whole, part.bodies, own);
    else if (grows && own.active && changes_with_size(own.name))
      copy_runs(of_whole, part.runs, true, own);
    else if (!own.active || (known != Known::whole && comes_with_body(own.name)))
      return;
    else if (std::string_view(own.name) == "driven_velocity" && whole.scene.bodies.driven.active)
      copy_driven(of_whole, whole.scene.bodies, part.runs, own);
    else if (known == Known::whole || !left_by_step(own.name, own.stage))
      copy_runs(of_whole, part.runs, true, own);
    else if (known == Known::by_both)
      copy_runs(of_whole, part.ghost_runs, true, own);
  });
  if (!part.has_meshes) return;
  each_pair(from.scene.nodes, s.scene.nodes, [](auto& of_whole, auto& own) {
    if (own.active == of_whole.active && own.values.size() == of_whole.values.size() && made_in_step(own.name)) return;
    own.active = of_whole.active;
    own.values = of_whole.values;
  });
}

void take_nodes(const Part& part, Simulation& whole) {
  each_pair(part.simulation->scene.nodes, whole.scene.nodes, [](auto& own, auto& of_whole) {
    if (of_whole.active && own.active && left_by_step(own.name, own.stage)) of_whole.values = own.values;
  });
}

Arrays arrays_of_parts(Simulation& whole) {
  Arrays arrays;
  const auto look = [&](auto& field, std::int64_t count, bool of_state) {
    arrays.push_back(field.active && (of_state || is_released(field, count)) && !made_in_step(field.name));
  };
  whole.scene.bodies.for_each_field(
      [&](auto& field) { look(field, whole.scene.bodies.count, left_by_step(field.name, field.stage)); });
  whole.scene.contactors.for_each_field([&](auto& field) { look(field, whole.scene.contactors.count, false); });
  return arrays;
}

Arrays arrays_to_fill(Simulation& whole, bool state, bool workspace) {
  Arrays arrays;
  const auto look = [&](auto& field, std::int64_t count, bool of_state) {
    if (workspace && made_in_step(field.name) && whole.scene.has(field.need)) field.activate(count);
    const bool released = is_released(field, count);
    if (released) field.resize(count);
    arrays.push_back(field.active && (released || of_state || (workspace && made_in_step(field.name))));
  };
  whole.scene.bodies.for_each_field(
      [&](auto& field) { look(field, whole.scene.bodies.count, state && left_by_step(field.name, field.stage)); });
  whole.scene.contactors.for_each_field([&](auto& field) { look(field, whole.scene.contactors.count, false); });
  return arrays;
}

namespace {

// Rows of contactors on bodies of the part that are marked, in the part and in the whole.
std::vector<std::array<std::int32_t, 2>> contactors_on(const std::vector<std::uint8_t>& marked, const Part& part,
                                                       const Simulation& whole) {
  std::vector<std::array<std::int32_t, 2>> rows;
  const Contactors& c = part.simulation->scene.contactors;
  rows.reserve(std::size_t(c.count));
  for (std::int64_t k = 0; k < c.count; ++k)
    if (*c.body[k] >= 0 && marked[std::size_t(*c.body[k])])
      rows.push_back({std::int32_t(k), whole.contactor(*c.id[k])});
  return rows;
}

// True if arrays of contactors are among them, which stand behind those of bodies.
bool has_contactors(const Scene& scene, const Arrays& arrays) {
  const std::size_t bodies = number_of_arrays(const_cast<Bodies&>(scene.bodies));
  return std::find(arrays.begin() + std::ptrdiff_t(bodies), arrays.end(), 1) != arrays.end();
}

} // namespace

void take(const Part& part, Simulation& whole, const Arrays& arrays) {
  Scene &from = part.simulation->scene, &to = whole.scene;
  std::size_t k = 0;
  each_pair(from.bodies, to.bodies, [&](auto& own, auto& of_whole) {
    if (arrays[k++] && own.active) copy_runs(own, part.own_runs, false, of_whole);
  });
  if (!has_contactors(to, arrays)) return;
  const auto rows = contactors_on(part.own, part, whole);
  each_pair(from.contactors, to.contactors, [&](auto& own, auto& of_whole) {
    if (!arrays[k++] || !own.active) return;
    for (const auto& [row, place] : rows) std::copy_n(own[row], own.components, of_whole[place]);
  });
}

void pack_rows(const Part& part, const std::vector<std::int32_t>& bodies, const Simulation& whole, const Arrays& arrays,
               Packer& packer) {
  Scene& from = part.simulation->scene;
  std::vector<std::int32_t> rows = bodies, places;
  std::size_t k = 0;
  const auto pack = [&](auto& field) {
    using T = typename std::decay_t<decltype(field)>::value_type;
    if (!arrays[k++]) return;
    std::vector<T> numbers;
    numbers.reserve(rows.size() * std::size_t(field.components));
    for (const std::int32_t row : rows)
      if (field.active) numbers.insert(numbers.end(), field[row], field[row] + field.components);
    packer.put_all(std::span<const T>(numbers));
  };
  std::vector<std::uint8_t> marked(part.bodies.size(), 0);
  for (const std::int32_t row : rows) {
    places.push_back(part.bodies[std::size_t(row)]);
    marked[std::size_t(row)] = 1;
  }
  packer.put_all(std::span<const std::int32_t>(places));
  from.bodies.for_each_field(pack);
  rows.clear();
  places.clear();
  if (has_contactors(whole.scene, arrays))
    for (const auto& [row, place] : contactors_on(marked, part, whole)) {
      rows.push_back(row);
      places.push_back(place);
    }
  packer.put_all(std::span<const std::int32_t>(places));
  from.contactors.for_each_field(pack);
}

void pack_own(const Part& part, const Simulation& whole, const Arrays& arrays, Packer& packer) {
  std::vector<std::int32_t> own;
  for (std::size_t i = 0; i < part.bodies.size(); ++i)
    if (part.own[i]) own.push_back(std::int32_t(i));
  pack_rows(part, own, whole, arrays, packer);
}

void take_packed(Piece bytes, Simulation& whole, const Arrays& arrays) {
  const auto as_it_is = [](std::int32_t place) { return place; };
  take_rows(bytes, whole.scene, arrays, as_it_is, as_it_is);
}

namespace {
constexpr std::size_t much = 1 << 20; // free bytes for which looking through the heap pays
}

void release(Simulation& whole, bool loads) {
  std::size_t freed = 0;
  const auto free = [&](auto& field) {
    using T = typename std::decay_t<decltype(field)>::value_type;
    const bool of_loads = std::string_view(field.stage) == "insertion" && !comes_with_body(field.name);
    if (!std::is_same_v<T, double> || !field.active || (loads && of_loads)) return;
    freed += field.values.capacity() * sizeof(T);
    Array<T>().swap(field.values);
  };
  whole.scene.bodies.for_each_field(free);
  whole.scene.contactors.for_each_field(free);
  if (freed > much) return_freed_memory();
}

void return_freed_memory() {
#ifdef __GLIBC__
#if __GLIBC_PREREQ(2, 33)
  if (mallinfo2().fordblks <= much) return;
#endif
  malloc_trim(0);
#endif
}

void release_workspace(Scene& whole) {
  whole.bodies.for_each_field([&](auto& field) {
    using T = typename std::decay_t<decltype(field)>::value_type;
    if (!made_in_step(field.name)) return;
    field.active = false;
    Array<T>().swap(field.values);
  });
}

} // namespace cairn
