// Contactors that a rope over a pulley runs between.
#pragma once
#include <cstdint>
#include <optional>

namespace cairn {

struct Contactors;
class LawTable;

struct RopeEnds {
  std::int32_t near = -1, pulley = -1, far = -1; // -1: one of them is gone
};
// Nothing for a material that is no rope's.
std::optional<RopeEnds> rope_ends(const Contactors& contactors, const LawTable& laws, int material);

} // namespace cairn
