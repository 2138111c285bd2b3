// Internal forces of a mesh: nodal forces at given displacements, their derivative, energy, and history variables; by
// materials of solids (bulk_model.hpp) or by another code (called_forces.hpp).
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
  // Prepares the map from the pattern of the tangent to the values of a lower triangle. Throws Error if that pattern
  // lacks an entry.
  virtual void fit(const SparseMatrix& lower) = 0;
  // Nodal forces (dofs) [N]; if given, their derivative [N/m] is added to the values of a lower triangle. History at
  // the end of the step is written beside that at its begin.
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
  // True if a shorter step may cure the fault; if not, the step is given up.
  virtual bool shorter_helps(const BulkResult&) const { return true; }
  // Description of a fault, with a remedy where a shorter step does not help.
  std::string told(const BulkResult& r) const { return describe(r) + (shorter_helps(r) ? "" : ": " + remedy_of(r)); }
  virtual std::string remedy() const { return "give a smaller dt or more newton_passes"; }
  // Reason why the stress of the named mesh cannot be found from its energy; empty if it can.
  virtual std::string not_by_energy(const std::string& mesh) const = 0;
  // True if energy and dissipation are reported; else they are zero in results.
  virtual bool knows_energy() const { return true; }
  virtual bool knows_dissipation() const { return true; }
  // History variables at the begin of the step, for a checkpoint; tells_history(): they can be read.
  virtual bool tells_history() const { return true; }
  virtual std::vector<double> history() const = 0;
  virtual std::int64_t history_size() const = 0; // -1: any
  virtual void take_history(std::span<const double> history) = 0;
  virtual void forget_history() = 0;                     // as at the start
  virtual std::shared_ptr<InternalForces> another() = 0; // for another simulation, at the start
  virtual std::int64_t bytes() const = 0;
  // True if forces and tangent may be evaluated between steps, at any displacement.
  virtual bool known_anywhere() const { return false; }
  virtual BulkModel* solid() { return nullptr; } // of materials of solids
  // Fields for views of the last evaluation that no step starts from; empty: none.
  virtual std::span<double> shown() { return {}; }
  std::string mesh = "mesh"; // name of the mesh, for error messages
  // Isotropic free strain at each node (swelling); empty: none.
  std::vector<double> swelling;
};

} // namespace cairn
