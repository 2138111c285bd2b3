// Report of a step by name: rows of report.def.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "simulation.hpp"

namespace cairn {

struct EnergyTerm {
  const char* name;
  double Energy::*member;
};
std::span<const EnergyTerm> energy_terms();
std::vector<std::pair<const char*, double>> report_numbers(const StepReport& report);

} // namespace cairn
