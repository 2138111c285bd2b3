// Moments of contacts between rigid bodies and meshes: a mesh bears them where a contact rests on one of its edges or
// faces, which turns with its nodes.
#include <algorithm>
#include <stdexcept>
#include <string>

#include "interaction_state.hpp"

namespace cairn {

// True if a law resists turning where a single contact has nothing else to hold it: bonds at several points need no
// such law.
bool Interactions::State::resists_turning(const LawTable::Entry& e) const {
  const LawInfo& law = law_infos()[std::size_t(e.law)];
  if (law.components(dim()) == dim() || law.keeps || law.joins) return false;
  bool told = false, any = false; // by parameters of this name
  for (std::size_t k = 0; k < law.parameters.size(); ++k) {
    if (law.parameters[k].name != "rolling" && (law.parameters[k].name != "twisting" || dim() == 2)) continue;
    told = true;
    any = any || e.params[k] > 0;
  }
  for (int k = e.first_curve; k < e.first_curve + e.curves; ++k)
    any = any || law.parameters[std::size_t(laws->curves()[std::size_t(k)].parameter)].name != "mu";
  return any || !told;
}

// A node or a point of a mesh has a place and no spin, and of two meshes neither has a body's.
void Interactions::State::refuse_moment(std::int64_t i) const {
  const std::int32_t a = candidates->contactor_a[i], b = candidates->contactor_b[i];
  const bool mesh_a = kind[a] & mapped, mesh_b = kind[b] & mapped;
  if (mesh_a != mesh_b && meshes->turns(mesh_a ? a : b)) return;
  const auto told = [&](std::int32_t contactor) {
    if (!(kind[contactor] & mapped)) return "body " + std::to_string(*bodies->id[body(contactor)]);
    return std::string(mesh_a && mesh_b ? "" : "a node of ") + "the mesh '" +
           meshes->meshes[std::size_t(meshes->mesh_of(contactor))].model.name + "'";
  };
  const auto material = [&](std::int32_t contactor) {
    return "'" + laws->name(*contactors->material[contactor]) + "'";
  };
  throw std::invalid_argument("law " + law_infos()[std::size_t(laws->entry(entry[i]).law)].python_name +
                              " acts by a moment, and between " + told(a) + " and " + told(b) +
                              " none can be borne: nodes have no spin; give materials " + material(a) + " and " +
                              material(b) + " another law, such as Coulomb" +
                              (mesh_a && mesh_b ? "" : ", or let an edge or a face of the mesh touch a round body"));
}

// Lays out the spins of sides: a rigid body turns against the face of a mesh, while between meshes several points carry
// moments. Bonds that hold fast have none: near a node bonded to one side, the next side would turn the body about that
// node with almost no lever, and load the bond as much as that takes.
void Interactions::State::lay_out_spins(cairn_batch& b) {
  if (b.components == dim() || b.mapped_a == b.mapped_b || law_infos()[b.law].holds) return;
  const auto numbers = 4 * dim() * (b.components - dim()) * std::int64_t(b.count);
  b.turns = scratch.take<std::int32_t>(b.count);
  (b.mapped_a ? b.spin_a : b.spin_b) = scratch.take<double>(numbers);
}

// The spin of the face about the axes of the contact.
void Interactions::State::fill_spin(const cairn_batch& b, int side, int lane, std::int64_t i, const Mapping& m) {
  const int d = dim(), rotations = b.components - d;
  b.turns[lane] = meshes->turns(side ? candidates->contactor_b[i] : candidates->contactor_a[i]) && m.mean < 0;
  double rows[4][3][3] = {}, axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  if (b.turns[lane]) meshes->spin(*nodes, m, rows);
  if (d == 3) axes_of(b, d, lane, axes);
  for (int k = 0; k < rotations; ++k)
    for (int j = 0; j < 4; ++j)
      for (int l = 0; l < d; ++l) {
        double sum = 0;
        for (int a = 0; a < rotations; ++a) sum += axes[k][a] * rows[j][a][l];
        spin_of(b, d, side, lane, j, l, k) = sum;
      }
}

// The moment of a contact to the nodes of the face that it turns against, as a couple.
void Interactions::State::give_moment(const cairn_batch& b, int lane) const {
  const int d = dim(), side = b.mapped_b ? 1 : 0;
  const std::int32_t which = (side ? b.body_b : b.body_a)[lane], *node = side ? b.node_b : b.node_a;
  MeshBody& mesh = meshes->meshes[std::size_t(which)];
  for (int j = 0; b.turns[lane] && j < (side ? b.nodes_b : b.nodes_a); ++j)
    system.condensed[which].each_node(std::size_t(node[j * b.count + lane]), [&](std::int32_t at, double) {
      for (int l = 0; l < d; ++l)
        for (int k = 0; k < b.components - d; ++k)
          mesh.impulse[std::size_t(d * (at - mesh.node(0)) + l)] +=
              (side ? -1 : 1) * spin_of(b, d, side, lane, j, l, k) * b.r[(d + k) * b.count + lane];
    });
}

} // namespace cairn
