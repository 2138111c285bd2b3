// Memory for the numbers of batches.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "../base/scratch.hpp"
#include "contact_classes.hpp"
#include "ropes.hpp"

namespace cairn {

// Lays out the numbers of batches in the order in which a sweep reads them.
class BatchStorage {
public:
  BatchStorage(const AssemblyInput& in, const ContactClasses& classes, const Ropes& ropes, ContactSystem& system,
               Scratch& scratch)
      : in_(in), classes_(classes), ropes_(ropes), system_(system), scratch_(scratch) {}

  // Columns of a batch that only its law reads; null where it does not.
  struct LawColumns {
    cairn_law_context context;
    double* geometry; // of the context, see laws/law_geometry.hpp
    double* fields;   // (n, 4) of the context, null: the scene has none
    double* flight;   // (n, c) that the bias holds besides the law's own [m/s]
    double* energy;   // (n, 4) as cairn_law_energy gives it
  };
  Array<LawColumns> of_law; // per batch
  double* parted = nullptr; // per place: speed of parting by growth [m/s]; null: nothing grows
  double* given = nullptr;  // (3 dim - 3) per place: impulses that the pose adds to the solution; null: none

  // place: where contacts stand in the memory, which statuses replace.
  void lay_out(std::int32_t* place);
  double* given_of(const cairn_batch& b) const { return given + std::size_t(3 * in_.dim() - 3) * std::size_t(b.first); }
  const LawColumns& columns_of(const cairn_batch& b) const { return of_law[std::size_t(&b - system_.batches.data())]; }
  bool has_params_of_pair(const cairn_batch& b) const {
    return b.params < own_numbers_.data() || b.params >= own_numbers_.data() + own_numbers_.size();
  }

private:
  double* params_of_pair(const cairn_batch& b);
  void lay_out_mapping(const cairn_batch& b, std::int32_t*& node, std::int32_t*& dof, double*& response,
                       std::int32_t stride);
  void lay_out_spins(cairn_batch& b);

  struct PairParams { // as solve has them, of `count` contacts
    std::int32_t entry, count;
    double* params;
  };
  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const Ropes& ropes_;
  ContactSystem& system_;
  Scratch& scratch_;
  std::vector<PairParams> params_of_pairs_; // of this step
  std::span<double> own_numbers_;           // numbers of all batches, without shared parameters
};

} // namespace cairn
