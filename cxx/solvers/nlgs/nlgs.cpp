#include "nlgs.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>

#include "../policy.hpp"
#include "../sweeps/light_error.hpp"
#include "nlgs_part.hpp"

namespace cairn {

// A row NAME of parts.def: adds its part if it is of use in this step.
#define CAIRN_NLGS_PART(name, meaning) void add_##name(NlgsState&, NlgsParts&);
#include "parts.def"
#undef CAIRN_NLGS_PART

NlgsState::NlgsState(ContactSystem& of, const Velocities& free_velocity, const SolverOptions& with, SweepHelp* by,
                     SolveReport& to)
    : system(of), velocity_free(free_velocity), options(with), help(by), report(to),
      schedule(of.schedule(with.threads > 0 ? with.threads : omp_get_max_threads())),
      free(measure_free(of, schedule, with.tolerance)), wanted(with.tolerance * with.tolerance),
      ends_at(with.tolerance), extrapolates(with.extrapolates), uneven(masses_differ(mass_ratio(of), by && !of.pack)),
      error_square([this] { return measure().square; }) {
  system.keeps_velocity = uneven;
  schedule.softening_relaxation = options.softening_relaxation;
}

StepError NlgsState::measure(bool last) { return cairn::measure(system, schedule, free, last, report); }

bool NlgsState::asks_for_accuracy() const { return std::isfinite(options.accuracy); }

double NlgsState::aim() const {
  return asks_for_accuracy() ? policy().accuracy_aim * options.accuracy : options.tolerance;
}

bool near_rest(const NlgsState& s) {
  const double tolerances = policy().rest_speed;
  const double most = tolerances * tolerances * s.options.tolerance * s.options.tolerance * s.free.energy;
  double u[6 * 128], moving = 0;
  for (std::size_t k = 0; k < s.system.batches.size(); ++k) {
    const cairn_batch& b = s.system.batches[k];
    cairn_relative_velocities(&s.schedule, std::int32_t(k), 0, u);
    for (int c = 0; c < s.system.dim; ++c)
      for (int lane = 0; lane < b.contacts; ++lane)
        moving += b.rho[lane] * u[c * b.count + lane] * u[c * b.count + lane];
  }
  return moving <= most;
}

namespace {

// The sweeps of one step, and when to measure the error: the change of a sweep costs nothing; the error costs about a
// sweep. Between two errors their squares keep about the same ratio to the change, which tells when the next one is
// worth it.
class Nlgs {
public:
  explicit Nlgs(NlgsState& state) : s_(state) {
#define CAIRN_NLGS_PART(name, meaning) add_##name(s_, parts_);
#include "parts.def"
#undef CAIRN_NLGS_PART
    cairn_add_impulses(&s_.schedule);
  }

  void run() {
    for (NlgsPart* part : parts_)
      if (part->begin()) return;
    while (s_.report.iterations < s_.options.max_iterations) {
      const double change = sweep();
      for (NlgsPart* part : parts_) part->swept();
      if (std::isfinite(change) && !worth_measuring(change)) continue;
      StepError error = s_.measure();
      for (NlgsPart* part : parts_) part->measured(error);
      if (!error.finite || !std::isfinite(change)) {
        if (recovers(error)) continue;
        s_.report.status = SolveStatus::diverged;
        give_none(s_.system, s_.velocity_free);
        break;
      }
      if (enough(error) || follow(error, change)) break;
    }
  }

  void finish() {
    StepError end = s_.measure(true);
    SolverOptions asked = s_.options;
    asked.tolerance = s_.ends_at;
    for (NlgsPart* part : parts_) part->end(end, asked);
    if (end.square <= s_.wanted && s_.report.light_error <= asked.tolerance && !s_.system.cell) // which gives way
      end.unbounded = grows_without_end(s_.system, s_.schedule, s_.velocity_free, end, s_.aim());
    conclude(s_.report, end, asked);
    for (NlgsPart* part : parts_)
      if (s_.report.status == SolveStatus::converged) part->close();
  }

private:
  // A pass of sweeps; returns dr.W dr of the last one, dr its change of impulses [J].
  double sweep() {
    int& done = s_.report.iterations;
    SweepPass pass{std::max({1, done / policy().pass_share, s_.options.min_iterations - done})};
    for (NlgsPart* part : parts_) part->prepare(pass);
    const int left = s_.options.max_iterations - done, sweeps = std::min(pass.sweeps, left);
    if (!pass.by) cairn_nlgs_sweep(sweeps, &s_.schedule, s_.system.change.data());
    done += std::min(pass.by ? pass.by->sweep(sweeps) : sweeps, left);
    s_.taken_over = pass.by != nullptr;
    return total(s_.system.change, s_.system.batches.size(), 1, 0);
  }

  // The other solver is asked before the step fails.
  bool worth_measuring(double change) const {
    const bool promising = s_.ratio > 0 && change * s_.ratio <= s_.wanted;
    return promising || s_.report.iterations >= next_check_ ||
           (s_.help && s_.report.iterations >= s_.options.max_iterations);
  }

  bool recovers(const StepError& error) {
    return std::any_of(parts_.begin(), parts_.end(), [&](NlgsPart* part) { return part->recover(error); });
  }

  // True if this error ends the sweeps.
  bool enough(StepError& error) {
    if (s_.report.iterations < s_.options.min_iterations || !(error.square <= s_.wanted || s_.due)) return false;
    for (NlgsPart* part : parts_)
      if (const Verdict verdict = part->judge(error); verdict != Verdict::none) return verdict == Verdict::ends;
    return error.square <= s_.wanted && s_.report.light_error <= s_.ends_at;
  }

  bool follow(const StepError& error, double change) {
    bool ends = false;
    s_.ratio = change > 0 ? error.square / change : 0;
    for (NlgsPart* part : parts_) ends = part->follow(error, change) || ends;
    next_check_ =
        s_.report.iterations +
        std::max(policy().check_sweeps, s_.report.iterations / (s_.taken_over ? policy().check_share_extrapolated
                                                                              : policy().check_share_plain));
    return ends;
  }

  NlgsState& s_;
  NlgsParts parts_;
  int next_check_ = std::max(s_.options.min_iterations, 1);
};

std::int64_t contacts_of(const ContactSystem& system) {
  std::int64_t sum = 0;
  for (const cairn_batch& b : system.batches) sum += b.contacts;
  return sum;
}

} // namespace

SolveReport solve_nlgs(ContactSystem& system, const Velocities& velocity_free, const SolverOptions& options,
                       SweepHelp* help) {
  SolveReport report;
  report.penetration = system.penetration;
  report.drift = system.drift;
  report.contacts = contacts_of(system);
  report.iterations = options.done;
  system.load(velocity_free);
  if (std::isfinite(options.accuracy)) report.velocity_error = 0;
  if (system.batches.empty()) return report;
  NlgsState state(system, velocity_free, options, help, report);
  Nlgs nlgs(state);
  nlgs.run();
  nlgs.finish();
  return report;
}

} // namespace cairn
