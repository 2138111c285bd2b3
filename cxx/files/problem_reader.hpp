// Frictional contact problems in the layout of FCLIB.
#pragma once
#include "../solvers/problems/friction_problem.hpp"

namespace cairn {

// A local problem. Throws FileError; UnknownStructure where the file is compressed.
FrictionProblem read_problem(const std::string& path);

} // namespace cairn
