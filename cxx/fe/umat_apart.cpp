// UMATs in processes of their own, so that a STOP, a fault of memory or an endless loop is an error of the step and no
// end of the program. A process is forked from this one when a material is first asked, and stays until it ends; what
// the calls read and write is in memory that both see. As the adapter of `cairn wrap-law` has it for contact laws.
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <utility>

#include "umat.hpp"

extern "C" void _gfortran_flush_i4(int*) __attribute__((weak));

namespace cairn {
namespace {

void flush_all() {
  if (_gfortran_flush_i4) _gfortran_flush_i4(nullptr);
  std::fflush(stdout);
  std::fflush(stderr);
}

// A run-time error of Fortran within an OPEN or a READ holds the lock of its unit, for which the flush would wait
// without end: the process ends after a fifth of a second then.
volatile std::sig_atomic_t exit_code;
void flush_and_leave(int code) {
  const itimerval soon = {{0, 0}, {0, 200000}};
  exit_code = code;
  std::signal(SIGALRM, [](int) { _exit(exit_code); });
  setitimer(ITIMER_REAL, &soon, nullptr);
  flush_all();
  _exit(code);
}

// Before the handlers of the libraries that the parent has open, which are the parent's to end.
#ifdef __GLIBC__
void leave(int code, void*) { flush_and_leave(code); }
void leave_at_exit() { on_exit(leave, nullptr); }
#else
void leave() { flush_and_leave(1); }
void leave_at_exit() { std::atexit(leave); }
#endif

// All of the bytes; a signal that arrives meanwhile is no end.
template <class Transfer>
bool whole(Transfer transfer, char* at, std::size_t size) {
  while (size > 0) {
    const ssize_t done = transfer(at, size);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    at += done;
    size -= std::size_t(done);
  }
  return true;
}
bool receive(int from, void* to, std::size_t size) {
  return whole([&](char* at, std::size_t n) { return recv(from, at, n, 0); }, static_cast<char*>(to), size);
}
bool give(int to, void* from, std::size_t size) {
  return whole([&](char* at, std::size_t n) { return send(to, at, n, MSG_NOSIGNAL); }, static_cast<char*>(from), size);
}

struct Request {
  std::int64_t points, params, first_cell;
  int points_of_cell, direct, shear, large;
  double h, time;
};

// Where the arrays of a call are in the memory that both see, behind the number of the point at hand.
struct Shared {
  volatile std::int64_t* working_on;
  double* params;
  UmatArrays arrays;

  static std::size_t doubles(std::int64_t points, std::size_t params, std::size_t states) {
    return 1 + params + std::size_t(points) * (2 * states + 6 + 9 + 9 + 1 + 3 + 6 + 36 + 1 + 1 + 1);
  }

  Shared(double* at, std::int64_t points, std::int64_t params_, std::size_t states) {
    const auto n = std::size_t(points);
    const auto take = [&](std::size_t size) { return std::exchange(at, at + size); };
    working_on = reinterpret_cast<volatile std::int64_t*>(take(1));
    params = take(std::size_t(params_));
    arrays.state_begin = take(n * states);
    arrays.strain = take(6 * n);
    arrays.gradient = take(9 * n);
    arrays.rotation = take(9 * n);
    arrays.length = take(n);
    arrays.place = take(3 * n);
    arrays.state = take(n * states);
    arrays.stress = take(6 * n);
    arrays.tangent = take(36 * n);
    arrays.energy = take(n);
    arrays.dissipated = take(n);
    arrays.status = reinterpret_cast<std::int32_t*>(take(n));
  }
};

void copy_in(const UmatCall& call, std::int64_t points, std::size_t states, const UmatArrays& a, const Shared& to) {
  const auto n = std::size_t(points);
  const auto put = [](const double* from, std::size_t size, const double* there) {
    if (size > 0) std::memcpy(const_cast<double*>(there), from, size * sizeof(double));
  };
  put(call.params.data(), call.params.size(), to.params);
  put(a.state_begin, n * states, to.arrays.state_begin);
  put(a.strain, 6 * n, to.arrays.strain);
  put(a.gradient, 9 * n, to.arrays.gradient);
  if (call.large) put(a.rotation, 9 * n, to.arrays.rotation);
  put(a.length, n, to.arrays.length);
  put(a.place, 3 * n, to.arrays.place);
  std::copy_n(a.status, n, to.arrays.status);
}

void copy_out(std::int64_t points, std::size_t states, const Shared& from, const UmatArrays& a) {
  const auto n = std::size_t(points);
  std::copy_n(from.arrays.state, n * states, a.state);
  std::copy_n(from.arrays.stress, 6 * n, a.stress);
  std::copy_n(from.arrays.tangent, 36 * n, a.tangent);
  std::copy_n(from.arrays.energy, n, a.energy);
  std::copy_n(from.arrays.dissipated, n, a.dissipated);
  std::copy_n(from.arrays.status, n, a.status);
}

class Apart {
public:
  explicit Apart(const BulkMaterialInfo& material) : material_(material) {}

  // False once its process ended.
  bool call(const UmatCall& call, std::int64_t points, const UmatArrays& a) {
    const std::size_t states = material_.state.size();
    const std::size_t needed = Shared::doubles(points, call.params.size(), states);
    if (!ready(needed)) {
      words_ = "has no process of its own, which could not be started";
      return false;
    }
    const Shared shared(memory_, points, std::int64_t(call.params.size()), states);
    copy_in(call, points, states, a, shared);
    *shared.working_on = 0;
    Request q{points,          std::int64_t(call.params.size()),
              call.first_cell, call.points_of_cell,
              call.direct,     call.shear,
              call.large,      call.h,
              call.time};
    char answer = 0;
    const bool alive = give(line_, &q, sizeof q);
    const bool in_time = !alive || wait();
    if (alive && in_time && receive(line_, &answer, 1)) {
      copy_out(points, states, shared, a);
      told();
      pass_on();
      return true;
    }
    at = *shared.working_on;
    end(in_time);
    return false;
  }

  // How it ended first since that was told.
  const std::string& told() {
    stopped_ = false;
    return words_;
  }
  std::int64_t at = 0; // the point in whose call it ended

private:
  bool ready(std::size_t needed) {
    if (child_ != 0 && owner_ != getpid()) { // of the process that this one was forked from
      close(line_);
      child_ = 0;
      memory_ = nullptr;
      size_ = 0;
    }
    if (child_ != 0 && needed <= size_) return true;
    if (child_ != 0) { // it sees too little memory
      close(line_);
      while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {}
      child_ = 0;
    }
    return start(std::max(needed, size_));
  }

  bool start(std::size_t needed) {
    if (needed > size_) {
      if (memory_) munmap(memory_, size_ * sizeof(double));
      void* found = mmap(nullptr, needed * sizeof(double), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
      memory_ = found == MAP_FAILED ? nullptr : static_cast<double*>(found);
      size_ = memory_ ? needed : 0;
      if (!memory_) return false;
    }
    if (said_) std::fclose(said_);
    said_ = std::tmpfile();
    passed_on_ = 0;
    int ends[2];
    if (!said_ || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return false;
    flush_all(); // or the child would print it again
    owner_ = getpid();
    child_ = fork();
    if (child_ == 0) {
      close(ends[0]);
      serve(ends[1]);
    }
    close(ends[1]);
    line_ = ends[0];
    if (child_ > 0) return true;
    close(line_);
    child_ = 0;
    return false;
  }

  [[noreturn]] void serve(int with) {
    leave_at_exit();
    std::signal(SIGINT, SIG_IGN); // a Ctrl-C, which goes to both, is the parent's to answer
    std::signal(SIGTERM, SIG_IGN);
    std::signal(SIGHUP, SIG_IGN); // as that of a terminal that closes
    for (const int fault : {SIGALRM, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) std::signal(fault, SIG_DFL);
    dup2(fileno(said_), 1);
    dup2(fileno(said_), 2);
    Request q;
    while (receive(with, &q, sizeof q)) {
      const Shared shared(memory_, q.points, q.params, material_.state.size());
      const std::vector<double> params(shared.params, shared.params + q.params);
      const UmatCall call{material_,    params,           q.large != 0, q.direct, q.shear,
                          q.first_cell, q.points_of_cell, q.h,          q.time};
      alarm(unsigned(std::min(material_.time_limit, 1e6)) + 2); // if the parent is gone, nobody else ends it
      call_umat_points(call, q.points, shared.arrays, shared.working_on);
      alarm(0);
      flush_all();
      char answer = 'x';
      if (!give(with, &answer, 1)) break;
    }
    _exit(0);
  }

  // False if it took too long.
  bool wait() const {
    using Clock = std::chrono::steady_clock;
    const auto end = Clock::now() + std::chrono::duration<double>(patience());
    for (;;) {
      const double left = std::chrono::duration<double>(end - Clock::now()).count();
      if (left <= 0) return false;
      pollfd answer{line_, POLLIN, 0};
      const int found = poll(&answer, 1, left > 1e6 ? 1000000000 : int(1e3 * left) + 1);
      if (found > 0 || (found < 0 && errno != EINTR)) return true;
    }
  }

  // Once a call was stopped, others of the same cells that need as long are not waited for as long.
  double patience() const { return stopped_ ? std::max(0.01, material_.time_limit / 100) : material_.time_limit; }

  void end(bool in_time) {
    if (!in_time) kill(child_, SIGKILL);
    close(line_);
    int status = 0;
    while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {}
    child_ = 0;
    pass_on();
    char how[96];
    if (!in_time)
      std::snprintf(how, sizeof how, "did not end within %g s (time_limit) and was stopped", material_.time_limit);
    else
      std::snprintf(how, sizeof how, "ended its process (%s %d)", WIFSIGNALED(status) ? "signal" : "exit status",
                    WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
    if (!stopped_) words_ = how + ("; it said: " + (last_.empty() ? "nothing" : last_));
    stopped_ = true;
  }

  // Copies the new output of the routine to its usual stream; keeps the end of it for messages.
  void pass_on() {
    char part[1024];
    ssize_t got = 0;
    while ((got = pread(fileno(said_), part, sizeof part, passed_on_)) > 0) {
      if (passed_on_ == 0) last_.clear();
      passed_on_ += got;
      std::fwrite(part, 1, std::size_t(got), stdout);
      last_.append(part, std::size_t(got));
      if (last_.size() > 1000) last_.erase(0, last_.size() - 1000);
    }
    if (passed_on_ > 0) std::fflush(stdout);
    std::replace(last_.begin(), last_.end(), '\n', ' ');
  }

  const BulkMaterialInfo& material_;
  double* memory_ = nullptr;
  std::size_t size_ = 0;
  int line_ = -1;
  pid_t child_ = 0, owner_ = 0; // owner: the process that started it; one that is forked from that starts its own
  std::FILE* said_ = nullptr;
  off_t passed_on_ = 0;
  std::string last_, words_;
  bool stopped_ = false;
};

// Process of each material; they are called one at a time.
Apart& apart(const BulkMaterialInfo& material) {
  static std::map<const BulkMaterialInfo*, Apart> known;
  return known.try_emplace(&material, material).first->second;
}

} // namespace

void call_umat_apart(const UmatCall& call, std::int64_t points, const UmatArrays& a) {
  const auto states = std::ptrdiff_t(call.material.state.size());
  Apart& process = apart(call.material);
  if (process.call(call, points, a)) return;
  // the others are not known either; the first fault that is found is told
  std::copy_n(a.state_begin, points * states, a.state);
  std::fill_n(a.stress, 6 * points, 0.0);
  std::fill_n(a.tangent, 36 * points, 0.0);
  std::fill_n(a.energy, points, 0.0);
  std::fill_n(a.dissipated, points, 0.0);
  a.status[std::clamp<std::int64_t>(process.at, 0, points - 1)] = umat_ends;
}

std::string last_words(const BulkMaterialInfo& material) { return apart(material).told(); }

} // namespace cairn
