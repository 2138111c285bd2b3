// What most C++ tests include, read once where CAIRN_PRECOMPILE is on. Files name all they use: others do without.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <span>
#include <stdexcept>
#include <unordered_map>
#include <vector>

#include "cairn/body_calls.h"
#include "cairn/cairn.h"
