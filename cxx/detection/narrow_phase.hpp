// Narrow phase: contacts of pairs that may touch, by the kernels of pairs.def in batches.
#pragma once
#include <cstdint>

#include "declared_pairs.hpp"
#include "pair_kinds.hpp"
#include "recalled_pairs.hpp"

namespace cairn::detection {

class NarrowPhase {
public:
  NarrowPhase(const PlacedScene& scene, const DeclaredPairs& declared) : scene_(scene), declared_(declared) {}

  void find(const OrderedPairs& pairs, Candidates& out);
  std::size_t bytes() const { return recalled_.bytes() + pieces_.capacity() * sizeof(Piece); }

private:
  struct Piece {                      // contacts that one thread found, from their first slot on
    std::int64_t slot, kept, refused; // refused: the first pair that cannot be, if any
  };
  std::int64_t slots_of(const OrderedPairs& pairs) const;
  bool left_alone(int kind) const { return pair_kinds[kind].hull_contact ? scene_.hulls_later : scene_.hulls_again; }
  void find_kind(int kind, std::int64_t first, std::int64_t last, std::int64_t slot, Candidates& out);
  void find_piece(int kind, std::int64_t first, std::int64_t last, Piece& piece, Candidates& out);
  // Pairs from first to last - 1 of a kind, whose contacts go from `slot` on; returns how many count.
  std::int64_t find_batch(int kind, std::int64_t first, std::int64_t last, std::int64_t slot, Piece& piece,
                          Candidates& out);
  std::int64_t find_hulls(int kind, std::int64_t first, std::int64_t last, std::int64_t slot, Candidates& out);
  bool repeated(std::int64_t pair) const; // as the one before it: declared, and found too
  std::int64_t drop_own_insides(std::int64_t first, std::int64_t count, Candidates& out) const;
  void close_ranks(Candidates& out) const;

  const PlacedScene& scene_;
  const DeclaredPairs& declared_;
  const std::int32_t *a_ = nullptr, *b_ = nullptr, *image_ = nullptr; // of the pairs
  Array<Piece> pieces_;
  RecalledPairs recalled_;
  std::int64_t first_recalled_ = 0; // among the pairs
  std::int64_t spoilt_ = -1;        // a pair to which a user's routine gave no number
};

} // namespace cairn::detection
