// Deformable bodies in their order.
#pragma once
#include <cstddef>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "mesh_body.hpp"

namespace cairn {

// Owns meshes that stay where they are in memory, as their parts refer to each other.
class MeshList {
  using Owners = std::vector<std::unique_ptr<MeshBody>>;
  template <class Owner, class Body>
  struct Iterator {
    using iterator_category = std::forward_iterator_tag;
    using value_type = MeshBody;
    using difference_type = std::ptrdiff_t;
    using pointer = Body*;
    using reference = Body&;
    Owner at;
    Body& operator*() const { return **at; }
    Body* operator->() const { return at->get(); }
    Iterator& operator++() {
      ++at;
      return *this;
    }
    Iterator operator++(int) {
      Iterator before = *this;
      ++at;
      return before;
    }
    bool operator==(const Iterator&) const = default;
  };

public:
  using iterator = Iterator<Owners::iterator, MeshBody>;
  using const_iterator = Iterator<Owners::const_iterator, const MeshBody>;
  iterator begin() { return {all_.begin()}; }
  iterator end() { return {all_.end()}; }
  const_iterator begin() const { return {all_.begin()}; }
  const_iterator end() const { return {all_.end()}; }
  std::size_t size() const { return all_.size(); }
  bool empty() const { return all_.empty(); }
  MeshBody& operator[](std::size_t k) { return *all_[k]; }
  const MeshBody& operator[](std::size_t k) const { return *all_[k]; }
  MeshBody& at(std::size_t k) { return *all_.at(k); }
  const MeshBody& at(std::size_t k) const { return *all_.at(k); }
  MeshBody& back() { return *all_.back(); }
  MeshBody& emplace_back(MeshModel model) {
    all_.push_back(std::make_unique<MeshBody>(std::move(model)));
    return *all_.back();
  }
  void erase(std::size_t k) { all_.erase(all_.begin() + std::ptrdiff_t(k)); }
  // Takes mesh k of another list, which leaves a gap there.
  void take(MeshList& from, std::size_t k) { all_.push_back(std::move(from.all_.at(k))); }

private:
  Owners all_;
};

} // namespace cairn
