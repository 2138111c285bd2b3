// The rows of integrators.def: how bodies, rigid ones and meshes, go from a step to the next.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "../contacts/interaction.hpp"
#include "strategy.hpp"

namespace cairn {

struct IntegratorInfo {
  std::string name, python_name, meaning;
  std::vector<LawParameter> parameters; // 4 at most
  cairn_integrator* kernel = nullptr;
};
const std::vector<IntegratorInfo>& integrator_infos();

// Which one moves the bodies, and the parameters of each.
class Integrator {
public:
  explicit Integrator(std::string chosen = "theta");
  std::string name;

  const IntegratorInfo& info() const { return integrator_infos()[row()]; } // throws Error with the names that there are
  cairn_scheme scheme(double h) const; // throws Error where a parameter is not whole
  // Parameters of the one that is chosen, as options.
  void add_options(std::vector<Option>& options);
  double& parameter(const std::string& integrator, int k);
  bool operator==(const Integrator&) const = default;

private:
  std::size_t row() const;
  std::vector<double> parameters_; // (4, rows)
};

} // namespace cairn
