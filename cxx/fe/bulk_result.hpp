#pragma once
#include <cstdint>

namespace cairn {

// Result of an evaluation. fault: 0 none, else that of the first faulty cell; see cairn_bulk_material.
struct BulkResult {
  int fault = 0;
  std::int64_t cell = -1, block = -1;
  double energy = 0, dissipated = 0; // [J]
  bool ok() const { return fault == 0; }
};

} // namespace cairn
