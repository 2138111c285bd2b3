// Mortar contacts of a step, which replace candidates of nodes of meshes that ask for them.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "../base/cell.hpp"
#include "mesh_seats.hpp"

namespace cairn {

class LawRules;
struct Candidates;
struct Margin;
struct MortarBox;
struct MortarRow;
struct MortarWork;

// Weighted means over nodes of a mesh.
struct NodeMeans {
  std::vector<std::int32_t> start, node; // nodes of mean i (of its mesh): from start[i] to start[i + 1]
  std::vector<double> weight;
  std::size_t count() const { return start.empty() ? 0 : start.size() - 1; }
  std::size_t begin(std::int32_t mean) const { return std::size_t(start[std::size_t(mean)]); }
  std::size_t end(std::int32_t mean) const { return std::size_t(start[std::size_t(mean) + 1]); }
  void clear() {
    start.clear();
    node.clear();
    weight.clear();
  }
  // Fills m with the heaviest of nodes by their weights, and keeps their mean where they are more than four.
  void map(Mapping& m, std::span<const std::int32_t> nodes, std::span<const double> weights);
};

class MortarContacts {
public:
  struct Search { // what detection went by
    const Contactors& contactors;
    const Margin& margin;
    const LawRules& rules;
    const Cell& cell;
  };
  // To be called when internal numbers change.
  void begin(const MeshList& meshes);
  // After detection: see mesh_mortar.cpp and mesh_mortar_sides.cpp.
  void weigh(const MeshList& meshes, const MeshSeats& seats, const Nodes& nodes, const Search& search, Candidates& c);
  // Mapping of a contactor by its mortar with another; null: they have none.
  const Mapping* mapping(std::int32_t contactor, std::int32_t other) const;
  const NodeMeans& means() const { return means_; }

private:
  friend struct MortarWork;
  using Seat = MeshSeats::Seat;
  using Role = MeshSeats::Role;
  struct Contact { // of a node and a side of another mesh, by their contactors
    std::int32_t node, edge;
    Mapping there, here; // here.mesh < 0: on the node alone
  };
  struct Kept { // candidate
    std::int32_t node, edge, feature, image;
    double gap, normal[3], point[3];
  };
  struct Met;   // of the search, see mortar_work.hpp
  struct Taken; // of one mesh with another, see mortar_work.hpp
  const Taken* taken_of(std::int32_t own, std::int32_t other) const;
  const Contact* find(std::int32_t node, std::int32_t edge) const;
  static bool asks(const MeshSeats& seats, std::int32_t a, std::int32_t b);
  bool looks_towards(const Nodes& nodes, const Seat& node, const Seat& side) const;
  bool replaces(const MeshSeats& seats, const Nodes& nodes, std::int32_t a, std::int32_t b) const;
  void find_sides(const MeshList& meshes, const MeshSeats& seats);
  void seek_sides(const Nodes& nodes, const Search& search);
  void seek_sides_of(const Nodes& nodes, const Search& search, const MortarBox& own, const MortarBox& other);
  const Nodes& seen_from(const Nodes& nodes, const Met& met, const Cell& cell);
  void weigh_pair(const Nodes& nodes, std::span<const Met> met);
  void put_row(const Nodes& nodes, std::int32_t own, std::int32_t other, const MortarRow& row, const Met& seen);

  std::vector<Contact> contacts_; // of the last candidates, by their contactors
  std::vector<Kept> kept_;
  NodeMeans means_;  // of the last mortars
  bool any_ = false; // a mesh asks for it
  std::shared_ptr<MortarWork> work_;
};

} // namespace cairn
