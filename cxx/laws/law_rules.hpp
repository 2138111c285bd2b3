// Which rule is about a pair of materials (or groups), in room and time that grow as materials and rules do.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "cairn/core.h"

namespace cairn {

// Contact rules between materials. A material has two words: that of its group, if any, and its own. A rule is about
// two words, a word and anything, or anything and anything. The most specific rule counts, in this order: two groups;
// group and material; group and anything; two materials; material and anything; anything. Among equals the last counts.
class LawRules {
public:
  static constexpr std::int32_t anything = -1;

  LawRules() = default;
  explicit LawRules(int materials);                                                          // word i is material i's
  LawRules(const std::vector<std::string>& material, const std::vector<std::string>& group); // group "": none

  int materials() const { return int(apart_.size()); }
  int rules() const { return int(meet_.size()) - first_rule; }
  // The word of that name, anything for "*"; -2 if no material and no group has it.
  std::int32_t word(const std::string& name) const;
  // These do not meet one another, unless a rule names both their groups.
  void keep_apart(std::span<const std::int32_t> materials);
  // Returns the rule's number. meet false: the materials pass through each other.
  std::int32_t add(std::int32_t word_a, std::int32_t word_b, bool meet);
  // The number of the rule that counts, cairn_no_rule or cairn_kept_apart.
  std::int32_t between(std::int32_t material_a, std::int32_t material_b) const;
  bool meets(std::int32_t rule) const { return meet_[std::size_t(rule + first_rule)] != 0; }
  bool all_meet() const { return all_meet_; }
  bool same_as(const LawRules& other) const; // the same rule counts between every two materials
  // The first material of each kind that rules can tell from the others.
  std::vector<std::int32_t> kinds() const;
  // Rules that no later one about the same words replaced, and the first material up to which there are materials for
  // both their sides; sorted by that.
  struct InForce {
    std::int32_t rule, from;
  };
  std::vector<InForce> in_force() const;
  // Rules as arrays for kernels over many pairs: see core.h.
  struct Arrays {
    const std::int8_t* meet; // from cairn_kept_apart on
    const std::int32_t* word;
    const std::int8_t* apart;
    const std::int32_t* alone;
    std::int32_t any;
    std::int64_t places;
    const std::int32_t *key, *rule;
  };
  Arrays arrays() const;

private:
  static constexpr int first_rule = 2; // of meet_, behind cairn_kept_apart and cairn_no_rule
  std::int32_t known(const std::string& name);
  void grow();
  bool all_meet_ = true;
  std::int32_t any_ = -1;
  std::int64_t pairs_ = 0;
  std::unordered_map<std::string, std::int32_t> words_;
  std::vector<std::int8_t> meet_{0, 1}, apart_;
  std::vector<std::int32_t> word_, alone_, key_, rule_;
};

} // namespace cairn
