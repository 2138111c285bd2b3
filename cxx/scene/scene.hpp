// What is simulated: bodies, their contactors, gravity, the periodic cell. Ids are global and never used twice.
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "../base/cell.hpp"
#include "../bodies/body.hpp"
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

// n contactors of one shape to add.
struct ContactorBatch {
  std::int64_t count = 0;
  Shape shape{};
  std::span<const std::int64_t> body;     // (n) ids
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
  Bodies bodies;
  Contactors contactors;

  // All or nothing: a wrong item throws Error and leaves the scene as it was. Returns the id of the first new body.
  std::int64_t add_bodies(const BodyBatch& batch);
  std::int64_t add_contactors(const ContactorBatch& batch);
  void remove_bodies(std::span<const std::int64_t> ids);
  // Vertices of the facets of these bodies, one after the other, from the centres of the bodies in space axes: bodies
  // of a facet each that follow the nodes of a mesh and do not turn. body: internal numbers.
  void move_facets(std::span<const std::int64_t> body, std::span<const double> vertex);

  // Dofs of bodies whose bit is set in mask take their velocity from velocity (3 | 6, n) or stay at zero without one.
  void drive(std::span<const std::int64_t> ids, std::uint8_t mask, std::span<const double> velocity);

  // Bodies along a space-filling curve, contactors in the order of their bodies. Depends on positions and ids alone.
  void renumber();

  std::int32_t internal(std::int64_t body_id) const; // throws Error for an id that is not there
  const std::vector<std::int32_t>& insertion_order() const { return insertion_order_; } // internal numbers by rising id
  const std::vector<std::int32_t>& contactor_insertion_order() const { return contactor_insertion_order_; }
  std::int64_t order_version() const { return order_version_; } // changes when internal numbers do
  void state_assigned();                                        // after velocity or rotation was written from outside
  void activate(Need need);                                     // makes the arrays of a need exist
  bool has(Need need) const;

  // For a checkpoint: after all fields are restored.
  std::int64_t next_body_id = 0, next_contactor_id = 0;
  void fields_restored();

private:
  void reorder(const std::vector<std::int32_t>& body_order);
  std::vector<double> check_hulls(const ContactorBatch& b) const;
  void refresh_orders();
  void append_to_orders(std::int64_t first_body, std::int64_t first_contactor);
  std::int64_t order_version_ = 0;
  std::vector<std::int32_t> facet_of_;                  // contactor of each body that carries a facet, or -1
  std::array<std::int64_t, 2> facets_known_ = {-1, -1}; // the order and number of contactors that it was made of
  std::vector<std::int32_t> insertion_order_, contactor_insertion_order_;
};

} // namespace cairn
