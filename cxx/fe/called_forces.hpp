// Forces on the nodes of a mesh that another finite element code finds, by the calls of cairn/body_calls.h.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cairn/body_calls.h"
#include "internal_forces.hpp"

namespace cairn {

class CalledForces final : public InternalForces, public std::enable_shared_from_this<CalledForces> {
public:
  // Calls whose context is at the start of its history, a new one for each simulation.
  using Open = std::function<cairn_body_calls()>;
  // from: who gives the forces ("librubber.so: rubber"). pattern of the tangent: a lower triangle, or all entries, of
  // which the symmetric part counts. Throws Error naming the mismatch.
  static std::shared_ptr<CalledForces> make(std::string from, int dim, SparseMatrix pattern, Open open);
  static std::shared_ptr<CalledForces> make(std::string from, int dim, SparseMatrix pattern,
                                            const cairn_body_calls& calls);
  ~CalledForces() override;
  CalledForces(const CalledForces&) = delete;
  CalledForces& operator=(const CalledForces&) = delete;

  bool throws_its_own = false; // exceptions of its calls name the mesh already

  // Symmetric part of the tangent at displacements of zero, on a triangle that they were fitted to [N/m].
  void find_stiffness(SparseMatrix& lower);
  // The lower triangle that holds the pattern, and the diagonal; values zero.
  SparseMatrix lower() const;
  // Adds to the values of such a triangle those of a matrix on the pattern.
  void add(const double* value, double* to) const;

  void fit(const SparseMatrix& lower) override;
  BulkResult evaluate(const MeshMotion& at, double* force, double* tangent) override;
  void commit() override;
  void rollback() override;
  std::string describe(const BulkResult& result) const override;
  std::string place_of_node(std::int64_t node) const override;
  std::string remedy() const override;
  std::string not_by_energy(const std::string& name) const override;
  bool knows_energy() const override { return calls_.gives_energy != 0; }
  bool knows_dissipation() const override { return calls_.gives_dissipation != 0; }
  bool tells_history() const override { return !calls_.commit || calls_.save; }
  std::vector<double> history() const override;
  std::int64_t history_size() const override { return -1; }
  void take_history(std::span<const double> history) override;
  void forget_history() override;
  std::shared_ptr<InternalForces> another() override;
  void give_back() { taken_ = false; } // the simulation that had it did not come to be
  std::int64_t bytes() const override;

private:
  CalledForces(std::string from, int dim, SparseMatrix pattern);
  void take(const cairn_body_calls& calls);
  std::string complaint() const;
  template <class Call>
  void guarded(const char* what, const Call& call) const;

  std::string from_;
  int dim_;
  SparseMatrix pattern_;
  bool whole_ = false; // all entries are given
  Open open_;
  cairn_body_calls calls_{};
  std::shared_ptr<void> context_; // where it is this model's own
  bool taken_ = false;            // a simulation has it
  std::string broken_;            // what failed where no error could be told
  std::vector<std::int64_t> place_;
  std::vector<double> value_, start_; // of the tangent; of the history at the start
};

} // namespace cairn
