#include "policy.hpp"

#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

#include "../base/call.hpp"

namespace cairn {

namespace {

bool set(Policy& policy, const std::string& name, double to) {
#define CAIRN_POLICY(type, row, value, unit, steers, source)                                                           \
  if (name == #row) return policy.row = type(to), true;
#include "policy.def"
#undef CAIRN_POLICY
  return false;
}

Policy changed_by_environment() {
  Policy policy;
  const char* text = std::getenv("CAIRN_POLICY");
  if (text == nullptr) return policy;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    char* end = nullptr;
    const char* number = equals == std::string::npos ? "" : word.c_str() + equals + 1;
    const double to = std::strtod(number, &end);
    if (end == number || *end != '\0' || !set(policy, word.substr(0, equals), to))
      throw Error("CAIRN_POLICY has '" + word + "': give name=number, with a name of the table of docs/policy.md");
    std::fprintf(stderr, "cairn: CAIRN_POLICY changes %s\n", word.c_str());
  }
  return policy;
}

} // namespace

const Policy& policy() {
  static const Policy read = changed_by_environment();
  return read;
}

} // namespace cairn
