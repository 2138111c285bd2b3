// Factors of the iteration matrix of a mesh.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "../soe/unit_reaches.hpp"
#include "mesh_equations.hpp"
#include "mesh_stability.hpp"

namespace cairn {

// Nodes that contacts rest on, and the compliance between them.
struct ContactNodes {
  struct Touches {
    std::vector<std::int32_t> nodes, ends; // how many there were after each time
  };
  std::vector<std::int32_t> active, place;
  std::vector<std::int32_t> order; // how many were active after each time where numbers depend on that
  Touches again;                   // to be touched before others
  std::int64_t leading = 0;
  Array<double> compliance;        // (leading, leading)
  bool reached = false;            // true if `reaches` replace the compliance
  std::vector<std::int32_t> asked; // nodes of which it was last decided whether to take reaches
  std::int64_t asked_numbers = -1; // entries of the reaches of `asked`
  UnitReaches reaches;
  void forget(std::int64_t nodes); // the contact nodes and their compliance
};

// Factors of A = M + damping C + stiffness K.
struct IterationFactors {
  double h = 0, damping = 0, stiffness = 0, largest = 0;
  double mixed = 0; // share of the inverse of M in the compliance, see mesh_jumps.cpp
  std::unique_ptr<Soe> soe;
  std::function<void(double*)> solver;
  std::vector<double> value; // of A
  bool known = false;        // of the pass: these are its factors
  bool undone = false;       // an undone step had them: they go first
  // Damped modes: the inverse of A is that without modes less Z B Z' (Woodbury 1950): Z (dofs, modes) and the
  // Cholesky factor of B^-1, lower (modes, modes).
  std::vector<double> modal_reach, modal_factor;
  ContactNodes contact;
  bool made() const { return soe || solver; }
  bool same_as(const IterationFactors& f) const {
    return h == f.h && damping == f.damping && stiffness == f.stiffness && largest == f.largest && mixed == f.mixed;
  }
  std::int64_t bytes() const;
};

// Solves with the factors of the iteration matrix that a step takes.
class MeshFactors {
public:
  MeshFactors(MeshModel& model, const MeshMatrices& matrices, const MeshStep& step, MeshEquations& equations,
              MeshStability& stability, NewtonSeconds& seconds)
      : model_(model), matrices_(matrices), step_(step), equations_(equations), stability_(stability),
        seconds_(seconds) {}
  static constexpr std::size_t most = 4;               // of kept ones
  std::vector<std::unique_ptr<IterationFactors>> kept; // of schemes
  IterationFactors* now = nullptr;                     // of the step
  std::int64_t solves = 0, factorisations = 0;         // forward and back, and of A, since the start

  void factorise(const cairn_scheme& scheme, bool check);
  // Factorises the tangent of a pass of Newton's method; first: the first pass of the step.
  void factorise_tangent(const std::vector<double>& tangent, bool first);
  void solve(double* b, std::int64_t columns = 1); // held dofs bring their given x
  // Changes of velocities by impulses b, zero at held dofs.
  void respond(double* b, std::int64_t columns = 1);
  double jump_share(const cairn_scheme& scheme) const; // see mesh_jumps.cpp
  static bool has_part(double share) { return share < 0 || share > 0; }
  ImpulseAnswer answer() const;
  bool by_units(const IterationFactors& f) const; // the compliance is entries of the inverse of A itself
  std::int64_t bytes() const;

private:
  void make_factors(IterationFactors& made, const cairn_scheme& scheme, bool check);
  void factorise_modes(IterationFactors& f);
  void solve_modes(double* b, std::int64_t columns);

  MeshModel& model_;
  const MeshMatrices& matrices_;
  const MeshStep& step_;
  MeshEquations& equations_;
  MeshStability& stability_;
  NewtonSeconds& seconds_;
  std::unique_ptr<IterationFactors> tangent_; // of the pass
  std::vector<double> modal_pull_;            // (modes)
  std::vector<double> responding_;            // (dofs, columns)
};

} // namespace cairn
