// Messages and advice where the stresses of a mesh are not found.
#include "../base/call.hpp"
#include "mesh_stresses.hpp"

namespace cairn {

// Advice for stresses that are not found: accelerations of a body lighter than its contacts hold lead too far.
std::string MeshStresses::advice() const {
  if (history_.past.empty()) return ": give a smaller dt";
  return ": give a smaller dt, Theta(), or Newmark with beta = gamma/2, which no acceleration moves that knows no "
         "contact";
}

std::string MeshStresses::remedy() const {
  return model_.bulk->remedy() + (jumps_.given.empty() ? "" : ", Theta(), or Newmark with beta = gamma/2");
}

std::string MeshStresses::describe(const BulkResult& fault) const {
  return "the mesh '" + model_.name + "': " + model_.bulk->describe(fault);
}

void MeshStresses::fail(const BulkResult& fault, const std::string& where, const std::string& advice) const {
  if (!model_.bulk->shorter_helps(fault))
    throw Error(describe(fault) + where + ": " + model_.bulk->remedy_of(fault)); // parts of the step end so, too
  throw StepTooLong(describe(fault) + where + advice);
}

} // namespace cairn
