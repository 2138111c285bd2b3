#include "../simulation/strategy.hpp"

#include "../base/call.hpp"

namespace cairn {

#define CAIRN_STRATEGY(name, python, meaning) std::unique_ptr<Strategy> make_##name();
#include "strategies.def"
#undef CAIRN_STRATEGY

const std::vector<StrategyInfo>& strategy_infos() {
  static const std::vector<StrategyInfo> rows = {
#define CAIRN_STRATEGY(name, python, meaning) {#name, #python, meaning, make_##name},
#include "strategies.def"
#undef CAIRN_STRATEGY
  };
  return rows;
}

std::unique_ptr<Strategy> make_strategy(const std::string& name) {
  std::string known;
  for (const StrategyInfo& row : strategy_infos()) {
    if (row.name == name) {
      std::unique_ptr<Strategy> made = row.make();
      made->name = name;
      return made;
    }
    known += std::string(known.empty() ? "" : ", ") + std::string(row.name);
  }
  throw Error("there is no strategy '" + name + "'; there are " + known);
}

std::vector<std::string> Strategy::texts_of(std::string_view) const { return {}; }

} // namespace cairn
