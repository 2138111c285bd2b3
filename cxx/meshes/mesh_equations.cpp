#include "mesh_equations.hpp"

#include <cstdio>
#include <string>

#include "../base/call.hpp"

namespace cairn {

// True if the mass of a dof is below the rounding of the stiffness that A adds to it: such a mass cannot hold a mesh
// without supports.
bool MeshEquations::lost_mass(std::int64_t row) const {
  return !model_.stiffness.value.empty() &&
         matrices_.on_diagonal(model_.mass.value, row) <
             1e-14 * step_.scheme.stiffness * matrices_.on_diagonal(model_.stiffness.value, row);
}

void MeshEquations::refuse(const SoeStatus& status) const {
  std::string where;
  if (status.row >= model_.dofs())
    where = " at a rigid part";
  else if (status.row >= 0)
    where = " at node " + std::to_string(status.row / model_.dim) + ", dof " +
            std::string(1, "xyz"[status.row % model_.dim]);
  if (status.kind == SoeStatus::not_finite)
    throw Error("the matrix of the mesh '" + model_.name + "' holds a number that is not finite" + where +
                ": check stiffness, mass and step");
  if (status.kind == SoeStatus::too_large)
    throw Error("the matrix of the mesh '" + model_.name + "' is too large for this build of its solver");
  if (status.row >= 0 && status.row < model_.dofs() && lost_mass(status.row)) {
    char step[32];
    std::snprintf(step, sizeof step, "%g", step_.scheme.h);
    throw Error(
        "the mass of the mesh '" + model_.name + "' is lost in rounding" + where + ": a step of " + step +
        " s is more than 1e7 times what a wave takes through a cell; give a shorter step, thicker cells, or hold "
        "the mesh");
  }
  throw Error("the matrix of the mesh '" + model_.name + "' is not positive definite" + where +
              ": a mass, a stiffness or a held dof is missing");
}

std::unique_ptr<Soe> MeshEquations::make_soe() const {
  return model_.ties.empty() ? Soe::make(model_.mass, model_.options) : model_.ties.make_soe();
}

SoeStatus MeshEquations::factor(Soe& soe, const double* value) const {
  return soe.factor(model_.ties.empty() ? value : model_.ties.reduced(value));
}

void MeshEquations::solve_mass(double* b) {
  for (std::int64_t i = 0; i < model_.dofs(); ++i)
    if (model_.held[i]) b[i] = 0;
  solve_bound_mass(b);
}

// Like solve_mass, except that held dofs bring their given x; rigid parts count where they stand now.
void MeshEquations::solve_bound_mass(double* b) {
  if (matrices_.lumped_mass && model_.ties.empty()) { // each dof for itself
    for (std::int64_t i = 0; i < model_.dofs(); ++i)
      if (!model_.held[i]) b[i] /= matrices_.lumped[i];
    return;
  }
  if (!mass_ || model_.ties.rigid_parts_turn()) {
    if (!mass_) mass_ = make_soe();
    if (const SoeStatus status = factor(*mass_, model_.mass.value.data()); !status) refuse(status);
  }
  model_.ties.empty() ? mass_->solve(b) : model_.ties.solve(*mass_, b);
}

} // namespace cairn
