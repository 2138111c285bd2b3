// Which rank has which body: the space-filling curve of the bodies, cut where the sum of counted costs says, and the
// bodies that others own and a rank may meet.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "../base/cell.hpp"

namespace cairn {

// Costs of a step, counted and never timed: of a body, and of a contact on it.
inline constexpr std::int64_t cost_of_body = 3, cost_of_contact = 2;

// Owner of each item of a curve: its prefix sums of cost are cut into equal parts. Depends on costs and count alone.
std::vector<std::int32_t> cut_curve(std::span<const std::int64_t> cost, int ranks);

// Bodies as the search for ghosts sees them, in the order of the curve.
struct Surroundings {
  int dim = 3;
  std::int64_t count = 0;
  const double* position = nullptr;         // (dim, count) [m]
  const double* radius = nullptr;           // (count) of a ball about the centre that holds all contactors [m]
  const std::uint8_t* everywhere = nullptr; // (count) 1: each rank has it anyway
  const std::int32_t* owner = nullptr;      // (count)
  Cell cell;
  double reach = 0; // gap between such balls up to which a body is a ghost [m]
};

// Bodies that each of these ranks meets and does not own, rising; those that are everywhere are left out.
std::vector<std::vector<std::int32_t>> find_ghosts(const Surroundings& s, std::span<const int> ranks);

// True if bodies i and j are no farther apart than the ghosts of each other.
bool near(const Surroundings& s, std::int64_t i, std::int64_t j);

// 1: each rank has the body: one that nothing moves, that has no bound, or that is far larger than most.
std::vector<std::uint8_t> bodies_everywhere(std::span<const double> radius, std::span<const std::uint8_t> fixed);

} // namespace cairn
