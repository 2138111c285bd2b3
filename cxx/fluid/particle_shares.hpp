// The loops over the particles of a liquid among the ranks of a scene: each rank makes the sums of its own particles,
// and all ranks learn them. A sum has the order of its list, so that bits do not depend on the number of ranks.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace cairn {

constexpr std::int64_t fluid_tile = 64; // particles whose sums are made together

// The ranks; those of this process follow each other.
class ParticleShares {
public:
  virtual ~ParticleShares() = default;
  virtual int ranks() const = 0;
  virtual int first_local() const = 0;
  virtual int last_local() const = 0; // behind the last one
  // Items of `size` bytes, of which rank r made those from first[r] to first[r + 1]: all become known to each.
  virtual void share(void* items, std::size_t size, std::span<const std::int64_t> first) = 0;
};

// Items in tiles, cut among ranks by counted costs.
class TileShares {
public:
  // cost_before(k): of the items before k. ranks null: this process makes all.
  template <class F>
  void cut(std::int64_t items, const ParticleShares* ranks, F&& cost_before) {
    const std::int64_t tiles = (items + fluid_tile - 1) / fluid_tile;
    const int many = ranks ? ranks->ranks() : 1;
    const auto total = double(cost_before(items));
    const auto at = [&](std::int64_t tile) { return std::min(fluid_tile * tile, items); };
    first_.assign(1, 0);
    first_tile_.assign(1, 0);
    double most = 0;
    for (int rank = 0; rank < many; ++rank) {
      std::int64_t tile = rank + 1 == many ? tiles : first_tile_.back();
      while (tile < tiles && double(cost_before(at(tile))) * many < total * (rank + 1)) ++tile;
      most = std::max(most, double(cost_before(at(tile))) - double(cost_before(first_.back())));
      first_tile_.push_back(tile);
      first_.push_back(at(tile));
    }
    imbalance_ = total > 0 ? most * many / total : 1;
    begin_ = first_tile_[std::size_t(ranks ? ranks->first_local() : 0)];
    end_ = first_tile_[std::size_t(ranks ? ranks->last_local() : 1)];
  }
  std::int64_t items() const { return first_.empty() ? 0 : first_.back(); }
  double imbalance() const { return imbalance_; }                             // largest cost of a rank over the mean
  const std::vector<std::int64_t>& first() const { return first_; }           // item of each rank (ranks + 1)
  const std::vector<std::int64_t>& first_tile() const { return first_tile_; } // likewise

  // f(first, last) for the tiles of this process, which any thread takes.
  template <class F>
  void each_tile(F&& f, bool threads = true) const {
    const std::int64_t n = items();
#pragma omp parallel for schedule(dynamic, 1) if (threads)
    for (std::int64_t t = begin_; t < end_; ++t) f(fluid_tile * t, std::min(fluid_tile * (t + 1), n));
  }

private:
  std::vector<std::int64_t> first_, first_tile_;
  std::int64_t begin_ = 0, end_ = 0;
  double imbalance_ = 1;
};

} // namespace cairn
