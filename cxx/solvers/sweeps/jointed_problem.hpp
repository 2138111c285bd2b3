// The contacts of a step among bodies that joints hold, as a problem of Coulomb's cones that any solver of problems
// takes, and the way back.
#pragma once
#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../problems/friction_problem.hpp"
#include "contact_system.hpp"
#include "held_rows.hpp"

namespace cairn {

// Contact problem with joints eliminated by static condensation: joints and their springs are equalities u_G + C r_G +
// e = 0, whose impulses follow from those of the contacts. A^-1 becomes A^-1 - A^-1 G' S^-1 G A^-1 in W and in q, with
// the Schur complement S = G A^-1 G' + C. For the coordinate of a joint
//   a limit is a contact without friction,
//   a motor of speed v and effort E is a contact with mu = 1 under the pressure h E, which slips at v.
// At first a motor holds its speed as an equality, and limits are left out, until a solution exceeds the effort of a
// motor or breaks a limit: see amend.
class JointedProblem {
public:
  static bool needed(const ContactSystem&); // there are joints
  // Empty, or what keeps these contacts from being a problem: other laws with a local solution of their own.
  static std::string obstacle(const ContactSystem&);
  // Takes the impulses at hand; afterwards records hold their velocities.
  JointedProblem(ContactSystem&, const cairn_schedule&, const Velocities& velocity_free);

  // Whatever the answer will be: each limit, and each motor whose effort has an end.
  void pose_all();
  // To be called first: eliminates the equalities of all posed coordinates. False: they have no factors.
  bool hold();
  // Alternative to a solve: impulses of joints alone, zero for all contacts, that undo in a step the position errors of
  // frames at detection, of those joints for which `moves` is true, and by how far their coordinates are `off` the ends
  // that hold them. False: no factors, or no equalities.
  bool undo_errors(const std::function<bool(const cairn_batch&, int)>& moves,
                   const std::function<double(const cairn_batch&, int)>& off);
  // Bytes of W in blocks, at most.
  double bytes() const;
  // W and q.
  void form();
  const FrictionProblem& problem() const { return problem_; }
  // The same with its contacts in the order of the candidates, for those who know nothing of batches.
  FrictionProblem in_order() const;
  // Impulses (dim, contacts) to begin with, as the step has them.
  void read(Array<double>& r) const;
  // Writes the impulses of the problem, and those of joints that follow, to the step; records are not updated.
  void write(const double* r);
  // Records hold the velocity that the impulses leave. Poses what this answer asks for, after the others; false:
  // nothing.
  bool amend();

private:
  struct Place {
    std::int32_t batch, lane;
  };
  struct Part { // of a row: what the velocity of a body adds to it
    std::int32_t row, count;
    std::size_t begin; // among dofs, values and, of rigid bodies, answers
  };
  struct Coordinate {
    Place place;
    std::int32_t component, row;
    std::int32_t held = -1;                      // the equality of its motor; -1: none
    double low, high, speed, effort, drag, pull; // [m/s, rad/s], [N s, N m s], see joint.f90
    bool low_posed = false, high_posed = false, motor_posed = false;
    bool locked() const { return !(low < high); }
    bool driven() const { return effort > 0 && !motor_posed; }
    // Speed of a motor with sufficient effort: its own, within the limits.
    double target() const { return std::max(std::min(speed, high), low); }
    // True if an impulse exceeds the effort of such a motor; a limit that keeps it from its speed bears the rest.
    bool overburdens(double r, double share) const {
      return (r >= share * effort && !(target() > speed)) || (r <= -share * effort && !(target() < speed));
    }
  };
  struct Equality {
    std::int32_t row;
    double compliance, q; // [1/kg], [m/s]
    Place place;
    std::int32_t component;
  };
  enum class Pose { low, high, motor };
  struct Posed { // a contact of the problem that represents a limit or a motor of a coordinate
    std::int32_t coordinate;
    Pose pose;
  };
  struct Use { // of a row: where the problem has it, or below it the equalities
    std::int32_t at;
    double sign;
  };

  const cairn_batch& batch(Place place) const;
  void take_contacts();
  void take_joint(Place place);
  void take_coordinate(Place place, int component, std::int32_t row);
  std::int32_t add_row(Place place, int component);
  void add_rigid(Place place, int side, int component);
  void add_mapped(Place place, int side, int component);
  void add_rope(Place place);
  double* part_of(std::int32_t body, int dofs);
  std::int32_t rigid(std::int32_t body);
  double between(std::int32_t body, const Part& a, const Part& b) const;
  void gather(std::int32_t row);
  void read_velocities(const cairn_schedule&, std::vector<double>& u) const;
  void pose(std::int32_t coordinate, Pose pose);
  void pose_what_acts();
  void list_equalities();
  void list_uses();
  HeldRows form_held();
  void form_pattern();
  void fill_blocks();
  void eliminate();
  void eliminate_together(const std::vector<std::int32_t>& owner, const double* x);
  void settle_diagonal();
  double& entry(std::int32_t row, std::int32_t column); // of W
  std::int32_t contacts() const { return std::int32_t(contacts_.size() + posed_.size()); }
  std::vector<std::vector<std::int32_t>> groups() const; // contacts of each body, then of each assembly

  ContactSystem& system_;
  const cairn_schedule& schedule_;
  FrictionProblem problem_;
  std::vector<Place> contacts_;
  std::vector<Equality> blocked_, equalities_;
  std::vector<Coordinate> coordinates_;
  std::vector<Posed> posed_;
  std::int32_t rows_ = 0; // dim for each contact, then those of joints
  std::vector<double> q_; // (rows) without impulses [m/s]
  std::vector<std::pair<Place, std::int32_t>> row_place_;
  std::vector<std::vector<Part>> of_body_; // rigid ones, then those condensed
  std::vector<std::vector<std::pair<std::int32_t, Part>>> of_row_;
  std::vector<std::int32_t> number_; // of rigid bodies that are in it; -1
  std::vector<double> inverse_;      // (dofs, dofs) of each
  std::vector<std::int32_t> dof_;
  std::vector<double> value_, answer_;
  std::vector<std::vector<Use>> uses_;
  std::vector<double> sum_;           // (rows) see gather
  std::vector<std::int32_t> touched_; // rows there
  std::optional<HeldRows> held_;
  std::vector<std::vector<std::pair<std::int32_t, double>>> pulls_; // of each row of the problem, by equality [1/kg]
  std::vector<double> impulse_;                                     // of equalities
  std::vector<double> plain_diagonal_;                              // of W before they are eliminated
};

} // namespace cairn
