#include "facet_trees.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

#include "../contactors/shapes.hpp"

namespace cairn::detection {

namespace {

constexpr std::int32_t leaf = 4; // triangles; fewer take more boxes, more more tests

} // namespace

FacetTrees::Tree::Tree(std::int32_t body, const Contactors& contactors, std::vector<std::int32_t> facets)
    : body_(body), facets_(std::move(facets)) {
  const Hulls& hulls = contactors.hulls;
  corner_.resize(6 * facets_.size());
  for (std::size_t i = 0; i < facets_.size(); ++i) {
    const std::int32_t facet = facets_[i];
    const auto hull = std::size_t(contactors.hull.values[std::size_t(facet)]);
    const double* vertex = &hulls.vertex[3 * std::size_t(hulls.first_vertex[hull])];
    for (int d = 0; d < 3; ++d) {
      const double centre = contactors.offset.active ? contactors.offset[facet][d] : 0;
      const auto [low, high] = std::minmax({vertex[d], vertex[3 + d], vertex[6 + d]});
      corner_[6 * i + std::size_t(d)] = centre + low;
      corner_[6 * i + 3 + std::size_t(d)] = centre + high;
    }
  }
  place_.resize(facets_.size());
  std::iota(place_.begin(), place_.end(), 0);
  nodes_.reserve(facets_.size());
  add(0, std::int32_t(facets_.size()));
  std::vector<std::int32_t> sorted(facets_.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) sorted[i] = facets_[std::size_t(place_[i])];
  facets_ = std::move(sorted);
  corner_ = {};
  place_ = {};
}

void FacetTrees::Tree::enclose(Node& node) const {
  for (int d = 0; d < 3; ++d) {
    node.low[d] = std::numeric_limits<double>::infinity();
    node.high[d] = -node.low[d];
    for (std::int32_t i = node.first; i < node.last; ++i) {
      const double* corner = &corner_[6 * std::size_t(place_[std::size_t(i)])];
      node.low[d] = std::min(node.low[d], corner[d]);
      node.high[d] = std::max(node.high[d], corner[3 + d]);
    }
  }
}

// The number of the node that holds these.
std::int32_t FacetTrees::Tree::add(std::int32_t first, std::int32_t last) {
  const auto number = std::int32_t(nodes_.size());
  nodes_.push_back({{}, {}, first, last, 0});
  enclose(nodes_.back());
  if (last - first <= leaf) return number;
  int axis = 0;
  const Node box = nodes_.back();
  for (int d = 1; d < 3; ++d)
    if (box.high[d] - box.low[d] > box.high[axis] - box.low[axis]) axis = d;
  const std::int32_t middle = first + (last - first) / 2;
  const auto centre = [&](std::int32_t i) {
    return corner_[6 * std::size_t(i) + std::size_t(axis)] + corner_[6 * std::size_t(i) + 3 + std::size_t(axis)];
  };
  std::nth_element(place_.begin() + first, place_.begin() + middle, place_.begin() + last,
                   [&](std::int32_t i, std::int32_t j) { return centre(i) < centre(j); });
  add(first, middle);
  const std::int32_t beside = add(middle, last);
  nodes_[std::size_t(number)].beside = beside;
  return number;
}

void FacetTrees::Tree::find(const double x[3], double reach, Array<std::int32_t>& found) const {
  std::int32_t open[64], depth = 0; // halves of at most 2^31 triangles
  open[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[std::size_t(open[--depth])];
    double square = 0;
    for (int d = 0; d < 3; ++d) {
      const double apart = std::max({node.low[d] - x[d], x[d] - node.high[d], 0.0});
      square += apart * apart;
    }
    if (square > reach * reach) continue;
    if (node.beside == 0) {
      found.insert(found.end(), facets_.begin() + node.first, facets_.begin() + node.last);
    } else {
      open[depth++] = node.beside;
      open[depth++] = std::int32_t(&node - nodes_.data()) + 1;
    }
  }
}

void FacetTrees::make(const Contactors& contactors) {
  trees_.clear();
  std::map<std::int32_t, std::vector<std::int32_t>> of_body;
  for (std::int64_t i = 0; i < contactors.count; ++i)
    if (info(Shape(contactors.shape.values[std::size_t(i)])).facet())
      of_body[contactors.body.values[std::size_t(i)]].push_back(std::int32_t(i));
  for (auto& [body, facets] : of_body) trees_.emplace_back(body, contactors, std::move(facets));
}

std::size_t FacetTrees::bytes() const {
  std::size_t total = trees_.capacity() * sizeof(Tree);
  for (const Tree& tree : trees_) total += tree.bytes();
  return total;
}

} // namespace cairn::detection
