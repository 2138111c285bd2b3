// Sparse factors by CHOLMOD (Chen, Davis, Hager and Rajamanickam, 2008). Its Core and Cholesky modules alone are called
// here (LGPL); supernodal factors need its GPL part, which a build with -D CAIRN_SUITESPARSE=lgpl does not ask for.
#include "../base/call.hpp"
#include "cairn/core.h"
#include "factors.hpp"

#if CAIRN_HAS_CHOLMOD
#include <cholmod.h>

#include <algorithm>
#include <string>

#include "column_factors.hpp"
#include "one_blas_thread.hpp"
#endif

namespace cairn {

#if CAIRN_HAS_CHOLMOD

namespace {

// Solutions with L L' by dense blocks of columns; a view as ColumnFactors.
struct BlockColumns {
  std::int64_t blocks = 0;
  const std::int32_t *column_start = nullptr, *row_start = nullptr, *value_start = nullptr, *row = nullptr;
  const double* value = nullptr;
  SoeTree tree;

  void view(const cholmod_factor& l, const double* values) {
    blocks = std::int64_t(l.nsuper);
    column_start = static_cast<const std::int32_t*>(l.super);
    row_start = static_cast<const std::int32_t*>(l.pi);
    value_start = static_cast<const std::int32_t*>(l.px);
    row = static_cast<const std::int32_t*>(l.s);
    value = values;
    if (!tree.first.empty()) return;
    tree.first.assign(column_start, column_start + blocks + 1);
    tree.node.resize(l.n);
    for (std::int32_t s = 0; s < blocks; ++s)
      std::fill(tree.node.begin() + tree.first[s], tree.node.begin() + tree.first[s + 1], s);
    tree.parent.resize(blocks);
    for (std::int32_t s = 0; s < blocks; ++s) {
      const std::int32_t below = row_start[s] + column_start[s + 1] - column_start[s];
      tree.parent[s] = below < row_start[s + 1] ? tree.node[row[below]] : -1;
    }
  }

  double pivot(std::int64_t j) const {
    const std::int32_t s = tree.node[j];
    const std::int64_t rows = row_start[s + 1] - row_start[s], own = j - column_start[s];
    const double l = value[value_start[s] + own * (rows + 1)];
    return l * l;
  }

  SoeBlock block(std::int32_t s) const {
    const std::int64_t columns = column_start[s + 1] - column_start[s], rows = row_start[s + 1] - row_start[s];
    return {column_start[s], columns, rows - columns, row + row_start[s] + columns, value + value_start[s], 0};
  }

  void solve(int lanes, double* y, double* work) const {
    cairn_front_triangles(lanes, blocks, column_start, row_start, value_start, row, value, y, work);
  }
};

class Cholmod final : public SoeFactors {
public:
  Cholmod(const SparseMatrix& pattern, const SoeOptions& options) : start_(pattern.start.begin(), pattern.start.end()) {
    cholmod_start(&common_);
    common_.print = 0;
    common_.final_ll = 0;
    common_.grow0 = 0; // allocate the exact size
    common_.grow2 = 0;
    common_.quick_return_if_not_posdef = 1;
    choose(options);
    const cholmod_sparse a = view(pattern);
    factor_ = cholmod_analyze(const_cast<cholmod_sparse*>(&a), &common_);
    if (factor_ == nullptr) { // too large for its integers, or no memory
      cholmod_finish(&common_);
      throw Error("CHOLMOD cannot analyse a matrix of " + std::to_string(pattern.n) + " unknowns and " +
                  std::to_string(pattern.row.size()) + " entries: its factors are too large");
    }
    if (std::any_of(options.last.begin(), options.last.end(), [](std::uint8_t last) { return last; }))
      put_last(a, options.last);
    order_ = static_cast<const std::int32_t*>(factor_->Perm);
    most_rows_ = factor_->is_super ? most_of(factor_->pi) : 0;
    const bool own = options.blocks == SoeBlocks::own || options.blocks == SoeBlocks::automatic;
    if (own && factor_->is_super) place_entries(pattern);
  }

  ~Cholmod() override {
    cholmod_free_factor(&factor_, &common_);
    cholmod_finish(&common_);
  }

  SoeStatus factor(const SparseMatrix& a) override {
    if (!entry_place_.empty()) return factor_blocks(a);
    const cholmod_sparse given = view(a);
    {
      const OneBlasThread one;
      cholmod_factorize(const_cast<cholmod_sparse*>(&given), factor_, &common_);
    }
    if (common_.status != CHOLMOD_OK && common_.status != CHOLMOD_NOT_POSDEF && common_.status != CHOLMOD_DSMALL)
      return {SoeStatus::too_large};
    return factor_->is_super ? take_blocks(a) : take_columns(a);
  }

  std::span<const std::int32_t> order() const override { return {order_, factor_->n}; }

  void solve(int lanes, double* y, double* work) const override {
    if (factor_->is_super)
      blocks_.solve(lanes, y, work);
    else
      columns_.solve(lanes, y);
  }

  std::int64_t work_per_lane() const override { return most_rows_; }
  const SoeTree* tree() const override { return factor_->is_super ? &blocks_.tree : &columns_.tree; }

  SoeBlock block(std::int32_t node) const override {
    return factor_->is_super ? blocks_.block(node) : columns_.block(node);
  }

  std::int64_t bytes() const override {
    return std::int64_t(common_.memory_inuse) + columns_.bytes() + 4 * start_.size() + 8 * values_.size() +
           8 * work_.size() + 8 * entry_place_.size() + 4 * (lists_.size() + place_.size());
  }

  std::int64_t entries() const override {
    if (factor_->is_super) return std::int64_t(factor_->xsize);
    return std::int64_t(factor_->nzmax);
  }

  const char* storage() const override { return "sparse"; }
  const char* library() const override {
    if (!entry_place_.empty()) return "cairn supernodal";
    return factor_->is_super ? "CHOLMOD supernodal" : "CHOLMOD simplicial";
  }

private:
  void choose(const SoeOptions& options) {
    common_.supernodal = options.blocks == SoeBlocks::simplicial  ? CHOLMOD_SIMPLICIAL
                         : options.blocks == SoeBlocks::automatic ? CHOLMOD_AUTO
                                                                  : CHOLMOD_SUPERNODAL;
    if (!CAIRN_HAS_SUPERNODAL) common_.supernodal = CHOLMOD_SIMPLICIAL;
    if (options.order == SoeOrder::automatic) return; // CHOLMOD's own rule
    common_.nmethods = 1;
    common_.method[0].ordering = options.order == SoeOrder::amd     ? CHOLMOD_AMD
                                 : options.order == SoeOrder::metis ? CHOLMOD_METIS
                                                                    : CHOLMOD_NATURAL;
  }

  // Takes the order with these equations at its end, if the factors grow little by that.
  void put_last(const cholmod_sparse& a, const std::vector<std::uint8_t>& last) {
    constexpr double growth = 1.1; // every step goes through all of them
    const double entries = common_.lnz;
    const auto* const order = static_cast<const std::int32_t*>(factor_->Perm);
    std::vector<std::int32_t> given(order, order + factor_->n);
    std::stable_partition(given.begin(), given.end(), [&](std::int32_t e) { return !last[e]; });
    const int methods = common_.nmethods, ordering = common_.method[0].ordering;
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_GIVEN;
    cholmod_factor* other = cholmod_analyze_p(const_cast<cholmod_sparse*>(&a), given.data(), nullptr, 0, &common_);
    common_.nmethods = methods;
    common_.method[0].ordering = ordering;
    if (other != nullptr && common_.lnz <= growth * entries) std::swap(factor_, other);
    cholmod_free_factor(&other, &common_);
  }

  cholmod_sparse view(const SparseMatrix& a) {
    cholmod_sparse out{};
    out.nrow = out.ncol = std::size_t(a.n);
    out.nzmax = a.row.size();
    out.p = start_.data();
    out.i = const_cast<std::int32_t*>(a.row.data());
    out.x = const_cast<double*>(a.value.data());
    out.stype = -1;
    out.itype = CHOLMOD_INT;
    out.xtype = CHOLMOD_REAL;
    out.dtype = CHOLMOD_DOUBLE;
    out.sorted = out.packed = 1;
    return out;
  }

  // Length of the longest supernode; starts: offset of each.
  std::int64_t most_of(const void* starts) const {
    const auto* const start = static_cast<const std::int32_t*>(starts);
    std::int64_t most = 0;
    for (std::size_t s = 0; s < factor_->nsuper; ++s) most = std::max<std::int64_t>(most, start[s + 1] - start[s]);
    return most;
  }

  // Where entries of the matrix stand in the blocks, and room for those.
  void place_entries(const SparseMatrix& a) {
    order_ = static_cast<const std::int32_t*>(factor_->Perm);
    values_.resize(factor_->xsize);
    blocks_.view(*factor_, values_.data());
    std::vector<std::int32_t> place(a.n);
    for (std::int64_t k = 0; k < a.n; ++k) place[order_[k]] = std::int32_t(k);
    entry_place_.reserve(a.row.size());
    for (std::int64_t j = 0; j < a.n; ++j)
      for (std::int64_t e = a.start[j]; e < a.start[j + 1]; ++e) {
        const auto [column, row] = std::minmax(place[j], place[a.row[e]]);
        const std::int32_t s = blocks_.tree.node[column];
        const std::int32_t *begin = blocks_.row + blocks_.row_start[s], *end = blocks_.row + blocks_.row_start[s + 1];
        entry_place_.push_back(blocks_.value_start[s] + (column - blocks_.column_start[s]) * (end - begin) +
                               (std::lower_bound(begin, end, row) - begin));
      }
    lists_.resize(3 * factor_->nsuper);
    place_.resize(a.n);
    work_.resize(most_rows_ * most_of(factor_->super));
  }

  SoeStatus factor_blocks(const SparseMatrix& a) {
    std::fill(values_.begin(), values_.end(), 0.0);
    for (std::size_t e = 0; e < entry_place_.size(); ++e) values_[entry_place_[e]] = a.value[e];
    std::int32_t failed = -1;
    std::int32_t* const list = lists_.data();
    cairn_block_cholesky(a.n, blocks_.blocks, blocks_.column_start, blocks_.row_start, blocks_.value_start, blocks_.row,
                         blocks_.tree.node.data(), values_.data(), list, list + blocks_.blocks,
                         list + 2 * blocks_.blocks, place_.data(), work_.data(), &failed);
    return judge_blocks(a, failed < 0 ? factor_->n : std::size_t(failed));
  }

  SoeStatus take_blocks(const SparseMatrix& a) {
    blocks_.view(*factor_, static_cast<const double*>(factor_->x));
    return judge_blocks(a, std::min(factor_->minor, factor_->n));
  }

  // good: columns before the first pivot that was not positive.
  SoeStatus judge_blocks(const SparseMatrix& a, std::size_t good) const {
    for (std::size_t j = 0; j < good; ++j)
      if (const SoeStatus status = judge_pivot(blocks_.pivot(j), a.value[a.start[order_[j]]], order_[j]); !status)
        return status;
    return good < factor_->n ? SoeStatus{SoeStatus::indefinite, order_[good]} : SoeStatus{};
  }

  SoeStatus take_columns(const SparseMatrix& a) {
    const auto *const start = static_cast<const std::int32_t*>(factor_->p), *const count =
                                                                                static_cast<const std::int32_t*>(
                                                                                    factor_->nz);
    columns_.resize(a.n);
    columns_.row = static_cast<const std::int32_t*>(factor_->i);
    columns_.value = static_cast<const double*>(factor_->x);
    for (std::int64_t j = 0; j < a.n; ++j) {
      columns_.first[j] = start[j] + 1;
      columns_.last[j] = std::int64_t(start[j]) + count[j];
      columns_.pivot[j] = columns_.value[start[j]];
    }
    columns_.find_tree();
    return columns_.judge(a, order_);
  }

  cholmod_common common_{};
  cholmod_factor* factor_ = nullptr;
  const std::int32_t* order_ = nullptr;
  std::vector<std::int32_t> start_;
  std::int64_t most_rows_ = 0;
  ColumnFactors columns_;
  BlockColumns blocks_;
  // of factors by the core's own kernel
  std::vector<std::int64_t> entry_place_;
  std::vector<double> values_, work_;
  std::vector<std::int32_t> lists_, place_;
};

} // namespace

std::unique_ptr<SoeFactors> make_cholmod(const SparseMatrix& pattern, const SoeOptions& options) {
  if (!CAIRN_HAS_SUPERNODAL && options.blocks == SoeBlocks::supernodal)
    throw Error("supernodal factors are CHOLMOD's GPL part: build with -D CAIRN_SUITESPARSE=gpl, or take simplicial");
  return std::make_unique<Cholmod>(pattern, options);
}

#else

std::unique_ptr<SoeFactors> make_cholmod(const SparseMatrix&, const SoeOptions& options) {
  if (options.blocks == SoeBlocks::supernodal)
    throw Error("supernodal factors are CHOLMOD's, which this build has not: install libsuitesparse-dev and build with "
                "-D CAIRN_SUITESPARSE=gpl");
  return nullptr;
}

#endif

} // namespace cairn
