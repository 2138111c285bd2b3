// The C API of joints (cairn/cairn.h): checks pointers, names the joint and the rules about its ends.
#include <algorithm>

#include "../scene/joint_parts.hpp"
#include "objects.hpp"

using namespace cairn::api;

namespace {

// "joint 0", "joint 1", ..., passing over names that materials and groups have.
std::string free_name(const cairn_scene& scene) {
  for (std::size_t k = scene.joints.size();; ++k) {
    std::string name = "joint " + std::to_string(k);
    const auto has = [&](const std::vector<std::string>& words) {
      return std::find(words.begin(), words.end(), name) != words.end();
    };
    if (!has(scene.materials) && !has(scene.groups)) return name;
  }
}

// Contacts may rest on a node that is joined, if it is one.
void rest_on_node(cairn_scene& scene, std::int64_t id) {
  for (cairn::MeshModel& m : scene.meshes) {
    const auto found = std::lower_bound(m.node_ids.begin(), m.node_ids.end(), id);
    if (found == m.node_ids.end() || *found != id) continue;
    const auto node = std::int32_t(found - m.node_ids.begin());
    const auto place = std::lower_bound(m.contact_nodes.begin(), m.contact_nodes.end(), node);
    if (place == m.contact_nodes.end() || *place != node) m.contact_nodes.insert(place, node);
  }
}

} // namespace

extern "C" int32_t cairn_scene_add_joint(cairn_scene* scene, const char* kind, int64_t a, int64_t b,
                                         const double* point, const double* axis, int32_t count,
                                         const char* const* names, const double* values, int64_t* ends,
                                         cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(kind, "kind");
    cairn::JointDraft draft;
    draft.kind = kind;
    const std::int64_t dim = scene->scene.dim, points = cairn::joint_points(draft.kind);
    require(point, "point");
    if (counted(count) > 0) {
      require(names, "names");
      require(values, "values");
    }
    draft.a = a;
    draft.b = b;
    draft.point = span_of(point, dim * points);
    draft.axis = span_of(axis, dim);
    for (std::int32_t k = 0; k < count; ++k) {
      require(names[k], "names");
      draft.numbers.emplace_back(names[k], values[k]);
    }
    const std::vector<double> parameters = cairn::joint_parameters(scene->scene, draft);
    const std::string name = free_name(*scene);
    const auto made = cairn::add_joint_ends(scene->scene, draft, std::int32_t(scene->materials.size()));
    scene->materials.push_back(name);
    scene->groups.push_back(name);
    scene->joints.push_back(name);
    for (const std::int64_t end : {a, b}) rest_on_node(*scene, end);
    scene->rules.push_back({-1, -1, name, "*", false, {}, {}});
    scene->rules.push_back({-1, -1, name, name, true, cairn::joint_law(), parameters});
    if (ends) std::copy(made.begin(), made.end(), ends);
  });
}
