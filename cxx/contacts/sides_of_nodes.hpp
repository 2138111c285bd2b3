// The edges and facets of meshes round a node, for whoever shares out their areas.
#pragma once
#include <span>
#include <vector>

#include "assembly_input.hpp"

namespace cairn {

// Contactors of the edges or facets that have a node of the scene.
struct SidesOfNodes {
  std::vector<std::int64_t> start;
  std::vector<std::int32_t> side;
  explicit SidesOfNodes(const AssemblyInput& in) : start(std::size_t(in.nodes->count) + 1, 0) {
    const auto each = [&](auto&& take) {
      for (const std::int32_t c : in.meshes->mapped().contactor)
        if (in.meshes->turns(c))
          for (int j = 0; j < in.dim(); ++j) take(c, std::size_t(in.meshes->middle(c).node[j]));
    };
    each([&](std::int32_t, std::size_t node) { ++start[node + 1]; });
    for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
    side.resize(std::size_t(start.back()));
    std::vector<std::int64_t> next(start.begin(), start.end() - 1);
    each([&](std::int32_t c, std::size_t node) { side[std::size_t(next[node]++)] = c; });
  }
  std::span<const std::int32_t> at(std::int32_t node) const {
    return {side.data() + start[std::size_t(node)], side.data() + start[std::size_t(node) + 1]};
  }
};

} // namespace cairn
