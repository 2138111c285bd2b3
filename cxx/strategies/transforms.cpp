#include "transforms.hpp"

#include <algorithm>
#include <cmath>

#include "../base/call.hpp"

namespace cairn {
namespace {

std::vector<double> copied(const double* from, int n) { return {from, from + n}; }

// Places of the nodes of a mesh, absolute, and their velocities.
void read_nodes(Simulation& s, const MeshBody& mesh, std::vector<double>& x, std::vector<double>& v) {
  const std::int64_t n = mesh.model.dofs();
  x.resize(std::size_t(n));
  v.resize(std::size_t(n));
  for (std::int64_t i = 0; i < n; ++i) {
    x[std::size_t(i)] = s.scene.nodes.position[mesh.first_node()][i] + s.scene.origin[std::size_t(i % s.scene.dim)];
    v[std::size_t(i)] = s.scene.nodes.velocity[mesh.first_node()][i];
  }
}

bool turns_far(const MeshDraft& d) {
  return std::any_of(d.cells.begin(), d.cells.end(), [](const MeshDraft::Cells& c) {
    return c.solid.material && c.solid.kinematics != Kinematics::small;
  });
}

void touch_all_around(MeshDraft& d) {
  const std::vector<std::int32_t> sides = d.boundary();
  if (d.contact_nodes.empty()) {
    for (const std::int32_t i : sides)
      if (i >= 0) d.contact_nodes.push_back(i);
    std::sort(d.contact_nodes.begin(), d.contact_nodes.end());
    d.contact_nodes.erase(std::unique(d.contact_nodes.begin(), d.contact_nodes.end()), d.contact_nodes.end());
  }
  if (d.side_nodes.empty()) d.side_nodes = sides;
}

std::vector<std::int64_t> parts_of(const MeshModel& m) {
  std::vector<std::int64_t> out = m.node_ids;
  out.insert(out.end(), m.point_ids.begin(), m.point_ids.end());
  out.insert(out.end(), m.side_ids.begin(), m.side_ids.end());
  return out;
}

// Refuses a body that is an end of a joint, which is between two rigid bodies and would go with it.
void check_unjoined(const LawTable& laws, std::int64_t id, std::int32_t material) {
  const int entry = laws.find(material, material);
  if (entry >= 0 && law_infos()[std::size_t(laws.entry(entry).law)].joins)
    throw Error(
        "body " + std::to_string(id) +
        " is an end of a joint, which a mesh in its place would not have: make bodies without joints deformable");
}

// Refuses what no free rigid body can be, or what these contactors cannot be given to, in a scene of its own.
void check_shape(const Scene& scene, const OtherShape& shape, const NodesMotion& motion) {
  bool free = shape.mass > 0 && std::isfinite(shape.mass);
  for (const double j : shape.inertia) free = free && j > 0 && std::isfinite(j);
  if (!free) throw Error("the shape is not of a free body: give a finite mass and moments of inertia above 0");
  Scene probe(scene.dim);
  probe.origin = scene.origin;
  probe.contactors.hulls = scene.contactors.hulls;
  double rotation[4];
  stored_rotation(scene.dim, shape.axes, rotation);
  const std::int64_t id = probe.add_bodies({1,
                                            {motion.centre.data(), std::size_t(scene.dim)},
                                            {rotation, std::size_t(scene.dim == 2 ? 1 : 4)},
                                            {},
                                            {&shape.mass, 1},
                                            shape.inertia});
  shape.add_contactors(probe, id);
  if (probe.contactors.count == 0) throw Error("the shape has no contactors: a body of it would touch nothing");
}

// Accounts for the change of kinetic and stored energy [J]; the balance begins with the first step, from the bodies as
// they are then.
void account(Simulation& s, double kinetic, double stored) {
  if (s.steps > 0) s.account_for_reshaping(kinetic, stored);
}

} // namespace

void Transforms::came_in(const Scene& scene, std::int64_t first) {
  if (first < 0) within_ = scene.next_body_id;
  start_.erase(start_.lower_bound(first), start_.end()); // of others, that a restart took back
  unknown_.erase(unknown_.lower_bound(first), unknown_.end());
  if (!scene.bodies.rotation.active) return;
  const int n = scene.bodies.rotation.components;
  for (const std::int32_t b : scene.insertion_order()) {
    const double* r = scene.bodies.rotation[b];
    const bool upright = std::all_of(r + n / 4, r + n, [](double x) { return std::abs(x) <= 0; });
    if (*scene.bodies.id[b] < first || upright) continue;
    start_[*scene.bodies.id[b]] = rotation_of(scene.dim, r);
  }
}

void Transforms::restarted(const Scene& scene) {
  start_.erase(start_.lower_bound(within_), start_.end());
  unknown_.clear();
  for (const std::int64_t id : scene.bodies.id.values)
    if (id >= within_) unknown_.insert(id);
}

Transforms::Former Transforms::former_of(const Scene& scene, std::int64_t id) const {
  const std::int32_t b = scene.find_body(id);
  if (b < 0) throw Error("there is no rigid body " + std::to_string(id) + ": give the number of one that is there");
  if (unknown_.count(id))
    throw Error(
        "how body " + std::to_string(id) +
        " stood as it came in is not known after a restart, since that was within a run: make bodies deformable "
        "that the scene was made with, or before the checkpoint");
  const Bodies& bodies = scene.bodies;
  Former out;
  out.id = id;
  out.mass = *bodies.mass[b];
  out.inertia = copied(bodies.inertia[b], bodies.inertia.components);
  bool free = std::isfinite(out.mass) && !(bodies.driven.active && *bodies.driven[b]);
  for (const double j : out.inertia) free = free && std::isfinite(j);
  if (!free)
    throw Error("body " + std::to_string(id) +
                " is held or driven: a deformable body in its place would fall; give it free dofs");
  if (const auto at = start_.find(id); at != start_.end()) out.start = at->second;
  for (int k = 0; bodies.surface_velocity.active && k < bodies.dofs(); ++k)
    if (bodies.surface_velocity[b][k] < 0 || bodies.surface_velocity[b][k] > 0)
      throw Error("body " + std::to_string(id) +
                  " has a surface velocity, which a deformable body cannot have: leave one of both out");
  if (bodies.damping.active) out.damping = *bodies.damping[b];
  if (bodies.force.active) out.force = copied(bodies.force[b], bodies.dofs());
  out.pushes = std::any_of(out.force.begin(), out.force.end(), [](double f) { return f < 0 || f > 0; });
  const Contactors& c = scene.contactors;
  for (const std::int32_t i : scene.contactor_insertion_order()) {
    if (*c.body[i] != b) continue;
    Shape shape;
    shape.shape = cairn::Shape(*c.shape[i]);
    shape.material = *c.material[i];
    shape.radius = *c.radius[i];
    if (c.hull.active) shape.hull = *c.hull[i];
    if (c.offset.active) shape.offset = copied(c.offset[i], scene.dim);
    if (c.direction.active && info(shape.shape).directed) shape.direction = copied(c.direction[i], scene.dim + 1);
    out.shapes.push_back(std::move(shape));
  }
  if (out.shapes.empty())
    throw Error("body " + std::to_string(id) + " has no contactors: a mesh in its place would touch what it did not");
  return out;
}

// Adds the mesh to a temporary scene, and to the simulation while its strategy checks it.
void Transforms::check_draft(const Simulation& s, const MeshDraft& d, std::int64_t id) const {
  Scene probe(s.scene.dim);
  probe.origin = s.scene.origin;
  auto& meshes = const_cast<Simulation&>(s).meshes.meshes;
  meshes.emplace_back(add_mesh_parts(probe, d, "body " + std::to_string(id), 0, 0));
  try {
    s.strategy().check_scene(s);
    stored_at_begin(meshes.back(), probe.nodes);
  } catch (...) {
    meshes.erase(meshes.size() - 1);
    throw;
  }
  meshes.erase(meshes.size() - 1);
}

// Throws Error unless the draft is a mesh that can replace a body.
void Transforms::check_cells(const MeshDraft& d, std::int64_t id, int dim) {
  const bool ring = std::any_of(d.cells.begin(), d.cells.end(), [](const MeshDraft::Cells& c) {
    return c.solid.material && c.solid.plane == Plane::axisymmetric;
  });
  if (d.cells.empty() || d.mass.n > 0 || d.called || d.dim != dim || (dim == 2 && ring))
    throw Error("the mesh has " + std::to_string(d.dim) + " dimensions" + (ring ? ", axisymmetric" : "") +
                (d.cells.empty() ? " and no cells" : "") + ": give cells of the shape of body " + std::to_string(id) +
                ", of the scene's " + std::to_string(dim));
}

void Transforms::check(const Simulation& s, std::int64_t id, const MeshDraft& draft) const {
  for (const Shape& shape : former_of(s.scene, id).shapes) check_unjoined(s.laws, id, shape.material);
  check_cells(draft, id, s.scene.dim);
  MeshDraft whole = draft;
  touch_all_around(whole);
  check_draft(s, whole, id);
}

std::size_t Transforms::deform(Simulation& s, std::int64_t id, MeshDraft d, const std::string& name,
                               std::int32_t node_material, std::int32_t side_material) {
  const int dim = s.scene.dim;
  Former former = former_of(s.scene, id);
  for (const Shape& shape : former.shapes) check_unjoined(s.laws, id, shape.material);
  check_cells(d, id, dim);
  const std::int64_t gone[] = {id};
  check_unbonded(s, gone, "body " + std::to_string(id));
  const RigidMotion at = motion_of(s.scene, id);
  SparseMatrix mass, stiffness, damping;
  std::vector<double> of_nodes;
  d.assemble(mass, stiffness, damping, of_nodes);
  MeshPlace place = place_of(dim, mass, d.reference, at, former.start, turns_far(d));
  for (MeshDraft::Cells& c : d.cells) c.density *= place.factor;
  for (double& m : mass.value) m *= place.factor;
  d.by_mass += former.damping;
  d.reference = place.reference;
  d.displacement = place.displacement;
  double kinetic = 0;
  d.velocity = velocities_of(dim, mass, place, at, kinetic);
  former.base = place.base;
  former.own = std::move(place.own);
  touch_all_around(d);
  check_draft(s, d, id);
  if (node_material < 0) node_material = former.shapes.front().material;
  if (side_material < 0) side_material = node_material;

  PassedContacts contacts(s, s.report.h, gone);
  s.remove_bodies(gone);
  s.add_mesh(add_mesh_parts(s.scene, d, name, node_material, side_material));
  s.follow_meshes();
  MeshBody& made = s.meshes.meshes.back();
  formers_[made.model.number] = std::move(former);
  contacts.pass_to(s, parts_of(made.model));
  const bool stressed =
      std::any_of(d.cells.begin(), d.cells.end(), [](const auto& c) { return !c.solid.initial_stress.empty(); });
  account(s, kinetic - at.kinetic, stressed ? stored_at_begin(made, s.scene.nodes) : 0);
  return s.meshes.meshes.size() - 1;
}

std::int64_t Transforms::former_id(const MeshBody& mesh) const {
  const auto of = formers_.find(mesh.model.number);
  return of == formers_.end() ? -1 : of->second.id;
}

// The body that a mesh was, or one of another shape with its force and its damping. Throws Error.
Transforms::Former Transforms::replaced(const Simulation& s, const MeshBody& mesh, const OtherShape* shape,
                                        const NodesMotion& motion) const {
  if (std::any_of(mesh.model.held.begin(), mesh.model.held.end(), [](std::uint8_t h) { return h != 0; }))
    throw Error("the mesh '" + mesh.model.name +
                "' has held dofs: a rigid body in its place would not; remove the mesh, add a wall");
  const auto known = formers_.find(mesh.model.number);
  if (known == formers_.end() && !shape)
    throw Error("the mesh '" + mesh.model.name +
                "' was no rigid body before: give the shape of one (cairn_simulation_rigidify_as)");
  Former out = known == formers_.end() ? Former{} : known->second;
  if (!shape) return out;
  check_shape(s.scene, *shape, motion);
  out.id = -1;
  out.shapes.clear();
  out.mass = shape->mass;
  out.inertia = shape->inertia;
  return out;
}

std::int64_t Transforms::rigidify(Simulation& s, std::size_t which, const OtherShape* shape) {
  s.place_meshes();
  MeshBody& mesh = s.meshes.meshes.at(which);
  const int dim = s.scene.dim;
  const std::int32_t number = mesh.model.number;
  std::vector<double> x, v;
  read_nodes(s, mesh, x, v);
  const NodesMotion motion = motion_of_nodes(dim, mesh.model.mass, x, v);
  const Former former = replaced(s, mesh, shape, motion);
  const std::vector<std::int64_t> gone = parts_of(mesh.model);
  check_unbonded(s, gone, "the mesh '" + mesh.model.name + "'");
  const double stored = stored_at_begin(mesh, s.scene.nodes);
  const Rotation axes =
      shape ? shape->axes : times(turn_of(dim, mesh.model.mass, x, former.own, former.base), former.start);

  PassedContacts contacts(s, s.report.h, gone);
  s.remove_bodies(gone);
  double kinetic = 0;
  const std::int64_t id = put_back(s.scene, former, motion, axes, kinetic);
  formers_.erase(number);
  if (shape) {
    shape->add_contactors(s.scene, id);
    start_[id] = axes; // it comes in as it stands
  }
  const std::int64_t there[] = {id};
  contacts.pass_to(s, there);
  account(s, kinetic - motion.kinetic, -stored);
  return id;
}

// The body with the mass and the momentum of the nodes.
std::int64_t Transforms::put_back(Scene& scene, const Former& of, const NodesMotion& motion, const Rotation& axes,
                                  double& kinetic) {
  const int dim = scene.dim;
  std::vector<double> inertia = of.inertia;
  for (double& j : inertia) j *= motion.mass / of.mass;
  const std::vector<double> velocity = velocity_of(dim, motion, axes, inertia, kinetic);
  double rotation[4];
  stored_rotation(dim, axes, rotation);
  const std::int64_t made = scene.add_bodies({1,
                                              {motion.centre.data(), std::size_t(dim)},
                                              {rotation, std::size_t(dim == 2 ? 1 : 4)},
                                              velocity,
                                              {&motion.mass, 1},
                                              inertia});
  for (const Shape& shape : of.shapes) {
    const bool hull = info(shape.shape).is_hull();
    const std::span<const double> radius = hull ? std::span<const double>() : std::span<const double>(&shape.radius, 1);
    const std::span<const std::int32_t> hulls = {&shape.hull, std::size_t(hull)};
    scene.add_contactors(
        {1, shape.shape, {&made, 1}, {&shape.material, 1}, radius, shape.offset, shape.direction, hulls});
  }
  const std::int64_t id = of.id < 0 ? made : of.id;
  if (id != made) scene.give_id(made, id);
  const std::int32_t b = scene.internal(id);
  if (scene.bodies.damping.active) *scene.bodies.damping[b] = of.damping;
  for (std::size_t k = 0; k < of.force.size(); ++k) scene.bodies.force[b][k] = of.force[k];
  return id;
}

void Transforms::load(Simulation& s, double h) {
  for (MeshBody& mesh : s.meshes.meshes) {
    const auto of = formers_.find(mesh.model.number);
    if (of == formers_.end() || !of->second.pushes) continue;
    s.place_meshes();
    std::vector<double> x, v;
    read_nodes(s, mesh, x, v);
    mesh.loads.begin = forces_of_wrench(s.scene.dim, mesh.model.mass, x, of->second.force);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += h * v[i];
    mesh.loads.end = forces_of_wrench(s.scene.dim, mesh.model.mass, x, of->second.force);
  }
}

void Transforms::has_loads(const MeshBody& mesh) {
  if (const auto of = formers_.find(mesh.model.number); of != formers_.end()) of->second.pushes = false;
}

} // namespace cairn
