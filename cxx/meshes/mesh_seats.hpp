// Mapped contactors on the nodes of their meshes: which part each is, where it stands, which nodes a point on it moves
// with.
#pragma once
#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../bodies/nodes.hpp"
#include "../contactors/mapped_contactors.hpp"
#include "mesh_list.hpp"

namespace cairn {

struct Candidates;

// Nodes of a mesh that carry a point of its surface, with weights whose sum is 1.
struct Mapping {
  std::int32_t mesh = -1;
  std::int32_t node[4] = {-1, -1, -1, -1};
  double weight[4] = {0, 0, 0, 0};
  std::int32_t mean = -1; // number of a mean over more nodes, of which these are the heaviest
};

class MeshSeats {
public:
  enum class Role : std::int8_t { node, point, edge, facet };
  // Nodes of a mapped contactor among those of the scene, -1 where there are fewer, and their weights in its middle.
  struct Middle {
    std::int32_t node[4] = {-1, -1, -1, -1};
    double weight[4] = {0, 0, 0, 0};
    double of(const Field<double>& field, int component) const { // its value there
      double sum = 0;
      for (int j = 0; j < 4 && node[j] >= 0; ++j) sum += weight[j] * field[node[j]][component];
      return sum;
    }
  };
  struct Seat { // of a mapped contactor
    std::int32_t mesh = -1, index = -1;
    Role role = Role::node;
    std::int32_t first_node = 0;    // of its mesh, so that mappings of many small meshes open none of them
    const MeshBody* body = nullptr; // the mesh
    Middle middle;
    bool is_side() const { return role == Role::edge || role == Role::facet; }
    bool is_half() const { return role == Role::facet && node(3) >= 0; } // of a face of four nodes, which may be warped
    std::int32_t node(int j) const;                                      // in its mesh, -1: none
  };

  // Finds which contactors are mapped from which parts; to be called when internal numbers change. numbers: how many
  // numbers of meshes there are.
  void place(const MeshList& meshes, std::size_t numbers, const Nodes& nodes, const Contactors& contactors);
  // Mapped contactors to where the nodes are.
  void follow(const Nodes& nodes, const Contactors& contactors);
  const MappedContactors& mapped() const { return mapped_; }
  std::span<const std::int32_t> facets() const { return facets_; }
  std::span<const double> facet_vertices() const { return facet_vertices_; }
  std::span<const Seat> seats() const { return seats_; } // of each of mapped()
  bool carries(std::int32_t contactor) const { return of_contactor_[std::size_t(contactor)] >= 0; }
  std::int32_t number(std::int32_t contactor) const { return of_contactor_[std::size_t(contactor)]; } // among seats()
  const Seat& seat(std::int32_t contactor) const { return seats_[std::size_t(number(contactor))]; }
  std::array<std::int32_t, 4> nodes_of_side(std::int32_t contactor) const;
  bool parted_warped(std::int32_t point, std::int32_t side) const;
  double cell_size(std::int32_t contactor) const {
    const std::int32_t at = number(contactor);
    return at < 0 ? std::numeric_limits<double>::infinity() : size_[std::size_t(at)];
  }
  std::string describe(std::int32_t contactor) const;
  // Takes from the candidates the edges beyond whose ends nodes lie on their line.
  void let_past_ends(const Candidates& candidates);
  // The nodes that a point (dim) [m] on a mapped contactor moves with; other: the contactor that it touches.
  Mapping mapping(const Nodes& nodes, std::int32_t contactor, const double* point, std::int32_t other) const;

private:
  Seat find_seat(const MeshList& meshes, std::int32_t mesh, std::int64_t part) const;
  void find_sizes(const MeshList& meshes);
  void find_nodes_beside(const MeshList& meshes);
  void find_sides_of_nodes(const MeshList& meshes);
  void part_from_themselves(const MeshList& meshes, const Contactors& contactors);
  void find_next_edges(const MeshList& meshes);

  MappedContactors mapped_;
  std::vector<Seat> seats_;
  std::vector<std::int32_t> of_contactor_; // its place among these, -1: a rigid body carries it
  std::vector<std::int32_t> facets_;
  std::vector<double> facet_vertices_;
  std::vector<double> size_;                                     // of the cells at each of mapped_ [m]
  std::vector<std::pair<std::int32_t, std::int32_t>> past_ends_; // edge and node, rising
};

// The spin of the edge or face where a mapping rests on it, in space axes, as rows of the velocities of its nodes
// [1/m]: 2D rows[node][0][direction]. See mesh_spin.cpp.
void spin_of_side(const MeshBody& mesh, const Nodes& nodes, const Mapping& mapping, double rows[4][3][3]);

} // namespace cairn
