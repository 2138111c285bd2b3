// Laws and parameters of the pairs of materials of a scene.
#pragma once
#include <map>
#include <span>
#include <string>
#include <vector>

#include "law_info.hpp"
#include "law_rules.hpp"

namespace cairn {

// Which law, with which parameters, rules a pair of materials (or groups): see LawRules.
class LawTable {
public:
  static constexpr int max_parameters = 20, max_states = 20;
  struct Entry {
    Law law;
    std::int16_t place = 0; // of the law among those of the table
    double params[max_parameters];
    std::int32_t first_curve = 0, curves = 0; // parameters that depend on temperature
  };
  // A parameter by the mean temperature of both sides [K]: piecewise linear, constant beyond its ends.
  struct Curve {
    int parameter = 0;
    std::vector<double> temperature, value;
    double at(double t) const;
  };
  LawTable() = default;
  explicit LawTable(std::vector<std::string> material_names); // numbered as contactors.material
  // Materials that may be of a group, "" if not.
  LawTable(std::vector<std::string> material_names, const std::vector<std::string>& groups);
  int materials() const { return int(names_.size()); }
  // Both orders of the pair. Throws std::invalid_argument naming parameter, value and range.
  void set(int material_a, int material_b, Law law, std::span<const double> params);
  void set_default(Law law, std::span<const double> params); // for pairs that have none of their own
  // Rules by the names of materials and groups or "*"; one that names nothing of the scene has no effect. After the
  // last of them: settle.
  void rule(const std::string& a, const std::string& b, Law law, std::span<const double> params,
            std::span<const Curve> curves = {});
  void pass_through(const std::string& a, const std::string& b);
  void keep_apart(std::span<const std::int32_t> materials) { rules_.keep_apart(materials); }
  // Numbers the laws that pairs of materials have by the first pair that has each, and forgets those that none has.
  void settle();
  // -1 if the pair has no law
  int find(int material_a, int material_b) const {
    const std::int32_t rule = rules_.between(material_a, material_b);
    return rule < 0 ? -1 : entry_of_[std::size_t(rule)];
  }
  const Entry& entry(int i) const { return entries_[i]; }
  int entries() const { return int(entries_.size()); }
  const std::vector<Law>& laws() const { return laws_; } // that the table has, each once
  const std::string& name(int material) const { return names_[material]; }
  const LawRules& rules() const { return rules_; }
  const std::vector<Curve>& curves() const { return curves_; }

private:
  int add(Law law, std::span<const double> params, std::span<const Curve> curves = {});
  void take(const Entry& entry);
  std::vector<std::string> names_;
  LawRules rules_;
  std::vector<std::int32_t> entry_of_; // of the rules; -1: a rule by which they pass through each other
  std::vector<Entry> entries_;
  std::vector<Curve> curves_;
  std::map<std::vector<double>, std::int32_t> known_; // law and parameters of the entries
  std::vector<Law> laws_;
};

} // namespace cairn
