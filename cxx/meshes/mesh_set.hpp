// Deformable bodies of a scene, and the contactors that are mapped from their nodes.
#pragma once
#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "../base/cell.hpp"
#include "condensed_meshes.hpp"
#include "mesh_areas.hpp"
#include "mesh_list.hpp"
#include "mesh_seats.hpp"
#include "mortar_contacts.hpp"

namespace cairn {

class MeshSet {
public:
  using Middle = MeshSeats::Middle;
  using MortarSearch = MortarContacts::Search;
  using SidePart = MeshAreas::SidePart;

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
  void follow(const Nodes& nodes, const Contactors& contactors) { seats_.follow(nodes, contactors); }
  const MappedContactors& mapped() const { return seats_.mapped(); }
  // Contactors that are facets, and their vertices as Scene::move_facets takes them, after `follow`.
  std::span<const std::int32_t> facets() const { return seats_.facets(); }
  std::span<const double> facet_vertices() const { return seats_.facet_vertices(); }
  bool carries(std::int32_t contactor) const { return seats_.carries(contactor); }
  std::int32_t mesh_of(std::int32_t contactor) const { return seats_.seat(contactor).mesh; }
  const Middle& middle(std::int32_t contactor) const { return seats_.seat(contactor).middle; }
  // Nodes of an edge or a facet, as numbers in the scene, in the order of the weights of `mapping`; -1: none.
  std::array<std::int32_t, 4> nodes_of_side(std::int32_t contactor) const { return seats_.nodes_of_side(contactor); }
  // The nodes that a point (dim) [m] on a mapped contactor moves with.
  // other: the contactor that it touches, whose mortar with this one counts in the place of the point.
  Mapping mapping(const Nodes& nodes, std::int32_t contactor, const double* point, std::int32_t other = -1) const {
    const Mapping* mortar = mortars_.mapping(contactor, other);
    return mortar ? *mortar : seats_.mapping(nodes, contactor, point, other);
  }
  // True if contacts on a mapped contactor turn with it: edges and facets turn, nodes and points have a position only.
  bool turns(std::int32_t contactor) const { return seats_.seat(contactor).is_side(); }
  void spin(const Nodes& nodes, const Mapping& mapping, double rows[4][3][3]) const {
    spin_of_side(meshes[std::size_t(mapping.mesh)], nodes, mapping, rows);
  }
  // Takes from the candidates the edges beyond whose ends nodes lie on their line.
  void let_past_ends(const Candidates& candidates) { seats_.let_past_ends(candidates); }
  // After detection: contacts of nodes of meshes that ask for mortars.
  void weigh_mortar(const Nodes& nodes, const MortarSearch& search, Candidates& candidates) {
    mortars_.weigh(meshes, seats_, nodes, search, candidates);
  }
  // True if a point and a half of a face of four nodes, of one mesh, coincided before the face opened. A warped face
  // then leaves a gap above rounding.
  bool parted_warped(std::int32_t point, std::int32_t side) const { return seats_.parted_warped(point, side); }
  // True if a contactor is a half of a face of four nodes, which may be warped.
  bool warps(std::int32_t contactor) const { return seats_.seat(contactor).is_half(); }
  // How near nodes of a cell are to each other where two contactors are, as the bodies lay at the start, the lesser of
  // both [m]; infinite where rigid bodies carry them.
  double cell_size(std::int32_t a, std::int32_t b) const { return std::min(seats_.cell_size(a), seats_.cell_size(b)); }
  // "node 3, quad cell 1, of the mesh 'block'"
  std::string describe(std::int32_t contactor) const { return seats_.describe(contactor); }

  // is_mark: of each of mapped(), whether it marks the end of a joint, and stands for no surface.
  void find_areas(const std::vector<std::uint8_t>& is_mark) { areas_.find(meshes, seats_, is_mark); }
  bool has_areas() const { return areas_.count() == seats_.seats().size(); }
  // Tributary area of a contact node or point [m2], in 2D per metre across the plane or over the revolution; 0 for
  // edges and facets. After find_areas, which is called again when internal numbers changed.
  double area(std::int32_t contactor) const { return areas_.area(seats_.number(contactor)); }
  // Part of the surface nearer to that node or point than to others [m2], for contacts with grains; zero at neighbours
  // of none.
  double near_area(std::int32_t contactor) const { return areas_.near_area(seats_.number(contactor)); }
  // Parts of a side by the contact nodes and points whose tributary areas they are in.
  std::span<const SidePart> parts_of_side(std::int32_t contactor) const { return areas_.parts(seats_.seat(contactor)); }
  // Areas that the corners of an edge or a triangle stand for, whether they touch or not.
  std::span<const double, 3> shares_of_side(std::int32_t contactor) const {
    return areas_.shares(seats_.seat(contactor));
  }
  // Area of a part of an edge, given by shares of its length [m2].
  double edge_area(std::int32_t contactor, double from, double to) const {
    return MeshAreas::edge_area(seats_.seat(contactor), from, to);
  }

  // Nodes that a contact may rest on become contact nodes: after begin_to_want, which each preparation of contacts
  // calls.
  void begin_to_want() { condensed_.begin(mortars_.means()); }
  void want(const Mapping& mapping) { condensed_.want(meshes, mortars_.means(), mapping, compliance_bytes); }
  // After all were wanted: compliances, and the meshes as solvers see them, with room for the velocities of contact
  // nodes. keep_nodes: those of means are rows, too.
  void condense(std::vector<CondensedBody>& out, Array<double>& velocity, bool keep_nodes) {
    condensed_.condense(meshes, mortars_.means(), compliance_bytes, out, velocity, keep_nodes);
  }
  // The same rows with compliances and room anew.
  void condense_again(std::vector<CondensedBody>& out, Array<double>& velocity) {
    condensed_.condense_again(meshes, mortars_.means(), out, velocity);
  }
  // Row of a mapping's mean in the body that was condensed last.
  std::int32_t row_of_mean(std::int32_t mean) const { return condensed_.row_of_mean(mean); }

private:
  MeshSeats seats_;
  MeshAreas areas_;
  MortarContacts mortars_;
  CondensedMeshes condensed_;
};

} // namespace cairn
