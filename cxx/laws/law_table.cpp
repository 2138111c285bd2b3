#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "law_table.hpp"

#include "bond_laws.hpp"
#include "cairn/rows/law.h"
#include "law_names.hpp"

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
  constexpr bool YES = true, NO = false;
  enum Giving { ALL, NORMAL, YIELDS };
  enum Keeping { lets_go, KEEPS, BONDS, ZONES, SPANS, JOINS, HOLDS };
  std::vector<LawInfo> all;
  all.reserve(most_laws);
  const auto add = [&](const char* parameters, const char* state, LawInfo law) {
    declare_law(law, parameters, state);
    for (std::size_t k = 0; k < law.parameters.size(); ++k) {
      const std::string& name = law.parameters[k].name;
      if (name != "shift" && name != "tolerance") continue;
      law.reach = int(k);
      law.reaches_back = name == "shift";
    }
    all.push_back(std::move(law));
  };
#define CAIRN_LAW(row, python, c2, c3, takes, remembers, prepares, solves, commits, measures, stores, gives, keeping,  \
                  forces)                                                                                              \
  add(takes, remembers,                                                                                                \
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
       .normal_bias = gives == NORMAL,                                                                                 \
       .yields = gives == YIELDS,                                                                                      \
       .keeps = keeping != 0,                                                                                          \
       .holds = int(keeping) == HOLDS,                                                                                 \
       .anchored = int(keeping) >= BONDS,                                                                              \
       .joins = int(keeping) == JOINS,                                                                                 \
       .spans = int(keeping) == SPANS,                                                                                 \
       .prepare = CAIRN_SLOT_##prepares(cairn_law_##row##_prepare),                                                    \
       .solve = CAIRN_SLOT_##solves(cairn_law_##row##_solve),                                                          \
       .commit = CAIRN_SLOT_##commits(cairn_law_##row##_commit),                                                       \
       .residual = CAIRN_SLOT_##measures(cairn_law_##row##_residual),                                                  \
       .energy = CAIRN_SLOT_##stores(cairn_law_##row##_energy),                                                        \
       .force = CAIRN_SLOT_##forces(cairn_law_##row##_force),                                                          \
       .stiffness = CAIRN_SLOT_##forces(cairn_law_##row##_stiffness),                                                  \
       .library = {}});
#include "../../core_f90/contact_laws/laws.def"
#undef CAIRN_LAW
#define CAIRN_LAW_TRAIT(trait, law) all[std::size_t(Law::law)].trait = true;
#include "../../core_f90/contact_laws/law_traits.def"
#undef CAIRN_LAW_TRAIT
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
  for (std::size_t k = 0; k < law.parameters.size(); ++k)
    if (law.parameters[k].name == "within") law.within = int(k);
  for (std::size_t k = 0; k < law.parameters.size(); ++k)
    if (law.parameters[k].name == "reach") law.reach = int(k);
  std::istringstream words(state);
  for (std::string word; words >> word;) {
    const auto colon = word.find(':');
    law.state.push_back(word.substr(0, colon));
    law.keeps_area |= law.state.back() == "area";
    law.state_begin.push_back(colon == std::string::npos ? std::numeric_limits<double>::quiet_NaN()
                                                         : number(word.substr(colon + 1)));
  }
  const auto most = [&](const char* what, std::size_t have, int largest) {
    if (have > std::size_t(largest))
      throw std::invalid_argument("law " + law.name + " has " + std::to_string(have) + " " + what + ", at most " +
                                  std::to_string(largest) + " are possible");
  };
  most("parameters", law.parameters.size(), LawTable::max_parameters);
  most("state variables", std::size_t(law.state_kept(3)), LawTable::max_states);
  if (law.keeps && (law.state.empty() || law.state[0].back() == '*'))
    throw std::invalid_argument("law " + law.name +
                                " keeps pairs and has no state variable to say which: declare one first, as held:0");
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
    : names_(std::move(material_names)), rules_(int(names_.size())) {}

LawTable::LawTable(std::vector<std::string> material_names, const std::vector<std::string>& groups)
    : names_(std::move(material_names)), rules_(names_, groups) {
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (!groups[i].empty()) names_[i] += " (" + groups[i] + ")";
}

double LawTable::Curve::at(double t) const {
  if (!(t > temperature.front())) return value.front();
  if (!(t < temperature.back())) return value.back();
  const auto k = std::size_t(std::upper_bound(temperature.begin(), temperature.end(), t) - temperature.begin());
  const double share = (t - temperature[k - 1]) / (temperature[k] - temperature[k - 1]);
  return value[k - 1] + share * (value[k] - value[k - 1]);
}

namespace {

// A plateau takes what opening to its end takes: no more than all.
void check_plateau(const LawInfo& info, const std::string& mode, double first, double strength, double work,
                   double plateau) {
  const double longest = work / strength + first / 2;
  if (!(plateau > longest * (1 + 8 * std::numeric_limits<double>::epsilon()))) return;
  std::ostringstream message;
  message << info.python_name << ": " << mode << "plateau = " << plateau << " m takes more than " << mode
          << "work = " << work << " J/m2: give at most work/strength + strength/(2 stiffness) = " << longest << " m";
  throw std::invalid_argument(message.str());
}

// Two lines that fall, from the strength at its opening to the knee, from there to the end.
void check_two_lines(const LawInfo& info, const std::string& mode, double first, double strength, double work,
                     double end, double share) {
  constexpr double slack = 8 * std::numeric_limits<double>::epsilon();
  const double knee = 2 * work * (1 - share) / end, at = (2 * work * share + knee * first) / strength;
  if (knee <= strength * (1 + slack) && at >= first * (1 - slack) && at <= end * (1 + slack)) return;
  std::ostringstream message;
  message << info.python_name << ": " << mode << "end = " << end << " m and first_share = " << share
          << " put the knee of the two lines at " << at << " m and " << knee << " Pa, which is not between " << first
          << " m and " << end << " m, below " << mode << "strength = " << strength
          << " Pa: with what is stored at the strength the first line has the share of the work, 2 first_share work >= "
             "opening (strength - knee), and the knee is 2 (1 - first_share) work/end";
  throw std::invalid_argument(message.str());
}

// Refuses a joint whose work of fracture is not above its stored energy at the strength, which it could then never
// reach; and a strength whose stored energy underflows.
void check_works(const LawInfo& info, const double* values) {
  const auto of = [&](const std::string& name) {
    for (std::size_t k = 0; k < info.parameters.size(); ++k)
      if (info.parameters[k].name == name) return values + k;
    return static_cast<const double*>(nullptr);
  };
  const double *normal = of("normal_stiffness"), *tangential = of("tangential_stiffness");
  if (!normal || !tangential) return;
  for (const std::string mode : {"", "normal_", "tangential_"}) {
    const double *strength = of(mode + "strength"), *work = of(mode + "work");
    if (!strength || !work) continue;
    const double softness =
        mode.empty() ? 0.5 / *normal + 0.5 / *tangential : 1 / (mode == "normal_" ? *normal : *tangential);
    const double stored = *strength * (*strength * softness) / 2;
    if (*strength > 0 && !(stored >= std::numeric_limits<double>::min())) {
      std::ostringstream message;
      message << info.python_name << ": " << mode << "strength = " << *strength
              << " Pa stores less energy than numbers can tell from none: give 0, which joins nothing, or a strength "
                 "that something could feel";
      throw std::invalid_argument(message.str());
    }
    if (!(*work < std::numeric_limits<double>::max())) continue;
    if (stored * (1 + 8 * std::numeric_limits<double>::epsilon()) < *work) continue;
    std::ostringstream message;
    message << info.python_name << ": " << mode << "work = " << *work << " J/m2 is no more than the " << stored
            << " J/m2 that are stored at " << mode << "strength = " << *strength
            << " Pa, strength^2/(2 stiffness): give more work, a larger stiffness or a smaller strength";
    throw std::invalid_argument(message.str());
  }
  for (const std::string mode : {"normal_", "tangential_"}) {
    const double *strength = of(mode + "strength"), *work = of(mode + "work");
    if (!strength || !work || !(*work < std::numeric_limits<double>::max()) || !(*strength > 0)) continue;
    const double first = *strength / *(mode == "normal_" ? normal : tangential);
    if (const double* plateau = of(mode + "plateau")) check_plateau(info, mode, first, *strength, *work, *plateau);
    if (const double* end = of(mode + "end"))
      check_two_lines(info, mode, first, *strength, *work, *end, *of("first_share"));
  }
}

// Refuses a composite interface whose tension lies beyond the tip of the cone, and softening that falls faster than the
// elastic part unloads, which no displacement could follow.
void check_composite(const LawInfo& info, const double* values) {
  const auto of = [&](const std::string& name) {
    const auto at = std::ranges::find(info.parameters, name, &LawParameter::name);
    return at == info.parameters.end() ? 0.0 : values[at - info.parameters.begin()];
  };
  if (std::ranges::find(info.parameters, "cap_work", &LawParameter::name) == info.parameters.end()) return;
  constexpr double slack = 8 * std::numeric_limits<double>::epsilon(), most = std::numeric_limits<double>::max();
  std::ostringstream message;
  const double friction = of("friction"), tension = of("tension"), cohesion = of("cohesion");
  if (tension * friction > cohesion * (1 + slack))
    message << "tension = " << tension
            << " Pa is beyond the tip of the cone: give at most cohesion/friction = " << cohesion / friction << " Pa";
  if (of("dilatancy") > friction)
    message << "dilatancy = " << of("dilatancy") << " makes work of friction: give at most friction = " << friction;
  const auto falls = [&](const std::string& work, const std::string& strength, const std::string& stiffness,
                         double share) {
    const double f = of(strength), k = of(stiffness), least = share * f * (f / k);
    if (!message.str().empty() || !(f > 0) || !(f < most) || !(of(work) < most) || of(work) > least * (1 + slack))
      return;
    message << work << " = " << of(work) << " J/m2 softens faster than the joint unloads by " << stiffness << " = " << k
            << " Pa/m: give more than " << least << " J/m2, a larger stiffness or a smaller " << strength;
  };
  falls("normal_work", "tension", "normal_stiffness", 1);
  falls("tangential_work", "cohesion", "tangential_stiffness", 1);
  falls("cap_work", "cap", "normal_stiffness", 67.0 / 75); // f/half, at half the strength
  if (!message.str().empty()) throw std::invalid_argument(info.python_name + ": " + message.str());
}

} // namespace

int LawTable::add(Law law, std::span<const double> params, std::span<const Curve> curves) {
  if (int(law) < 0 || std::size_t(law) >= law_infos().size())
    throw std::invalid_argument("law: " + std::to_string(int(law)) + " is no row of laws.def");
  const LawInfo& info = law_infos()[std::size_t(law)];
  if (params.size() != info.parameters.size())
    throw std::invalid_argument(info.python_name + " takes " + std::to_string(info.parameters.size()) +
                                " parameters, " + std::to_string(params.size()) + " were given");
  Entry entry{law, 0, {}};
  const auto check = [&](std::size_t k, double value) {
    const LawParameter& p = info.parameters[k];
    if (value >= p.smallest && value <= p.largest) return;
    std::ostringstream message;
    message << info.python_name << ": " << p.name << " = " << value << ", must lie between " << p.smallest << " and "
            << p.largest;
    throw std::invalid_argument(message.str());
  };
  for (std::size_t k = 0; k < params.size(); ++k) {
    check(k, params[k]);
    // an infinite friction stays a number, so that its product with no impulse is none
    entry.params[k] = std::min(params[k], std::numeric_limits<double>::max());
  }
  if (curves.empty()) check_works(info, entry.params), check_composite(info, entry.params);
  std::vector<double> key(entry.params, entry.params + params.size());
  key.push_back(double(law));
  for (const Curve& c : curves) {
    for (const double value : c.value) check(std::size_t(c.parameter), value);
    for (const double t : c.temperature) {
      double there[max_parameters];
      std::copy_n(entry.params, params.size(), there);
      for (const Curve& other : curves) there[other.parameter] = other.at(t);
      check_works(info, there), check_composite(info, there);
    }
    key.push_back(c.parameter);
    key.insert(key.end(), c.temperature.begin(), c.temperature.end());
    key.insert(key.end(), c.value.begin(), c.value.end());
  }
  const auto [at, is_new] = known_.try_emplace(std::move(key), std::int32_t(entries_.size()));
  if (!is_new) return at->second;
  entry.first_curve = std::int32_t(curves_.size());
  entry.curves = std::int32_t(curves.size());
  curves_.insert(curves_.end(), curves.begin(), curves.end());
  take(entry);
  return at->second;
}

void LawTable::take(const Entry& entry) {
  const auto known = std::find(laws_.begin(), laws_.end(), entry.law);
  entries_.push_back(entry);
  entries_.back().place = std::int16_t(known - laws_.begin());
  if (known == laws_.end()) laws_.push_back(entry.law);
}

void LawTable::set(int a, int b, Law law, std::span<const double> params) {
  for (int m : {a, b})
    if (m < 0 || m >= materials())
      throw std::invalid_argument("law: material " + std::to_string(m) + " is not one of the " +
                                  std::to_string(materials()));
  entry_of_.push_back(add(law, params));
  const std::int32_t* word = rules_.arrays().word;
  rules_.add(word[2 * std::size_t(a) + 1], word[2 * std::size_t(b) + 1], true);
}

void LawTable::set_default(Law law, std::span<const double> params) {
  entry_of_.push_back(add(law, params));
  rules_.add(LawRules::anything, LawRules::anything, true);
}

void LawTable::rule(const std::string& a, const std::string& b, Law law, std::span<const double> params,
                    std::span<const Curve> curves) {
  const std::int32_t first = rules_.word(a), second = rules_.word(b);
  const int entry = add(law, params, curves);
  if (first < LawRules::anything || second < LawRules::anything) return;
  entry_of_.push_back(entry);
  rules_.add(first, second, true);
}

void LawTable::pass_through(const std::string& a, const std::string& b) {
  const std::int32_t first = rules_.word(a), second = rules_.word(b);
  if (first < LawRules::anything || second < LawRules::anything) return;
  entry_of_.push_back(-1);
  rules_.add(first, second, false);
}

// Materials that no rule tells apart are ruled alike, so the first of each kind is enough; a row is passed over while
// all laws were met that rules about the materials so far could give.
void LawTable::settle() {
  const std::vector<Entry> given = std::move(entries_);
  entries_.clear();
  laws_.clear();
  std::vector<std::int32_t> now(given.size(), -1);
  std::vector<char> awaited(given.size(), 0);
  const std::vector<LawRules::InForce> rules = rules_.in_force();
  const std::vector<std::int32_t> kinds = rules_.kinds();
  std::size_t next = 0, missing = 0;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    for (; next < rules.size() && rules[next].from <= kinds[i]; ++next) {
      const std::int32_t entry = entry_of_[std::size_t(rules[next].rule)];
      if (entry < 0 || awaited[std::size_t(entry)]) continue;
      awaited[std::size_t(entry)] = 1;
      ++missing;
    }
    for (std::size_t j = 0; j <= i && missing > 0; ++j) {
      const int entry = find(kinds[i], kinds[j]);
      if (entry < 0 || now[std::size_t(entry)] >= 0) continue;
      now[std::size_t(entry)] = std::int32_t(entries_.size());
      take(given[std::size_t(entry)]);
      --missing;
    }
  }
  for (std::int32_t& entry : entry_of_)
    if (entry >= 0) entry = now[std::size_t(entry)];
  for (auto at = known_.begin(); at != known_.end();) {
    at->second = now[std::size_t(at->second)];
    at = at->second < 0 ? known_.erase(at) : std::next(at);
  }
}

bool can_bond(Law law) {
  const LawInfo& of = law_infos()[std::size_t(law)];
  return (of.anchored && !of.spans) || of.bonds;
}

} // namespace cairn
