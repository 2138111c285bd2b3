// Deformable body, by the matrices of its nodes or by the stresses of a material: its step and its interface to
// contacts.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "../base/field.hpp"
#include "mesh_compliance.hpp"
#include "mesh_linear_step.hpp"
#include "mesh_model.hpp"
#include "mesh_newton.hpp"

namespace cairn {

// Hands the step of a mesh to the part that makes it: see mesh_linear_step.hpp, mesh_newton.hpp.
class MeshBody {
public:
  explicit MeshBody(MeshModel model);
  MeshBody(const MeshBody&) = delete;
  MeshBody& operator=(const MeshBody&) = delete;

  MeshModel model;
  MeshLoads loads;
  MeshWork work; // of the last step
  NewtonSeconds newton_seconds;
  Array<double> impulse;        // (dofs) of contacts, to be given
  std::vector<double> reaction; // (dofs) forces that hold the held dofs, of the last step [N]; of free ones rounding

  // Its place among the nodes of the scene.
  std::int64_t first_node() const { return step_.first_node; }
  void place_from(std::int64_t first_node) { step_.first_node = first_node; }
  std::int32_t node(std::int64_t i) const { return std::int32_t(step_.first_node + i); }

  std::int64_t solves() const { return factors_.solves; }                     // forward and back, since the start
  std::int64_t factorisations() const { return factors_.factorisations; }     // of A, since the start
  double size() const { return size_; }                                       // of a cell, about [m]
  double mass() const { return matrices_.mean_mass * double(model.nodes()); } // of the whole [kg]
  std::int64_t touching() const { return touching_; } // nodes that contacts may ever rest on, 1 at least
  // Inverse of the mass of the whole mesh, 0 where it has held dofs along each axis [1/kg].
  double inverse_mass() const { return inverse_mass_; }
  bool linear() const { return model.linear(); }
  // A step of central differences that is certain to be stable [s], see mesh_stability.hpp.
  double stable_step(double rate_share, const Nodes& nodes);

  // Velocities of nodes at the end of the step without contacts, from those in `nodes`; of a step's begin.
  // Of a body whose stresses are a material's: Newton's method round the solution of contacts. free_velocity is its
  // first pass; after a solution, with `impulse` gathered, `judge` moves on, with a part of the change where the
  // whole one leaves more of the balance; `linearise` makes the free velocity of the next pass.
  // check: throws Error beyond the limit of an explicit scheme.
  void free_velocity(Nodes& nodes, const double* gravity, const cairn_scheme& scheme, bool check);
  // tolerance: on the error, by which judge guesses whether a pass is the last; else it makes the tangent of the next.
  NewtonError judge(double tolerance = 0) { return newton_.judge(tolerance); }
  void linearise(Nodes& nodes) { newton_.linearise(nodes); }
  // The end of the step becomes the begin of the next; or the step was undone.
  void commit();
  void roll_back();
  // Results of the last step, as views have them: kept while another step is tried, put back if that one is undone.
  struct Results {
    Array<double> impulse;
    std::vector<double> reaction, stress;
  };
  void keep(Results& to) const;
  void put_back(const Results& from);
  // State for a checkpoint: internal forces at the begin of the next step [N], then their stored energy [J]; empty
  // before the first step. restore() throws Error for the state of another mesh.
  std::vector<double> memory() const { return stresses_.memory(); }
  void restore(std::span<const double> state, std::span<const double> memory) { stresses_.restore(state, memory); }
  void forget() { stresses_.forget(); } // as at the start
  std::vector<double> touched() const { return compliance_.touched(); }
  void restore_touched(std::span<const double> of) { compliance_.restore_touched(of); }
  std::string describe(const BulkResult& fault) const { return stresses_.describe(fault); }
  // Throws the description of a fault: StepTooLong with the advice where shorter parts of the step may mend it, else
  // Error.
  [[noreturn]] void fail(const BulkResult& fault, const std::string& where, const std::string& advice) const {
    stresses_.fail(fault, where, advice);
  }
  std::string remedy() const { return stresses_.remedy(); } // where no balance is found
  // Starts the stored derivatives of the integrator at the nodes, from the forces at hand; and the change of velocity
  // over the step by forces without contacts.
  void start_history(Nodes& nodes, const double* gravity, const cairn_scheme& scheme);
  void smooth_change(Nodes& nodes, double* change);
  // The way of the step beside that of the velocities at its ends, where rigid parts turn; else it is left as it is.
  void turn_way(const Nodes& nodes, double* way) { stresses_.turn_way(nodes, way); }

  // Contact nodes and the compliance between them, see mesh_compliance.hpp.
  using Bytes = MeshCompliance::Bytes;
  void touch(const std::vector<std::int32_t>& more) { compliance_.touch(more); }
  void rest_on(const std::vector<std::int32_t>& nodes, const Bytes& of, bool may_reach) {
    compliance_.rest_on(nodes, of, may_reach);
  }
  std::int64_t contact_nodes() const { return std::int64_t(contact().active.size()); }
  std::int32_t place(std::int32_t node) const { return contact().place[std::size_t(node)]; } // among them, -1: none
  std::int32_t contact_node(std::int64_t place) const { return contact().active[std::size_t(place)]; }
  bool may_exceed(double bytes) const { return 8.0 * double(model.dofs()) * double(model.dofs()) > bytes; }
  double* compliance() { return factors_.now->contact.compliance.data(); }
  std::int64_t leading() const { return contact().leading; }
  const UnitReaches* reaches() const { return contact().reached ? &contact().reaches : nullptr; }

  // The velocities that `push` adds to are none: it then gives displacements, over the step, that impulses make.
  void rest() { std::fill(step_.free.begin(), step_.free.end(), 0.0); }
  double stored(const Nodes& nodes) { return linear_step_.stored(nodes); } // energy of the displacements at hand [J]
  // Velocities of nodes at the end of the step with `impulse`.
  void push(Nodes& nodes);
  // Changes of the velocities of the first n dofs, zero at held ones, by forces on these over 1 s.
  void answer(const double* force, std::int64_t n, double* change);
  // Adds forces (n) on the first n dofs to the loads of the step at hand, and what they change to its free velocity;
  // held dofs bear them.
  void add_load(const double* force, std::int64_t n, Nodes& nodes);
  // Force on each node that its points of mass need besides gravity and contacts [N], and the works of the step.
  void account(Nodes& nodes, const double* gravity);
  std::int64_t bytes() const;

private:
  const ContactNodes& contact() const { return factors_.now->contact; }
  void find_sizes();
  void mark_contact_nodes();

  MeshMatrices matrices_{model};
  MeshStep step_{model, matrices_};
  MeshEquations equations_{model, matrices_, step_};
  MeshStability stability_{model, loads, matrices_, step_, equations_};
  MeshFactors factors_{model, matrices_, step_, equations_, stability_, newton_seconds};
  MeshCompliance compliance_{model, factors_};
  MeshHistory history_{model, matrices_, step_, equations_};
  MeshJumps jumps_{model, loads, impulse, matrices_, step_, equations_, factors_, history_};
  MeshWorks works_{model, loads, step_, reaction, work};
  MeshLinearStep linear_step_{model, loads,      impulse,  reaction, work,   matrices_,
                              step_, equations_, factors_, history_, jumps_, works_};
  MeshStresses stresses_{model, loads, newton_seconds, step_, stability_, history_, jumps_};
  MeshNewton newton_{model,      loads,      impulse,  reaction, work,   newton_seconds, matrices_, step_,
                     equations_, stability_, factors_, history_, jumps_, works_,         stresses_};
  double size_ = 0;
  double inverse_mass_ = 0;
  std::int64_t touching_ = 1;
};

} // namespace cairn
