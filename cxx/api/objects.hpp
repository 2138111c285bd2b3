// Common parts of the C API: the objects behind the handles, and the conversion of exceptions to codes.
#pragma once
#include <atomic>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../base/call.hpp"
#include "../base/fastest.hpp"
#include "../files/file_error.hpp"
#include "../fluid/fluid_draft.hpp"
#include "../scene/mesh_parts.hpp"
#include "../strategies/options.hpp"
#include "../strategies/reshape_watches.hpp"
#include "../strategies/transforms.hpp"
#include "cairn/cairn.h"

// Materials and the rules between pairs of them.
struct cairn_matter {
  // By numbers of materials, -1 and -1 for all, or by words where these are given.
  struct Rule {
    int a, b;
    std::string word_a, word_b;
    bool meet;
    cairn::Law law;
    std::vector<double> parameters;
  };
  std::vector<std::string> materials, groups; // a group for each material, "" if none
  std::vector<Rule> rules;
  std::vector<std::string> joints;          // their names, each that of the material of its ends and of their group
  std::vector<std::string> meshes;          // their names
  std::vector<std::string> meet_themselves; // of meshes whose points meet their own sides
};

struct cairn_scene {
  explicit cairn_scene(int dim) : scene(dim) {}
  cairn::Scene scene;
  cairn_matter matter{};
  std::vector<cairn::MeshModel> meshes{};
  cairn::FluidDraft fluid{}; // without particles: no liquid
};

struct cairn_simulation {
  explicit cairn_simulation(cairn::Simulation made) : simulation(std::move(made)) {}
  cairn::Simulation simulation;
  // Present activity. While a step is made, it calls laws and bodies of the program, which may only read; the function
  // of cairn_simulation_before_parts may give loads, too.
  enum Work { nothing, step, loads };
  std::atomic<int> work{nothing};
  cairn::Transforms transforms{};
  cairn::ReshapeWatches watches{};
  std::vector<std::unique_ptr<cairn::Strategy>> left{}; // strategies that were in use, with their settings
  cairn_matter matter{};
  std::string fingerprint;                           // of the scene that it was made of
  bool restarted = false;                            // from a checkpoint
  std::map<std::string, std::int64_t> last_output{}; // its step, by the path of the run that it was written to
  cairn::FluidDraft fluid{};                         // of the scene, for bodies that come in
};

struct cairn_mesh {
  cairn::MeshDraft draft;
};

namespace cairn::api {

inline int32_t failed(cairn_error* error, int32_t code, const char* message) {
  if (error) {
    error->code = code;
    error->item = -1;
    std::snprintf(error->message, sizeof error->message, "%s", message);
  }
  return code;
}

// Runs body(); an exception becomes a code and a message.
template <class Body>
int32_t guarded(cairn_error* error, Body&& body) {
  try {
    body();
  } catch (const std::bad_alloc&) {
    return failed(error, cairn_out_of_memory, "out of memory");
  } catch (const Error& e) {
    return failed(error, cairn_wrong_input, e.what());
  } catch (const std::invalid_argument& e) {
    return failed(error, cairn_wrong_input, e.what());
  } catch (const FileError& e) { return failed(error, cairn_file_error, e.what()); } catch (const std::exception& e) {
    return failed(error, cairn_internal_error, e.what());
  } catch (...) { return failed(error, cairn_internal_error, "an exception of unknown type"); }
  if (error) *error = cairn_error{};
  return cairn_ok;
}

inline void require(const void* pointer, const char* name) {
  if (!pointer) throw Error(std::string(name) + " is NULL; it has no default");
}

// The simulation, refused while it makes a step that `call` would find half done; gives_loads: but for its function
// of cairn_simulation_before_parts. Over ranks, all make the call.
inline cairn_simulation& between_steps(cairn_simulation* simulation, const char* call, bool gives_loads = false) {
  require(simulation, "simulation");
  const int work = simulation->work;
  if (work == cairn_simulation::step || (work == cairn_simulation::loads && !gives_loads))
    throw Error(std::string(call) +
                " stands between steps, and one is being made, which called this function: call it once "
                "cairn_simulation_step has returned");
  if (work == cairn_simulation::nothing) simulation->simulation.strategy().meet(call);
  return *simulation;
}

// While it stands, the simulation is at that.
class AtWork {
public:
  AtWork(cairn_simulation& of, cairn_simulation::Work work) : of_(of), before_(of.work.exchange(work)) {}
  ~AtWork() { of_.work = before_; }
  AtWork(const AtWork&) = delete;
  AtWork& operator=(const AtWork&) = delete;

private:
  cairn_simulation& of_;
  int before_;
};

inline std::int64_t counted(std::int64_t n) {
  if (n < 0) throw Error("n is " + std::to_string(n) + "; it must be at least 0");
  return n;
}

template <class T>
std::span<const T> span_of(const T* values, std::int64_t n) {
  return values ? std::span<const T>(values, std::size_t(n)) : std::span<const T>();
}

inline void check_finite(const char* name, const double* values, std::int64_t n) {
  for (std::int64_t i = 0; i < n; ++i)
    if (!std::isfinite(values[i]))
      throw cairn::Error(std::string(name) + "[" + std::to_string(i) + "] is not a finite number");
}

inline void check_speed(const char* name, const double* values, std::int64_t n) {
  check_finite(name, values, n);
  for (std::int64_t i = 0; i < n; ++i)
    if (std::abs(values[i]) > cairn::fastest)
      throw cairn::Error(std::string(name) + "[" + std::to_string(i) + "]: " + cairn::too_fast);
}

// Copies a text, cut to `capacity` characters with the terminating nought.
inline void copy_text(const std::string& from, std::int64_t capacity, char* text) {
  if (capacity < 1) throw Error("capacity is " + std::to_string(capacity) + "; a text needs room for 1 character");
  require(text, "text");
  std::snprintf(text, std::size_t(capacity), "%s", from.c_str());
}

void check_word(const cairn_scene& scene, const std::string& word); // a material, a group or "*"
void check_materials(std::int64_t n, const std::int32_t* material, std::size_t known);
std::int64_t add_bodies(Scene& scene, std::int64_t n, const double* position, const double* rotation,
                        const double* velocity, const double* mass, const double* inertia);
std::int64_t add_contactors(Scene& scene, const char* shape, std::int64_t n, const std::int64_t* body,
                            const std::int32_t* material, const double* radius, const double* offset,
                            const double* direction, const std::int32_t* hull);
void drive(Scene& scene, std::int64_t n, const std::int64_t* bodies, std::uint8_t mask, const double* velocity);
// Values (components, n) of bodies, all of them in the order of insertion without ids.
// True for a field that bodies bear and that is no state of theirs.
bool is_load(const std::string& field);
void set_body_field(Scene& scene, const std::string& name, std::int64_t n, const std::int64_t* bodies,
                    const double* values);
LawTable table_of(const cairn_matter& matter, int dim);
void start_fluid(cairn_simulation& simulation); // that of its draft
void renew_fluid(cairn_simulation& simulation); // contactors came in
// Throws Error if the liquid, if there is one, cannot meet new contactors.
void check_fluid(const cairn_simulation& simulation, const char* shape, std::int64_t n, const std::int64_t* body,
                 const std::int32_t* material, const double* radius);
MeshBody& mesh_of(cairn_simulation& simulation, std::int32_t mesh);

} // namespace cairn::api
