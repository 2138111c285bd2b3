// The unknowns of networks: rigid bodies in their internal order, then nodes of meshes in theirs.
#pragma once
#include <algorithm>
#include <vector>

#include "../scene/scene.hpp"

namespace cairn {

inline std::int64_t unknowns(const Scene& scene) { return scene.bodies.count + scene.nodes.count; }
inline std::int64_t unknown_of_node(const Scene& scene, std::int64_t node) { return scene.bodies.count + node; }
// Unknown of the body or node with this id; -1: it was removed.
inline std::int32_t unknown_of_id(const Scene& scene, std::int64_t id) {
  const std::int32_t body = scene.find_body(id), node = body < 0 ? scene.find_node(id) : -1;
  return node < 0 ? body : std::int32_t(unknown_of_node(scene, node));
}

// A value of each unknown: that of bodies itself where there are no nodes, else both in `room`; null: the scene has
// none.
inline const double* values_of(const Field<double>& bodies, const Field<double>& nodes, std::vector<double>& room) {
  if (!bodies.active || nodes.values.empty()) return bodies.active ? bodies.values.data() : nullptr;
  room.assign(bodies.values.begin(), bodies.values.end());
  room.insert(room.end(), nodes.values.begin(), nodes.values.end());
  return room.data();
}
inline void copy_to(std::vector<double>& out, const Field<double>& bodies, const Field<double>& nodes) {
  out.assign(bodies.values.begin(), bodies.values.end());
  out.insert(out.end(), nodes.values.begin(), nodes.values.end());
}
inline void give_back(const std::vector<double>& values, Field<double>& bodies, Field<double>& nodes) {
  const auto n = std::ptrdiff_t(bodies.values.size());
  std::copy_n(values.begin(), n, bodies.values.begin());
  std::copy(values.begin() + n, values.end(), nodes.values.begin());
}

} // namespace cairn
