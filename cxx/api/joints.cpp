// The C API of joints (cairn/cairn.h): checks pointers, names the joint and the rules about its ends.
#include <algorithm>

#include "../scene/joint_parts.hpp"
#include "../simulation/contact_fields.hpp"
#include "objects.hpp"

using namespace cairn::api;

namespace {

// "joint 0", "joint 1", ..., passing over names that materials and groups have.
std::string free_name(const cairn_matter& matter) {
  for (std::size_t k = matter.joints.size();; ++k) {
    std::string name = "joint " + std::to_string(k);
    const auto has = [&](const std::vector<std::string>& words) {
      return std::find(words.begin(), words.end(), name) != words.end();
    };
    if (!has(matter.materials) && !has(matter.groups)) return name;
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

cairn::JointDraft draft_of(int dim, const char* kind, std::int64_t a, std::int64_t b, const double* point,
                           const double* axis, std::int32_t count, const char* const* names, const double* values) {
  require(kind, "kind");
  cairn::JointDraft draft;
  draft.kind = kind;
  const std::int64_t points = cairn::joint_points(draft.kind);
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
  return draft;
}

// A material of its own for the ends of a joint, which touch nothing else.
void know_joint(cairn_matter& matter, const std::vector<double>& parameters) {
  const std::string name = free_name(matter);
  matter.materials.push_back(name);
  matter.groups.push_back(name);
  matter.joints.push_back(name);
  matter.rules.push_back({-1, -1, name, "*", false, {}, {}});
  matter.rules.push_back({-1, -1, name, name, true, cairn::joint_law(), parameters});
}

std::int32_t material_of(const cairn::Simulation& s, std::int64_t end) {
  const std::int32_t contactor = s.contactor(end);
  return contactor < 0 ? -1 : *s.scene.contactors.material[contactor];
}

} // namespace

extern "C" {

int32_t cairn_scene_add_joint(cairn_scene* scene, const char* kind, int64_t a, int64_t b, const double* point,
                              const double* axis, int32_t count, const char* const* names, const double* values,
                              int64_t* ends, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    const cairn::JointDraft draft = draft_of(scene->scene.dim, kind, a, b, point, axis, count, names, values);
    const std::vector<double> parameters = cairn::joint_parameters(scene->scene, draft);
    const auto made = cairn::add_joint_ends(scene->scene, draft, std::int32_t(scene->matter.materials.size()));
    know_joint(scene->matter, parameters);
    for (const std::int64_t end : {a, b}) rest_on_node(*scene, end);
    if (ends) std::copy(made.begin(), made.end(), ends);
  });
}

int32_t cairn_simulation_add_joint(cairn_simulation* simulation, const char* kind, int64_t a, int64_t b,
                                   const double* point, const double* axis, int32_t count, const char* const* names,
                                   const double* values, int64_t* ends, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_add_joint");
    cairn::Simulation& s = simulation->simulation;
    cairn::Scene& scene = s.scene;
    const cairn::JointDraft draft = draft_of(scene.dim, kind, a, b, point, axis, count, names, values);
    for (const auto& [side, end] : {std::pair{"a", a}, std::pair{"b", b}})
      if (end >= 0 && scene.find_node(end) >= 0)
        throw cairn::Error(std::string(side) + " of a joint is " + std::to_string(end) +
                           ", a node of a mesh; give a rigid body, or join it by cairn_scene_add_joint before the run");
    const std::vector<double> parameters = cairn::joint_parameters(scene, draft);
    cairn_matter matter = simulation->matter;
    know_joint(matter, parameters);
    s.use(table_of(matter, scene.dim));
    const std::int64_t next = scene.next_body_id;
    const auto made = cairn::add_joint_ends(scene, draft, std::int32_t(matter.materials.size()) - 1);
    simulation->matter = std::move(matter);
    simulation->transforms.came_in(scene, next);
    if (ends) std::copy(made.begin(), made.end(), ends);
  });
}

int32_t cairn_simulation_remove_joint(cairn_simulation* simulation, const int64_t* ends, cairn_error* error) {
  return guarded(error, [&] {
    between_steps(simulation, "cairn_simulation_remove_joint");
    require(ends, "ends");
    cairn::Simulation& s = simulation->simulation;
    const std::int32_t material = material_of(s, ends[0]), other = material_of(s, ends[1]);
    const cairn_matter& known = simulation->matter;
    const auto is_joint = [&] {
      const std::string& name = known.materials[std::size_t(material)];
      return std::find(known.joints.begin(), known.joints.end(), name) != known.joints.end() &&
             s.laws.find(material, material) >= 0;
    };
    if (ends[0] == ends[1] || material < 0 || material != other || !is_joint())
      throw cairn::Error("ends are " + std::to_string(ends[0]) + " and " + std::to_string(ends[1]) +
                         ", which no joint has; give those of one that is there, as cairn_scene_add_joint or "
                         "cairn_simulation_add_joint told them");
    cairn_matter matter = known;
    const std::string name = matter.materials[std::size_t(material)];
    matter.rules.push_back({-1, -1, name, name, false, {}, {}});
    const double stored = cairn::stored_between(s, material);
    s.use(table_of(matter, s.scene.dim));
    simulation->matter = std::move(matter);
    if (s.steps > 0) s.account_for_reshaping(0, -stored);
  });
}

} // extern "C"
