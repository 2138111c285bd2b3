#include "reshape_watches.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "../base/call.hpp"

namespace cairn {

std::int64_t mesh_of_body(const Simulation& s, const Transforms& transforms, std::int64_t id) {
  for (std::size_t m = 0; m < s.meshes.meshes.size(); ++m)
    if (transforms.former_id(s.meshes.meshes[m]) == id) return std::int64_t(m);
  return -1;
}

void ReshapeWatches::add(Simulation& s, const Transforms& transforms, ReshapeWatch watch) {
  if (watch.bodies.empty()) throw Error("there is no body to watch: give ids of rigid bodies");
  for (const auto& [name, value] : {std::pair{"force", watch.force}, std::pair{"stress", watch.stress}})
    if (!(value > 0))
      throw Error(std::string(name) + " is " + std::to_string(value) + "; give a threshold above 0, or inf: none");
  if (std::isinf(watch.force) && std::isinf(watch.stress))
    throw Error("there is no threshold: give force [N], stress [Pa], or both");
  if (!(watch.back >= 0) || std::isinf(watch.back))
    throw Error("back is " + std::to_string(watch.back) + "; give a finite force above 0, or 0: never rigid again");
  for (const std::int64_t id : watch.bodies)
    if (mesh_of_body(s, transforms, id) < 0) transforms.check(s, id, watch.draft);
  watch.volume = watch.draft.volume();
  watches_.push_back(std::move(watch));
}

void ReshapeWatches::weigh(Simulation& s, const Transforms& transforms) {
  rigid_.clear();
  of_rigid_.clear();
  meshes_.clear();
  of_mesh_.clear();
  for (std::size_t w = 0; w < watches_.size(); ++w)
    for (const std::int64_t id : watches_[w].bodies) {
      if (s.scene.find_body(id) >= 0) {
        rigid_.push_back(id);
        of_rigid_.push_back(w);
      } else if (const std::int64_t mesh = mesh_of_body(s, transforms, id); mesh >= 0 && watches_[w].back > 0) {
        meshes_.push_back(std::size_t(mesh));
        of_mesh_.push_back(w);
      }
    }
  loads_.read(s, rigid_, meshes_);
}

void ReshapeWatches::look(Simulation& s, Transforms& transforms) {
  if (watches_.empty()) return;
  weigh(s, transforms);
  above_.clear();
  below_.clear();
  for (std::size_t i = 0; i < rigid_.size(); ++i) {
    const ReshapeWatch& of = watches_[of_rigid_[i]];
    const ContactLoad& load = loads_.of_bodies[i];
    if (load.force > of.force || (std::isfinite(of.stress) && load.stress(s.scene.dim, of.volume) > of.stress))
      above_.push_back(i);
  }
  for (std::size_t i = 0; i < meshes_.size(); ++i)
    if (loads_.of_meshes[i].force < watches_[of_mesh_[i]].back)
      below_.push_back(transforms.former_id(s.meshes.meshes[meshes_[i]]));
  for (const std::size_t i : above_) {
    const ReshapeWatch& of = watches_[of_rigid_[i]];
    if (s.scene.find_body(rigid_[i]) >= 0) // two watches may look at it
      transforms.deform(s, rigid_[i], of.draft, "body " + std::to_string(rigid_[i]), of.node_material,
                        of.side_material);
  }
  for (const std::int64_t id : below_)
    if (const std::int64_t mesh = mesh_of_body(s, transforms, id); mesh >= 0) transforms.rigidify(s, std::size_t(mesh));
}

} // namespace cairn
