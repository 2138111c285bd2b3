#include "ranked_sweeps.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "../solvers/policy.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/step_error.hpp"
#include "cairn/rows/ranked_sweep.h"

namespace cairn {
namespace {

// True where a side that moves rests on a face: plain sweeps stay near the answer that the step begins with. On meshes
// over-relaxed ones carry impulses along an edge.
bool faced(const cairn_batch& b) {
  return b.mapped_a || b.mapped_b || (b.moves_a && !is_radial(b.side_a)) || (b.moves_b && !is_radial(b.side_b));
}

} // namespace

void add_over_ranks(std::span<ExactSum> sums, Exchange& exchange) {
  if (exchange.whole()) return exchange.sum({}); // it has all terms
  constexpr std::size_t words = ExactSum::words + 1;
  std::vector<std::int64_t> all(words * sums.size());
  for (std::size_t k = 0; k < sums.size(); ++k) sums[k].write({all.data() + words * k, words});
  exchange.sum(all);
  for (std::size_t k = 0; k < sums.size(); ++k) sums[k].read({all.data() + words * k, words});
}

RankedSweeps::RankedSweeps(std::vector<Part>& parts, ColourLinks& links, int colours, Exchange& exchange,
                           const SolverOptions& options, SweepExchange* once_a_sweep)
    : parts_(parts), links_(links), colours_(colours), exchange_(exchange), options_(options),
      once_(exchange.ranks() > 1 ? once_a_sweep : nullptr) {
  if (once_) once_->start();
  double least = std::numeric_limits<double>::infinity(), most = 0;
  std::int64_t counts[] = {0, 0};                             // contacts, those on faces
  const bool ends_early = options.enough > options.tolerance; // as without ranks, where clumps count in such packs
  double other_shapes[] = {0};
  for (Part& part : parts) {
    ContactSystem& system = part.simulation->interactions.system();
    const int threads = options.threads > 0 ? options.threads : omp_get_max_threads();
    Share& share = shares_.emplace_back();
    share.system = &system;
    share.bodies = &part.simulation->scene.bodies;
    share.nodes = &part.simulation->scene.nodes;
    share.schedule = system.schedule(threads);
    share.schedule.softening_relaxation = options.softening_relaxation;
    for (const cairn_batch& b : system.batches) {
      counts[0] += b.contacts;
      if (faced(b)) counts[1] += b.contacts;
    }
    if (!system.batches.empty() && !(system.clumps && ends_early)) other_shapes[0] = 1;
    for (std::size_t i = 0; i < part.bodies.size(); ++i) {
      if (!part.own[i] || part.fixed[i]) continue;
      const double* inverse = part.simulation->scene.bodies.inverse_mass[std::int64_t(i)];
      const double light = *std::max_element(inverse, inverse + system.dim);
      if (light > 0) least = std::min(least, light), most = std::max(most, light);
    }
    for (const CondensedBody& mesh : system.condensed)
      if (mesh.inverse_mass > 0) {
        most = std::max(most, mesh.inverse_mass);
        least = std::min(least, mesh.inverse_mass * double(mesh.touching));
      }
  }
  exchange.sum(counts);
  exchange.largest(other_shapes);
  double ends[] = {-least, most};
  exchange.largest(ends);
  contacts_ = counts[0];
  mass_ratio_ = ends[1] > 0 ? ends[1] / -ends[0] : 1;
  const bool on_faces = other_shapes[0] > 0 && double(counts[1]) > policy().extrapolation_faces * double(counts[0]);
  extrapolates_ = options.extrapolates && mass_ratio_ <= policy().extrapolation_mass_ratio && !on_faces;
  clumps_ = !(other_shapes[0] > 0);
}

void RankedSweeps::drive_cell(double h) {
  cell_.begin(parts_, h, exchange_);
  extrapolates_ = extrapolates_ && !cell_.follows();
  if (cell_.follows()) cell_.follow(parts_, exchange_);
}

// kernel(schedule) on the contacts of each colour, and the velocities that it changed to those who share them.
template <class Kernel>
void RankedSweeps::by_colours(Kernel&& kernel, double share) {
  if (exchange_.ranks() == 1) return kernel(shares_[0].schedule, *shares_[0].system);
  if (once_) {
    std::vector<Array<cairn_record>*> records;
    for (std::size_t l = 0; l < shares_.size(); ++l) {
      ContactSystem& system = *shares_[l].system;
      records.push_back(&system.record);
      once_->begin(l, system.record);
      if (!system.batches.empty()) kernel(shares_[l].schedule, system);
    }
    once_->end(records, exchange_, share);
    return;
  }
  for (int colour = 0; colour < colours_; ++colour) {
    for (Share& share : shares_) {
      if (share.system->batches.empty()) continue;
      cairn_schedule of_colour = share.schedule;
      of_colour.stages = 1;
      of_colour.first_task += colour;
      if (of_colour.first_task[0] < of_colour.first_task[1]) kernel(of_colour, *share.system);
    }
    tell(colour);
  }
}

void RankedSweeps::tell(int colour) {
  const auto k = std::size_t(colour);
  const int n = shares_[0].system->velocities();
  const auto each = [&](bool out, auto&& f) {
    for (std::size_t l = 0; l < shares_.size(); ++l)
      for (std::size_t j = 0; j < links_.links[l].size(); ++j) {
        Link& link = links_.links[l][j];
        const auto& first = out ? link.out_first : link.in_first;
        for (std::int32_t at = first[k]; at < first[k + 1]; at += n)
          f(shares_[l].system->record[std::size_t((out ? links_.out : links_.in)[l][j][std::size_t(at / n)])].x,
            (out ? link.out : link.in).data() + at);
      }
  };
  each(true, [n](const double* x, double* numbers) { std::copy_n(x, n, numbers); });
  exchange_.pass(links_.links, colour);
  each(false, [n](double* x, const double* numbers) { std::copy_n(numbers, n, x); });
}

void RankedSweeps::each_colour(const std::function<void(const cairn_schedule&, const ContactSystem&)>& f) {
  by_colours(f);
}

void RankedSweeps::give_impulses() {
  for (Share& share : shares_) share.system->load(share.free());
  by_colours([](const cairn_schedule& schedule, ContactSystem&) { cairn_add_impulses(&schedule); });
}

// f(impulses, their number, lanes of a row, place of the first lane, batch) for every row of impulses in memory.
template <class F>
void RankedSweeps::each_row(Share& share, F&& f) const {
  for (const cairn_batch& b : share.system->batches) {
    const auto lanes = std::size_t(b.count), components = std::size_t(b.components);
    if (!b.pack) f(b.r, lanes * components, lanes, std::size_t(0), b);
    for (std::size_t first = 0; b.pack && first < lanes; first += 8)
      f(b.r + first * std::size_t(b.pack), 8 * components, std::size_t(8), first, b);
  }
}

// Begins beyond the last sweep (Nesterov 1983): velocities follow, since they are linear in the impulses.
template <int n>
void RankedSweeps::extrapolate_bodies(Share& share, double factor) {
  ContactSystem& system = *share.system;
  share.before.resize(std::size_t(n) * std::size_t(system.bodies));
  cairn_record* record = system.record.data();
  double* all = share.before.data();
#pragma omp parallel for schedule(static) num_threads(share.schedule.threads) if (share.schedule.threads > 1)
  for (std::int64_t b = 0; b < system.bodies; ++b) {
    double *before = all + n * b, *v = record[b].x, now[n];
    std::copy_n(v, n, now);
    for (int k = 0; k < n && factor > 0; ++k) v[k] = now[k] + factor * (now[k] - before[k]);
    std::copy_n(now, n, before);
  }
}

void RankedSweeps::extrapolate_nodes(Share& share, double factor) {
  Array<double>& velocity = share.system->condensed_velocity;
  share.condensed_before.resize(velocity.size());
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    const double now = velocity[i];
    if (factor > 0) velocity[i] = now + factor * (now - share.condensed_before[i]);
    share.condensed_before[i] = now;
  }
}

void RankedSweeps::extrapolate_velocities(double factor) {
  for (Share& share : shares_) {
    share.system->dim == 2 ? extrapolate_bodies<3>(share, factor) : extrapolate_bodies<6>(share, factor);
    if (!share.system->condensed.empty()) extrapolate_nodes(share, factor);
  }
}

void RankedSweeps::extrapolate_impulses(double factor) {
  for (Share& share : shares_) {
    std::size_t at = 0;
    each_row(share, [&](double* r, std::size_t count, std::size_t, std::size_t, const cairn_batch&) {
      if (share.r_before.size() < at + count) share.r_before.resize(at + count), share.r_start.resize(at + count);
      for (std::size_t k = 0; k < count; ++k, ++at) {
        const double now = r[k];
        if (factor > 0) r[k] = now + factor * (now - share.r_before[at]);
        share.r_before[at] = now;
        share.r_start[at] = r[k];
      }
    });
  }
}

// Tells whether the extrapolation still points along the sweeps (O'Donoghue & Candes 2015).
void RankedSweeps::follow_sweep() {
  ExactSum sums[2]; // of changes, and of those against the way
  for (Share& share : shares_) {
    std::size_t at = 0;
    each_row(share,
             [&](const double* r, std::size_t count, std::size_t lanes, std::size_t first, const cairn_batch& b) {
               for (std::size_t lane = 0; lane < lanes && first + lane < std::size_t(b.contacts); ++lane) {
                 double square = 0, way = 0;
                 for (std::size_t k = lane; k < count; k += lanes) {
                   const double change = r[k] - share.r_start[at + k];
                   square += change * change;
                   way -= change * (r[k] - share.r_before[at + k]);
                 }
                 sums[0].add(square / b.rho[first + lane]);
                 sums[1].add(way / b.rho[first + lane]);
               }
               at += count;
             });
  }
  add_over_ranks(sums, exchange_);
  sequence_.follow(sums[0].value(), sums[1].value());
}

// Reciprocal of a unit: a sum near `scale` then has 13 digits, and terms up to 128 times `scale` are told apart.
double RankedSweeps::reciprocal_unit(double scale) {
  constexpr int digits = 44, most = 1000;
  int exponent = 0;
  std::frexp(scale, &exponent);
  return std::ldexp(1.0, std::min(digits - exponent, most));
}

// Sums of whole numbers, in units that follow the last sweep: exact sums would cost a third of a sweep. A sum that is
// far smaller or larger than the last one is coarse once, and no more in the next sweep.
void RankedSweeps::sweep_extrapolated() {
  constexpr double steps_over_change = 1024; // extrapolated steps are longer than the changes of a sweep
  const double factor = sequence_.factor(), of_change = reciprocal_unit(change_),
               of_way = reciprocal_unit(steps_over_change * change_);
  extrapolate_velocities(factor);
  for (Share& share : shares_) {
    std::int32_t components = 1;
    for (const cairn_batch& b : share.system->batches) components = std::max(components, b.components);
    share.stride = components;
    share.r_before.resize(std::size_t(components) * std::size_t(share.system->places()));
    share.change.resize(share.system->batches.size());
    share.along.resize(share.system->batches.size());
  }
  by_colours([&](const cairn_schedule& schedule, ContactSystem& system) {
    Share& share = *std::ranges::find(shares_, &system, &Share::system);
    cairn_ranked_sweep(&schedule, factor, share.stride, share.r_before.data(), of_change, of_way, share.change.data(),
                       share.along.data());
  });
  std::int64_t sums[] = {0, 0, 0, 0}; // of changes, their low and their high words; of those against the way
  const auto add = [&](std::int64_t sum, std::int64_t* words) {
    words[0] += sum & 0xffffffff;
    words[1] += sum >> 32;
  };
  for (const Share& share : shares_)
    for (std::size_t b = 0; b < share.system->batches.size(); ++b) {
      add(share.change[b], sums);
      add(share.along[b], sums + 2);
    }
  exchange_.sum(sums);
  const auto total = [](const std::int64_t* words) { return std::ldexp(double(words[1]), 32) + double(words[0]); };
  const double least = 0x1p-40 * change_, change = total(sums) / of_change;
  sequence_.follow(change, total(sums + 2) / of_way);
  change_ = std::max(change, least);
}

// A sweep with one exchange at its end, of which a share is taken: impulses as velocities.
template <class Kernel>
void RankedSweeps::sweep_once(Kernel&& kernel) {
  const double part = once_->share();
  for (Share& share : shares_) {
    share.v_sweep.assign(share.system->condensed_velocity.begin(), share.system->condensed_velocity.end());
    std::size_t at = 0;
    each_row(share, [&](const double* r, std::size_t count, std::size_t, std::size_t, const cairn_batch&) {
      if (share.r_sweep.size() < at + count) share.r_sweep.resize(at + count);
      std::copy_n(r, count, share.r_sweep.begin() + std::ptrdiff_t(at));
      at += count;
    });
  }
  by_colours(kernel, part);
  for (Share& share : shares_) {
    Array<double>& velocity = share.system->condensed_velocity;
    for (std::size_t i = 0; i < velocity.size() && part < 1; ++i)
      velocity[i] = share.v_sweep[i] + part * (velocity[i] - share.v_sweep[i]);
    std::size_t at = 0;
    each_row(share, [&](double* r, std::size_t count, std::size_t, std::size_t, const cairn_batch&) {
      for (std::size_t k = 0; k < count; ++k, ++at) r[k] = share.r_sweep[at] + part * (r[k] - share.r_sweep[at]);
    });
  }
}

void RankedSweeps::sweep() {
  const bool extrapolates = extrapolates_ && iterations_ >= policy().plain_sweeps;
  const double factor = sequence_.factor();
  for (Share& share : shares_) share.schedule.relaxation = extrapolates || once_ || cell_.follows() ? 1 : relaxation_;
  const auto kernel = [](const cairn_schedule& schedule, ContactSystem& system) {
    cairn_nlgs_sweep(1, &schedule, system.change.data());
  };
  counted_ = extrapolates && !once_;
  if (!counted_) ratio_ = 0;
  if (counted_) {
    sweep_extrapolated();
  } else if (extrapolates) {
    extrapolate_velocities(factor);
    extrapolate_impulses(factor);
    sweep_once(kernel);
    follow_sweep();
  } else {
    once_ ? sweep_once(kernel) : by_colours(kernel);
  }
  if (cell_.follows()) cell_.follow(parts_, exchange_);
  ++iterations_;
}

// Errors of counted sweeps follow their changes, as the last measurement found them to.
bool RankedSweeps::worth_measuring(double wanted) const {
  const bool promising = ratio_ > 0 && change_ * ratio_ <= wanted;
  return promising || iterations_ >= next_check_ || iterations_ >= options_.max_iterations;
}

// Sweeps until the next error is worth its cost: by how the last ones fell, as far as changes do not tell it.
int RankedSweeps::sweeps_to_check(double square, double wanted) {
  const Policy& p = policy();
  const int since = std::max(iterations_ - last_check_, 1);
  const int most =
      extrapolates_ ? std::max(p.check_sweeps, iterations_ / p.check_share_extrapolated) : std::max(4, iterations_ / 4);
  double to_come = std::max(4, iterations_ / 8);
  if (ratio_ > 0) {
    to_come = most;
  } else if (last_square_ > square && square > 0 && last_check_ > 0) {
    const double rate = std::log(last_square_ / square) / since;
    to_come = std::clamp(0.6 * std::log(square / wanted) / rate, 1.0, double(most));
  } else if (iterations_ < p.plain_sweeps) {
    to_come = 2;
  }
  last_check_ = iterations_;
  last_square_ = square;
  return int(to_come);
}

// A few contacts that slip may cycle, for ever if sweeps are extrapolated or over-relaxed.
void RankedSweeps::damp() {
  extrapolates_ = false;
  cycles_ = true;
  relaxation_ = policy().relaxation_damped;
}

// Projected over-relaxation where sweeps are not extrapolated (Cryer 1971), less where an error did not fall.
void RankedSweeps::relax(double square) {
  if (once_) {
    constexpr double half = 0.5; // below it, extrapolated sweeps diverge
    once_->follow(square);
    extrapolates_ = extrapolates_ && once_->share() > half;
    return;
  }
  if (extrapolates_ || cycles_) return;
  if (!relaxes_ && iterations_ >= policy().plain_sweeps) {
    relaxes_ = true;
    relaxation_ = policy().relaxation_first;
  } else if (!(square < policy().relaxation_fall * relaxed_square_)) {
    relaxation_ = std::max(1.0, relaxation_ - policy().relaxation_decrement);
  }
  relaxed_square_ = std::min(relaxed_square_, square);
}

void RankedSweeps::keep_best(double square) {
  if (!(square < least_square_)) return;
  least_square_ = square;
  for (Share& share : shares_) {
    std::size_t at = 0;
    each_row(share, [&](const double* r, std::size_t count, std::size_t, std::size_t, const cairn_batch&) {
      if (share.best.size() < at + count) share.best.resize(at + count);
      std::copy_n(r, count, share.best.begin() + std::ptrdiff_t(at));
      at += count;
    });
  }
}

bool RankedSweeps::give_back(double square) {
  if (!(least_square_ < square)) return false;
  for (Share& share : shares_) {
    std::size_t at = 0;
    each_row(share, [&](double* r, std::size_t count, std::size_t, std::size_t, const cairn_batch&) {
      std::copy_n(share.best.begin() + std::ptrdiff_t(at), count, r);
      at += count;
    });
  }
  give_impulses();
  if (cell_.follows()) cell_.follow(parts_, exchange_);
  return true;
}

// True of a dense pack, as in the sweeps of one rank: many contacts press, and most of them did in the last step.
bool RankedSweeps::persists() {
  std::int64_t counts[] = {0, 0}; // that press, that did in the last step too
  for (const Share& share : shares_)
    for (const cairn_batch& b : share.system->batches)
      for (int lane = 0; lane < b.contacts; ++lane) {
        const bool presses = at(b, b.r, lane, 0) > 0;
        counts[0] += presses;
        counts[1] += presses && b.status[lane] != 0;
      }
  exchange_.sum(counts);
  return counts[0] >= policy().pack_contacts && 2 * counts[1] > counts[0];
}

void RankedSweeps::tell_depth(SolveReport& report) {
  double depth[] = {0, 0};
  for (const Share& share : shares_) {
    depth[0] = std::max(depth[0], share.system->penetration);
    depth[1] = std::max(depth[1], share.system->drift);
  }
  exchange_.largest(depth);
  report.penetration = depth[0];
  report.drift = depth[1];
}

// What may follow upon an error: the end of dense packs, the error of light bodies, the impulses of another solver.
void RankedSweeps::look_further(Error& error, double& wanted, SolveReport& report) {
  const bool may_end_early = options_.enough > options_.tolerance;
  if (may_end_early && iterations_ >= options_.patience && persists()) wanted = options_.enough * options_.enough;
  if (error.square <= wanted && uneven_) measure_light(report);
  if (!help_ || (may_end_early && iterations_ < options_.patience)) return;
  if (!get_help(error, error.square <= wanted, report)) return;
  error = measure();
  helped_astray_ = !error.finite;
  if (error.square <= wanted && uneven_) measure_light(report);
}

// Where the error is no number: back to the best impulses, without what led away from them; else to none.
bool RankedSweeps::falls_back(const Error& error, SolveReport& report) {
  if ((extrapolates_ || helped_astray_) && give_back(error.square)) {
    if (!helped_astray_) extrapolates_ = false;
    helped_astray_ = false;
    return true;
  }
  report.status = SolveStatus::diverged;
  for (Share& share : shares_)
    each_row(share, [](double* r, std::size_t count, std::size_t, std::size_t, const cairn_batch&) {
      std::fill_n(r, count, 0.0);
    });
  return false;
}

SolveReport RankedSweeps::solve() {
  SolveReport report;
  report.contacts = contacts_;
  tell_depth(report);
  if (contacts_ == 0) {
    if (std::isfinite(options_.accuracy)) report.velocity_error = 0;
    for (Share& share : shares_) share.system->load(share.free());
    if (cell_.driven()) cell_.follow(parts_, exchange_);
    cell_.end(parts_);
    return report;
  }
  const bool may_end_early = options_.enough > options_.tolerance;
  for (Share& share : shares_)
    for (const cairn_batch& b : share.system->batches)
      for (int lane = 0; lane < b.contacts && may_end_early; ++lane) b.status[lane] = at(b, b.r, lane, 0) > 0;
  measure_free();
  leave_stale_start();
  give_impulses();
  double wanted = options_.tolerance * options_.tolerance;
  next_check_ = std::max(options_.min_iterations, 1);
  constexpr int least_between = 4; // sweeps between two light errors
  uneven_ = masses_differ(mass_ratio_, help_ && help_->possible());
  const bool sweeps = !(help_ && help_->alone());
  if (!sweeps) solve_elsewhere(report);
  while (sweeps && iterations_ < options_.max_iterations) {
    if (clumps_ && extrapolates_ && iterations_ >= policy().clump_sweeps) damp();
    sweep();
    if (!worth_measuring(wanted)) continue;
    Error error = measure();
    if (error.finite) look_further(error, wanted, report);
    if (!error.finite && falls_back(error, report)) continue;
    if (!error.finite) break;
    const bool small = error.square <= wanted;
    if (small && !std::isnan(report.velocity_error) && !proven_)
      break; // the rank that solves made all sweeps that are allowed
    if (small && report.light_error <= std::sqrt(wanted) && iterations_ >= options_.min_iterations) break;
    keep_best(error.square);
    relax(error.square);
    if (!small) sequence_.follow_error(iterations_);
    ratio_ = counted_ && !small ? error.square / change_ : 0;
    next_check_ =
        iterations_ + (small ? std::max(least_between, iterations_ / 8) : sweeps_to_check(error.square, wanted));
    if (may_end_early && iterations_ < options_.patience) next_check_ = std::min(next_check_, options_.patience);
    if (help_ && iterations_ < help_->last_call()) next_check_ = std::min(next_check_, help_->last_call());
  }
  finish(wanted, report);
  cell_.end(parts_);
  return report;
}

void RankedSweeps::finish(double wanted, SolveReport& report) {
  // light bodies between heavy ones would feel the rounding of impulses
  const bool keeps = uneven_ && report.status != SolveStatus::diverged;
  if (!keeps) give_impulses();
  if (cell_.driven()) cell_.follow(parts_, exchange_);
  Error end = measure(&report);
  if (iterations_ >= options_.max_iterations && end.square > wanted && give_back(end.square)) end = measure(&report);
  if (uneven_ && end.finite) measure_light(report);
  report.iterations = iterations_;
  report.checks = checks_;
  report.error = std::sqrt(end.square);
  SolverOptions asked = options_;
  asked.tolerance = std::sqrt(wanted);
  if (!std::isfinite(options_.accuracy) && report.velocity_error > 0) asked.accuracy = options_.tolerance;
  StepError last{end.square, end.finite, end.growth};
  last.unbounded = end.square <= wanted && report.light_error <= asked.tolerance && grows_without_end(end);
  last.vague = std::isfinite(options_.accuracy) && !proven_;
  last.rounded = last.vague && !(end.square > 0);
  conclude(report, last, asked, hint_of(report, asked.tolerance));
}

} // namespace cairn
