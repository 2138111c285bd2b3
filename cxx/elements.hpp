// Finite elements: rows of elements.def with their kernels.
#pragma once
#include <cstdint>

#include "cairn/core.h"

namespace cairn {

struct ElementInfo {
  const char *name, *cell; // file of the kernel; cell type of a mesh
  int dim, nodes;
  cairn_element_matrices* matrices;
  cairn_element_stress* stress;
};
inline constexpr ElementInfo element_infos[] = {
#define CAIRN_ELEMENT(name, cell, dim, nodes)                                                                          \
  {#name, #cell, dim, nodes, cairn_element_##name##_matrices, cairn_element_##name##_stress},
#include "../core_f90/elements/elements.def"
#undef CAIRN_ELEMENT
};

} // namespace cairn
