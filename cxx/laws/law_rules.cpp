#include "law_rules.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <set>

namespace cairn {

LawRules::LawRules(int materials) : apart_(materials, 0), word_(2 * std::size_t(materials)), alone_(materials, -1) {
  for (int i = 0; i < materials; ++i) {
    word_[2 * std::size_t(i)] = -1;
    word_[2 * std::size_t(i) + 1] = i;
  }
}

LawRules::LawRules(const std::vector<std::string>& material, const std::vector<std::string>& group)
    : apart_(material.size(), 0), word_(2 * material.size()) {
  for (std::size_t i = 0; i < material.size(); ++i) {
    word_[2 * i] = group[i].empty() ? -1 : known(group[i]);
    word_[2 * i + 1] = known(material[i]);
  }
}

std::int32_t LawRules::known(const std::string& name) {
  const auto [at, is_new] = words_.try_emplace(name, std::int32_t(alone_.size()));
  if (is_new) alone_.push_back(-1);
  return at->second;
}

std::int32_t LawRules::word(const std::string& name) const {
  if (name == "*") return anything;
  const auto at = words_.find(name);
  return at == words_.end() ? -2 : at->second;
}

void LawRules::keep_apart(std::span<const std::int32_t> materials) {
  for (const std::int32_t m : materials) apart_[std::size_t(m)] = 1;
  if (!materials.empty()) all_meet_ = false;
}

std::int32_t LawRules::add(std::int32_t a, std::int32_t b, bool meet) {
  const std::int32_t number = rules();
  meet_.push_back(meet);
  all_meet_ = all_meet_ && meet;
  if (a == anything && b == anything) {
    any_ = number;
  } else if (a == anything || b == anything) {
    alone_[std::size_t(a == anything ? b : a)] = number;
  } else {
    if (2 * (pairs_ + 1) > std::int64_t(rule_.size())) grow();
    std::int32_t added = 0;
    cairn_law_rule_place(a, b, number, std::int64_t(rule_.size()), key_.data(), rule_.data(), &added);
    pairs_ += added;
  }
  return number;
}

void LawRules::grow() {
  std::vector<std::int32_t> key(std::max<std::size_t>(2 * key_.size(), 16), -1), rule(key.size() / 2, -1);
  for (std::size_t i = 0; i < rule_.size(); ++i) {
    std::int32_t added = 0;
    if (key_[2 * i] >= 0)
      cairn_law_rule_place(key_[2 * i], key_[2 * i + 1], rule_[i], std::int64_t(rule.size()), key.data(), rule.data(),
                           &added);
  }
  key_.swap(key);
  rule_.swap(rule);
}

std::int32_t LawRules::between(std::int32_t a, std::int32_t b) const {
  std::int32_t found = cairn_no_rule;
  cairn_law_rule_between(a, b, word_.data(), apart_.data(), alone_.data(), any_, std::int64_t(rule_.size()),
                         key_.data(), rule_.data(), &found);
  return found;
}

bool LawRules::same_as(const LawRules& other) const {
  return any_ == other.any_ && meet_ == other.meet_ && apart_ == other.apart_ && word_ == other.word_ &&
         alone_ == other.alone_ && key_ == other.key_ && rule_ == other.rule_;
}

LawRules::Arrays LawRules::arrays() const {
  return {meet_.data(), word_.data(), apart_.data(), alone_.data(), any_, std::int64_t(rule_.size()),
          key_.data(),  rule_.data()};
}

std::vector<std::int32_t> LawRules::kinds() const {
  std::vector<char> named(alone_.size(), 0);
  for (std::size_t w = 0; w < named.size(); ++w) named[w] = alone_[w] >= 0;
  for (const std::int32_t w : key_)
    if (w >= 0) named[std::size_t(w)] = 1;
  std::set<std::array<std::int32_t, 3>> known;
  std::vector<std::int32_t> first;
  for (std::int32_t m = 0; m < materials(); ++m) {
    std::array<std::int32_t, 3> kind = {word_[2 * std::size_t(m)], word_[2 * std::size_t(m) + 1],
                                        apart_[std::size_t(m)]};
    for (int k = 0; k < 2; ++k)
      if (kind[k] >= 0 && !named[std::size_t(kind[k])]) kind[k] = -1;
    if (known.insert(kind).second) first.push_back(m);
  }
  return first;
}

std::vector<LawRules::InForce> LawRules::in_force() const {
  const std::int32_t nowhere = std::numeric_limits<std::int32_t>::max();
  std::vector<std::int32_t> from(alone_.size(), nowhere);
  for (std::int32_t m = materials() - 1; m >= 0; --m)
    for (int k = 0; k < 2; ++k)
      if (const std::int32_t w = word_[2 * std::size_t(m) + k]; w >= 0) from[std::size_t(w)] = m;
  std::vector<InForce> found;
  if (any_ >= 0) found.push_back({any_, 0});
  for (std::size_t w = 0; w < alone_.size(); ++w)
    if (alone_[w] >= 0) found.push_back({alone_[w], from[w]});
  for (std::size_t i = 0; i < rule_.size(); ++i)
    if (rule_[i] >= 0)
      found.push_back({rule_[i], std::max(from[std::size_t(key_[2 * i])], from[std::size_t(key_[2 * i + 1])])});
  std::sort(found.begin(), found.end(),
            [](const InForce& a, const InForce& b) { return a.from != b.from ? a.from < b.from : a.rule < b.rule; });
  return found;
}

} // namespace cairn
