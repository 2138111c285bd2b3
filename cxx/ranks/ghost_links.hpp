// Ghosts follow their owners.
#pragma once
#include <cstdint>
#include <vector>

#include "part.hpp"

namespace cairn {

// Messages between the owners of bodies and the ranks that have ghosts of them.
class GhostLinks {
public:
  // Ranks tell owners which of their bodies they follow; fixed ones are not. All ranks call it after a partition.
  void link(const std::vector<Part>& parts, Exchange& exchange);
  // The field of ghosts from their owners. All ranks call it.
  void follow(std::vector<Part>& parts, Exchange& exchange, Field<double> Bodies::*field);

private:
  Links links_;                                                  // from owners to ghosts, of each local rank
  std::vector<std::vector<std::vector<std::int32_t>>> out_, in_; // local numbers of bodies, by rank and link
};

} // namespace cairn
