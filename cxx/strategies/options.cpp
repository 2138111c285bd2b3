#include "options.hpp"

#include <cmath>
#include <cstdio>

#include "../base/call.hpp"

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
using Kept = std::decay_t<decltype(*std::declval<T>())>;

} // namespace

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
