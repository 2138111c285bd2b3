// Bodies as the solver of a step has them.
#pragma once
#include <vector>

#include "anchor_frames.hpp"
#include "contact_classes.hpp"

namespace cairn {

// Loads velocities with inverse masses of rigid bodies, or condensed meshes, into the records of the solver.
class BodyRecords {
public:
  BodyRecords(const AssemblyInput& in, ContactSystem& system, ContactClasses& classes, const AnchorFrames& frames)
      : in_(in), system_(system), classes_(classes), frames_(frames) {}
  void load();                               // kinds of sides of contactors as well
  void measure_speeds(const Bodies& bodies); // to which velocity errors are relative

private:
  void load_further_inertia(std::int64_t n); // for sides that read it; -1: none does
  void load_meshes();

  const AssemblyInput& in_;
  ContactSystem& system_;
  ContactClasses& classes_;
  const AnchorFrames& frames_;
};

} // namespace cairn
