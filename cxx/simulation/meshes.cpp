// Deformable bodies in the step: where they stand, and their part of the balance.
#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../fluid/fluid.hpp"
#include "simulation.hpp"

namespace cairn {

void Simulation::add_mesh(MeshModel model) {
  if (model.dim != scene.dim)
    throw Error("the mesh '" + model.name + "' has " + std::to_string(model.dim) + " dimensions, the scene " +
                std::to_string(scene.dim));
  const MeshParts* nodes = model.node_ids.empty() ? nullptr : scene.part(model.node_ids.front());
  if (!nodes) throw Error("the nodes of the mesh '" + model.name + "' are not in the scene");
  model.number = nodes->mesh;
  meshes.meshes.emplace_back(std::move(model));
  meshes_placed_ = -1;
}

void Simulation::remove_bodies(std::span<const std::int64_t> ids) {
  std::vector<std::int64_t> going(ids.begin(), ids.end());
  std::sort(going.begin(), going.end());
  const auto goes = [&](std::int64_t id) { return std::binary_search(going.begin(), going.end(), id); };
  std::vector<std::size_t> gone;
  for (std::size_t m = 0; m < meshes.meshes.size(); ++m) {
    const MeshModel& model = meshes.meshes[m].model;
    std::int64_t all = 0, some = 0, stays = -1;
    for (const auto* of : {&model.node_ids, &model.point_ids, &model.side_ids})
      for (const std::int64_t id : *of) {
        ++all;
        goes(id) ? void(++some) : void(stays = id);
      }
    if (some == 0) continue;
    if (some < all)
      throw Error("body " + std::to_string(stays) + " of the mesh '" + model.name + "' would stay of " +
                  std::to_string(all) + ": a deformable body is removed with all of its nodes, points and sides");
    gone.push_back(m);
  }
  std::vector<double> room;
  if (fluid) room = fluid->room_without(scene, going);
  scene.remove_bodies(ids);
  if (fluid) fluid->fill_room(room);
  for (std::size_t k = gone.size(); k-- > 0;) meshes.meshes.erase(gone[k]);
  if (meshes.empty()) meshes = {}; // nothing is mapped from them
  meshes_placed_ = -1;
  forget_contacts();
}

void Simulation::account_for_reshaping(double kinetic, double stored) {
  energy.kinetic += kinetic;
  energy.stored += stored;
  energy.dissipated_reshaping -= kinetic + stored;
  energy.turned_over += std::abs(kinetic) + std::abs(stored);
  energy.in_play = energy.largest_kinetic + energy.turned_over;
  report.energy = energy;
}

void Simulation::place_meshes() {
  if (meshes.empty() || meshes_placed_ == scene.order_version()) return;
  if (!scene.meshes_in_order()) { // contacts of the last step go by numbers of contactors, too
    std::vector<std::int64_t> ids;
    const auto each = [&](auto&& f) {
      for (auto* of : {&candidates.contactor_a, &candidates.contactor_b})
        for (std::int64_t i = 0; i < candidates.count; ++i) f((*of)[std::size_t(i)]);
    };
    each([&](std::int32_t c) { ids.push_back(*scene.contactors.id[c]); });
    scene.put_meshes_in_order();
    auto id = ids.begin();
    each([&](std::int32_t& c) { c = contactor(*id++); });
  }
  meshes.place(scene.nodes, scene.contactors);
  meshes_placed_ = scene.order_version();
}

void Simulation::follow_meshes() {
  if (meshes.empty()) return;
  place_meshes();
  meshes.follow(scene.nodes, scene.contactors);
  if (!meshes.facets().empty()) scene.move_facets(meshes.facets(), meshes.facet_vertices());
}

NewtonSeconds Simulation::newton_seconds() const {
  NewtonSeconds sum = pass_seconds;
  for (const MeshBody& mesh : meshes.meshes) {
    sum.assembly += mesh.newton_seconds.assembly;
    sum.factorisation += mesh.newton_seconds.factorisation;
    sum.balance += mesh.newton_seconds.balance;
  }
  return sum;
}

// Adds the elastic energy and dissipation of meshes to the balance; account() already counts their nodes as point
// masses.
void Simulation::account_for_meshes() {
  if (meshes.empty()) return;
  for (MeshBody& mesh : meshes.meshes) {
    const MeshWork& w = mesh.work;
    energy.stored += w.stored;
    energy.kinetic += w.kinetic;
    energy.work_external += w.elastic + w.damping + w.inertia + w.warmed - w.binding + w.beyond - w.driven;
    energy.work_driven += w.driven;
    energy.dissipated_bulk += w.drag;
    energy.dissipated_material += w.material;
    energy.absorbed += w.absorbed;
    energy.dissipated_integrator += w.integrator + w.beyond + (w.damping - w.drag);
    energy.closure +=
        w.kinetic_change + w.stored_change + w.material + w.absorbed + w.integrator + w.binding - w.elastic - w.inertia;
    energy.turned_over += std::abs(w.elastic) + std::abs(w.damping) + std::abs(w.inertia) + std::abs(w.warmed);
  }
  energy.in_play = energy.largest_kinetic + energy.turned_over;
}

} // namespace cairn
