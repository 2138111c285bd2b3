// What opposes the deformation of a mesh: forces on its nodes at displacements, their derivative, energy, and what is
// kept from step to step; by materials of solids (bulk_model.hpp) or by another code (called_forces.hpp).
#pragma once
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "../soe/soe.hpp"
#include "bulk_result.hpp"

namespace cairn {

class BulkModel;

inline constexpr double no_time = std::numeric_limits<double>::quiet_NaN(); // that is not known

// Where forces are asked for.
struct MeshMotion {
  const double* u;               // displacements (dofs) [m]
  const double* v;               // velocities (dofs) there [m/s]
  double time = 0, h = 1;        // there, and the length of the step at hand [s]
  double theta = 1;              // of the end in rates of strain
  double rate = 0;               // derivative of v by u along the step [1/s]
  const double* begin = nullptr; // displacements at the begin, where forces are those whose work is the energy's change
  double begin_time = no_time;   // of the step [s]
};

class InternalForces {
public:
  virtual ~InternalForces() = default;
  // Where what they give stands in the values of a lower triangle. Throws Error for a pattern that does not hold it.
  virtual void fit(const SparseMatrix& lower) = 0;
  // Forces (dofs) [N], and to the values of a lower triangle their derivative is added [N/m], if given. What is kept at
  // the end of the step is found beside that at its begin.
  virtual BulkResult evaluate(const MeshMotion& at, double* force, double* tangent) = 0;
  virtual void commit() = 0; // the end of the step is the begin of the next
  virtual void rollback() {} // the step was undone
  // "quad 12 with nodes 1 2 3 4: its volume is not positive"
  virtual std::string describe(const BulkResult& result) const = 0;
  // "node 12, quad cell 3", the first that has it; and what may help where no balance is found.
  virtual std::string place_of_node(std::int64_t node) const = 0;
  virtual std::string remedy_of(const BulkResult&) const {
    return "give a smaller dt, a finer mesh or a stiffer material";
  }
  // Whether a shorter step may mend it; if not, nothing more is asked in this one.
  virtual bool shorter_helps(const BulkResult&) const { return true; }
  // The same with what helps, of a fault that does not tell so by itself.
  std::string told(const BulkResult& r) const { return describe(r) + (shorter_helps(r) ? "" : ": " + remedy_of(r)); }
  virtual std::string remedy() const { return "give a smaller dt or more newton_passes"; }
  // Why no stress is known by its energy, of the mesh of that name; empty: it is.
  virtual std::string not_by_energy(const std::string& mesh) const = 0;
  // Whether energy and what is dissipated are told; else they are zero in results.
  virtual bool knows_energy() const { return true; }
  virtual bool knows_dissipation() const { return true; }
  // What is kept at the begin of the step, for a checkpoint, and whether it can be told.
  virtual bool tells_history() const { return true; }
  virtual std::vector<double> history() const = 0;
  virtual std::int64_t history_size() const = 0; // -1: any
  virtual void take_history(std::span<const double> history) = 0;
  virtual void forget_history() = 0;                     // as at the start
  virtual std::shared_ptr<InternalForces> another() = 0; // for another simulation, at the start
  virtual std::int64_t bytes() const = 0;
  // Whether forces and their derivative may be asked for between steps, at any displacements.
  virtual bool known_anywhere() const { return false; }
  virtual BulkModel* solid() { return nullptr; } // of materials of solids
  // What views show of the last evaluation, and no step begins from; empty: nothing.
  virtual std::span<double> shown() { return {}; }
  std::string mesh = "mesh"; // the name of the mesh, for what is thrown
  // Free strain of each node, by which its surroundings would be longer without a stress, all ways alike; empty: none.
  std::vector<double> swelling;
};

} // namespace cairn
