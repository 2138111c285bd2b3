// The C API of scenes (cairn/cairn.h): checks pointers, turns exceptions into codes, decides nothing else.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "../plugs/plug.hpp"
#include "../scene/cell_boundaries.hpp"
#include "cairn/build.h"
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

namespace {

cairn::Shape shape_named(const char* name) {
  std::string known;
  for (const cairn::ShapeInfo& shape : cairn::shape_infos()) {
    if (std::strcmp(name, shape.name) == 0) return cairn::Shape(&shape - cairn::shape_table);
    known += std::string(known.empty() ? "" : ", ") + shape.name;
  }
  throw Error(std::string("there is no shape '") + name + "'; there are " + known);
}

cairn::Law law_named(const char* name) {
  const auto& infos = cairn::law_infos();
  std::string known;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (infos[i].name == name || infos[i].python_name == name) return cairn::Law(i);
    known += (i ? ", " : "") + infos[i].python_name;
  }
  throw Error(std::string("there is no law '") + name + "'; there are " + known);
}

// A wrong parameter must leave the scene as it was.
void keep(cairn_scene& scene, cairn_matter::Rule rule) {
  if (rule.meet) cairn::LawTable({""}).set_default(rule.law, rule.parameters);
  scene.matter.rules.push_back(std::move(rule));
}

std::vector<double> parameters_of(std::int32_t n, const double* parameter) {
  if (counted(n) > 0) require(parameter, "parameter");
  return n > 0 ? std::vector<double>(parameter, parameter + n) : std::vector<double>();
}

std::int32_t add_material(cairn_scene& scene, const char* name, const std::string& group) {
  for (const std::string& joint : scene.matter.joints)
    if (joint == name || joint == group) throw Error("'" + joint + "' is the name of a joint; give another name");
  for (std::size_t i = 0; i < scene.matter.materials.size(); ++i)
    if (scene.matter.materials[i] == name && scene.matter.groups[i] == group)
      throw Error(std::string("there is a material '") + name + "' " + (group.empty() ? "" : "of '" + group + "' ") +
                  "already; give it another name");
  scene.matter.materials.emplace_back(name);
  scene.matter.groups.push_back(group);
  return std::int32_t(scene.matter.materials.size()) - 1;
}

// True if a group is that of the nodes of a mesh; of_sides: of its sides.
bool of_nodes(const cairn_matter& matter, const std::string& group) {
  return std::find(matter.meshes.begin(), matter.meshes.end(), group) != matter.meshes.end();
}
bool of_sides(const cairn_matter& matter, int dim, const std::string& group) {
  return std::any_of(matter.meshes.begin(), matter.meshes.end(),
                     [&](const std::string& name) { return cairn::side_group(name, dim) == group; });
}

} // namespace

namespace cairn::api {

void check_word(const cairn_scene& scene, const std::string& word) {
  if (word == "*") return;
  std::string known = "*";
  for (const auto* names : {&scene.matter.materials, &scene.matter.groups})
    for (const std::string& name : *names) {
      if (name == word) return;
      if (!name.empty()) known += ", " + name;
    }
  throw Error("there is no material and no group '" + word + "'; there are " + known);
}

void check_materials(std::int64_t n, const std::int32_t* material, std::size_t known) {
  for (std::int64_t i = 0; i < counted(n); ++i)
    if (material[i] < 0 || std::size_t(material[i]) >= known)
      throw Error("material[" + std::to_string(i) + "] is " + std::to_string(material[i]) + "; there are " +
                  std::to_string(known) + ", counted from 0");
}

std::int64_t add_bodies(Scene& scene, std::int64_t n, const double* position, const double* rotation,
                        const double* velocity, const double* mass, const double* inertia) {
  require(position, "position");
  require(mass, "mass");
  require(inertia, "inertia");
  const int dim = scene.dim;
  counted(n);
  return scene.add_bodies({n, span_of(position, n * dim), span_of(rotation, n * (dim == 2 ? 1 : 4)),
                           span_of(velocity, n * scene.bodies.dofs()), span_of(mass, n),
                           span_of(inertia, n * (dim == 2 ? 1 : 3))});
}

std::int64_t add_contactors(Scene& scene, const char* shape, std::int64_t n, const std::int64_t* body,
                            const std::int32_t* material, const double* radius, const double* offset,
                            const double* direction, const std::int32_t* hull) {
  require(shape, "shape");
  require(body, "body");
  require(material, "material");
  const int dim = scene.dim;
  return scene.add_contactors({n, shape_named(shape), span_of(body, n), span_of(material, n), span_of(radius, n),
                               span_of(offset, n * dim), span_of(direction, n * (dim + 1)), span_of(hull, n)});
}

void drive(Scene& scene, std::int64_t n, const std::int64_t* bodies, std::uint8_t mask, const double* velocity) {
  require(bodies, "bodies");
  scene.drive(span_of(bodies, counted(n)), mask, span_of(velocity, n * scene.bodies.dofs()));
}

bool is_load(const std::string& field) { return field == "force" || field == "damping" || field == "surface_velocity"; }

void set_body_field(Scene& scene, const std::string& name, std::int64_t n, const std::int64_t* bodies,
                    const double* values) {
  require(values, "values");
  if (!is_load(name) && name != "position" && name != "rotation" && name != "velocity")
    throw Error("the field '" + name +
                "' cannot be given; give position, rotation, velocity, force, damping or surface_velocity");
  if (!bodies && n != scene.bodies.count)
    throw Error("n is " + std::to_string(n) + " without ids of bodies; there are " +
                std::to_string(scene.bodies.count));
  std::vector<std::int32_t> items = scene.insertion_order();
  if (bodies) {
    items.clear();
    for (std::int64_t i = 0; i < counted(n); ++i) items.push_back(scene.internal(bodies[i]));
  }
  if (name == "velocity" || name == "surface_velocity") check_speed(name.c_str(), values, n * scene.bodies.dofs());
  scene.bodies.for_each_field([&](auto& field) {
    if (field.name != name) return;
    const int c = field.components;
    for (std::int64_t i = 0; i < n * c; ++i)
      if (!std::isfinite(values[i]) || (name == "damping" && values[i] < 0))
        throw Error(name + "[" + std::to_string(i / c) + "] is " + std::to_string(values[i]) +
                    "; give a finite number" + (name == "damping" ? " of 0 or more" : ""));
    scene.activate(field.need);
    for (std::int64_t i = 0; i < n; ++i) {
      auto* to = field[items[std::size_t(i)]];
      double size = 0;
      for (int k = 0; k < c; ++k) size += values[i * c + k] * values[i * c + k];
      const bool turn = name == "rotation" && c == 4;
      if (turn && !(size > 0)) throw Error("rotation[" + std::to_string(i) + "] is nought; give a quaternion w x y z");
      using T = typename std::decay_t<decltype(field)>::value_type;
      for (int k = 0; k < c; ++k)
        to[k] = T(name == "position" ? values[i * c + k] - scene.origin[k]
                  : turn             ? values[i * c + k] / std::sqrt(size)
                                     : values[i * c + k]);
    }
  });
  if (!is_load(name)) scene.state_assigned();
}

LawTable table_of(const cairn_matter& s, int dim) {
  LawTable table(s.materials, s.groups);
  std::vector<std::int32_t> nodes;
  for (std::size_t i = 0; i < s.groups.size(); ++i)
    if (of_nodes(s, s.groups[i])) nodes.push_back(std::int32_t(i));
  table.keep_apart(nodes);
  const auto& open = s.meet_themselves;
  for (const std::string& name : s.meshes)
    if (std::find(open.begin(), open.end(), name) == open.end()) table.pass_through(name, side_group(name, dim));
  const auto of_joint = [&](const cairn_matter::Rule& rule) {
    return std::find(s.joints.begin(), s.joints.end(), rule.word_a) != s.joints.end();
  };
  std::vector<cairn_matter::Rule> rules = s.rules; // those of joints after all others, so that they count
  std::stable_partition(rules.begin(), rules.end(), [&](const auto& rule) { return !of_joint(rule); });
  for (const auto& rule : rules) {
    if (!rule.meet)
      table.pass_through(rule.word_a, rule.word_b);
    else if (!rule.word_a.empty())
      table.rule(rule.word_a, rule.word_b, rule.law, rule.parameters);
    else if (rule.a < 0)
      table.set_default(rule.law, rule.parameters);
    else
      table.set(rule.a, rule.b, rule.law, rule.parameters);
  }
  table.settle(); // a law that no pair has is no obstacle to a strategy that cannot use it
  return table;
}

} // namespace cairn::api

extern "C" {

const char* cairn_version(void) { return CAIRN_VERSION; }

int32_t cairn_plug_contact_law(const char* library, const char* law, int32_t replace, cairn_error* error) {
  return guarded(error, [&] {
    require(library, "library");
    require(law, "law");
    cairn::plug_law(library, law, {replace != 0, false});
  });
}

int32_t cairn_scene_create(int32_t dim, cairn_scene** scene, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    if (dim != 2 && dim != 3) throw Error("dim is " + std::to_string(dim) + "; it must be 2 or 3");
    *scene = new cairn_scene(dim);
  });
}

void cairn_scene_destroy(cairn_scene* scene) { delete scene; }

int32_t cairn_scene_set_gravity(cairn_scene* scene, const double* gravity, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(gravity, "gravity");
    for (int c = 0; c < scene->scene.dim; ++c)
      if (!std::isfinite(gravity[c])) throw Error("gravity[" + std::to_string(c) + "] is not a finite number");
    std::copy_n(gravity, scene->scene.dim, scene->scene.gravity.begin());
  });
}

int32_t cairn_scene_set_origin(cairn_scene* scene, const double* origin, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(origin, "origin");
    if (scene->scene.bodies.count > 0) throw Error("the origin is set before the first body is added");
    for (int c = 0; c < scene->scene.dim; ++c)
      if (!std::isfinite(origin[c])) throw Error("origin[" + std::to_string(c) + "] is not a finite number");
    std::copy_n(origin, scene->scene.dim, scene->scene.origin.begin());
  });
}

int32_t cairn_scene_set_cell(cairn_scene* scene, const double* lengths, const double* corner, double lean,
                             double shear_rate, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(lengths, "lengths");
    const int dim = scene->scene.dim, last = dim - 1;
    cairn::Cell cell;
    for (int k = 0; k < dim; ++k) {
      if (!(lengths[k] >= 0))
        throw Error("lengths[" + std::to_string(k) + "] is " + std::to_string(lengths[k]) +
                    "; give a length, 0 or inf where the cell is not periodic");
      cell.periodic[k] = lengths[k] > 0 && std::isfinite(lengths[k]);
      if (cell.periodic[k]) cell.vectors[4 * k] = lengths[k];
      if (corner) cell.corner[k] = corner[k];
      if (!std::isfinite(cell.corner[k])) throw Error("corner[" + std::to_string(k) + "] is not a finite number");
    }
    if (!std::isfinite(lean) || !std::isfinite(shear_rate)) throw Error("lean and shear_rate must be finite numbers");
    if ((lean != 0 || shear_rate != 0) && !(cell.periodic[0] && cell.periodic[last]))
      throw Error("lean and shear_rate need a cell that is periodic along its first and its last axis");
    cell.vectors[3 * last] = lean;
    cell.velocity_gradient[3 * last] = shear_rate;
    cairn::set_cell(scene->scene, cell);
  });
}

int32_t cairn_scene_add_material(cairn_scene* scene, const char* name, int32_t* material, cairn_error* error) {
  return cairn_scene_add_material_of_group(scene, name, "", material, error);
}

int32_t cairn_scene_add_material_of_group(cairn_scene* scene, const char* name, const char* group, int32_t* material,
                                          cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(name, "name");
    require(group, "group");
    require(material, "material");
    if (of_nodes(scene->matter, group) || of_sides(scene->matter, scene->scene.dim, group))
      throw Error(std::string("the group '") + group + "' is of a deformable body; give another name");
    *material = add_material(*scene, name, group);
  });
}

int32_t cairn_scene_set_law(cairn_scene* scene, int32_t material_a, int32_t material_b, const char* law,
                            int32_t parameters, const double* parameter, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(law, "law");
    const int known = int(scene->matter.materials.size());
    const bool standard = material_a == -1 && material_b == -1;
    for (int m : {material_a, material_b})
      if (!standard && (m < 0 || m >= known))
        throw Error("there is no material " + std::to_string(m) + "; there are " + std::to_string(known) +
                    ", counted from 0");
    keep(*scene, {material_a, material_b, "", "", true, law_named(law), parameters_of(parameters, parameter)});
  });
}

int32_t cairn_scene_set_rule(cairn_scene* scene, const char* a, const char* b, const char* law, int32_t parameters,
                             const double* parameter, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(a, "a");
    require(b, "b");
    for (const char* word : {a, b}) check_word(*scene, word);
    cairn_matter::Rule rule{-1, -1, a, b, law != nullptr, {}, {}};
    if (law) {
      rule.law = law_named(law);
      rule.parameters = parameters_of(parameters, parameter);
    }
    keep(*scene, std::move(rule));
  });
}

int32_t cairn_scene_add_bodies(cairn_scene* scene, int64_t n, const double* position, const double* rotation,
                               const double* velocity, const double* mass, const double* inertia, int64_t* first,
                               cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    const auto id = add_bodies(scene->scene, n, position, rotation, velocity, mass, inertia);
    if (first) *first = id;
  });
}

int32_t cairn_scene_add_contactors(cairn_scene* scene, const char* shape, int64_t n, const int64_t* body,
                                   const int32_t* material, const double* radius, const double* offset,
                                   const double* direction, int64_t* first, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(material, "material");
    check_materials(n, material, scene->matter.materials.size());
    const auto id = add_contactors(scene->scene, shape, n, body, material, radius, offset, direction, nullptr);
    if (first) *first = id;
  });
}

int32_t cairn_scene_add_hull_contactors(cairn_scene* scene, const char* shape, int64_t n, const int64_t* body,
                                        const int32_t* material, const int32_t* hull, const double* offset,
                                        int64_t* first, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(material, "material");
    require(hull, "hull");
    check_materials(n, material, scene->matter.materials.size());
    const auto id = add_contactors(scene->scene, shape, n, body, material, nullptr, offset, nullptr, hull);
    if (first) *first = id;
  });
}

int32_t cairn_scene_drive(cairn_scene* scene, int64_t n, const int64_t* bodies, uint8_t mask, const double* velocity,
                          cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    drive(scene->scene, n, bodies, mask, velocity);
  });
}

int32_t cairn_scene_set_body_field(cairn_scene* scene, const char* name, int64_t n, const int64_t* bodies,
                                   const double* values, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(name, "name");
    set_body_field(scene->scene, name, n, bodies, values);
  });
}

int32_t cairn_scene_add_mesh(cairn_scene* scene, const cairn_mesh* mesh, const char* name, int32_t material,
                             int32_t side_material, int64_t* first, int32_t* number, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(mesh, "mesh");
    require(name, "name");
    const std::int32_t chosen[] = {material, side_material < 0 ? material : side_material};
    check_materials(2, chosen, scene->matter.materials.size());
    const std::string group = name, sides = cairn::side_group(group, scene->scene.dim);
    if (group.empty() || group == "*") throw Error("a mesh is named '" + group + "'; give it a name of its own");
    for (const auto* words : {&scene->matter.materials, &scene->matter.groups})
      for (const std::string& word : *words)
        if (word == group || word == sides)
          throw Error("the name '" + word + "' is taken already; give the mesh another one");
    const int own = int(scene->matter.materials.size());
    cairn::Scene changed = scene->scene;
    scene->meshes.push_back(cairn::add_mesh_parts(changed, mesh->draft, group, own, own + 1));
    const std::int64_t id = scene->meshes.back().node_ids.front();
    scene->scene = std::move(changed);
    for (int k = 0; k < 2; ++k) {
      scene->matter.materials.push_back(std::string(scene->matter.materials[std::size_t(chosen[k])]));
      scene->matter.groups.push_back(k == 0 ? group : sides);
    }
    scene->matter.meshes.push_back(group);
    if (mesh->draft.self_contact) scene->matter.meet_themselves.push_back(group);
    if (first) *first = id;
    if (number) *number = std::int32_t(scene->meshes.size()) - 1;
  });
}

} // extern "C"
