// Settings of strategies by their names in options.def, for callers that cannot name a member: C, Fortran, Python.
#pragma once
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "simulation.hpp"

namespace cairn {

struct OptionInfo {
  std::string_view name, kind, ends, meaning; // kind: number, whole, flag, text
  double smallest = 0, largest = 0;
};

template <class T>
constexpr std::string_view kind_of_option() {
  if constexpr (std::is_same_v<T, bool>) return "flag";
  if constexpr (std::is_same_v<T, int>) return "whole";
  if constexpr (std::is_same_v<T, double>) return "number";
  return "text";
}

// visit(info, member, default) for every row of a strategy.
template <class Visit>
void each_option(Nscd& s, Visit&& visit) {
  constexpr double never = std::numeric_limits<double>::infinity(), none = std::numeric_limits<double>::quiet_NaN();
  constexpr int most = std::numeric_limits<int>::max();
#define CAIRN_NSCD_OPTION(name, type, member, standard, ends, low, high, meaning)                                      \
  visit(OptionInfo{#name, kind_of_option<type>(), ends, meaning, double(low), double(high)}, s.member, type(standard));
#include "options.def"
  (void)none;
}
template <class Visit>
void each_option(SmoothDem& s, Visit&& visit) {
  constexpr double never = std::numeric_limits<double>::infinity(), none = std::numeric_limits<double>::quiet_NaN();
  constexpr int most = std::numeric_limits<int>::max();
#define CAIRN_SMOOTH_DEM_OPTION(name, type, member, standard, ends, low, high, meaning)                                \
  visit(OptionInfo{#name, kind_of_option<type>(), ends, meaning, double(low), double(high)}, s.member, type(standard));
#include "options.def"
}

// A strategy with the defaults of the list.
template <class Strategy>
Strategy standard_options() {
  Strategy s;
  each_option(s, [](const OptionInfo&, auto& member, auto standard) { member = standard; });
  return s;
}

// Throws Error naming option, value and range, or the options that there are, and leaves the strategy as it was. NaN
// brings back a default that is found from the scene.
void set_option(Nscd& strategy, const std::string& name, double value);
void set_option(Nscd& strategy, const std::string& name, const std::string& text);
void set_option(SmoothDem& strategy, const std::string& name, double value);
void set_option(SmoothDem& strategy, const std::string& name, const std::string& text);
double option_number(Nscd strategy, const std::string& name);
double option_number(SmoothDem strategy, const std::string& name);
std::string option_text(Nscd strategy, const std::string& name);
std::string option_text(SmoothDem strategy, const std::string& name);

} // namespace cairn
