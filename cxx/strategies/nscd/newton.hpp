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
  // What this process met by itself; empty: no error. Throws where another process met one.
  virtual void agree(const std::string& fault) { (void)fault; }
};

} // namespace cairn
