// Overlap beyond what a strategy allows.
#pragma once
#include "batch_storage.hpp"

namespace cairn {

// Finds displacements that take back overlap of more than a share of the smaller body.
class OverlapLimit {
public:
  OverlapLimit(const AssemblyInput& in, ContactSystem& system) : in_(in), system_(system) {}
  bool is_set() const { return in_.options.overlap_limit < std::numeric_limits<double>::infinity(); }
  double deepest_drift() const; // overlap beyond the limit over the size of the smaller body
  // True if most pairs that pressed in the last step touch by faces, as blocks of masonry do.
  bool bears_on_faces();
  // True once overlap of a pack adds up all the same: steps are then solved to their tolerance.
  bool adds_up() const;
  // True if contacts press as in the last step, and many do: after a solution.
  bool persists() const;
  // Keeps which contacts press, by the impulses that a solution starts from.
  void note_loaded();
  // Velocities (3 | 6, bodies) that take back overlap in a step, the smallest in the metric of mass. persisting: of
  // contacts alone that press in this step and did in the last one. False: there is none.
  bool find_velocities(const Bodies& bodies, bool persisting, Array<double>& velocity);

  // Its parts, for ranks. Velocities that displacements are to have along normals; false: none is above 0.
  bool ask(const cairn_schedule& schedule, bool persisting);
  void begin(); // without impulses and velocities
  void keep() { before_ = impulse_; }
  void sweep(const cairn_schedule& schedule); // over the contacts of a colour, or all
  double impulse(std::int32_t place) const { return impulse_[std::size_t(place)]; }
  double impulse_before(std::int32_t place) const { return before_[std::size_t(place)]; } // when they were kept
  static constexpr int most_sweeps = 8;            // measured: the deepest overlap of a pack is no smaller with 50
  static bool ends(double change, double largest); // energies of this sweep, and of the largest

private:
  bool applies_to(const cairn_batch& b) const;
  double overlap_beyond(std::int64_t i, double gap, double& size) const;

  const AssemblyInput& in_;
  ContactSystem& system_;
  Array<double> asked_, impulse_, before_; // per place [m/s], [N s]
  Array<char> loaded_, pressed_;           // per place, per candidate: the contact pressed in the last step
};

} // namespace cairn
