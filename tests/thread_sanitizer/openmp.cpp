// Functions of the OpenMP run-time library that Cairn calls, over std::thread. GCC's own library waits by futexes,
// which the thread sanitizer does not see, so that it would report a race in every parallel region.
#include <omp.h>

#include <condition_variable>
#include <cstdlib>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

namespace {

// A loop whose pieces go to whoever asks.
struct Loop {
  long next, end, increment, chunk;
  int inside; // threads that have not left it
};

struct Team {
  explicit Team(int n) : size(n) {}
  void barrier() {
    std::unique_lock lock(mutex);
    const unsigned long now = phase;
    if (++waiting == size) {
      waiting = 0;
      ++phase;
      changed.notify_all();
    } else {
      changed.wait(lock, [&] { return phase != now; });
    }
  }
  const int size;
  std::mutex mutex;
  std::condition_variable changed;
  int waiting = 0;
  unsigned long phase = 0;
  std::map<int, Loop> loops; // by how many a thread has met before
};

// Rank of a thread in its team, and loops that it has met.
struct Place {
  Team* team = nullptr;
  int rank = 0, loops = 0;
};

int threads_of_the_environment() {
  const char* const told = std::getenv("OMP_NUM_THREADS");
  const int n = told ? std::atoi(told) : int(std::thread::hardware_concurrency());
  return n > 0 ? n : 1;
}

thread_local Place place;
thread_local int wanted = threads_of_the_environment();
std::mutex critical, atomic;

// Sections of different names may lie within each other, so each name has a lock of its own.
std::mutex& lock_of(void** name) {
  static std::mutex guard;
  static std::map<void**, std::mutex> locks;
  const std::lock_guard lock(guard);
  return locks[name];
}

using Body = void (*)(void*);

void run_team(Body body, void* data, unsigned asked, const Loop* loop) {
  const int size = place.team ? 1 : asked > 0 ? int(asked) : wanted;
  Team team(size);
  if (loop) team.loops.emplace(0, *loop).first->second.inside = size;
  const Place before = place;
  const auto member = [&](int rank) {
    place = {&team, rank, 0};
    body(data);
  };
  std::vector<std::thread> others;
  for (int rank = 1; rank < size; ++rank) others.emplace_back(member, rank);
  member(0);
  for (std::thread& other : others) other.join();
  place = before;
}

} // namespace

extern "C" {

void GOMP_parallel(Body body, void* data, unsigned threads, unsigned) { run_team(body, data, threads, nullptr); }

void GOMP_parallel_loop_nonmonotonic_dynamic(Body body, void* data, unsigned threads, long start, long end,
                                             long increment, long chunk, unsigned) {
  const Loop loop{start, end, increment, chunk, 0};
  run_team(body, data, threads, &loop);
}

void GOMP_barrier() {
  if (place.team) place.team->barrier();
}

bool GOMP_loop_nonmonotonic_dynamic_next(long* first, long* last) {
  const std::lock_guard lock(place.team->mutex);
  Loop& loop = place.team->loops.at(place.loops);
  if (loop.increment > 0 ? loop.next >= loop.end : loop.next <= loop.end) return false;
  *first = loop.next;
  const long end = loop.next + loop.chunk * loop.increment;
  *last = (loop.increment > 0 ? end < loop.end : end > loop.end) ? end : loop.end;
  loop.next = *last;
  return true;
}

bool GOMP_loop_nonmonotonic_dynamic_start(long start, long end, long increment, long chunk, long* first, long* last) {
  {
    const std::lock_guard lock(place.team->mutex);
    place.team->loops.try_emplace(place.loops, Loop{start, end, increment, chunk, place.team->size});
  }
  return GOMP_loop_nonmonotonic_dynamic_next(first, last);
}

void GOMP_loop_end_nowait() {
  const std::lock_guard lock(place.team->mutex);
  const auto at = place.team->loops.find(place.loops++);
  if (--at->second.inside == 0) place.team->loops.erase(at);
}

void GOMP_loop_end() {
  GOMP_loop_end_nowait();
  place.team->barrier();
}

void GOMP_critical_start() { critical.lock(); }
void GOMP_critical_end() { critical.unlock(); }
void GOMP_critical_name_start(void** name) { lock_of(name).lock(); }
void GOMP_critical_name_end(void** name) { lock_of(name).unlock(); }
void GOMP_atomic_start() { atomic.lock(); }
void GOMP_atomic_end() { atomic.unlock(); }

int omp_get_thread_num() { return place.rank; }
int omp_get_thread_num_() { return place.rank; }
int omp_get_num_threads() { return place.team ? place.team->size : 1; }
int omp_get_max_threads() { return wanted; }
void omp_set_num_threads(int n) { wanted = n > 0 ? n : 1; }
int omp_pause_resource_all(omp_pause_resource_t) { return 0; }
}
