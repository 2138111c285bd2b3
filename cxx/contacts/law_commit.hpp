// End of a step for laws.
#pragma once
#include "batch_storage.hpp"
#include "brittle_faces.hpp"
#include "contact_energy.hpp"
#include "plugged_laws.hpp"

namespace cairn {

// Commits the internal variables of laws after an accepted step.
class LawCommit {
public:
  LawCommit(const AssemblyInput& in, const ContactClasses& classes, const BatchStorage& storage,
            PluggedLawChecks& plugged, ContactSystem& system, ContactEnergy& energy)
      : in_(in), classes_(classes), storage_(storage), plugged_(plugged), system_(system), energy_(energy),
        brittle_(in, classes, system) {}
  void commit();
  void mark_bonds(bool converged) const; // whether bonds that hold fast correct their errors in the next step

private:
  void commit_batch(const cairn_schedule& schedule, std::size_t which, int thread);
  struct Sums { // of a contact, or of a batch [J]
    double stored, taken_normal, taken_tangential, released, created, turned_over, driven_tangential, driven_normal;
    void add(const Sums& one);
  };
  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const BatchStorage& storage_;
  PluggedLawChecks& plugged_;
  ContactSystem& system_;
  ContactEnergy& energy_;
  BrittleFaces brittle_;
  Array<Sums> sums_;
};

} // namespace cairn
