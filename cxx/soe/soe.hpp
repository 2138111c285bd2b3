// Systems of linear equations A x = b: a pattern analysed once, values factorised when they change, solved many times.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace cairn {

// A square matrix by compressed columns, rows rising in a column and none twice. Of a symmetric matrix the lower
// triangle with the diagonal alone; of one that is not, all entries.
struct SparseMatrix {
  std::int64_t n = 0;
  std::vector<std::int64_t> start{0}; // (n + 1) of the columns
  std::vector<std::int32_t> row;
  std::vector<double> value;
};

// Lower triangle of a sum of small full matrices, as elements add them: clique c couples the unknowns
// unknown[clique_start[c]] ... unknown[clique_start[c + 1] - 1] with each other. The diagonal is there whole; values
// are zero.
SparseMatrix lower_pattern(std::int64_t n, std::span<const std::int64_t> clique_start,
                           std::span<const std::int32_t> unknown);

// Adds the matrices of the cliques, full ones with a column after the other, to the values of such a pattern.
void add_cliques(const SparseMatrix& pattern, std::span<const std::int64_t> clique_start,
                 std::span<const std::int32_t> unknown, const double* matrix, std::span<double> value);

// Where entry (row, column) stands in `value`, or -1; of a lower triangle give row >= column.
std::int64_t place_of(const SparseMatrix& pattern, std::int64_t row, std::int64_t column);

enum class SoeStorage {
  automatic,  // diagonal if A is; dense up to 60 unknowns; banded while the half band is at most 24; else sparse
  diagonal,   // A pattern with entries off its diagonal is refused.
  banded,     // LAPACK's dpbtrf in the reverse order of Cuthill and McKee (1969)
  dense,      // LAPACK's dpotrf
  sparse,     // CHOLMOD; Eigen's SimplicialLDLT in a build without it, banded in a build without both
  unsymmetric // UMFPACK; Eigen's SparseLU in a build without it. The pattern holds all entries.
};

// Ordering of sparse factors. Automatic: AMD, and for large systems METIS if it gives less fill.
enum class SoeOrder { automatic, amd, metis, natural };

// Factors of CHOLMOD: simplicial LDL' by columns (LGPL), or supernodal LL' by dense blocks, in LAPACK (GPL). Own: the
// same blocks factorised by a kernel of the core, nine times faster than plain LAPACK and twice as fast as OpenBLAS,
// with bits independent of the library; simplicial where the build has no blocks. Automatic has own blocks where
// CHOLMOD finds at least 40 operations for an entry of L, and the build may.
enum class SoeBlocks { automatic, simplicial, supernodal, own };

struct SoeOptions {
  SoeStorage storage = SoeStorage::automatic;
  SoeOrder order = SoeOrder::automatic;
  SoeBlocks blocks = SoeBlocks::automatic;
  // (n), not zero: x is given there, not sought; empty: none. See Soe::solve.
  std::vector<std::uint8_t> held;
  // (n), nonzero: entries of the inverse will be requested between these. Sparse factors eliminate them last if that
  // adds little fill, so that such entries need only the end of the factors. Empty: none.
  std::vector<std::uint8_t> last = {};
};

// How a factorisation ended. A pivot counts as zero below 8 roundings of its diagonal entry, 8 * 2^-52 * a_ii: then
// nothing of it is known.
// Supernodal factors call a pivot that came out negative indefinite even if it is a rounding below zero.
struct SoeStatus {
  enum Kind { done, not_finite, singular, indefinite, too_large };
  Kind kind = done;
  std::int64_t row = -1; // the unknown, in the caller's numbers, at which it failed; -1 if none can be named
  explicit operator bool() const { return kind == done; }
};

class SoeFactors;
class UnitFronts;
struct UnitReaches;

// Factors and solutions keep their bits under any number of threads or right sides, and when A or the unit of an
// unknown changes by a power of two. One call at a time on an Soe; different objects may be used at once.
class Soe {
public:
  // Analyses the pattern; its values are not read. Throws Error for invalid options: a storage that does not fit, an
  // order or blocks that this build lacks.
  static std::unique_ptr<Soe> make(const SparseMatrix& pattern, const SoeOptions& options = {});
  ~Soe();

  // `value` in the order of the pattern's. After anything but `done` there are no factors to solve with.
  SoeStatus factor(const double* value);

  // Solves A x = b in place of b, (columns, n) with the unknowns of a column contiguous. At held unknowns b contains
  // the given x, which is kept; its contribution moves to the right sides of all others. Allocates only when more
  // threads are requested than before.
  void solve(double* b, std::int64_t columns = 1, int threads = 1) const;

  // Selected inversion: out (m, m) holds entry (indices[i], indices[j]) of the inverse of A, so that B A^-1 B' needs no
  // full columns; sparse factors are traversed only where the indices reach. Symmetric to the last bit. Zero for held
  // unknowns. May allocate.
  void solve_units(std::span<const std::int32_t> indices, double* out, int threads = 1) const;
  // Extends the result of the last call for a symmetric A, to the same bits: the first `known` indices were the list of
  // the last call since the factorisation, with their entries in out (leading, m). With sparse factors only new indices
  // cost time.
  void add_units(std::span<const std::int32_t> indices, std::int64_t known, double* out, std::int64_t leading,
                 int threads = 1);
  // Columns of the inverse factor of groups of `together` unknowns, in order, appended to `out` as groups.
  // reach_numbers: how many numbers that would be; -1 unless the factors are sparse ones of a symmetric matrix. Each
  // number has the same bits in any request.
  void add_reaches(std::span<const std::int32_t> unknowns, int together, UnitReaches& out, int threads = 1) const;
  std::int64_t reach_numbers(std::span<const std::int32_t> unknowns, int together) const;

  std::int64_t size() const { return n_; }
  bool factorised() const { return factorised_; }
  std::int64_t bytes() const;   // of factors, pattern and workspace
  std::int64_t entries() const; // of the factors, once factorised
  const char* storage() const;  // diagonal, banded, dense, sparse, unsymmetric
  const char* library() const;  // what factorises: cairn, LAPACK, CHOLMOD simplicial, CHOLMOD supernodal, ...
  Soe(const Soe&) = delete;
  Soe& operator=(const Soe&) = delete;

private:
  Soe() = default;
  void take_equations(const SparseMatrix& pattern, const std::vector<std::uint8_t>& held);
  SoeStatus gather(const double* value);
  SoeStatus scale();
  SoeStatus scale_symmetric();
  void lift(double* b) const;
  void solve_lanes(double* b, std::int64_t columns, double* work) const;
  std::int64_t work_size() const;
  struct Wanted {       // an unknown whose entries of the inverse are asked for
    std::int64_t index; // in the caller's list
    std::int32_t equation, place;
  };
  std::vector<Wanted> wanted_of(std::span<const std::int32_t> indices) const; // those not held, by rising places
  void add_fronts(UnitFronts& units, std::span<const std::int32_t> indices, std::int64_t known, double* out,
                  std::int64_t leading, int threads) const;
  std::vector<std::int32_t> places_of(std::span<const std::int32_t> group) const; // of those not held
  void take_diagonal(std::span<const std::int32_t> indices, double* out, std::int64_t leading) const;
  void solve_columns(std::span<const std::int32_t> indices, double* out, std::int64_t leading, int threads) const;

  std::int64_t n_ = 0;
  bool symmetric_ = true, factorised_ = false;
  std::vector<std::int32_t> unknown_;       // of each equation: those not held
  std::vector<std::int32_t> equation_;      // of each unknown, or -1
  std::vector<std::int32_t> place_;         // of each equation in the order of elimination
  std::vector<std::int64_t> value_place_;   // of each entry of the equations, in the values given
  std::vector<std::int32_t> pulled_, pull_; // equation and held unknown of each entry between them
  std::vector<std::int64_t> pull_place_;
  std::vector<double> pull_value_;
  SparseMatrix scaled_;
  std::vector<double> left_, right_; // powers of two: the factors are those of left A right
  std::unique_ptr<SoeFactors> factors_;
  std::unique_ptr<UnitFronts> units_; // of add_units
  std::int64_t units_known_ = 0;
  mutable std::vector<double> work_;
};

// Licence of the sparse factors in this build: "gpl", "lgpl", "bsd" or "off", as CAIRN_SUITESPARSE.
const char* soe_licence();

} // namespace cairn
