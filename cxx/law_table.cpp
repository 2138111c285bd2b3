#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "interaction.hpp"

namespace cairn {

namespace {

double number(const std::string& text) {
  if (text == "inf") return std::numeric_limits<double>::infinity();
  return std::stod(text);
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

std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream words(text);
  for (std::string word; words >> word;) all.push_back(word);
  return all;
}

} // namespace

const std::vector<LawInfo>& law_infos() {
  static const std::vector<LawInfo> infos = [] {
    constexpr bool YES = true, NO = false, NORMAL = true, ALL = false;
    std::vector<LawInfo> all;
#define CAIRN_LAW(name, python, c2, c3, parameters, state, has_prepare, has_solve, has_commit, bias_along)             \
  all.push_back({#name, #python, c2, c3, parameters_of(parameters), words_of(state), has_prepare, has_solve,           \
                 has_commit, bias_along});
#include "../core_f90/contact_laws/laws.def"
#undef CAIRN_LAW
    return all;
  }();
  return infos;
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
  Entry entry{law, {0, 0, 0, 0}};
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
