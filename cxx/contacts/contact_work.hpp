// Work of contacts.
#pragma once
#include "assembly_input.hpp"
#include "contact_energy.hpp"

namespace cairn {

// Measures the work of impulses in a step.
class ContactWork {
public:
  ContactWork(const AssemblyInput& in, ContactSystem& system, ContactEnergy& energy)
      : in_(in), system_(system), energy_(energy) {}
  void measure(const cairn_schedule& schedule); // where the records hold the mean velocities of the step
  void book();                                  // adds it to the energy of the step, at the velocities after it
  std::int64_t bytes() const;

private:
  void count_jump_work();

  const AssemblyInput& in_;
  ContactSystem& system_;
  ContactEnergy& energy_;
  Array<double> sums_; // (4, batches)
};

} // namespace cairn
