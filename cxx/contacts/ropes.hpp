// Ropes over a pulley: joints of three ends.
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "assembly_input.hpp"
#include "rope_ends.hpp"

namespace cairn {

// Adds the far part of ropes, from pulley to far end, to their contacts between near end and pulley.
class Ropes {
public:
  Ropes(const AssemblyInput& in, const ContactSystem& system) : in_(in), system_(system) {}

  // Far part of a rope: carrier of the end, then of the pulley.
  struct FarPart {
    std::int32_t body[2];
    double lever[2][3] = {}, normal[3] = {}, length = 0; // normal: from the pulley to the end
  };
  void find(const Contactors& of, const LawTable& by);
  bool has_lost_end(int material) const { // of a rope
    return !of_material_.empty() && of_material_[std::size_t(material)].value_or(RopeEnds{0, 0, 0}).far < 0;
  }
  // True if a contact is a rope between its near end and its pulley; other marks may touch freely.
  bool is_rope(std::int64_t i) const {
    if (of_material_.empty()) return false;
    const std::int32_t a = in_.candidates->contactor_a[i], b = in_.candidates->contactor_b[i];
    const RopeEnds ends = of_material_[std::size_t(*in_.contactors->material[a])].value_or(RopeEnds{});
    return ends.far >= 0 && std::minmax(a, b) == std::minmax(ends.near, ends.pulley);
  }
  RopeEnds ends_of(std::int64_t i) const { // of a rope
    return *of_material_[std::size_t(*in_.contactors->material[in_.candidates->contactor_a[i]])];
  }
  FarPart far_part(std::int64_t i) const;
  void fill(cairn_batch& b) const;

private:
  const AssemblyInput& in_;
  const ContactSystem& system_;
  std::vector<std::optional<RopeEnds>> of_material_; // empty where there is none
};

} // namespace cairn
