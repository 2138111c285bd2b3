#include "report.hpp"

namespace cairn {

std::span<const EnergyTerm> energy_terms() {
  static constexpr EnergyTerm rows[] = {
#define CAIRN_ENERGY_TERM(name, meaning) {#name, &Energy::name},
#include "report.def"
  };
  return rows;
}

std::vector<std::pair<const char*, double>> report_numbers(const StepReport& report) {
  return {
#define CAIRN_REPORT_NUMBER(name, member, meaning) {#name, double(report.member)},
#include "report.def"
  };
}

} // namespace cairn
