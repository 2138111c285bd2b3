// The stresses of a mesh of solids whose material is a batch over Gauss points: forces on nodes, their tangent, energy,
// and the state of the points at begin and end of a step.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "../base/field.hpp"
#include "../soe/soe.hpp"
#include "bulk_materials.hpp"
#include "bulk_result.hpp"
#include "elements.hpp"
#include "internal_forces.hpp"

namespace cairn {

enum class Kinematics { small, corotational, total_lagrangian, logarithmic }; // as cairn_strain_measure counts them
enum class Plane { strain, stress, axisymmetric };

// Cells with a common element and material.
struct BulkCells {
  const ElementInfo* element = nullptr;
  const BulkMaterialInfo* material = nullptr;
  std::vector<double> params;
  Kinematics kinematics = Kinematics::small;
  Plane plane = Plane::strain;
  bool mean_dilatation = false;
  double thickness = 1;           // [m]
  std::vector<std::int32_t> node; // (nodes, cells)
  // True stress before the body moves (6, points, cells) [Pa], components in Voigt order of the scene's axes (xx yy zz
  // xy xz yz); empty: none.
  std::vector<double> initial_stress;
  std::int64_t count() const { return std::int64_t(node.size()) / element->nodes; }
};

class BulkModel final : public InternalForces {
public:
  // place (dim, nodes) at the start [m], from the axis where cells are axisymmetric.
  BulkModel(int dim, std::vector<double> place, std::vector<BulkCells> cells);
  ~BulkModel() override;
  BulkModel(const BulkModel&) = delete;
  BulkModel& operator=(const BulkModel&) = delete;

  const std::vector<BulkCells>& cells() const { return cells_; }
  const std::vector<double>& place() const { return place_; } // (dim, nodes) at the start [m]
  bool finite() const;                                        // whether a cell counts large strains
  std::string not_by_energy(const std::string& mesh) const override;
  // Throws Error for a pattern in which rows of the dofs of a node do not stand side by side.
  void fit(const SparseMatrix& lower) override;
  // The same by starts of columns and rows, unless it was that pattern before.
  void fit_once(std::span<const std::int64_t> start, std::span<const std::int32_t> row);
  // By the state at the begin; begin: displacements there, the derivative is then twice that of the forces.
  BulkResult evaluate(const double* u, double h, double theta, double* force, double* tangent,
                      const double* begin = nullptr);
  BulkResult evaluate(const MeshMotion& at, double* force, double* tangent) override;
  void commit() override;
  std::string describe(const BulkResult& result) const override;
  std::string remedy_of(const BulkResult& result) const override;
  bool shorter_helps(const BulkResult& result) const override;
  std::string place_of_node(std::int64_t node) const override;
  std::vector<double> history() const override { return state_begin_; } // all blocks
  std::int64_t history_size() const override { return std::int64_t(state_begin_.size()); }
  void take_history(std::span<const double> history) override;
  void forget_history() override;
  std::shared_ptr<InternalForces> another() override;
  BulkModel* solid() override { return this; }
  bool known_anywhere() const override { return true; }
  // Routines of users may leave their energies alone: then those of their stresses are not known.
  bool knows_energy() const override;
  bool knows_dissipation() const override { return knows_energy(); }
  std::span<double> shown() override { return stress_; }

  std::vector<double> state_at_start() const; // of the first step: nought, but for an initial stress
  // Mean of the true stresses (6, cells) and of the states (states, cells) of a block, at the last evaluation.
  void cell_stress(std::size_t block, double* out) const;
  void cell_state(std::size_t block, double* out) const;
  std::int64_t bytes() const override;

private:
  // The first block that keeps more than an energy of its strain, or changes it by more than the gradient at its
  // points: then no stress by energy is known; -1: none.
  std::int64_t first_not_by_energy() const;
  struct Block {
    std::vector<double> value, gradient, weight; // of the shape functions at the points
    // (nodes (nodes + 1) / 2, cells): index into the lower triangle of the entry of each pair of nodes, first row of
    // the later node in the first column of the earlier; -1 - entry where their order in the cell is reversed
    std::vector<std::int32_t> entry;
    std::int64_t first_state = 0, first_stress = 0;
    int states = 0;
    bool silent = false;         // user's routine that has so far returned no energy, stored or dissipated
    std::vector<double> stretch; // (3, 3, points, cells) U0 - 1 at which the law has the initial stress; empty: none
  };
  struct Work;  // of a thread
  struct Step { // arguments of an evaluation
    const double *u, *begin;
    double h, theta;
    bool want;
  };
  void evaluate_tile(std::size_t block, std::int64_t first, std::int64_t n, const Step& step, Work& work, double* force,
                     double* stiffness, BulkResult& result);
  void gather(std::size_t block, std::int64_t first, std::int64_t n, const double* u, Work& work) const;
  void evaluate_linear(std::size_t block, std::int64_t first, std::int64_t n, const Step& step, Work& work,
                       double* force, double* half, BulkResult& result);
  bool find_gradients(std::size_t block, std::int64_t n, Work& work);
  void stresses_by_energy(std::size_t block, std::int64_t first, std::int64_t n, const Step& step, Work& work);
  void stresses_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, double theta, bool want,
                          Work& work);
  void from_start_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, double theta, bool want,
                            Work& work);
  void law_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, double theta, bool want,
                     Work& work);
  bool one_damage(std::size_t block) const; // of all points of a cell
  void damage_cells(std::size_t block, std::int64_t first, std::int64_t n, Work& work);
  void add_growth_of_damage(std::size_t block, std::int64_t n, Work& work, const double* force,
                            double* stiffness) const;
  void check_initial_stress(std::size_t block) const;
  void start_from_stress(std::size_t block);
  void find_stretches(std::size_t block, std::int64_t first, std::int64_t n, Work& work);
  std::string describe_stress(std::size_t block, std::int64_t point) const;
  void material_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, double theta, bool want,
                          Work& work);
  void find_swelling(std::size_t block, std::int64_t first, std::int64_t n, Work& work) const;
  void call_umat(std::size_t block, std::int64_t first, std::int64_t n, double h, Work& work);
  void find_places(std::size_t block, std::int64_t n, Work& work) const;
  void rates_at_points(std::size_t block, std::int64_t first, std::int64_t n, double h, bool want, Work& work);
  static void keep_volume(std::int64_t points, Work& work);
  void start_from_thickness(std::size_t block, std::int64_t first, std::int64_t n, Work& work) const;
  void add_forces(std::size_t block, std::int64_t first, std::int64_t n, const double* force, double* to) const;
  bool halves(std::size_t block, const Step& step) const; // matrices are lower halves, some cells side by side
  void add_matrices(std::size_t block, std::int64_t first, std::int64_t n, const double* stiffness, const Step& step,
                    std::int64_t low, std::int64_t high, double* to) const;

  int dim_;
  std::vector<double> place_;
  std::vector<BulkCells> cells_;
  std::vector<Block> blocks_;
  std::vector<double> state_begin_, state_, stress_;
  std::vector<double> state_start_; // empty: nought
  std::vector<Work> work_;
  std::vector<std::int32_t> wide_;  // (nodes) entries of the first column of each
  std::vector<std::int64_t> start_; // of the pattern that fit_once saw
  std::vector<std::int32_t> row_;
  std::vector<double> force_, stiffness_; // of the cells of a chunk
  std::vector<BulkResult> results_;
  double begin_time_ = no_time; // of the step [s]
};

} // namespace cairn
