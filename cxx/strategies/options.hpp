// Settings of strategies by their names, for callers that cannot name a member: C, Fortran, Python. Those of
// options.def are rows of that list; a strategy of one page names its own there.
#pragma once
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "simulation.hpp"

namespace cairn {

template <class T>
constexpr std::string_view kind_of_option() {
  if constexpr (std::is_same_v<T, bool>) return "flag";
  if constexpr (std::is_same_v<T, int>) return "whole";
  if constexpr (std::is_same_v<T, double>) return "number";
  return "text";
}

// visit(info, member, default) for every row of a strategy.
template <class Visit>
void each_option(NscdOptions& s, Visit&& visit) {
  constexpr double never = std::numeric_limits<double>::infinity(), none = std::numeric_limits<double>::quiet_NaN();
  constexpr int most = std::numeric_limits<int>::max();
#define CAIRN_NSCD_OPTION(name, type, member, standard, ends, low, high, meaning)                                      \
  visit(OptionInfo{#name, kind_of_option<type>(), ends, meaning, double(low), double(high)}, s.member, type(standard));
#include "options.def"
  (void)none;
}
template <class Visit>
void each_option(SmoothDemOptions& s, Visit&& visit) {
  constexpr double never = std::numeric_limits<double>::infinity(), none = std::numeric_limits<double>::quiet_NaN();
  constexpr int most = std::numeric_limits<int>::max();
#define CAIRN_SMOOTH_DEM_OPTION(name, type, member, standard, ends, low, high, meaning)                                \
  visit(OptionInfo{#name, kind_of_option<type>(), ends, meaning, double(low), double(high)}, s.member, type(standard));
#include "options.def"
}

// Settings with the defaults of the list.
template <class Settings>
Settings standard_options() {
  Settings s;
  each_option(s, [](const OptionInfo&, auto& member, auto standard) { member = standard; });
  return s;
}

template <class Settings>
std::vector<Option> rows_of(Settings& settings) {
  std::vector<Option> rows;
  each_option(settings, [&](const OptionInfo& info, auto& member, const auto& standard) {
    bool may_lack = false;
    if constexpr (std::is_same_v<std::decay_t<decltype(standard)>, double>) may_lack = standard != standard;
    rows.push_back({info, &member, may_lack});
  });
  return rows;
}

// Throws Error naming option, value and range, or the options that there are, and leaves the strategy as it was. NaN
// brings back a default that is found from the scene.
void set_option(Strategy& strategy, const std::string& name, double value);
void set_option(Strategy& strategy, const std::string& name, const std::string& text);
double option_number(const Strategy& strategy, const std::string& name);
std::string option_text(const Strategy& strategy, const std::string& name);

} // namespace cairn
