#include "older_states.hpp"

#include <algorithm>
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
      p.nodes ? there.own_nodes(p.mesh, p.first, p.count) : void(there.add_parts(p.mesh, p.count));
    }
  tree.add("parts", stored_parts(there));
  return out;
}

bool is_older_state_of(const StoredValue& state, const Scene& scene) {
  const std::optional<StoredValue> as_now = without_bodies_of_parts(state, scene);
  if (!as_now) return false;
  const StoredValue& tree = as_now->tree("scene");
  const StoredValue &bodies = tree.tree("bodies"), &contactors = tree.tree("contactors");
  const auto same = [](const Field<double>& own, const StoredValue& given, std::size_t theirs, std::int64_t mine) {
    const auto row = std::size_t(own.components) * sizeof(double);
    return given.array.bytes.size() >= (theirs + 1) * row &&
           std::memcmp(own[mine], &given.array.bytes[theirs * row], row) == 0;
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
