// Forces on the nodes of bars and beams that move as far as they like (corotational_frames.f90). Rotations of the nodes
// of beams have no inertia: they are found at given displacements, where no moment is left, and what displacements
// change of them is in the tangent.
#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "bulk_model.hpp"

namespace cairn {

struct FrameCells {
  int dim = 2;
  Kinematics kinematics = Kinematics::corotational; // or total_lagrangian, of bars
  std::vector<double> reference;                    // (dim, nodes) [m]
  std::vector<std::int32_t> node;                   // (2, n)
  std::vector<double> young, area, pull;            // (n) [Pa, m2], before it moves, tension positive [N]
  bool beams = false;
  std::vector<double> inertia;        // (2, n) of bending along the second axis of the section, the third [m4]
  std::vector<double> shear, torsion; // (n) modulus [Pa], [m4]
  std::vector<double> shear_area;     // (n) [m2], 0: it does not shear
  std::array<double, 3> up{0, 0, 1};  // in 3D the second axis lies in the plane of this and the beam
  std::vector<std::int32_t> clamped;  // nodes that do not turn
};

class FrameModel final : public InternalForces {
public:
  // Throws Error, naming the cell.
  explicit FrameModel(FrameCells cells);
  // Pattern of the tangent (lower triangle with the diagonal); values zero.
  SparseMatrix lower() const;

  // Adds to a stiffness at rest the axial stiffness of each cell in the transverse directions. The sum bounds the
  // stiffness of corotational bars and slender beams at any rotation, so explicit integrators take their step from it.
  void stiffen(SparseMatrix& stiffness) const;
  void fit(const SparseMatrix& lower) override;
  BulkResult evaluate(const MeshMotion& at, double* force, double* tangent) override;
  void commit() override;
  std::string describe(const BulkResult& result) const override;
  std::string place_of_node(std::int64_t node) const override;
  std::string not_by_energy(const std::string& name) const override;
  std::vector<double> history() const override;
  std::int64_t history_size() const override;
  void take_history(std::span<const double> history) override;
  void forget_history() override;
  std::shared_ptr<InternalForces> another() override;
  bool known_anywhere() const override { return true; }
  std::int64_t bytes() const override;
  // Rotation matrix of each node (9) by columns, at the begin of the step; empty for bars.
  const std::vector<double>& rotations() const { return turned_begin_; }
  std::size_t count() const { return of_.node.size() / 2; }
  // Forces on the second end of each cell [N] in the last evaluation; for beams also moments on both ends [N m] (3 | 9,
  // n).
  const std::vector<double>& cell_forces() const { return force_; }

private:
  void take_beams();
  void take_rotations();
  void gather(const double* u);
  void predict(const double* u);
  BulkResult kernel(bool tangents);
  BulkResult find_rotations();
  double left_of_moments() const; // the largest over what turns its node by a radian
  void add_moments();
  bool factor_turns(double* shift);
  void turn_by(double share);
  void add_tangent(double* tangent);

  FrameCells of_;
  std::vector<double> d0_, axes_, stiff_; // see the kernels
  std::vector<double> moved_, ends_, energy_, force_, tangent_;
  std::vector<double> begin_; // of the bars, where forces are by energy
  std::vector<std::int32_t> fault_;
  std::vector<std::int64_t> place_; // of the tangent in the values of the fitted triangle
  // rotations: the first unknown of each node, -1 none; of the begin of the step and its displacements
  std::vector<std::int64_t> unknown_;
  std::size_t unknowns_ = 0;
  std::vector<double> turned_, turned_begin_, turned_before_, u_, u_begin_, guess_, mean_, from_, to_, weight_;
  SparseMatrix turns_; // moments by rotations
  std::vector<std::int64_t> turns_place_;
  std::unique_ptr<Soe> soe_;
  std::vector<double> moment_, way_, values_, mixed_, followed_;
};

} // namespace cairn
