// Moments of contacts between rigid bodies and meshes: a mesh bears them where a contact rests on one of its edges or
// faces, which turns with its nodes.
#include "face_moments.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "../laws/law_info.hpp"

namespace cairn {

// True if a law resists turning where a single contact has nothing else to hold it: bonds at several points need no
// such law.
bool resists_turning(const AssemblyInput& in, const LawTable::Entry& e) {
  const LawInfo& law = law_infos()[std::size_t(e.law)];
  if (law.components(in.dim()) == in.dim() || law.keeps || law.joins) return false;
  bool told = false, any = false; // by parameters of this name
  for (std::size_t k = 0; k < law.parameters.size(); ++k) {
    if (law.parameters[k].name != "rolling" && (law.parameters[k].name != "twisting" || in.dim() == 2)) continue;
    told = true;
    any = any || e.params[k] > 0;
  }
  for (int k = e.first_curve; k < e.first_curve + e.curves; ++k)
    any = any || law.parameters[std::size_t(in.laws->curves()[std::size_t(k)].parameter)].name != "mu";
  return any || !told;
}

// A node or a point of a mesh has a place and no spin, and of two meshes neither has a body's.
void refuse_moment(const AssemblyInput& in, const ContactClasses& classes, std::int64_t i) {
  const std::int32_t a = in.candidates->contactor_a[i], b = in.candidates->contactor_b[i];
  const bool mesh_a = classes.is_mapped(a), mesh_b = classes.is_mapped(b);
  if (mesh_a != mesh_b && in.meshes->turns(mesh_a ? a : b)) return;
  const auto told = [&](std::int32_t contactor) {
    if (!classes.is_mapped(contactor)) return "body " + std::to_string(*in.bodies->id[in.body(contactor)]);
    return std::string(mesh_a && mesh_b ? "" : "a node of ") + "the mesh '" +
           in.meshes->meshes[std::size_t(in.meshes->mesh_of(contactor))].model.name + "'";
  };
  const auto material = [&](std::int32_t contactor) {
    return "'" + in.laws->name(*in.contactors->material[contactor]) + "'";
  };
  throw std::invalid_argument("law " + classes.law(i).python_name + " acts by a moment, and between " + told(a) +
                              " and " + told(b) + " none can be borne: nodes have no spin; give materials " +
                              material(a) + " and " + material(b) + " another law, such as Coulomb" +
                              (mesh_a && mesh_b ? "" : ", or let an edge or a face of the mesh touch a round body"));
}

} // namespace cairn
