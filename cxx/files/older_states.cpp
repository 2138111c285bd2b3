#include "older_states.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>

#include "../contactors/mapped_contactors.hpp"

namespace cairn {

namespace {

std::vector<std::int64_t> ids_of(const StoredValue& tree) {
  return numbers_of<std::int64_t>(tree.at("id").array, "id");
}

// The rows of an array that stay.
void keep_rows(StoredArray& array, const std::vector<std::uint8_t>& stays) {
  const std::size_t rows = stays.size(), bytes = rows ? array.bytes.size() / rows : 0;
  if (array.shape.empty() || array.shape[0] != std::int64_t(rows)) return; // refused where it is looked at
  std::size_t to = 0;
  for (std::size_t i = 0; i < rows; ++i)
    if (stays[i]) std::memmove(&array.bytes[bytes * to++], &array.bytes[bytes * i], bytes);
  array.shape[0] = std::int64_t(to);
  array.bytes.resize(bytes * to);
}

StoredValue& member(StoredValue& tree, const std::string& name) {
  for (auto& [known, value] : tree.members)
    if (known == name) return value;
  throw std::invalid_argument(name + " is missing");
}

} // namespace

StoredValue stored_parts(const Scene& scene) {
  std::vector<std::int64_t> rows;
  for (const MeshParts& p : scene.parts()) rows.insert(rows.end(), {p.first, p.count, p.mesh, p.nodes});
  return {"array", StoredArray::of(rows.data(), {std::int64_t(rows.size()) / 4, 4}), {}};
}

std::vector<MeshParts> parts_of(const StoredValue& scene) {
  std::vector<MeshParts> out;
  const StoredValue* given = scene.find("parts");
  if (!given) return out;
  const std::vector<std::int64_t> rows = numbers_of<std::int64_t>(given->array, "parts");
  for (std::size_t i = 0; i + 3 < rows.size(); i += 4) {
    constexpr std::int64_t most = std::int64_t(1) << 31;
    const std::int64_t end = out.empty() ? 0 : out.back().first + out.back().count;
    if (rows[i] < end || rows[i] >= most * most || rows[i + 1] < 1 || rows[i + 1] >= most || rows[i + 2] < 1 ||
        rows[i + 2] >= most || rows[i + 2] > rows[i] + rows[i + 1])
      throw std::invalid_argument("parts[" + std::to_string(i / 4) + "] are no numbers of a mesh");
    out.push_back({rows[i], rows[i + 1], std::int32_t(rows[i + 2]), rows[i + 3] != 0});
  }
  return out;
}

namespace {

// Points, edges and faces were bodies.
std::optional<StoredValue> without_bodies_of_parts(const StoredValue& state, const Scene& scene) {
  if (state.tree("scene").find("parts") || scene.parts().empty()) return {};
  StoredValue out = state;
  StoredValue& tree = member(out, "scene");
  StoredValue &bodies = member(tree, "bodies"), &contactors = member(tree, "contactors");
  const std::vector<std::int64_t> ids = ids_of(bodies);
  std::vector<std::uint8_t> stays(ids.size(), 1);
  std::vector<std::int32_t> now(ids.size());
  std::int32_t kept = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const MeshParts* of = scene.part(ids[i]);
    stays[i] = !of || of->nodes;
    now[i] = stays[i] ? kept++ : -1;
  }
  auto body = numbers_of<std::int32_t>(contactors.at("body").array, "contactors/body");
  std::vector<std::int64_t> part(body.size(), -1);
  for (std::size_t c = 0; c < body.size(); ++c) {
    if (body[c] < 0 || std::size_t(body[c]) >= ids.size())
      throw std::invalid_argument("contactors/body[" + std::to_string(c) + "] is " + std::to_string(body[c]) +
                                  ": there are bodies from 0 to " + std::to_string(std::int64_t(ids.size()) - 1));
    const std::int64_t id = ids[std::size_t(body[c])];
    const MeshParts* of = scene.part(id);
    if (of) part[c] = id;
    body[c] = of ? -of->mesh : now[std::size_t(body[c])];
  }
  for (auto& [name, value] : bodies.members) keep_rows(value.array, stays);
  const auto n = std::int64_t(body.size());
  member(contactors, "body") = {"array", StoredArray::of(body.data(), {n}), {}};
  contactors.add_array("part", part.data(), {n});
  std::vector<std::int64_t> sorted(ids);
  std::sort(sorted.begin(), sorted.end());
  Scene there(scene.dim); // of the meshes that were not removed
  for (const MeshParts& p : scene.parts())
    if (std::binary_search(sorted.begin(), sorted.end(), p.first)) {
      there.next_body_id = p.first;
      const std::vector<double> mass(p.nodes ? std::size_t(p.count) : 0, 1.0);
      const std::vector<double> place(mass.size() * std::size_t(scene.dim), 0.0);
      p.nodes ? there.add_nodes(p.mesh, place, {}, mass) : there.add_parts(p.mesh, p.count);
    }
  tree.add("parts", stored_parts(there));
  return out;
}

// Rows of the nodes among the bodies of a state: those of a mesh one after the other, meshes in the order of the rows
// of their first nodes. Throws where one is missing.
std::vector<std::size_t> rows_of_nodes(const std::vector<std::int64_t>& ids, const std::vector<MeshParts>& parts) {
  std::map<std::int64_t, std::size_t> row;
  for (std::size_t i = 0; i < ids.size(); ++i) row[ids[i]] = i;
  const auto of = [&](std::int64_t id) {
    if (const auto at = row.find(id); at != row.end()) return at->second;
    throw std::invalid_argument("parts name node " + std::to_string(id) + ", which is no body");
  };
  std::map<std::size_t, const MeshParts*> by_row;
  for (const MeshParts& p : parts)
    if (p.nodes) by_row[of(p.first)] = &p;
  std::vector<std::size_t> out;
  for (const auto& [first, p] : by_row)
    for (std::int64_t k = 0; k < p->count; ++k) out.push_back(of(p->first + k));
  return out;
}

// Nodes were bodies that did not turn.
std::optional<StoredValue> without_bodies_of_nodes(const StoredValue& state, const Scene& scene) {
  const StoredValue& before = state.tree("scene");
  const std::vector<MeshParts> parts = parts_of(before);
  if (before.find("nodes") || std::none_of(parts.begin(), parts.end(), [](const MeshParts& p) { return p.nodes; }))
    return {};
  StoredValue out = state;
  StoredValue& tree = member(out, "scene");
  StoredValue &bodies = member(tree, "bodies"), &contactors = member(tree, "contactors");
  const std::vector<std::int64_t> ids = ids_of(bodies);
  const std::vector<std::size_t> rows = rows_of_nodes(ids, parts);
  const auto n = std::int64_t(rows.size());
  StoredValue nodes;
  Nodes known(scene.dim);
  known.for_each_field([&](auto& field) {
    using T = typename std::decay_t<decltype(field)>::value_type;
    const std::string name(field.name);
    const auto c = std::size_t(field.components);
    std::vector<T> values(rows.size() * c, T{});
    const StoredValue* given = bodies.find(name);
    if (field.name == "mesh") {
      for (std::size_t k = 0; k < rows.size(); ++k) values[k] = T(part_with(parts, ids[rows[k]])->mesh);
    } else if (given) {
      const std::vector<T> all = numbers_of<T>(given->array, "bodies/" + name);
      const std::size_t each = ids.empty() ? 0 : all.size() / ids.size();
      if (each < c || each * ids.size() != all.size())
        throw std::invalid_argument("bodies/" + name + " holds " + std::to_string(all.size()) + " numbers for " +
                                    std::to_string(ids.size()) + " bodies");
      for (std::size_t k = 0; k < rows.size(); ++k)
        std::copy_n(all.begin() + std::ptrdiff_t(each * rows[k]), c, values.begin() + std::ptrdiff_t(c * k));
    } else if (field.need != Need::always) {
      return;
    }
    nodes.add_array(name, values.data(), c == 1 ? std::vector{n} : std::vector{n, std::int64_t(c)});
  });
  std::vector<std::uint8_t> stays(ids.size(), 1);
  for (const std::size_t row : rows) stays[row] = 0;
  std::vector<std::int32_t> now(ids.size(), -1);
  std::int32_t kept = 0;
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (stays[i]) now[i] = kept++;
  auto body = numbers_of<std::int32_t>(contactors.at("body").array, "contactors/body");
  for (std::int32_t& b : body) {
    if (b < 0) continue;
    if (std::size_t(b) >= ids.size() || now[std::size_t(b)] < 0)
      throw std::invalid_argument("contactors/body holds " + std::to_string(b) + ", which is no rigid body");
    b = now[std::size_t(b)];
  }
  std::erase_if(bodies.members, [](const auto& m) { return m.name == "whole"; });
  for (auto& [name, value] : bodies.members) keep_rows(value.array, stays);
  member(contactors, "body") = {"array", StoredArray::of(body.data(), {std::int64_t(body.size())}), {}};
  tree.add("nodes", std::move(nodes));
  return out;
}

} // namespace

std::optional<StoredValue> state_as_now(const StoredValue& state, const Scene& scene) {
  std::optional<StoredValue> parts = without_bodies_of_parts(state, scene);
  std::optional<StoredValue> nodes = without_bodies_of_nodes(parts ? *parts : state, scene);
  return nodes ? nodes : parts;
}

bool is_older_state_of(const StoredValue& state, const Scene& scene) {
  const std::optional<StoredValue> as_now = state_as_now(state, scene);
  if (!as_now) return false;
  const StoredValue& tree = as_now->tree("scene");
  const StoredValue &bodies = tree.tree("bodies"), &contactors = tree.tree("contactors");
  // to rounding: masses of nodes come from sums over elements, which another version may take in another order
  const auto same = [](const Field<double>& own, const StoredValue& given, std::size_t theirs, std::int64_t mine) {
    const auto row = std::size_t(own.components) * sizeof(double);
    if (given.array.bytes.size() < (theirs + 1) * row) return false;
    for (int k = 0; k < own.components; ++k) {
      double there;
      std::memcpy(&there, &given.array.bytes[theirs * row + std::size_t(k) * sizeof(double)], sizeof(double));
      const double here = own[mine][k];
      if (here != there && !(std::abs(here - there) <= 0x1p-40 * std::abs(here))) return false;
    }
    return true;
  };
  const std::vector<std::int64_t> ids = ids_of(bodies), named = ids_of(contactors);
  std::map<std::int64_t, std::int64_t> own, own_contactors;
  for (std::int64_t i = 0; i < scene.bodies.count; ++i) own[*scene.bodies.id[i]] = i;
  for (std::int64_t c = 0; c < scene.contactors.count; ++c) own_contactors[*scene.contactors.id[c]] = c;
  std::size_t shared = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto at = own.find(ids[i]);
    if (at == own.end()) continue;
    ++shared;
    if (!same(scene.bodies.mass, bodies.at("mass"), i, at->second) ||
        !same(scene.bodies.inertia, bodies.at("inertia"), i, at->second))
      return false;
  }
  if (const StoredValue* nodes = tree.find("nodes")) {
    const std::vector<std::int64_t> theirs = ids_of(*nodes);
    for (std::size_t i = 0; i < theirs.size(); ++i) {
      const std::int32_t mine = scene.find_node(theirs[i]);
      if (mine < 0) continue;
      ++shared;
      if (!same(scene.nodes.mass, nodes->at("mass"), i, mine)) return false;
    }
  }
  const auto body = numbers_of<std::int32_t>(contactors.at("body").array, "contactors/body");
  const auto part = numbers_of<std::int64_t>(contactors.at("part").array, "contactors/part");
  const auto shape = numbers_of<std::int16_t>(contactors.at("shape").array, "contactors/shape");
  for (std::size_t c = 0; c < named.size(); ++c) {
    const auto at = own_contactors.find(named[c]);
    if (at == own_contactors.end()) continue;
    const std::int64_t carrier = body[c] < 0 ? part[c] : ids[std::size_t(body[c])];
    if (shape[c] != *scene.contactors.shape[at->second] ||
        carrier != carrier_id(scene.bodies, scene.contactors, at->second))
      return false;
  }
  return shared > 0;
}

} // namespace cairn
