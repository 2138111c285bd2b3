// Contacts as Newton's method of deformable bodies sees them, pass by pass.
#pragma once
#include "../../solvers/solver_options.hpp"
#include "nscd.hpp"

namespace cairn {

class ContactPasses {
public:
  virtual ~ContactPasses() = default;
  virtual void give() = 0;                              // impulses to the nodes
  virtual void again(const SolverOptions& options) = 0; // prepared and solved with the tangent at hand
  virtual void end() = 0;                               // memory is that of the begin of the step again
  // Tells the other processes of an error of this one, empty: none. Throws if another process has one.
  virtual void agree(const std::string& fault) { (void)fault; }
};

} // namespace cairn
