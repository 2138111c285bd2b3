#include "zone_laws.hpp"

#include <cstddef>
#include <iterator>

namespace cairn {

namespace {

#define CAIRN_ZONE_ZONES(kernel) kernel
#define CAIRN_ZONE_NO(kernel) nullptr
#define CAIRN_ZONE_KEEPS(kernel) nullptr
#define CAIRN_ZONE_BONDS(kernel) nullptr
#define CAIRN_ZONE_SPANS(kernel) nullptr
#define CAIRN_ZONE_JOINS(kernel) nullptr
#define CAIRN_ZONE_HOLDS(kernel) nullptr
cairn_law_zone* const zones[] = {
#define CAIRN_LAW(row, python, c2, c3, takes, remembers, prepares, solves, commits, measures, stores, gives, keeping,  \
                  forces)                                                                                              \
  CAIRN_ZONE_##keeping(cairn_law_##row##_zone),
#include "../../core_f90/contact_laws/laws.def"
#undef CAIRN_LAW
};

} // namespace

cairn_law_zone* zone_of(std::int32_t law) {
  return std::size_t(law) < std::size(zones) ? zones[law] : nullptr; // others are plugged in
}

} // namespace cairn
