// Headers of most C++ tests, compiled once with CAIRN_PRECOMPILE. Tests include all that they use, and build without
// it.
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
