#include "step_error.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "batch.hpp"
#include "contact_rounding.hpp"
#include "light_error.hpp"

namespace cairn {

double total(const Array<double>& values, std::size_t n, std::size_t stride, std::size_t offset) {
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += values[stride * i + offset];
  return sum;
}

namespace {

double rounding_of(const ContactSystem& system) {
  double sum = 0;
  each_rounding(system, [&](double of_a, double of_b) {
    sum += of_a;
    sum += of_b;
  });
  return rounding_square * sum;
}

} // namespace

// Scale of the error. Bonded bodies can carry self-equilibrated impulses, thousands of times those of their weight. An
// error relative to these alone could be as large as the weight: the solid would fall, with each step called converged.
// So the scale there is that of velocities and of their changes by loads, if smaller. Bodies at rest without loads have
// neither: they are solved to some digits above rounding. Pressure by growth is no load, so it is left out.
double least_of_scale(bool holds, bool grows, double tolerance) {
  constexpr double digits = 0x1p-30;
  return holds && !grows ? std::min(1.0, digits * digits / (tolerance * tolerance)) : 1;
}

FreeScale measure_free(ContactSystem& system, const cairn_schedule& schedule, double tolerance) {
  cairn_contact_scale(&schedule, system.sums.data());
  return {total(system.sums, system.batches.size(), 6, 0), rounding_of(system),
          least_of_scale(system.may_hold(), system.grows, tolerance)};
}

StepError measure(ContactSystem& system, const cairn_schedule& schedule, FreeScale free, bool last,
                  SolveReport& report) {
  // a millionth of the mean impulse of a contact
  const double least_scale = 0x1p-40 * free.energy / double(report.contacts);
  cairn_contact_error(&schedule, last, least_scale, system.sums.data());
  ++report.checks;
  const std::size_t n = system.batches.size();
  const double residual = total(system.sums, n, 6, 0), size = total(system.sums, n, 6, 1);
  double worst = 0, outside = 0;
  for (std::size_t b = 0; b < n; ++b) {
    const double* s = &system.sums[6 * b];
    if (s[2] > worst) {
      worst = s[2];
      report.worst_contact = system.candidate[system.batches[b].first + std::int64_t(s[3]) - 1];
    }
    outside = std::max(outside, s[4]);
  }
  double scale = std::max(size, free.energy);
  if (free.least < 1) {
    const double speed = system.speed();
    scale = std::clamp(speed * speed, free.least * scale, scale);
  }
  // the projection on a cone can swallow a velocity that is no number, so bodies are asked too
  bool finite = std::isfinite(residual) && std::isfinite(size) && std::isfinite(free.energy) && std::isfinite(scale);
  for (const cairn_record& r : system.record)
    finite = finite && std::isfinite(r.x[0] + r.x[1] + r.x[2] + r.x[3] + r.x[5]);
  StepError e{residual > free.rounding && scale > 0 ? residual / scale : 0, finite};
  e.growth = free.energy > 0 ? size / free.energy : 0;
  if (!finite) e.square = std::numeric_limits<double>::infinity();
  report.error = std::sqrt(e.square);
  report.worst_error = std::sqrt(worst);
  report.cone_distance = std::sqrt(outside);
  return e;
}

double endless_growth(double tolerance) {
  constexpr double share = 0.1;
  return share / std::max(tolerance, std::sqrt(std::numeric_limits<double>::epsilon()));
}

bool grows_without_end(ContactSystem& system, const cairn_schedule& schedule, const Velocities& velocity_free,
                       const StepError& error, double tolerance) {
  const double least = endless_growth(tolerance);
  if (!error.finite || !(error.growth > least * least) || !system.condensed.empty()) return false;
  return measure_light(system, schedule, velocity_free).power > least;
}

namespace {

// Advice by the end of the solver: more iterations do not help where it ended by itself. On the stack, since a step
// allocates nothing but the hint.
struct Remedy {
  char text[160];
  Remedy(const SolveReport& r, const SolverOptions& options, const char* others) {
    if (r.iterations >= options.max_iterations)
      std::snprintf(text, sizeof text, "allow more iterations, %s", others);
    else
      std::snprintf(text, sizeof text, "%s ended by itself, before its limit of %d: take %s%s", r.solver,
                    options.max_iterations, options.solver == "auto" ? "" : "cairn.Auto, ", others);
  }
};

// A contact by its place, after a few words; over ranks it is not known.
struct Named {
  char text[64] = "";
  Named(const char* words, std::int64_t contact) {
    if (contact >= 0) std::snprintf(text, sizeof text, "%s%lld", words, static_cast<long long>(contact));
  }
};

std::string hint_of(const SolveReport& r, const StepError& last, const SolverOptions& options) {
  constexpr double rounding = 16 * std::numeric_limits<double>::epsilon();
  char text[500];
  const bool limited = r.iterations >= options.max_iterations;
  if (last.unbounded)
    std::snprintf(text, sizeof text,
                  "impulses grow without end, and contacts close as without them: no motion obeys bodies that are "
                  "squeezed; look for what is driven or held on both sides%s",
                  Named(", near contact ", r.worst_contact).text);
  else if (r.status == SolveStatus::diverged)
    std::snprintf(text, sizeof text,
                  "impulses are not finite after %d iterations, so none were given: look for velocities, masses or "
                  "gaps of absurd size%s, or lower dt",
                  r.iterations, Named(" near contact ", r.worst_contact).text);
  else if (r.error <= rounding && r.light_error > options.tolerance)
    std::snprintf(text, sizeof text,
                  "light bodies under heavy ones are not solved: light_error %.2e, tol is %.2e%s, and only rounding is "
                  "left of the error: their masses differ by more than 16 digits tell apart, so that neither "
                  "more iterations nor a smaller tol help: give %smasses that differ less, or a tol of %.0e or more",
                  r.light_error, options.tolerance, Named(", the worst contact is ", r.light_contact).text,
                  options.solver == "auto" ? "" : "cairn.Auto, ", 2 * r.light_error);
  else if (r.error <= options.tolerance && r.light_error > options.tolerance)
    std::snprintf(
        text, sizeof text,
        "light bodies under heavy ones are not solved: light_error %.2e, tol is %.2e, after %d iterations%s: %s",
        r.light_error, options.tolerance, r.iterations, Named(", the worst contact is ", r.light_contact).text,
        Remedy(r, options, limited && options.solver != "auto" ? "cairn.Auto or a smaller dt" : "a smaller tol or dt")
            .text);
  else if (r.error <= options.tolerance && last.rounded)
    std::snprintf(text, sizeof text,
                  "only rounding is left of the error after %d iterations, and velocities are not known to be as exact "
                  "as was asked: velocity_error %.2e, accuracy is %.2e: more iterations change nothing, give an "
                  "accuracy of %.0e or more",
                  r.iterations, r.velocity_error, options.accuracy, 2 * r.velocity_error);
  else if (r.error <= options.tolerance && r.velocity_error <= options.accuracy)
    std::snprintf(
        text, sizeof text,
        "velocities may be as exact as was asked, but nothing proves it: velocity_error %.2e is an estimate from their "
        "changes alone, accuracy is %.2e, after %d iterations: %s",
        r.velocity_error, options.accuracy, r.iterations, Remedy(r, options, "a larger accuracy or a smaller dt").text);
  else if (r.error <= options.tolerance)
    std::snprintf(
        text, sizeof text,
        "velocities are not known to be as exact as was asked: velocity_error %.2e, accuracy is %.2e, after %d "
        "iterations: %s",
        r.velocity_error, options.accuracy, r.iterations, Remedy(r, options, "a larger accuracy or a smaller dt").text);
  else
    std::snprintf(text, sizeof text, "error %.2e after %d iterations, tol is %.2e: %s%s", r.error, r.iterations,
                  options.tolerance, Remedy(r, options, "a larger tol or a smaller dt").text,
                  Named("; the worst contact is ", r.worst_contact).text);
  return text;
}

} // namespace

void conclude(SolveReport& report, const StepError& last, const SolverOptions& options, const std::string& hint) {
  const bool exact = !last.vague && (!std::isfinite(options.accuracy) || report.velocity_error <= options.accuracy);
  const bool small =
      last.finite && exact && !last.unbounded && std::max(report.error, report.light_error) <= options.tolerance;
  if (!last.finite) report.status = SolveStatus::diverged;
  if (report.status != SolveStatus::diverged)
    report.status = small ? SolveStatus::converged : SolveStatus::iteration_limit;
  if (report.status == SolveStatus::converged) return;
  if (hint.empty() || last.unbounded)
    report.hint = hint_of(report, last, options);
  else
    report.hint = hint;
}

void give_none(ContactSystem& system, const Velocities& velocity_free) {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      for (int k = 0; k < b.components; ++k) at(b, b.r, lane, k) = 0;
  system.load(velocity_free);
}

} // namespace cairn
