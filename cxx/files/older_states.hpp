// States of files in which nodes, and before that points, edges and faces of meshes, were bodies of the scene.
#pragma once
#include <optional>

#include "../scene/scene.hpp"
#include "stored_tree.hpp"

namespace cairn {

// Parts of deformable bodies as a state holds them, (n, 4): first number, how many, mesh, 1 for nodes.
StoredValue stored_parts(const Scene& scene);
std::vector<MeshParts> parts_of(const StoredValue& scene); // of the tree "scene" of a state

// The state as it is written now, for a scene with meshes; none: it is.
std::optional<StoredValue> state_as_now(const StoredValue& state, const Scene& scene);

// True if an old state fits the scene: bodies in both have the same masses and contactors.
bool is_older_state_of(const StoredValue& state, const Scene& scene);

} // namespace cairn
