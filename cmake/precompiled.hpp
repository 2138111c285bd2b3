// Headers that most files of cxx include, precompiled where CAIRN_PRECOMPILE is on. Files still name all that they use,
// for builds without it.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <variant>

#include "simulation/simulation.hpp"
