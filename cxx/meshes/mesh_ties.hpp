// Dofs of a mesh that follow others: nodes tied to nodes elsewhere, and parts that move as rigid bodies.
//   x = T y,   A x = b   becomes   T' A T y = T' b,
// where y holds the dofs that follow nothing and, behind all dofs, the velocity and the spin of each rigid part.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "../soe/soe.hpp"

namespace cairn {

class MeshTies {
public:
  // Input, filled before `start`: slave dofs as weighted sums of masters, which follow nothing; rows by starts.
  std::vector<std::int32_t> dof, master;
  std::vector<std::int64_t> first{0};
  std::vector<double> weight;
  // Nodes of each rigid part, by starts.
  std::vector<std::int32_t> rigid_node;
  std::vector<std::int64_t> rigid_first{0};
  bool turns = false; // rigid parts turn as far as they like; else as little as a linear body may

  bool empty() const { return dof.empty() && rigid_node.empty(); }
  bool rigid_parts_turn() const { return turns && !rigid_node.empty(); }

  // For a mesh of a dimension with nodes at some places (dim, nodes) [m], held dofs and a pattern of its matrices.
  // Throws Error for dofs that follow and are held, follow twice, or are followed while they follow.
  void start(int dim, const std::vector<double>& place, const SparseMatrix& pattern, const SoeOptions& options);
  bool bound(std::int64_t i) const { return !bound_.empty() && bound_[std::size_t(i)]; } // follows, or is followed

  std::unique_ptr<Soe> make_soe() const { return Soe::make(pattern_, options_); }
  // Values of the matrix of the unknowns, from those of A.
  const double* reduced(const double* value);
  // Solves by the factors of such a matrix in place of b (dofs); held dofs bring their given x.
  void solve(const Soe& soe, double* b);
  // Sets slave velocities from their masters (dofs).
  void follow(double* v) const;
  // Mean velocities of a step from places (dim, nodes), in which rigid parts turn whole: nearest to those given. From
  // now on they turn as at the middle of that way.
  void turn(double* way, const double* place, double h);
  // From now on T is that of nodes at some places (dim, nodes).
  void stand_at(const double* place) { set_arms(place, nullptr, 0); }
  // Centripetal accelerations of the nodes of rigid parts by their spin (dofs) [m/s2]; zero for others.
  void centripetal(const double* v, double* out) const;

private:
  struct Term { // of an entry of the matrix of the unknowns: a product of two weights and an entry of A
    std::int64_t entry, place, one, two;
    double times;
  };
  void take_rows();
  void take_pattern(const SparseMatrix& pattern);
  void set_arms(const double* place, const double* way, double half);
  void fit(std::size_t part, const double* v, double* mean, double* spin) const;

  int dim_ = 2;
  std::int64_t dofs_ = 0, unknowns_ = 0;
  std::vector<std::uint8_t> bound_, follows_;
  std::vector<std::int64_t> start_; // rows of T, (dofs + 1)
  std::vector<std::int32_t> column_;
  std::vector<double> value_;
  std::vector<double> arm_; // (dim, rigid_node) from the middle of the part [m]
  SparseMatrix pattern_;
  SoeOptions options_;
  std::vector<Term> terms_;
  std::vector<double> work_;
};

} // namespace cairn
