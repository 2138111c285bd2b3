// Settings of strategies by their names, for callers that cannot name a member: C, Fortran, Python. Those of
// options.def are rows of that list; a strategy of one page names its own there.
#pragma once
#include <string>
#include <vector>

#include "../simulation/simulation.hpp"

namespace cairn {

// Settings with the defaults of the list, and its rows for settings that are kept somewhere: of NscdOptions and
// SmoothDemOptions, in options.cpp.
template <class Settings>
Settings standard_options();
template <class Settings>
std::vector<Option> rows_of(Settings& settings);

// Throws Error naming option, value and range, or the options that there are, and leaves the strategy as it was. NaN
// brings back a default that is found from the scene.
void set_option(Strategy& strategy, const std::string& name, double value);
void set_option(Strategy& strategy, const std::string& name, const std::string& text);
double option_number(const Strategy& strategy, const std::string& name);
std::string option_text(const Strategy& strategy, const std::string& name);

} // namespace cairn
