// Counts of communication over many ranks without a step: bodies along the curve are cut, and contacts coloured, as in
// a run.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace cairn {

// Counts by rank.
struct RankCounts {
  int colours = 0;
  std::vector<std::int64_t> bodies, ghosts, contacts;
  std::vector<std::int64_t> neighbours;      // ranks that it tells velocities
  std::vector<std::int64_t> messages, bytes; // that it sends in a sweep
  std::vector<std::int64_t> ghost_bytes;     // that it receives at the end of a step
};

// position (dim, n) [m], radius (n) [m], contacts: pairs of bodies (2, m), bodies named by their places.
RankCounts count_over_ranks(int dim, std::span<const double> position, std::span<const double> radius,
                            std::span<const std::int64_t> contacts, double reach, int ranks);

} // namespace cairn
