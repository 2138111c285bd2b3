// Finite elements: rows of elements.def with their kernels.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cairn/core.h"

namespace cairn {

struct ElementInfo {
  const char *name, *cell; // file of the kernel; cell type of a mesh
  int dim, nodes, points;
  cairn_element_rule* rule;
  cairn_element_shape* shape;
};
inline constexpr ElementInfo element_infos[] = {
#define CAIRN_ELEMENT(name, cell, dim, nodes, points)                                                                  \
  {#name, #cell, dim, nodes, points, cairn_element_##name##_rule, cairn_element_##name##_shape},
#include "../../core_f90/elements/elements.def"
#undef CAIRN_ELEMENT
};

// Shape functions of an element at the points of its rule, and their gradients in its middle.
struct ElementShape {
  std::vector<double> value, gradient, weight, middle;
  explicit ElementShape(const ElementInfo& e)
      : value(std::size_t(e.nodes * e.points)), gradient(value.size() * e.dim), weight(e.points),
        middle(std::size_t(e.dim * e.nodes)) {
    std::vector<double> xi(std::size_t(e.dim * e.points)), mean(e.dim, 0.0), unused(e.nodes);
    e.rule(xi.data(), weight.data());
    for (int p = 0; p < e.points; ++p) {
      e.shape(&xi[p * e.dim], &value[p * e.nodes], &gradient[p * e.dim * e.nodes]);
      for (int k = 0; k < e.dim; ++k) mean[k] += xi[p * e.dim + k] / e.points;
    }
    e.shape(mean.data(), unused.data(), middle.data());
  }
};

} // namespace cairn
