#include "options.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <string_view>
#include <type_traits>

#include "../base/call.hpp"
#include "nscd/nscd_options.hpp"
#include "smooth/smooth_dem_options.hpp"

namespace cairn {
namespace {

std::string shown(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.15g", x);
  return text;
}

void check_range(const OptionInfo& o, double value) {
  const bool low = o.ends[0] == '[' ? value >= o.smallest : value > o.smallest;
  const bool high = o.ends[1] == ']' ? value <= o.largest : value < o.largest;
  if (!low || !high)
    throw Error(std::string(o.name) + " is " + shown(value) + "; give a value in " + o.ends[0] + shown(o.smallest) +
                ", " + shown(o.largest) + o.ends[1] + ", " + std::string(o.meaning));
  if (o.kind != "number" && value != std::floor(value))
    throw Error(std::string(o.name) + " is " + shown(value) + "; give a whole number");
}

Option option_of(Strategy& s, const std::string& name) {
  std::string known;
  for (const Option& o : s.options()) {
    if (o.info.name == name) return o;
    known += (known.empty() ? "" : ", ") + std::string(o.info.name);
  }
  throw Error("the strategy has no option '" + name + "'; it has " + known);
}

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

template <class T>
using Kept = std::decay_t<decltype(*std::declval<T>())>;

} // namespace

template <class Settings>
Settings standard_options() {
  Settings s;
  each_option(s, [](const OptionInfo&, auto& member, auto standard) { member = standard; });
  return s;
}
template NscdOptions standard_options<NscdOptions>();
template SmoothDemOptions standard_options<SmoothDemOptions>();

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
template std::vector<Option> rows_of(NscdOptions& settings);
template std::vector<Option> rows_of(SmoothDemOptions& settings);

void set_option(Strategy& strategy, const std::string& name, double value) {
  const Option o = option_of(strategy, name);
  std::visit(
      [&](auto* member) {
        using T = Kept<decltype(member)>;
        if constexpr (std::is_same_v<T, std::string>) {
          throw Error(name + " is " + shown(value) + "; give a text: " + std::string(o.info.meaning));
        } else {
          if (!(o.may_lack && std::isnan(value))) check_range(o.info, value);
          const T before = *member;
          *member = T(value);
          try {
            strategy.check_options();
          } catch (...) {
            *member = before;
            throw;
          }
        }
      },
      o.member);
}

void set_option(Strategy& strategy, const std::string& name, const std::string& text) {
  const Option o = option_of(strategy, name);
  auto* const* member = std::get_if<std::string*>(&o.member);
  if (!member) throw Error(name + " is '" + text + "'; give a number: " + std::string(o.info.meaning));
  std::string known;
  for (const std::string& may_be : strategy.texts_of(name)) {
    if (may_be == text) {
      **member = text;
      return;
    }
    known += (known.empty() ? "" : ", ") + may_be;
  }
  throw Error("there is no " + name + " '" + text + "'; there are " + known);
}

double option_number(const Strategy& strategy, const std::string& name) {
  const auto copy = strategy.fresh();
  return std::visit(
      [&](auto* member) -> double {
        if constexpr (std::is_same_v<Kept<decltype(member)>, std::string>)
          throw Error(name + " is a text, and no number");
        else
          return double(*member);
      },
      option_of(*copy, name).member);
}

std::string option_text(const Strategy& strategy, const std::string& name) {
  const auto copy = strategy.fresh();
  return std::visit(
      [&](auto* member) -> std::string {
        if constexpr (std::is_same_v<Kept<decltype(member)>, std::string>)
          return *member;
        else
          return shown(double(*member));
      },
      option_of(*copy, name).member);
}

} // namespace cairn
