// Deformable bodies in the step: where they stand among the bodies of the scene, and their part of the balance.
#include "../base/call.hpp"
#include "simulation.hpp"

namespace cairn {

void Simulation::add_mesh(MeshModel model) {
  if (model.dim != scene.dim)
    throw Error("the mesh '" + model.name + "' has " + std::to_string(model.dim) + " dimensions, the scene " +
                std::to_string(scene.dim));
  if (!scene.has(Need::force)) scene.activate(Need::force);
  meshes.meshes.emplace_back(std::move(model));
  meshes_placed_ = -1;
}

void Simulation::place_meshes() {
  if (meshes.empty() || meshes_placed_ == scene.order_version()) return;
  meshes.place(scene.bodies, scene.insertion_order());
  meshes_placed_ = scene.order_version();
}

void Simulation::follow_meshes() {
  if (meshes.empty()) return;
  place_meshes();
  facet_bodies_.clear();
  facet_vertices_.clear();
  for (const MeshBody& mesh : meshes.meshes) {
    mesh.follow(scene.bodies);
    if (scene.dim == 2) continue;
    facet_bodies_.insert(facet_bodies_.end(), mesh.sides.begin(), mesh.sides.end());
    mesh.facet_vertices(scene.bodies, facet_vertices_);
  }
  if (!facet_bodies_.empty()) scene.move_facets(facet_bodies_, facet_vertices_);
}

// The nodes of meshes count as points of mass in account(); what else they store and dissipate, here.
void Simulation::account_for_meshes() {
  if (meshes.empty()) return;
  for (MeshBody& mesh : meshes.meshes) {
    const MeshWork& w = mesh.work;
    mesh.commit();
    energy.stored += w.stored;
    energy.kinetic += w.kinetic;
    energy.work_external += w.elastic + w.damping + w.inertia;
    energy.dissipated_bulk += w.damping;
    energy.dissipated_material += w.material;
    energy.dissipated_integrator += w.elastic - w.stored_change - w.material + w.inertia - w.kinetic_change;
  }
}

} // namespace cairn
