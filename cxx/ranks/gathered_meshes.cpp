#include "gathered_meshes.hpp"

#include <algorithm>
#include <utility>

namespace cairn {

BorrowedRows::BorrowedRows(ContactSystem& owner, const Nodes& nodes, GatheredContacts& to)
    : owner_(owner), to_(to), before_(owner.condensed_velocity.begin(), owner.condensed_velocity.end()) {
  to_.see_nodes(&nodes.velocity_free);
  change();
}

BorrowedRows::~BorrowedRows() {
  change();
  to_.see_nodes(nullptr);
  if (!kept_) std::copy(before_.begin(), before_.end(), owner_.condensed_velocity.begin());
}

// Batches point to what these arrays hold, which stays where it is.
void BorrowedRows::change() {
  ContactSystem& other = to_.system();
  std::swap(owner_.condensed, other.condensed);
  std::swap(owner_.condensed_dofs, other.condensed_dofs);
  std::swap(owner_.condensed_velocity, other.condensed_velocity);
  std::swap(owner_.reaches, other.reaches);
}

} // namespace cairn
