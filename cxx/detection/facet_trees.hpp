// Triangles of rigid surfaces by trees of boxes in the axes of their bodies, which last as long as the surfaces do.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "../contactors/contactor.hpp"

namespace cairn::detection {

// A bounding volume hierarchy for each rigid body that has triangles, halved at the median of the longest axis. A
// search maps what it seeks into the axes of the body, so that a surface that moves costs nothing but the boxes near
// bodies.
class FacetTrees {
public:
  class Tree {
  public:
    Tree(std::int32_t body, const Contactors& contactors, std::vector<std::int32_t> facets);
    std::int32_t body() const { return body_; }
    std::span<const std::int32_t> facets() const { return facets_; }
    // Adds the triangles whose boxes a ball around x [m] in the axes of the body meets.
    void find(const double x[3], double reach, Array<std::int32_t>& found) const;
    std::size_t bytes() const { return facets_.capacity() * sizeof(std::int32_t) + nodes_.capacity() * sizeof(Node); }

  private:
    struct Node {
      double low[3], high[3];
      std::int32_t first, last; // facets below it
      std::int32_t beside;      // its second child, the first follows it; 0: none
    };
    std::int32_t add(std::int32_t first, std::int32_t last);
    void enclose(Node& node) const;
    std::int32_t body_;
    std::vector<std::int32_t> facets_;
    std::vector<double> corner_; // (3, 2, facets) of their boxes, while the tree is made [m]
    std::vector<std::int32_t> place_;
    std::vector<Node> nodes_;
  };

  // Makes the trees of the surfaces of these contactors.
  void make(const Contactors& contactors);
  std::span<const Tree> trees() const { return trees_; }
  std::size_t bytes() const;

private:
  std::vector<Tree> trees_;
};

} // namespace cairn::detection
