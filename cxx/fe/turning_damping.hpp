// The part b K of Rayleigh's damping of solids that move far: K of each cell at the start, turned with the cell, of the
// velocities that are no rotation of it. What turns as a rigid body is not braked, forces have neither sum nor moment,
// and their power is never above zero.
#pragma once
#include <cstdint>
#include <vector>

#include "../soe/soe.hpp"

namespace cairn {

class BulkModel;
struct BulkCells;

class TurningDamping {
public:
  // Of cells with `damping`; damping: lower triangle of C at the start, whose pattern has those of the cells.
  TurningDamping(const BulkModel& model, const SparseMatrix& damping);
  static bool is_of(const BulkCells& cells);
  // Values of C where nodes are at `place` (dim, nodes) [m].
  void at(const double* place, SparseMatrix& damping) const;

private:
  struct Cells {
    int nodes = 0;
    std::vector<std::int32_t> node;  // (nodes, cells)
    std::vector<double> value;       // (dofs, dofs, cells), b K of each [N s/m]
    std::vector<std::int64_t> entry; // (nodes, dofs, cells): first row of a node in a column, -1 above the diagonal
  };
  template <class Use>
  void each_entry(const Cells& cells, std::int64_t cell, Use&& use) const;

  int dim_;
  std::vector<double> place_, still_; // at the start; what does not turn
  std::vector<Cells> cells_;
};

} // namespace cairn
