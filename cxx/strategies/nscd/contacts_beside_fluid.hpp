// Contacts as the passes of an incompressible liquid see them: those of one process, or of several ranks.
#pragma once
#include "../../base/field.hpp"

namespace cairn {

class ContactsBesideFluid {
public:
  virtual ~ContactsBesideFluid() = default;
  // Velocities that the solution at hand gives to the bodies of the liquid's scene (dofs, bodies).
  virtual const Array<double>& velocities() = 0;
  virtual void keep() = 0;    // their memory at the begin of the step
  virtual void again() = 0;   // prepared and solved with the free velocities that the pressure gave
  virtual void restore() = 0; // the memory that was kept
};

} // namespace cairn
