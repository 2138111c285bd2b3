#include "own_conditions.hpp"

#include <cmath>
#include <limits>
#include <string_view>

#include "../../laws/law_names.hpp"

namespace cairn {
namespace {

// A parameter by its name; `without` if the law has none of it.
double parameter(const LawTable::Entry& entry, std::string_view name, double without) {
  const auto& known = law_infos()[std::size_t(entry.law)].parameters;
  for (std::size_t k = 0; k < known.size(); ++k)
    if (known[k].name == name) return entry.params[k];
  return without;
}

bool rebounds(const LawTable::Entry& entry) {
  return parameter(entry, "normal", 0) > 0 || std::abs(parameter(entry, "tangential", 0)) > 0;
}

// Counted from elsewhere than where surfaces meet.
bool counts_from_elsewhere(const LawTable::Entry& entry) {
  return std::abs(parameter(entry, "shift", 0)) > 0 || parameter(entry, "from_start", 0) > 0;
}

bool yields(const LawTable::Entry& entry) {
  return parameter(entry, "stiffness", std::numeric_limits<double>::infinity()) < std::numeric_limits<double>::max();
}

} // namespace

std::string own_condition(const LawTable::Entry& entry) {
  const LawInfo& law = law_infos()[std::size_t(entry.law)];
  constexpr const char *gap = "a gap of its own", *rebound = "a restitution", *nothing = "";
  switch (entry.law) {
  case Law::newton_restitution: return rebounds(entry) ? rebound : nothing;
  case Law::unilateral_contact: return rebounds(entry) ? rebound : counts_from_elsewhere(entry) ? gap : nothing;
  case Law::elastic_contact:
    if (counts_from_elsewhere(entry)) return gap;
    if (parameter(entry, "viscosity", 0) > 0) return "a dashpot";
    return parameter(entry, "stiffness", 0) > 0 ? "" : "no stiffness";
  case Law::adhesive_contact:
  case Law::mac_contact:
    if (entry.law == Law::adhesive_contact && rebounds(entry)) return rebound;
    if (yields(entry) && parameter(entry, "viscosity", 0) > 0) return "a dashpot";
    if (yields(entry) && parameter(entry, "force", 0) > 0) return "an attraction that its spring bears";
    break;
  case Law::critical_voigt: return "a spring and a dashpot";
  case Law::gap_rescue: return "a spring that takes back overlap";
  case Law::coupled_motion: return "a hold on bodies that are apart";
  case Law::wear: return parameter(entry, "wear", 0) > 0 ? gap : nothing;
  default: break;
  }
  return law.keeps && !law.spans && parameter(entry, "within", 0) > 0 ? "bonds across a gap (within)" : "";
}

std::string own_overlap(const LawTable::Entry& entry) {
  switch (entry.law) {
  case Law::elastic_contact:
  case Law::adhesive_contact:
  case Law::mac_contact:
    if (yields(entry)) return "a spring that presses by its overlap";
    [[fallthrough]];
  case Law::unilateral_contact: return counts_from_elsewhere(entry) ? "a gap of its own" : "";
  case Law::critical_voigt: return "a spring that presses by its overlap";
  case Law::wear: return parameter(entry, "wear", 0) > 0 ? "a gap of its own" : "";
  default: return "";
  }
}

} // namespace cairn
