// The scene: bodies, their contactors, gravity, the periodic cell. Ids are global and never used twice.
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "../base/cell.hpp"
#include "../bodies/body.hpp"
#include "../bodies/nodes.hpp"
#include "../contactors/contactor.hpp"

namespace cairn {

// n bodies to add; an empty span stands for the default named beside it.
struct BodyBatch {
  std::int64_t count = 0;
  std::span<const double> position; // (dim, n) [m], absolute
  std::span<const double> rotation; // (1 | 4, n): none
  std::span<const double> velocity; // (3 | 6, n): zero
  std::span<const double> mass;     // (n) [kg]; inf: moved by nothing
  std::span<const double> inertia;  // (1 | 3, n) [kg m2]; inf allowed
};

// Numbers that follow each other, of nodes, points between nodes, edges or faces of a deformable body. Nodes are rows
// of the scene's nodes; the others have a number alone, by which contacts name them.
struct MeshParts {
  std::int64_t first = 0, count = 0;
  std::int32_t mesh = 0; // from 1
  bool nodes = false;
};

// The parts that contain the number `id`; parts are in rising order; null: none.
const MeshParts* part_with(std::span<const MeshParts> parts, std::int64_t id);

// n contactors of one shape to add.
struct ContactorBatch {
  std::int64_t count = 0;
  Shape shape{};
  std::span<const std::int64_t> body;     // (n) ids of rigid bodies, or of parts of deformable ones
  std::span<const std::int32_t> material; // (n) or (1)
  std::span<const double> radius;         // (n) [m]: zero
  std::span<const double> offset;         // (dim, n) [m]: zero
  std::span<const double> direction;      // (dim + 1, n): none
  std::span<const std::int32_t> hull{};   // (n) numbers of hulls, of polygons and polyhedra only; radius is theirs
};

class Scene {
public:
  explicit Scene(int dim);

  int dim;
  std::array<double, 3> gravity{}, origin{};
  Cell cell;
  Bodies bodies; // rigid ones
  Nodes nodes;   // of deformable ones
  Contactors contactors;

  // All or nothing: a wrong item throws Error and leaves the scene as it was. Returns the id of the first new body.
  std::int64_t add_bodies(const BodyBatch& batch);
  std::int64_t add_contactors(const ContactorBatch& batch);
  // A number for a deformable body, which no other has or had, from 1. Its nodes, position (dim, n) [m] absolute,
  // velocity (dim, n) or empty, mass (n) [kg]; numbers of other parts of it. Both return the first number.
  std::int32_t new_mesh() { return ++meshes_; }
  std::int64_t add_nodes(std::int32_t mesh, std::span<const double> position, std::span<const double> velocity,
                         std::span<const double> mass);
  std::int64_t add_parts(std::int32_t mesh, std::int64_t count);
  const std::vector<MeshParts>& parts() const { return parts_; } // by rising number
  const MeshParts* part(std::int64_t id) const { return part_with(parts_, id); }
  // A body takes the id of one that is gone. Throws Error for one that nobody had, or that somebody has.
  void give_id(std::int64_t id, std::int64_t wanted);
  // Bodies, nodes and numbers of parts.
  void remove_bodies(std::span<const std::int64_t> ids);
  // Vertices of facets that are mapped from nodes, one facet after the other, from their centres in space axes.
  // contactor: internal numbers.
  void move_facets(std::span<const std::int32_t> contactor, std::span<const double> vertex);

  // Dofs of bodies whose bit is set in mask take their velocity from velocity (3 | 6, n) or stay at zero without one.
  void drive(std::span<const std::int64_t> ids, std::uint8_t mask, std::span<const double> velocity);

  // Bodies along a space-filling curve, deformable ones by their first nodes; contactors in the order of their bodies,
  // mapped ones behind. Depends on positions and ids alone.
  void renumber();
  // The same by places (dim, bodies) [m] of bodies whose numbers others hold; there are no nodes. Returns which body
  // each new number was.
  std::vector<std::int32_t> renumber(std::span<const double> position);
  // True if mapped contactors are behind all others, and nodes of a mesh together; put_meshes_in_order() makes it so
  // and keeps the order otherwise.
  bool meshes_in_order() const;
  void put_meshes_in_order();

  std::int32_t internal(std::int64_t body_id) const; // throws Error for an id that is not there
  std::int32_t node(std::int64_t id) const;          // place among the nodes, as above
  std::int32_t find_body(std::int64_t id) const;     // -1 for an id that is not there
  std::int32_t find_node(std::int64_t id) const;
  const std::vector<std::int32_t>& insertion_order() const { return insertion_order_; } // internal numbers by rising id
  const std::vector<std::int32_t>& node_insertion_order() const { return node_insertion_order_; }
  const std::vector<std::int32_t>& contactor_insertion_order() const { return contactor_insertion_order_; }
  std::int64_t order_version() const { return order_version_; } // changes when internal numbers do
  void state_assigned();                                        // after velocity or rotation was written from outside
  void activate(Need need);                                     // makes the arrays of a need exist
  bool has(Need need) const;
  // Room for so many bodies and contactors, so that arrays are not copied while these come.
  void reserve(std::int64_t bodies, std::int64_t contactors) { room_ = {bodies, contactors}; }
  // true: numbers (all arrays of doubles) of bodies that come are checked, and left to others, which hold them: only
  // ids, shapes and materials are kept. Arrays that have numbers already stay as they are.
  void leave_numbers(bool leave) { leaves_numbers_ = leave; }

  // For a checkpoint: after all fields are restored.
  std::int64_t next_body_id = 0, next_contactor_id = 0;
  void fields_restored(std::vector<MeshParts> parts);

private:
  std::vector<std::int32_t> nodes_together() const;
  void reorder(const std::vector<std::int32_t>& body_order, const std::vector<std::int32_t>& node_order,
               std::span<const std::int64_t> gone = {});
  std::vector<std::int32_t> places_of_contactors(const std::vector<std::int32_t>& now,
                                                 const std::vector<std::int32_t>& node_order) const;
  std::vector<double> check_hulls(const ContactorBatch& b) const;
  void refresh_orders();
  void append_to_orders(std::int64_t first_body, std::int64_t first_node, std::int64_t first_contactor);
  template <class Holder>
  void make_room(Holder& holder, std::int64_t count, std::int64_t room) const;
  bool leaves_numbers_ = false;
  std::array<std::int64_t, 2> room_{}; // of bodies, of contactors
  std::int64_t order_version_ = 0;
  std::int32_t meshes_ = 0;
  std::vector<MeshParts> parts_;
  std::vector<std::int32_t> insertion_order_, node_insertion_order_, contactor_insertion_order_;
};

} // namespace cairn
