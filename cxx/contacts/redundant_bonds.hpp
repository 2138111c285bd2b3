// Bonds on meshes at places that another bond holds already.
#pragma once
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "contact_classes.hpp"

namespace cairn {

// Nodes of a mesh that a contact may rest on, those that carry it first.
struct SupportNodes {
  std::int32_t mesh = -1, node[4] = {-1, -1, -1, -1};
  int nodes = 0, carrying = 0;
};
// Supports of both sides of a contact.
struct BondSupport {
  std::int32_t candidate = -1;
  SupportNodes a, b;
  bool left_out = false;
};

// Leaves out bonds that would make the Delassus operator singular.
class RedundantBonds {
public:
  RedundantBonds(const AssemblyInput& in, const ContactClasses& classes) : in_(in), classes_(classes) {}
  // Bonds left out because others share the side that they touch go to `remainder`.
  void leave_out(std::vector<std::int32_t>& beginning, std::vector<std::int32_t>& remainder);

private:
  BondSupport support_of(std::int64_t i) const;
  std::array<std::int64_t, 2> contactors_of(const BondSupport& s) const;
  static bool may_be_redundant(const BondSupport& s);
  bool is_redundant(const BondSupport& s) const;
  void add(const BondSupport& s);

  const AssemblyInput& in_;
  const ContactClasses& classes_;
  std::vector<BondSupport> held_;                                   // that hold, of those that begin
  std::vector<std::pair<std::int64_t, std::int32_t>> by_contactor_; // (contactor, place in held_), sorted
};

} // namespace cairn
