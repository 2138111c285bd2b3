// Internal forces of a mesh over a step.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "mesh_jumps.hpp"

namespace cairn {

// Evaluates the internal forces of a mesh that is not linear, from the begin of a step to its end.
class MeshStresses {
public:
  MeshStresses(MeshModel& model, MeshLoads& loads, NewtonSeconds& seconds, MeshStep& step, MeshStability& stability,
               MeshHistory& history, MeshJumps& jumps)
      : model_(model), loads_(loads), seconds_(seconds), step_(step), stability_(stability), history_(history),
        jumps_(jumps) {}
  std::vector<double> force_begin, force_end; // (dofs) at both ends of the step [N]
  std::vector<double> force_step;             // (dofs) over a step that is predicted, or has ended [N]
  std::vector<double> tangent;                // derivative of force_end by displacements, on the pattern of A [N/m]
  std::vector<double> press;                  // (dofs) of pressures over the step [N]
  std::vector<double> swelling_force;         // (dofs) of free strains, see find_swelling_force; empty: nothing swells
  std::vector<double> way_beside;      // (dofs) see turn_way; empty where no rigid part turns, or nothing is kept [m]
  BulkResult found;                    // at the end
  double stored_begin = 0, warmed = 0; // energy at the begin [J], and that which swelling gave it

  void take_scheme(bool check);
  void begin(double size); // size: of a cell [m]
  void predict();
  // Stresses and forces at velocities v (dofs) of the end of the step [m/s].
  BulkResult evaluate(const std::vector<double>& v, bool with_tangent);
  double force_of(std::size_t i) const; // of the stresses over the step [N]
  void find_at_end(const std::vector<double>& end);
  double way_of(std::size_t i, double v) const; // of a dof that ends with a velocity [m]
  void turn_way(const Nodes& nodes, double* way);
  void commit(const std::vector<double>& end);
  std::vector<double> memory() const;
  void restore(std::span<const double> state, std::span<const double> memory);
  void forget();
  std::string advice() const; // where stresses are not found
  std::string remedy() const; // where no balance is found
  std::string describe(const BulkResult& fault) const;
  [[noreturn]] void fail(const BulkResult& fault, const std::string& where, const std::string& advice) const;

private:
  BulkResult evaluate_at(const double* v, double rate, bool with_tangent);
  BulkResult forces_at_begin(double* force);
  void find_swelling_force();
  void add_press(double* tangent);

  MeshModel& model_;
  MeshLoads& loads_;
  NewtonSeconds& seconds_;
  MeshStep& step_;
  MeshStability& stability_;
  MeshHistory& history_;
  MeshJumps& jumps_;
  std::vector<double> press_begin_;            // (dofs) of pressures at the begin of the step [N]
  std::vector<double> way_end_, velocity_end_; // (dofs) displacement and velocity at the end of the last step
  double end_share_ = 0.5;                     // weight of the end of the step in the mean of loads [-]
  bool begun_ = false;                         // true if stored_begin and force_begin are known
  bool undone_ = false;                        // the last step was not committed: nodes begin at way_end_, to the bit
};

} // namespace cairn
