// Compliance of a mesh.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "mesh_factors.hpp"

namespace cairn {

// Finds how the contact nodes of a mesh respond to unit impulses.
class MeshCompliance {
public:
  MeshCompliance(const MeshModel& model, MeshFactors& factors) : model_(model), factors_(factors) {}
  struct Bytes {
    double most = 1e9; // more is not taken if reaches take less
    double easy = 1e9; // beyond, reaches are swept sooner if they take a quarter
  };
  // Contact nodes from now on, in this order after those that are.
  void touch(const std::vector<std::int32_t>& more);
  void touch_again(); // in the order of a run that this one goes on with
  // The same of nodes, rising and none twice, that are all the step needs. Where their compliance would take more bytes
  // than `of` says it may be kept by reaches of its factor, and nodes that are not needed may be forgotten.
  void rest_on(const std::vector<std::int32_t>& nodes, const Bytes& of, bool may_reach);
  // For a checkpoint, see mesh_touched.cpp: h, damping, stiffness, largest, mixed of factors, how often nodes came to
  // touch, how many there were after each time, and these nodes; of the next ones. Empty where nothing depends on it.
  std::vector<double> touched() const;
  void restore_touched(std::span<const double> of); // throws Error for the list of another mesh

private:
  std::vector<std::int32_t> dofs_of(std::span<const std::int32_t> nodes) const;
  bool by_units() const { return factors_.by_units(*factors_.now); }

  const MeshModel& model_;
  MeshFactors& factors_;
  std::vector<double> columns_; // (some, dofs) right sides that are solved at once
};

} // namespace cairn
