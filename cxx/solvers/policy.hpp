// Numbers that steer the choice and the pace of solvers, in one table: policy.def.
#pragma once
#include <cstdint>

namespace cairn {

struct Policy {
#define CAIRN_POLICY(type, name, value, unit, steers, source) type name = value;
#include "policy.def"
#undef CAIRN_POLICY
};

// The numbers of the table, but for those that the environment variable CAIRN_POLICY changes when a program first asks:
// "name=value name=value", for studies (benchmarks/policy.py), which is told on standard error. Throws Error for a name
// that is none of the table.
const Policy& policy();

} // namespace cairn
