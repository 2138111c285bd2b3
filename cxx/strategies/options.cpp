#include "options.hpp"

#include <cmath>
#include <cstdio>

#include "../base/call.hpp"
#include "../solvers/problems/friction_problem.hpp"

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

void check_solver(const std::string& text) {
  std::string known;
  for (const ProblemSolverInfo& s : problem_solvers()) {
    if (s.name == text) return;
    known += (known.empty() ? "" : ", ") + s.name;
  }
  throw Error("there is no solver '" + text + "'; there are " + known);
}

void check_together(const Nscd& s) {
  if (s.solver.min_iterations > s.solver.max_iterations)
    throw Error("min_iter is " + std::to_string(s.solver.min_iterations) + ", above max_iter, " +
                std::to_string(s.solver.max_iterations) + ": give them in this order");
}
void check_together(const SmoothDem&) {}

// Calls found(info, member, default) for the option of that name.
template <class Strategy, class Found>
void with_option(Strategy& s, const std::string& name, Found&& found) {
  bool any = false;
  std::string known;
  each_option(s, [&](const OptionInfo& o, auto& member, const auto& standard) {
    known += (known.empty() ? "" : ", ") + std::string(o.name);
    if (o.name != name) return;
    any = true;
    found(o, member, standard);
  });
  if (!any) throw Error("the strategy has no option '" + name + "'; it has " + known);
}

template <class Strategy>
void set_number(Strategy& strategy, const std::string& name, double value) {
  Strategy changed = strategy;
  with_option(changed, name, [&](const OptionInfo& o, auto& member, const auto& standard) {
    using T = std::decay_t<decltype(member)>;
    if constexpr (std::is_same_v<T, std::string>) {
      throw Error(name + " is " + shown(value) + "; give a text: " + std::string(o.meaning));
    } else {
      const bool may_lack = std::isnan(double(standard));
      if (!(may_lack && std::isnan(value))) check_range(o, value);
      member = T(value);
    }
  });
  check_together(changed);
  strategy = changed;
}

template <class Strategy>
void set_text(Strategy& strategy, const std::string& name, const std::string& text) {
  with_option(strategy, name, [&](const OptionInfo& o, auto& member, const auto&) {
    if constexpr (std::is_same_v<std::decay_t<decltype(member)>, std::string>) {
      check_solver(text); // the one text that there is
      member = text;
    } else {
      throw Error(name + " is '" + text + "'; give a number: " + std::string(o.meaning));
    }
  });
}

template <class Strategy>
double number_of(Strategy& s, const std::string& name) {
  double value = 0;
  with_option(s, name, [&](const OptionInfo&, auto& member, const auto&) {
    if constexpr (std::is_same_v<std::decay_t<decltype(member)>, std::string>)
      throw Error(name + " is a text, and no number");
    else
      value = double(member);
  });
  return value;
}

template <class Strategy>
std::string text_of(Strategy& s, const std::string& name) {
  std::string text;
  with_option(s, name, [&](const OptionInfo&, auto& member, const auto&) {
    if constexpr (std::is_same_v<std::decay_t<decltype(member)>, std::string>)
      text = member;
    else
      text = shown(double(member));
  });
  return text;
}

} // namespace

void set_option(Nscd& s, const std::string& name, double value) { set_number(s, name, value); }
void set_option(SmoothDem& s, const std::string& name, double value) { set_number(s, name, value); }
void set_option(Nscd& s, const std::string& name, const std::string& text) { set_text(s, name, text); }
void set_option(SmoothDem& s, const std::string& name, const std::string& text) { set_text(s, name, text); }
double option_number(Nscd s, const std::string& name) { return number_of(s, name); }
double option_number(SmoothDem s, const std::string& name) { return number_of(s, name); }
std::string option_text(Nscd s, const std::string& name) { return text_of(s, name); }
std::string option_text(SmoothDem s, const std::string& name) { return text_of(s, name); }

} // namespace cairn
