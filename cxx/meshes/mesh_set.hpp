// Deformable bodies of a scene, and the nodes that carry a contact on them.
#pragma once
#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "../base/cell.hpp"
#include "../bodies/condensed_body.hpp"
#include "../bodies/nodes.hpp"
#include "../contactors/mapped_contactors.hpp"
#include "mesh_list.hpp"

namespace cairn {

class LawRules;
struct Candidates;
struct Margin;
struct MortarBox;
struct MortarRow;
struct MortarWork;

// Nodes of a mesh that carry a point of its surface, with weights whose sum is 1.
struct Mapping {
  std::int32_t mesh = -1;
  std::int32_t node[4] = {-1, -1, -1, -1};
  double weight[4] = {0, 0, 0, 0};
  std::int32_t mean = -1; // number of a mean over more nodes, of which these are the heaviest
};

class MeshSet {
public:
  MeshList meshes;
  MeshBody::Bytes compliance_bytes; // see MeshBody::rest_on

  bool empty() const { return meshes.empty(); }
  bool linear() const {
    return std::all_of(meshes.begin(), meshes.end(), [](const MeshBody& m) { return m.linear(); });
  }
  // Finds where the nodes of each begin, and which contactors are mapped from them; to be called when internal numbers
  // change.
  void place(const Nodes& nodes, const Contactors& contactors);
  // Mapped contactors to where the nodes are.
  void follow(const Nodes& nodes, const Contactors& contactors);
  const MappedContactors& mapped() const { return mapped_; }
  // Contactors that are facets, and their vertices as Scene::move_facets takes them, after `follow`.
  std::span<const std::int32_t> facets() const { return facets_; }
  std::span<const double> facet_vertices() const { return facet_vertices_; }
  bool carries(std::int32_t contactor) const { return of_contactor_[std::size_t(contactor)] >= 0; }
  std::int32_t mesh_of(std::int32_t contactor) const { return seat(contactor).mesh; }
  // Places of the nodes of a mapped contactor among those of the scene, -1 where there are fewer, and their weights in
  // its middle.
  struct Middle {
    std::int32_t node[4] = {-1, -1, -1, -1};
    double weight[4] = {0, 0, 0, 0};
    double of(const Field<double>& field, int component) const { // its value there
      double sum = 0;
      for (int j = 0; j < 4 && node[j] >= 0; ++j) sum += weight[j] * field[node[j]][component];
      return sum;
    }
  };
  const Middle& middle(std::int32_t contactor) const { return seat(contactor).middle; }
  // Nodes of an edge or a facet, as numbers in the scene, in the order of the weights of `mapping`; -1: none.
  std::array<std::int32_t, 4> nodes_of_side(std::int32_t contactor) const;
  // The nodes that a point (dim) [m] on a mapped contactor moves with.
  // other: the contactor that it touches, whose mortar with this one counts in the place of the point.
  Mapping mapping(const Nodes& nodes, std::int32_t contactor, const double* point, std::int32_t other = -1) const;
  // True if contacts on a mapped contactor turn with it: edges and facets turn, nodes and points have a position only.
  bool turns(std::int32_t contactor) const {
    return seat(contactor).role == Role::edge || seat(contactor).role == Role::facet;
  }
  // The spin of the edge or face where a mapping rests on it, in space axes, as rows of the velocities of its nodes
  // [1/m]: 2D rows[node][0][direction]. See mesh_spin.cpp.
  void spin(const Nodes& nodes, const Mapping& mapping, double rows[4][3][3]) const;
  // After detection: contacts of nodes of meshes that ask for mortars, see mesh_mortar.cpp and mesh_mortar_sides.cpp.
  struct MortarSearch { // what detection went by
    const Contactors& contactors;
    const Margin& margin;
    const LawRules& rules;
    const Cell& cell;
  };
  // Takes from the candidates the edges beyond whose ends nodes lie on their line.
  void let_past_ends(const Candidates& candidates);
  void weigh_mortar(const Nodes& nodes, const MortarSearch& search, Candidates& candidates);
  // Tributary area of a contact node or point [m2], in 2D per metre across the plane or over the revolution; 0 for
  // edges and facets. After find_areas, which is called again when internal numbers changed.
  double area(std::int32_t contactor) const { return area_[std::size_t(of_contactor_[std::size_t(contactor)])]; }
  // Part of the surface nearer to that node or point than to others [m2], for contacts with grains; zero at neighbours
  // of none.
  double near_area(std::int32_t contactor) const {
    return near_area_[std::size_t(of_contactor_[std::size_t(contactor)])];
  }
  // Part of a side within the tributary area of a contact node or point; area() is the sum over sides.
  struct SidePart {
    std::int32_t owner; // contactor
    int corner;         // number of the node among those of the side, -1: a point
    double from, to;    // of an edge: from 0 at its first node to 1 at its second
    double area;        // [m2], of a metre across the plane, or round the axis
  };
  std::span<const SidePart> parts_of_side(std::int32_t contactor) const;
  // Areas that the corners of an edge or a triangle stand for, whether they touch or not.
  std::span<const double, 3> shares_of_side(std::int32_t contactor) const;
  // Area of a part of an edge, given by shares of its length [m2].
  double edge_area(std::int32_t contactor, double from, double to) const;
  // True if a point and a half of a face of four nodes, of one mesh, coincided before the face opened. A warped face
  // then leaves a gap above rounding.
  bool parted_warped(std::int32_t point, std::int32_t side) const;
  // True if a contactor is a half of a face of four nodes, which may be warped.
  bool warps(std::int32_t contactor) const {
    return seat(contactor).role == Role::facet && node_of(seat(contactor), 3) >= 0;
  }
  bool has_areas() const { return area_.size() == seats_.size(); }
  // How near nodes of a cell are to each other where two contactors are, as the bodies lay at the start, the lesser of
  // both [m]; infinite where rigid bodies carry them.
  double cell_size(std::int32_t a, std::int32_t b) const { return std::min(cell_size(a), cell_size(b)); }
  std::string describe(std::int32_t contactor) const; // "node 3, quad cell 1, of the mesh 'block'"
  // is_mark: of each of mapped(), whether it marks the end of a joint, and stands for no surface.
  void find_areas(const std::vector<std::uint8_t>& is_mark);
  // Nodes that a contact may rest on become contact nodes: after begin_to_want, which each preparation of contacts
  // calls.
  void begin_to_want() { std::fill(mean_row_.begin(), mean_row_.end(), -1); }
  void want(const Mapping& mapping);
  // After all were wanted: compliances, and the meshes as solvers see them, with room for the velocities of contact
  // nodes. keep_nodes: those of means are rows, too.
  void condense(std::vector<CondensedBody>& out, Array<double>& velocity, bool keep_nodes);
  // The same rows with compliances and room anew.
  void condense_again(std::vector<CondensedBody>& out, Array<double>& velocity);
  // Row of a mapping's mean in the body that was condensed last.
  std::int32_t row_of_mean(std::int32_t mean) const { return mean_row_[std::size_t(mean)]; }

private:
  friend struct MortarWork;
  enum class Role : std::int8_t { node, point, edge, facet };
  struct Seat { // of a mapped contactor
    std::int32_t mesh = -1, index = -1;
    Role role = Role::node;
    std::int32_t first_node = 0; // of its mesh, so that mappings of many small meshes open none of them
    Middle middle;
  };
  const Seat& seat(std::int32_t contactor) const { return seats_[std::size_t(of_contactor_[std::size_t(contactor)])]; }
  Seat find_seat(std::int32_t mesh, std::int64_t part) const;
  void find_sizes();
  void find_nodes_beside();
  void find_sides_of_nodes();
  double cell_size(std::int32_t contactor) const {
    const std::int32_t at = of_contactor_[std::size_t(contactor)];
    return at < 0 ? std::numeric_limits<double>::infinity() : size_[std::size_t(at)];
  }
  std::int32_t node_of(const Seat& s, int j) const; // in its mesh, -1: none
  bool across(const Seat& point, const Seat& side) const;
  struct MortarContact { // of a node and a side of another mesh, by their contactors
    std::int32_t node, edge;
    Mapping there, here; // here.mesh < 0: on the node alone
  };
  struct KeptMortar {
    std::int32_t node, edge, feature, image;
    double gap, normal[3], point[3];
  };
  struct MetMortar;   // of the search, see mortar_work.hpp
  struct TakenMortar; // of one mesh with another, see mortar_work.hpp
  const TakenMortar* taken_of(std::int32_t own, std::int32_t other) const;
  const MortarContact* mortar_of(std::int32_t node, std::int32_t edge) const;
  bool is_on_side(std::int32_t a, std::int32_t b) const;
  bool asks_mortar(std::int32_t a, std::int32_t b) const;
  bool looks_towards(const Nodes& nodes, const Seat& node, const Seat& side) const;
  bool is_left_to_mortar(const Nodes& nodes, std::int32_t a, std::int32_t b) const;
  void find_mortar_sides();
  void seek_sides(const Nodes& nodes, const MortarSearch& search);
  void seek_sides_of(const Nodes& nodes, const MortarSearch& search, const MortarBox& own, const MortarBox& other);
  const Nodes& seen_from(const Nodes& nodes, const MetMortar& met, const Cell& cell);
  void weigh_pair(const Nodes& nodes, std::span<const MetMortar> met);
  void put_row(const Nodes& nodes, std::int32_t own, std::int32_t other, const MortarRow& row, const MetMortar& seen);
  void put_mortar(Candidates& candidates, std::int64_t& to, const KeptMortar& m, int dim) const;
  void sort_mortar();
  void end_mortar(Candidates& candidates, std::int64_t count, int dim);
  // Fills m with the heaviest of nodes by their weights, and numbers their mean where they are more than four.
  void map_mean(Mapping& m, std::span<const std::int32_t> node, std::span<const double> weight);
  void take_rows(std::size_t mesh, CondensedBody& body, bool keep_nodes);
  void mix(MeshBody& mesh, CondensedBody& body);
  void make_room(std::vector<CondensedBody>& out, Array<double>& velocity);
  void part_from_themselves(const Contactors& contactors);
  void find_next_edges();

  MappedContactors mapped_;
  std::vector<Seat> seats_;                // of each of mapped_
  std::vector<std::int32_t> of_contactor_; // its place among these, -1: a rigid body carries it
  std::vector<std::int32_t> facets_;
  std::vector<double> facet_vertices_;
  std::vector<double> area_, near_area_, size_;   // of each of mapped_
  std::vector<double> side_share_;                // (3, sides), mesh by mesh
  std::vector<SidePart> parts_;                   // side by side, mesh by mesh
  std::vector<std::int64_t> first_part_;          // (sides + 1)
  std::vector<std::int64_t> first_side_;          // of each mesh among them
  std::vector<std::vector<std::int32_t>> wanted_; // nodes of each mesh
  std::vector<MortarContact> mortar_;             // of the last candidates, by their contactors
  std::vector<KeptMortar> kept_mortar_;
  std::vector<std::pair<std::int32_t, std::int32_t>> past_ends_; // edge and node, rising
  bool any_mortar_ = false;                                      // a mesh asks for it
  // Means of the last mortars: their nodes (of the mesh) and weights; rows, -1 unless wanted.
  std::vector<std::int32_t> mean_start_, mean_node_, mean_row_;
  std::vector<double> mean_weight_;
  std::vector<std::vector<std::int32_t>> wanted_means_, direct_; // of each mesh; nodes that contacts rest on themselves
  std::vector<double> columns_;
  std::shared_ptr<MortarWork> mortar_work_;
};

} // namespace cairn
