// Which contact stands in which batch. It depends on the candidates and their order alone.
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "../base/scratch.hpp"
#include "contact_classes.hpp"
#include "ropes.hpp"

namespace cairn {

// Groups the contacts of a step into batches that threads may sweep at the same time.
class ContactPlan {
public:
  ContactPlan(const AssemblyInput& in, const ContactClasses& classes, const Ropes& ropes, ContactSystem& system,
              Scratch& scratch)
      : in_(in), classes_(classes), ropes_(ropes), system_(system), scratch_(scratch) {}
  void plan();
  std::int64_t bytes() const;

private:
  bool is_hub(std::int32_t contactor) const;
  void plan_tiles();
  void plan_colours();
  void plan_hubs();
  void plan_late();
  std::int32_t response_rows(const std::int32_t* contacts, int n, const std::int32_t* contactor) const;
  void emit(const std::int32_t* contacts, int n, int hub);
  void emit_sorted(const std::vector<std::int32_t>& contacts, int largest, int hub);

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  const Ropes& ropes_;
  ContactSystem& system_;
  Scratch& scratch_;
  std::uint64_t *colours_ = nullptr, *tile_colours_ = nullptr; // taken by contacts of each carrier
  std::int32_t* order_ = nullptr;                              // in which candidates are batched
  std::vector<std::int32_t> tile_stage_, order_start_;
  std::vector<std::int32_t> hub_contacts_, late_contacts_, rope_contacts_, of_hub_;
  std::vector<std::pair<std::int64_t, std::int32_t>> by_hub_; // 2 body + side, candidate
  std::vector<std::uint32_t> key_of_order_;
  std::vector<std::int32_t> order_count_, sorted_;
};

} // namespace cairn
