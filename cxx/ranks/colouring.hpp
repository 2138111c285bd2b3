// Colours of contacts over ranks: contacts of one colour share no body that moves. A contact takes the first colour
// that none of its neighbours took before it, in the order of hashed keys (Jones & Plassmann 1993), so that colours
// follow from ids and the graph of contacts alone, whatever rank has which.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "../detection/candidates.hpp"
#include "exchange.hpp"

namespace cairn {

// Contacts and bodies of one rank.
struct ColourShare {
  std::vector<ContactKey> key;                   // of the contacts that it owns
  std::vector<std::array<std::int32_t, 2>> body; // their bodies by local numbers; -1: one that nothing moves
  std::vector<std::int64_t> id;                  // of local bodies
  std::vector<std::int32_t> owner;               // rank, of local bodies
  std::vector<std::uint8_t> in_turn;             // 1: swept after all colours, one after the other; empty: none is
  std::vector<std::int32_t> colour;              // found, of the contacts
  std::vector<std::int32_t> by_id;               // local bodies by rising id, kept between two colourings

  // A contact of another rank on a body that this one has contacts on, or owns.
  struct Other {
    ContactKey key;
    std::uint64_t hash;
    std::int32_t rank, number, colour; // number: among the contacts of its rank; -1 - number where it is in turn
    std::array<std::int32_t, 2> body;  // local numbers; -1: not shared
  };
  std::vector<Other> others;
  // Bodies with contacts of other ranks, and the ranks that follow their velocities, besides this one.
  std::vector<std::int32_t> shared; // local numbers, by rising id
  std::vector<std::vector<std::int32_t>> sharers;
};

// Returns the number of colours; messages between ranks are few, as many as contacts wait for each other across them.
// Contacts in turn, which are all on one rank, have the last colour for themselves.
int colour_contacts(std::vector<ColourShare>& shares, Exchange& exchange);

// Links by which shared bodies follow each other after each colour, `numbers` a body; which bodies are in them.
struct ColourLinks {
  Links links;
  std::vector<std::vector<std::vector<std::int32_t>>> out, in; // local numbers of bodies, by rank and link
};
ColourLinks link_colours(const std::vector<ColourShare>& shares, const Exchange& exchange, int colours, int numbers);

} // namespace cairn
