// How many threads a step uses.
#pragma once
#include <omp.h>

#include <algorithm>
#include <cstdint>

namespace cairn {

// Threads of a step, put back afterwards. A thread is worth its waiting from some thousand contacts on; results do not
// depend on their number.
class Threads {
public:
  Threads(int wanted, std::int64_t contacts) : before_(omp_get_max_threads()) {
    const std::int64_t useful = 1 + contacts / 4096;
    omp_set_num_threads(wanted > 0 ? wanted : int(std::min<std::int64_t>(before_, useful)));
  }
  ~Threads() { omp_set_num_threads(before_); }
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

private:
  int before_;
};

} // namespace cairn
