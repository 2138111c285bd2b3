// What most files of cxx include, read once where CAIRN_PRECOMPILE is on. Files name all they use: others do without.
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
