// Entries of the inverse of a factorised matrix between unknowns that come in turns.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "factors.hpp"

namespace cairn {

// E A^-1 E' = Z'Z with L Z = E' of factors A = L L'. A unit right side reaches the nodes of L from its own up to the
// root alone, which are gone through once for all right sides together. A sum goes by nodes from the leaves up and by
// columns of a node, so that an entry has the same bits however many others are asked for, with it or before. Z is kept
// from the second call on, so that later ones cost what is new; where it would take more than half of what the factors
// take, all is made again instead.
class UnitFronts {
public:
  struct Wanted {               // an unknown whose entries are asked for
    std::int64_t index = 0;     // in `out`
    std::int32_t place = 0;     // in the order of elimination
    double right = 1, left = 1; // powers of two: an entry is in these units
  };
  // Adds rows and columns of `more` to out (leading, ...), which holds those of earlier calls at their indices.
  void add(const SoeFactors& factors, const std::vector<Wanted>& more, double* out, std::int64_t leading, int threads);
  // Calls use for each right side at each node that it reaches, from the leaves up: Z at the columns of this, a stride
  // apart. Right sides of a node come from several threads.
  using UseFront = std::function<void(const SoeBlock&, const Wanted&, const double* y, std::int64_t stride)>;
  void each_front(const SoeFactors& factors, const std::vector<Wanted>& wanted, int threads, const UseFront& use);
  std::int64_t bytes() const;

private:
  struct Node { // one that right sides [begin, end) of a batch reach
    std::int32_t node = -1;
    std::int64_t begin = 0, end = 0, own = 0; // own: the first whose unknown is a column of this node
    std::int64_t value = -1;                  // where Z is kept (end - begin, columns); -1: it is not
    // Columns that are zero in right sides from `lane` on.
    std::int64_t zeros(const std::vector<Wanted>& wanted, std::int64_t lane, const SoeBlock& block) const {
      return lane < own ? 0 : wanted[std::size_t(lane)].place - block.first;
    }
  };
  struct Batch { // right sides that were solved together
    std::vector<Wanted> wanted;
    std::vector<std::int64_t> index;
    std::vector<Node> nodes; // from the leaves up
    std::vector<double> value;
  };
  struct Pending { // what a node hands on
    std::int32_t node = -1;
    std::int64_t begin = 0, end = 0, first = 0; // right sides; where they stand
  };
  static Batch batch_of(const SoeTree& tree, const std::vector<Wanted>& wanted);
  static std::int64_t numbers_of(const SoeFactors& factors, const Batch& batch); // of Z
  bool room_to_keep(const SoeFactors& factors, const Batch& batch) const;
  void solve(const SoeFactors& factors, Batch& batch, bool keep, double* out, std::int64_t leading, int threads,
             const UseFront& use = {});
  void make_room(const SoeFactors& factors, const Batch& batch);
  void assemble(const SoeFactors& factors, const SoeBlock& block, const Batch& batch, const Node& node);
  void multiply(const SoeBlock& block, const Batch& batch, std::size_t at, std::int64_t from, std::int64_t end,
                double* out, std::int64_t leading) const;
  void hand_on(const SoeBlock& block, const Node& node);
  void find_twins(std::int64_t nodes, const Batch& batch);
  void finish(const Batch& batch, double* out, std::int64_t leading) const;

  std::vector<Batch> batches_;          // each larger than all that came after it
  std::vector<double> front_, pending_; // right sides by the rows of a node; what its children hand on, the last on top
  std::vector<Pending> stack_;
  std::vector<std::int64_t> row_; // of a place of elimination in the node at hand
  // For each node of the present batch and each earlier batch: index of the same node there, or -1.
  std::vector<std::int32_t> twin_, number_;
};

} // namespace cairn
