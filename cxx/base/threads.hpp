// How many threads a step uses.
#pragma once
#include <omp.h>
#include <pthread.h>

#include <algorithm>
#include <cstdint>

namespace cairn {

// Threads that wait for the next loop are not there in a child of a fork, which would wait for them for ever: they are
// let go before, and both sides make new ones when they need them.
inline const int registered_before_forks =
    pthread_atfork([] { omp_pause_resource_all(omp_pause_soft); }, nullptr, nullptr);

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
