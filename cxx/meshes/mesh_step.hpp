// The step of a mesh at hand.
#pragma once
#include <cstdint>
#include <vector>

#include "../base/field.hpp"
#include "cairn/core.h"
#include "mesh_matrices.hpp"

namespace cairn {

// Vectors of the step of a mesh that its stages share, with the scheme of the integrator.
class MeshStep {
public:
  MeshStep(const MeshModel& model, const MeshMatrices& matrices) : model_(model), matrices_(matrices) {}
  std::int64_t first_node = 0; // where its nodes begin among those of the scene
  cairn_scheme scheme{};
  std::vector<double> q, v;          // (dofs) displacements, velocities at the begin [m], [m/s]
  std::vector<double> free;          // (dofs) velocities at the end without contacts [m/s]
  std::vector<double> f;             // (dofs) loads [N]
  std::vector<double> iterate;       // (dofs) velocities of a pass of Newton's method [m/s]
  std::vector<double> weight;        // (dofs) M g [N]
  std::vector<double> a, b, scratch; // (dofs) of a stage

  double h() const { return scheme.h; }
  double share() const { return scheme.share; }          // of the end in the mean velocity
  double end_weight() const { return scheme.end_share; } // of the end in forces of stresses
  bool is_explicit() const { return !(scheme.stiffness > 0); }
  bool by_energy() const { return scheme.by_energy != 0; } // stresses are a discrete gradient
  // Weight of the end of the step in the rates of strain of viscous laws: the mid-point where stresses are predicted,
  // else the weight of the integrator.
  double rate_share() const { return is_explicit() ? 1 : (scheme.histories > 0 ? 0.5 : scheme.share); }

  void weigh(const double* gravity);
  void gather(const Field<double>& field, double* out) const;
  void scatter(const double* values, Field<double>& field) const;

private:
  const MeshModel& model_;
  const MeshMatrices& matrices_;
  std::vector<double> gravity_; // of `weight` [m/s2]
};

} // namespace cairn
