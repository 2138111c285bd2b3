// A part of NLGS in steps: one mechanism beside the sweeps, in a file of its own, switched on by its row of parts.def.
// The loop, nlgs.cpp, calls the hooks of all parts in the order of the list.
#pragma once
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <memory_resource>
#include <utility>

#include "../solve_report.hpp"
#include "../solver_options.hpp"
#include "../sweeps/contact_system.hpp"
#include "../sweeps/refinement.hpp"
#include "../sweeps/step_error.hpp"
#include "sweep_help.hpp"

namespace cairn {

// State of one solve that the loop and its parts share.
struct NlgsState {
  NlgsState(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options, SweepHelp* help,
            SolveReport& report);

  ContactSystem& system;
  const Velocities& velocity_free;
  const SolverOptions& options;
  SweepHelp* help; // null: none
  SolveReport& report;
  cairn_schedule schedule;
  const FreeScale free;
  double wanted;           // square of the error that ends the sweeps; below that of the tolerance for exact velocities
  double ends_at;          // error at which the step counts as converged
  double ratio = 0;        // square of the error over the change of a sweep, which foretells the next [1/J]
  bool extrapolates;       // sweeps are extrapolated, from the tenth on
  bool cycles = false;     // extrapolated sweeps of a pack took so long that a few of its contacts may cycle
  bool taken_over = false; // the last pass was made by a part
  bool uneven;             // masses differ so much that light errors count
  bool help_waits = false; // the other solver is not asked yet
  bool due = false;        // velocities are looked at although the error is above the one wanted
  bool proven = false;     // velocities are known to be as exact as was asked
  bool changed = false;    // by another method than sweeps, since the last of them
  Refinement refinement;   // the last one of velocities
  std::function<double()>
      error_square; // measures the present impulses; captures one pointer, so that no call allocates

  StepError measure(bool last = false);
  bool above(const StepError& error) const { return error.finite && error.square > wanted; }
  // Error of impulses that sweeps aim at; where an accuracy of velocities was asked, that times accuracy_aim.
  double aim() const;
  bool asks_for_accuracy() const;
};

class NlgsPart;

// A number of sweeps made in one go, and the part that makes them.
struct SweepPass {
  int sweeps;
  NlgsPart* by = nullptr; // null: plain sweeps
};

enum class Verdict {
  none,    // the errors decide
  goes_on, // more sweeps
  ends     // the impulses at hand are the solution
};

class NlgsPart {
public:
  virtual ~NlgsPart() = default;
  // Before the first sweep, with the impulses of the last step. True: they are the solution, and stay as they are.
  virtual bool begin() { return false; }
  // Before a pass: takes it over, or makes it shorter.
  virtual void prepare(SweepPass&) {}
  // Makes sweeps that it took over, their last change in system.change; returns how many that was in work.
  virtual int sweep(int sweeps) { return sweeps; }
  // After each pass. No error is known, and none may be measured.
  virtual void swept() {}
  // Brings the error that was just measured down, if it is above the wanted one.
  virtual void measured(StepError&) {}
  // Called once the error is small enough: the step ends, goes on, or the errors decide.
  virtual Verdict judge(StepError&) { return Verdict::none; }
  // Sweeps go on after this error; change: dr.W dr of the last sweep [J]. True: they end here all the same.
  virtual bool follow(const StepError&, double change) {
    (void)change;
    return false;
  }
  // Impulses are no numbers. True: they are again, and sweeps go on.
  virtual bool recover(const StepError&) { return false; }
  // After the last sweep: figures of the report, and the tolerances by which it will be concluded.
  virtual void end(StepError&, SolverOptions& asked) { (void)asked; }
  // The step converged.
  virtual void close() {}
};

// The parts of one solve in room on the stack, so that a step allocates nothing.
class NlgsParts {
public:
  static constexpr std::size_t most = 32;
  NlgsParts() = default;
  NlgsParts(const NlgsParts&) = delete;
  NlgsParts& operator=(const NlgsParts&) = delete;
  ~NlgsParts() {
    while (count_ > 0) std::destroy_at(parts_[--count_]);
  }
  template <class Part, class... Arguments>
  void add(Arguments&&... arguments) {
    void* place = memory_.allocate(sizeof(Part), alignof(Part));
    parts_[count_] = new (place) Part(std::forward<Arguments>(arguments)...);
    ++count_;
  }
  NlgsPart* const* begin() const { return parts_.data(); }
  NlgsPart* const* end() const { return parts_.data() + count_; }

private:
  alignas(std::max_align_t) std::array<std::byte, 8192> room_;
  std::pmr::monotonic_buffer_resource memory_{room_.data(), room_.size()};
  std::array<NlgsPart*, most> parts_;
  std::size_t count_ = 0;
};

// True if contacts move too little for the tolerance to tell it from rest. Errors of one sign would move standing
// bodies by a margin below the tolerance, step by step, until they fall (a stack at the edge of toppling).
bool near_rest(const NlgsState&);

} // namespace cairn
