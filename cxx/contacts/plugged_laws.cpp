// Checks of laws from users' libraries: their results must be finite.
#include "plugged_laws.hpp"

#include <omp.h>

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/contact_rows.hpp"

namespace cairn {

void PluggedFault::note(std::int32_t at_batch, int at_lane, int at_component, const char* name, double found) {
#pragma omp critical(cairn_plugged_fault)
  if (batch < 0 || at_batch < batch) *this = {at_batch, at_lane, at_component, name, found};
}

void PluggedLawChecks::check_prepared(const cairn_batch& b, const double* bias, const double* compliance,
                                      const double* mu) {
  const int n = b.count, states = int(law_infos()[b.law].state.size());
  const auto at_batch = std::int32_t(&b - system_.batches.data());
  const auto check = [&](const char* name, const double* values, int columns, bool positive) {
    for (int k = 0; k < columns; ++k)
      for (int lane = 0; lane < b.contacts; ++lane) {
        const double value = values[k * n + lane];
        if (!std::isfinite(value) || (positive && value < 0)) return fault_.note(at_batch, lane, k, name, value);
      }
  };
  check("bias", bias, b.pack ? 1 : b.components, false);
  check("compliance", compliance, b.pack ? 1 : b.components, true);
  check("mu", mu, 1, true);
  for (int lane = 0; b.pack && lane < b.contacts; ++lane)
    if (compliance[lane] > 0) fault_.note(at_batch, lane, 0, "compliance", compliance[lane]);
  if (b.state) check("state", b.state, states, false);
}

// Checks that a posed gap may replace the bias of a law along the normal: that bias must be zero, the gap over the
// step, or the value that holds a contact open.
void PluggedLawChecks::check_posed(const cairn_batch& b, const double* gap) {
  constexpr double rounding = 1e-12;
  for (int lane = 0; lane < b.contacts; ++lane) {
    const double bias = b.bias[lane], posed = gap[lane] / in_.h;
    if (std::abs(bias) <= 0 || bias >= never() || std::abs(bias - posed) <= rounding * std::abs(posed)) continue;
    return fault_.note(std::int32_t(&b - system_.batches.data()), lane, 0, "bias", bias);
  }
}

void PluggedLawChecks::refuse() const {
  const cairn_batch& b = system_.batches[fault_.batch];
  const LawInfo& law = law_infos()[b.law];
  const std::int64_t i = system_.candidate[b.first + fault_.lane];
  std::ostringstream text;
  text << "law " << law.name << " of " << law.library << " gave " << fault_.what << "(" << fault_.component + 1
       << ") = " << fault_.value << " for contact " << i << ", between bodies "
       << carrier_id(*in_.bodies, *in_.contactors, in_.candidates->contactor_a[i]) << " and "
       << carrier_id(*in_.bodies, *in_.contactors, in_.candidates->contactor_b[i]) << " (gap " << in_.candidates->gap[i]
       << " m";
  const LawTable::Entry& e = classes_.rule(i);
  for (std::size_t k = 0; k < law.parameters.size(); ++k) text << ", " << law.parameters[k].name << " " << e.params[k];
  text << ")";
  const char* why = law.complaint ? law.complaint() : nullptr;
  if (why && *why)
    text << ": " << why;
  else if (!std::isfinite(fault_.value))
    text << ": look for a division by zero, a root of a negative number or a result that is not set";
  else if (std::string_view(fault_.what) == "bias")
    text << ": the strategy imposes the gap between surfaces in its place: take NSCD";
  else if (fault_.value > 0)
    text << ": a law that says normal_bias has none";
  else
    text << ": it must not be negative";
  throw std::invalid_argument(text.str());
}

// Sweeps batch by batch, like the solver, until a plugged law turns finite velocities into a value that is not finite.
void PluggedLawChecks::find(const Bodies& with, int sweeps) {
  bool any = false;
  for (const cairn_batch& b : system_.batches) any |= law_infos()[b.law].plugged() && law_infos()[b.law].solve;
  if (!any) return;
  system_.load(with.velocity_free);
  const cairn_schedule all = system_.schedule(1);
  const std::int32_t task[] = {0, 1}, batch[] = {0, 1};
  double change = 0;
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (std::size_t k = 0; k < system_.batches.size(); ++k) {
      cairn_batch& b = system_.batches[k];
      cairn_schedule one = all;
      one.stages = one.batches = 1;
      one.first_task = task;
      one.first_batch = batch;
      one.batch = &b;
      cairn_nlgs_sweep(1, &one, &change);
      for (int lane = 0; lane < b.contacts; ++lane)
        for (int c = 0; c < b.components; ++c) {
          const double r = at(b, b.r, lane, c);
          if (std::isfinite(r)) continue;
          if (!law_infos()[b.law].plugged()) return; // a divergence like any other
          fault_.note(std::int32_t(k), lane, c, "r", r);
          refuse();
        }
    }
}

} // namespace cairn
