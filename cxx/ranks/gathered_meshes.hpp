// Deformable bodies among gathered contacts. The rank that has all contacts on them has the compliance of their nodes,
// which does not travel: contacts are gathered there, and solved on the rows of nodes of its own system.
#pragma once
#include <vector>

#include "../bodies/nodes.hpp"
#include "../solvers/sweeps/contact_system.hpp"
#include "gathered_contacts.hpp"

namespace cairn {

// The rows of nodes of a rank are with the gathered contacts, and back at the end, with velocities as they were unless
// these are kept.
class BorrowedRows {
public:
  BorrowedRows(ContactSystem& owner, const Nodes& nodes, GatheredContacts& to);
  ~BorrowedRows();
  BorrowedRows(const BorrowedRows&) = delete;
  BorrowedRows& operator=(const BorrowedRows&) = delete;
  void keep_velocities() { kept_ = true; } // of the solution

private:
  void change();
  ContactSystem& owner_;
  GatheredContacts& to_;
  std::vector<double> before_; // velocities
  bool kept_ = false;
};

} // namespace cairn
