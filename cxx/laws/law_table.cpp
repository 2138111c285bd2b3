#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "../contacts/interaction.hpp"

namespace cairn {

namespace {

double number(const std::string& text) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {}
  if (used == 0 || used != text.size())
    throw std::invalid_argument("'" + text + "' is no number: write name:default:smallest:largest, as in mu:0.3:0:inf");
  return value;
}

// "name:default:smallest:largest", separated by blanks
std::vector<LawParameter> parameters_of(const std::string& declared) {
  std::vector<LawParameter> all;
  std::istringstream words(declared);
  for (std::string word; words >> word;) {
    LawParameter p;
    std::istringstream parts(word);
    std::string standard, smallest, largest;
    std::getline(parts, p.name, ':');
    std::getline(parts, standard, ':');
    std::getline(parts, smallest, ':');
    std::getline(parts, largest, ':');
    p.required = standard.empty();
    p.standard = p.required ? 0 : number(standard);
    p.smallest = smallest.empty() ? 0 : number(smallest);
    p.largest = largest.empty() ? std::numeric_limits<double>::infinity() : number(largest);
    all.push_back(p);
  }
  return all;
}

constexpr std::size_t most_laws = 1024;

#define CAIRN_SLOT_YES(kernel) kernel
#define CAIRN_SLOT_NO(kernel) nullptr
std::vector<LawInfo> built_in_laws() {
  constexpr bool YES = true, NO = false, NORMAL = true, ALL = false;
  std::vector<LawInfo> all;
  all.reserve(most_laws);
  const auto add = [&](const char* parameters, const char* state, LawInfo law) {
    declare_law(law, parameters, state);
    all.push_back(std::move(law));
  };
#define CAIRN_LAW(row, python, c2, c3, takes, keeps, prepares, solves, commits, bias_along, forces)                    \
  add(takes, keeps,                                                                                                    \
      {.name = #row,                                                                                                   \
       .python_name = #python,                                                                                         \
       .components2 = c2,                                                                                              \
       .components3 = c3,                                                                                              \
       .parameters = {},                                                                                               \
       .state = {},                                                                                                    \
       .state_begin = {},                                                                                              \
       .has_prepare = prepares,                                                                                        \
       .has_solve = solves,                                                                                            \
       .has_commit = commits,                                                                                          \
       .normal_bias = bias_along,                                                                                      \
       .prepare = CAIRN_SLOT_##prepares(cairn_law_##row##_prepare),                                                    \
       .solve = CAIRN_SLOT_##solves(cairn_law_##row##_solve),                                                          \
       .commit = CAIRN_SLOT_##commits(cairn_law_##row##_commit),                                                       \
       .force = CAIRN_SLOT_##forces(cairn_law_##row##_force),                                                          \
       .stiffness = CAIRN_SLOT_##forces(cairn_law_##row##_stiffness),                                                  \
       .library = {}});
#include "../../core_f90/contact_laws/laws.def"
#undef CAIRN_LAW
  return all;
}

std::vector<LawInfo>& laws() {
  static std::vector<LawInfo> all = built_in_laws();
  return all;
}

} // namespace

const std::vector<LawInfo>& law_infos() { return laws(); }

void declare_law(LawInfo& law, const std::string& parameters, const std::string& state) {
  law.parameters = parameters_of(parameters);
  std::istringstream words(state);
  for (std::string word; words >> word;) {
    const auto colon = word.find(':');
    law.state.push_back(word.substr(0, colon));
    law.state_begin.push_back(colon == std::string::npos ? std::numeric_limits<double>::quiet_NaN()
                                                         : number(word.substr(colon + 1)));
  }
  const auto most = [&](const char* what, std::size_t have, int largest) {
    if (have > std::size_t(largest))
      throw std::invalid_argument("law " + law.name + " has " + std::to_string(have) + " " + what + ", at most " +
                                  std::to_string(largest) + " are possible");
  };
  most("parameters", law.parameters.size(), LawTable::max_parameters);
  most("state variables", law.state.size(), LawTable::max_states);
}

Law register_law(LawInfo law, bool replace) {
  std::vector<LawInfo>& all = laws();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].name != law.name && all[i].python_name != law.name) continue;
    if (!replace && all[i].library != law.library)
      throw std::invalid_argument("there is a law '" + law.name + "' already" +
                                  (all[i].plugged() ? ", from " + all[i].library : std::string()) +
                                  ": give yours another name, or say replace");
    law.name = all[i].name;
    law.python_name = all[i].python_name;
    all[i] = std::move(law);
    return Law(i);
  }
  if (all.size() >= most_laws) throw std::invalid_argument("more than " + std::to_string(most_laws) + " laws");
  all.push_back(std::move(law));
  return Law(all.size() - 1);
}

LawTable::LawTable(std::vector<std::string> material_names)
    : names_(std::move(material_names)), table_(names_.size() * names_.size(), std::int16_t(-1)) {}

int LawTable::add(Law law, std::span<const double> params) {
  if (int(law) < 0 || std::size_t(law) >= law_infos().size())
    throw std::invalid_argument("law: " + std::to_string(int(law)) + " is no row of laws.def");
  const LawInfo& info = law_infos()[std::size_t(law)];
  if (params.size() != info.parameters.size())
    throw std::invalid_argument(info.python_name + " takes " + std::to_string(info.parameters.size()) +
                                " parameters, " + std::to_string(params.size()) + " were given");
  Entry entry{law, 0, {}};
  for (std::size_t k = 0; k < params.size(); ++k) {
    const LawParameter& p = info.parameters[k];
    if (!(params[k] >= p.smallest && params[k] <= p.largest)) {
      std::ostringstream message;
      message << info.python_name << ": " << p.name << " = " << params[k] << ", must lie between " << p.smallest
              << " and " << p.largest;
      throw std::invalid_argument(message.str());
    }
    // an infinite friction stays a number, so that its product with no impulse is none
    entry.params[k] = std::min(params[k], std::numeric_limits<double>::max());
  }
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    bool same = entries_[i].law == law;
    for (int k = 0; k < max_parameters; ++k) same = same && !(entries_[i].params[k] != entry.params[k]);
    if (same) return int(i);
  }
  if (entries_.size() >= 32767) throw std::invalid_argument("law: more than 32767 different laws in one table");
  const auto known = std::find(laws_.begin(), laws_.end(), law);
  entry.place = std::int16_t(known - laws_.begin());
  if (known == laws_.end()) laws_.push_back(law);
  entries_.push_back(entry);
  return int(entries_.size()) - 1;
}

void LawTable::set(int a, int b, Law law, std::span<const double> params) {
  for (int m : {a, b})
    if (m < 0 || m >= materials())
      throw std::invalid_argument("law: material " + std::to_string(m) + " is not one of the " +
                                  std::to_string(materials()));
  const auto entry = std::int16_t(add(law, params));
  table_[std::size_t(a) * names_.size() + b] = entry;
  table_[std::size_t(b) * names_.size() + a] = entry;
}

void LawTable::set_default(Law law, std::span<const double> params) {
  const auto entry = std::int16_t(add(law, params));
  for (std::int16_t& e : table_)
    if (e < 0) e = entry;
}

} // namespace cairn
