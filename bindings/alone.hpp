// One thread at a time has a simulation. A step lets other threads of Python run meanwhile; where they use the
// simulation that steps, or its scene, they wait for the end of the step.
#pragma once
#include <pybind11/pybind11.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "simulation/simulation.hpp"

namespace cairn {

class StepAlone {
public:
  // With Python's lock held, as all that follows but the waiting itself.
  explicit StepAlone(const Simulation& s) : simulation_(&s) {
    wait_for(&s);
    all().stepping.push_back({&s, &s.scene, std::this_thread::get_id()});
  }
  ~StepAlone() {
    auto& stepping = all().stepping;
    const auto mine =
        std::find_if(stepping.rbegin(), stepping.rend(), [&](const Row& row) { return row.simulation == simulation_; });
    stepping.erase(std::next(mine).base());
    {
      const std::scoped_lock lock(all().mutex);
      ++all().ended;
    }
    all().one_ended.notify_all();
  }
  StepAlone(const StepAlone&) = delete;
  StepAlone& operator=(const StepAlone&) = delete;

  // Returns once no other thread steps the simulation, or the one whose scene this is.
  static void wait_for(const void* object) {
    while (busy(object)) {
      const std::int64_t seen = all().ended;
      const pybind11::gil_scoped_release release;
      std::unique_lock lock(all().mutex);
      all().one_ended.wait(lock, [&] { return all().ended != seen; });
    }
  }

private:
  struct Row {
    const void *simulation, *scene;
    std::thread::id thread;
  };
  struct All {
    std::vector<Row> stepping;
    std::int64_t ended = 0;
    std::mutex mutex;
    std::condition_variable one_ended;
  };
  static All& all() {
    static All* const rows = new All; // threads may still wait when the program ends
    return *rows;
  }
  static bool busy(const void* object) {
    return std::any_of(all().stepping.begin(), all().stepping.end(), [&](const Row& row) {
      return (row.simulation == object || row.scene == object) && row.thread != std::this_thread::get_id();
    });
  }

  const Simulation* simulation_;
};

} // namespace cairn

namespace pybind11::detail {

template <class T>
struct waiting_caster : type_caster_base<T> {
  bool load(handle from, bool convert) {
    if (!type_caster_base<T>::load(from, convert)) return false;
    cairn::StepAlone::wait_for(this->value);
    return true;
  }
};
template <>
struct type_caster<cairn::Simulation> : waiting_caster<cairn::Simulation> {};
template <>
struct type_caster<cairn::Scene> : waiting_caster<cairn::Scene> {};

} // namespace pybind11::detail
