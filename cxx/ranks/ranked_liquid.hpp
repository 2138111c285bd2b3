// An incompressible liquid over ranks. Each process finds the whole pressure, to the same bits, beside a copy of the
// bodies that the liquid meets, which it moves to where contacts are detected as their owners move them. The velocities
// that pressure gives go to the parts, and those that contacts leave come back from their owners. Deformable bodies are
// whole in each process: they are with the copy while the liquid is at work, and with a part while contacts are.
#pragma once
#include <array>
#include <memory>
#include <vector>

#include "../simulation/simulation.hpp"
#include "../strategies/nscd/nscd.hpp"
#include "exchange.hpp"
#include "part.hpp"

namespace cairn {

// Deformable bodies and their nodes go from a part to the copy of the liquid, and back at the end; to: null: there are
// none.
class MeshesInLiquid {
public:
  MeshesInLiquid(Part* from, Simulation& to) : from_(from), to_(to) { change(); }
  ~MeshesInLiquid() { change(); }
  MeshesInLiquid(const MeshesInLiquid&) = delete;
  MeshesInLiquid& operator=(const MeshesInLiquid&) = delete;
  // f() while they are with the part.
  template <class F>
  void with_contacts(F&& f) {
    const MeshesInLiquid back(from_, to_);
    f();
  }

private:
  void change();
  Part* from_;
  Simulation& to_;
};

class RankedLiquid {
public:
  RankedLiquid(); // out of line: a simulation owns a liquid
  ~RankedLiquid();
  static bool flows_in(const Simulation& whole);
  // Takes the liquid of the whole for a step, and a copy of its bodies as they stand. partition: number of the one that
  // parts are of; owner: rank of each body of the whole.
  void take(Simulation& whole, const Strategy& model, const std::vector<Part>& parts,
            const std::vector<std::int32_t>& owner, int ranks, std::int64_t partition);
  void give_back(Simulation& whole);
  bool taken() const { return copy_.simulation && copy_.simulation->fluid; }
  Simulation& beside() { return *copy_.simulation; } // the liquid and its bodies
  Nscd& stages() { return static_cast<Nscd&>(*copy_.strategy); }

  // Where contacts are detected: the first pressure, of contacts as in the last step. meshes: the part that has them.
  void press(double h, std::vector<Part>& parts, Part* meshes);
  // In a later pass of Newton's method, before contacts are solved anew.
  void press_again(std::vector<Part>& parts, Part* meshes);
  // Free velocities and inverse masses, by the pressure, to the parts.
  void give_free(std::vector<Part>& parts) const;
  // Velocities of the solution of contacts at hand, from their owners.
  const Array<double>& velocities(const std::vector<Part>& parts, Exchange& exchange);
  // Velocities at the end of the step, and forces, with the sum of both impulses.
  void settle(std::vector<Part>& parts, Exchange& exchange, Part* meshes);
  void finish();
  void undo();
  std::int64_t bytes() const;

private:
  using Rows = std::vector<std::array<std::int32_t, 2>>; // in a part, in the copy
  bool is_of(const Simulation& whole, std::int64_t partition) const;
  void make(Simulation& whole, const Strategy& model, const std::vector<Part>& parts,
            const std::vector<std::int32_t>& owner, int ranks);
  template <class F>
  void fetch(const std::vector<Part>& parts, Exchange& exchange, F&& velocity_of);
  void give(Field<double> Bodies::*field, std::vector<Part>& parts) const;

  Part copy_;
  std::vector<std::int64_t> met_;     // ids of bodies that the liquid knows
  std::vector<Rows> all_, own_;       // of each part
  std::vector<std::int32_t> in_turn_; // rows of the copy by rank of their owner
  std::vector<std::int64_t> first_;   // of each rank among these (ranks + 1)
  std::vector<double> sent_;          // velocities in that order (dofs, n)
  Array<double> velocity_;            // (dofs, n) by rows
  std::int64_t partition_ = -1;
  bool pressed_ = false; // in the step at hand
};

} // namespace cairn
