// Messages and advice where the stresses of a mesh are not found.
#include "../base/call.hpp"
#include "mesh_body.hpp"

namespace cairn {

// Advice for stresses that are not found: accelerations of a body lighter than its contacts hold lead too far.
std::string MeshBody::advice() const {
  if (past_.empty()) return ": give a smaller dt";
  return ": give a smaller dt, Theta(), or Newmark with beta = gamma/2, which no acceleration moves that knows no "
         "contact";
}

std::string MeshBody::remedy() const {
  return model.bulk->remedy() + (given_jump_.empty() ? "" : ", Theta(), or Newmark with beta = gamma/2");
}

std::string MeshBody::describe(const BulkResult& fault) const {
  return "the mesh '" + model.name + "': " + model.bulk->describe(fault);
}

void MeshBody::fail(const BulkResult& fault, const std::string& where, const std::string& advice) const {
  if (!model.bulk->shorter_helps(fault))
    throw Error(describe(fault) + where + ": " + model.bulk->remedy_of(fault)); // parts of the step end so, too
  throw StepTooLong(describe(fault) + where + advice);
}

} // namespace cairn
