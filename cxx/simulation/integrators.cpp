#include "integrators.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../base/call.hpp"
#include "cairn/core.h"
#include "cairn/rows/integrator.h"

namespace cairn {
namespace {

constexpr std::size_t most_parameters = 4;

IntegratorInfo row_of(const char* name, const char* python_name, const char* parameters, const char* meaning,
                      cairn_integrator* kernel) {
  LawInfo words; // of the same form as those of laws
  declare_law(words, parameters, "");
  return {name, python_name, meaning, words.parameters, kernel};
}

} // namespace

const std::vector<IntegratorInfo>& integrator_infos() {
  static const std::vector<IntegratorInfo> rows = {
#define CAIRN_INTEGRATOR(name, python, parameters, meaning)                                                            \
  row_of(#name, #python, parameters, meaning, cairn_integrator_##name),
#include "../../core_f90/integrators/integrators.def"
#undef CAIRN_INTEGRATOR
  };
  return rows;
}

Integrator::Integrator(std::string chosen) : name(std::move(chosen)) {
  for (const IntegratorInfo& info : integrator_infos())
    for (std::size_t k = 0; k < most_parameters; ++k)
      parameters_.push_back(k < info.parameters.size() ? info.parameters[k].standard : 0);
}

std::size_t Integrator::row() const {
  std::string known;
  const auto& rows = integrator_infos();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].name == name) return i;
    known += (known.empty() ? "" : ", ") + rows[i].name;
  }
  throw Error("there is no integrator '" + name + "'; there are " + known);
}

cairn_scheme Integrator::scheme(double h) const {
  cairn_scheme scheme;
  info().kernel(h, &parameters_[most_parameters * row()], &scheme);
  return scheme;
}

double& Integrator::parameter(const std::string& integrator, int k) {
  const auto& rows = integrator_infos();
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const auto& info) { return info.name == integrator; });
  return parameters_.at(most_parameters * std::size_t(found - rows.begin()) + std::size_t(k));
}

void Integrator::add_options(std::vector<Option>& options) {
  const IntegratorInfo& chosen = info();
  for (std::size_t k = 0; k < chosen.parameters.size(); ++k) {
    const LawParameter& p = chosen.parameters[k];
    const bool whole = p.standard == std::floor(p.standard) && p.smallest == std::floor(p.smallest) &&
                       p.largest == std::floor(p.largest);
    options.push_back({{p.name, whole ? "whole" : "number", "[]", chosen.meaning, p.smallest, p.largest},
                       &parameters_[most_parameters * row() + k]});
  }
}

} // namespace cairn
