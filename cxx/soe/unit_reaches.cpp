#include "unit_reaches.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "../base/call.hpp"
#include "factors.hpp"
#include "unit_fronts.hpp"

namespace cairn {

namespace {

struct Segment {
  std::int64_t place, length;
};

// Rows of Z that the columns of some places have, together.
class ReachFinder {
public:
  explicit ReachFinder(const SoeFactors& factors) : factors_(factors), tree_(*factors.tree()) {}

  const std::vector<Segment>& find(const std::vector<std::int32_t>& places) {
    nodes_.clear();
    for (const std::int32_t p : places) {
      std::int32_t node = tree_.node.empty() ? p : tree_.node[std::size_t(p)];
      nodes_.push_back({node, p});
      for (node = tree_.parent[std::size_t(node)]; node >= 0; node = tree_.parent[std::size_t(node)])
        nodes_.push_back({node, factors_.block(node).first});
    }
    std::sort(nodes_.begin(), nodes_.end(),
              [](const Begin& a, const Begin& b) { return a.node != b.node ? a.node < b.node : a.place < b.place; });
    found_.clear();
    std::int32_t last = -1;
    for (const Begin& n : nodes_) {
      if (n.node == last) continue;
      last = n.node;
      const SoeBlock block = factors_.block(n.node);
      const std::int64_t end = block.first + block.columns;
      if (!found_.empty() && found_.back().place + found_.back().length == n.place)
        found_.back().length = end - found_.back().place;
      else
        found_.push_back({n.place, end - n.place});
    }
    return found_;
  }

private:
  struct Begin {
    std::int32_t node, place;
  };
  const SoeFactors& factors_;
  const SoeTree& tree_;
  std::vector<Begin> nodes_;
  std::vector<Segment> found_;
};

constexpr std::int64_t groups_at_once = 512; // whose fronts stay in the memory that is near

} // namespace

std::int64_t UnitReaches::bytes() const {
  std::size_t numbers = first.capacity() + place.capacity() + length.capacity() + value.capacity();
  for (const std::vector<double>& k : kept) numbers += k.capacity();
  return std::int64_t(8 * numbers);
}

std::vector<std::int32_t> Soe::places_of(std::span<const std::int32_t> group) const {
  std::vector<std::int32_t> places;
  for (const std::int32_t i : group) {
    if (i < 0 || i >= n_)
      throw Error("unknown " + std::to_string(i) + " is none of " + std::to_string(n_) + ": they count from 0");
    if (equation_[std::size_t(i)] >= 0) places.push_back(place_[std::size_t(equation_[std::size_t(i)])]);
  }
  return places;
}

std::int64_t Soe::reach_numbers(std::span<const std::int32_t> unknowns, int together) const {
  if (!factorised_ || !symmetric_ || factors_->tree() == nullptr) return -1;
  ReachFinder finder(*factors_);
  std::int64_t numbers = 0;
  const auto each = std::size_t(together);
  for (std::size_t g = 0; g + each <= unknowns.size(); g += each)
    for (const Segment& s : finder.find(places_of(unknowns.subspan(g, each)))) numbers += together * s.length;
  return numbers;
}

void Soe::add_reaches(std::span<const std::int32_t> unknowns, int together, UnitReaches& out, int threads) const {
  if (!factorised_ || !symmetric_ || factors_->tree() == nullptr)
    throw Error("columns of the inverse factor are of sparse factors of a symmetric matrix");
  out.equations = scaled_.n;
  out.unit = scaled_.n > 0 ? left_[0] / right_[0] : 1;
  const auto each = std::size_t(together);
  const std::int64_t groups = std::int64_t(unknowns.size() / each), before = out.groups();
  ReachFinder finder(*factors_);
  std::vector<std::int64_t> from; // of each new segment in the numbers of its group
  std::vector<std::int64_t> size(std::size_t(groups), 0);
  std::vector<std::int32_t> lowest(std::size_t(groups), 0); // place, by which neighbours come together
  const auto segments_before = std::int64_t(out.place.size());
  for (std::int64_t g = 0; g < groups; ++g) {
    const std::vector<std::int32_t> places = places_of(unknowns.subspan(std::size_t(g) * each, each));
    for (const Segment& s : finder.find(places)) {
      out.place.push_back(s.place);
      out.length.push_back(s.length);
      from.push_back(size[std::size_t(g)]);
      size[std::size_t(g)] += together * s.length;
    }
    out.first.push_back(std::int64_t(out.place.size()));
    if (!places.empty()) lowest[std::size_t(g)] = *std::min_element(places.begin(), places.end());
  }
  std::vector<std::int64_t> order(static_cast<std::size_t>(groups));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::int64_t a, std::int64_t b) { return lowest[std::size_t(a)] < lowest[std::size_t(b)]; });
  out.value.resize(std::size_t(before + groups));
  for (std::int64_t begin = 0; begin < groups; begin += groups_at_once) {
    const std::int64_t end = std::min(begin + groups_at_once, groups);
    std::int64_t numbers = 0;
    std::vector<UnitFronts::Wanted> wanted;
    for (std::int64_t k = begin; k < end; ++k) numbers += size[std::size_t(order[std::size_t(k)])];
    std::vector<double>& values = out.kept.emplace_back(std::size_t(numbers), 0.0);
    std::vector<double*> at(std::size_t(end - begin));
    numbers = 0;
    for (std::int64_t k = begin; k < end; ++k) {
      const std::int64_t g = order[std::size_t(k)];
      out.value[std::size_t(before + g)] = at[std::size_t(k - begin)] = values.data() + numbers;
      numbers += size[std::size_t(g)];
      for (std::size_t c = 0; c < each; ++c)
        if (const std::int32_t e = equation_[std::size_t(unknowns[std::size_t(g) * each + c])]; e >= 0)
          wanted.push_back({std::int64_t(each) * (k - begin) + std::int64_t(c), place_[std::size_t(e)],
                            right_[std::size_t(e)], left_[std::size_t(e)]});
    }
    UnitFronts().each_front(
        *factors_, wanted, threads,
        [&](const SoeBlock& block, const UnitFronts::Wanted& w, const double* y, std::int64_t stride) {
          const std::int64_t k = w.index / together, column = w.index % together,
                             g = before + order[std::size_t(begin + k)];
          const auto segment =
              std::upper_bound(out.place.begin() + out.first[std::size_t(g)],
                               out.place.begin() + out.first[std::size_t(g) + 1], block.first + block.columns - 1) -
              out.place.begin() - 1;
          const std::int64_t place = out.place[std::size_t(segment)], length = out.length[std::size_t(segment)];
          double* to = at[std::size_t(k)] + from[std::size_t(segment - segments_before)] + column * length;
          for (std::int64_t c = std::max<std::int64_t>(0, place - block.first); c < block.columns; ++c)
            to[block.first + c - place] = w.right * y[stride * c];
        });
  }
}

} // namespace cairn
