// Sweeps that begin beyond the last one (Nesterov 1983), begun again where that leads astray (O'Donoghue & Candes
// 2015): what plain sweeps carry through a pile contact by contact takes the square root of as many of them.
#pragma once
#include "contact_system.hpp"
#include "nesterov_sequence.hpp"

namespace cairn {

// Criteria for the extrapolation of sweeps.
struct ExtrapolationGrounds {
  double mass_ratio = 1;     // the largest of moving bodies
  double faced_share = 0;    // of the contacts, between faces or of meshes that are swept in turn
  bool extrapolates() const; // whether they are, unless the solver forbids it
};
ExtrapolationGrounds extrapolation_grounds(const ContactSystem& system);

class Extrapolation {
public:
  Extrapolation(ContactSystem& system, const cairn_schedule& schedule);
  // True if batches and masses permit extrapolation: see the source.
  bool allowed() const { return allowed_; }
  void forbid() { allowed_ = false; }
  // Changes of impulses by the last of them are left in system.change. Returns how many sweeps that was in work, some
  // of it done where most is left to do.
  int sweep(int sweeps);
  // Somebody else changed impulses and velocities: the next sweep begins from them as they are.
  void restart() { sequence_.restart(); }

private:
  void lean_condensed();
  void sweep_slow_tasks();
  ContactSystem& system_;
  const cairn_schedule& schedule_;
  std::int32_t stride_ = 1; // components of a contact, at most
  bool allowed_ = true;
  NesterovSequence sequence_;
  double factor_ = 0, contacts_ = 0;
  double swept_beside_ = 0; // in sweeps, that were not yet counted
};

// The impulses of the smallest error that was measured.
class BestImpulses {
public:
  explicit BestImpulses(ContactSystem& system);
  // Told of each error; keeps the impulses at hand if it is the smallest and more sweeps may follow.
  void offer(double error_square, bool goes_on);
  // Restores the best impulses and records where those at hand are worse. False: nothing changed.
  bool give_back(double error_square, const Velocities& velocity_free, const cairn_schedule& schedule);

private:
  ContactSystem& system_;
  double least_;
};

} // namespace cairn
