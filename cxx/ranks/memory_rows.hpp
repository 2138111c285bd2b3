// What contacts remember, by rows that go from rank to rank.
#pragma once
#include <vector>

#include "../contacts/contact_memory.hpp"
#include "part.hpp"

namespace cairn {

// Some rows of a memory.
ContactMemory rows_of(const ContactMemory& m, const std::vector<std::size_t>& rows);

// Rows of a memory whose contactors are both there, and for which f(one, two) is true.
template <class F>
std::vector<std::size_t> rows_where(const Simulation& s, const ContactMemory& m, F&& f) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < m.keys.size(); ++i) {
    const std::int32_t one = s.contactor(m.keys[i].contactor_a), two = s.contactor(m.keys[i].contactor_b);
    if (one >= 0 && two >= 0 && f(one, two)) rows.push_back(i);
  }
  return rows;
}

// Memory of contacts on own bodies. Contacts between ghosts began later here than at their owners.
ContactMemory own_memory(const Part& part);
// A memory as bytes, and back to the end of another one.
void pack(const ContactMemory& m, Packer& packer);
void add_packed(Piece bytes, ContactMemory& to);
// By keys, each once: ranks that share a body tell of both.
void put_in_order(ContactMemory& m);

} // namespace cairn
