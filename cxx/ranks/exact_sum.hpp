// A sum of doubles that is exact until it is read (Kulisch 1981; Neal 2015): the same bits in whatever order, on
// whatever thread or rank the terms are added. Scaling all terms by a power of two scales it.
#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

namespace cairn {

class ExactSum {
public:
  static constexpr int words = 68; // of 32 bits each: all exponents of doubles, and room for 2^31 terms

  void add(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    if (bits << 1 == 0) return;
    const int exponent = int(bits >> 52 & 0x7ff);
    if (exponent == 0x7ff) {
      wrong_ = true;
      return;
    }
    std::uint64_t mantissa = bits & 0xfffffffffffffu;
    if (exponent > 0) mantissa |= std::uint64_t(1) << 52;
    const int place = std::max(exponent, 1) - 1, word = place >> 5, shift = place & 31;
    const std::uint64_t low = mantissa << shift, high = shift > 0 ? mantissa >> (64 - shift) : 0;
    const std::int64_t sign = bits >> 63 ? -1 : 1;
    word_[word] += sign * std::int64_t(low & 0xffffffffu);
    word_[word + 1] += sign * std::int64_t(low >> 32);
    word_[word + 2] += sign * std::int64_t(high);
    if (++terms_ == most_terms) carry();
  }

  void add(const ExactSum& other) {
    carry();
    ExactSum there = other;
    there.carry();
    for (int k = 0; k < words; ++k) word_[k] += there.word_[k];
    wrong_ = wrong_ || there.wrong_;
    ++terms_;
  }

  // Words for an integer sum over ranks; the last one counts sums with a term that is not finite.
  void write(std::span<std::int64_t> to) {
    carry();
    std::copy_n(word_, words, to.begin());
    to[words] = wrong_;
  }
  void read(std::span<const std::int64_t> from) {
    std::copy_n(from.begin(), words, word_);
    wrong_ = from[words] != 0;
    carry();
  }

  // Nearest double; NaN if a term was no finite number.
  double value() {
    if (wrong_) return std::numeric_limits<double>::quiet_NaN();
    carry();
    const bool negative = word_[words - 1] < 0;
    ExactSum size = *this;
    if (negative) {
      for (std::int64_t& w : size.word_) w = -w;
      size.carry();
    }
    int top = words - 1;
    while (top > 0 && size.word_[top] == 0) --top;
    // three words hold at least 65 bits from the first one on, so that the rest tells no more than on which side of a
    // tie the sum is
    using Wide = unsigned __int128;
    const int low = std::max(top - 2, 0);
    Wide kept = 0;
    for (int k = top; k >= low; --k) kept = kept << 32 | Wide(std::uint64_t(size.word_[k]));
    const bool more = std::any_of(size.word_, size.word_ + low, [](std::int64_t w) { return w != 0; });
    if (kept == 0) return 0;
    const auto upper = std::uint64_t(kept >> 64);
    const int length = upper ? 128 - std::countl_zero(upper) : 64 - std::countl_zero(std::uint64_t(kept));
    const int drop = std::max(length - 53, 0);
    auto mantissa = std::uint64_t(kept >> drop);
    if (drop > 0) {
      const Wide half = Wide(1) << (drop - 1), rest = kept & ((Wide(1) << drop) - 1);
      if (rest > half || (rest == half && (more || (mantissa & 1)))) ++mantissa;
    }
    const double x = std::ldexp(double(mantissa), 32 * low + drop - 1074);
    return negative ? -x : x;
  }

private:
  static constexpr std::int64_t most_terms = std::int64_t(1) << 29;
  // Words from 0 to 2^32 - 1, the last one with the sign.
  void carry() {
    for (int k = 0; k + 1 < words; ++k) {
      const std::int64_t over = word_[k] >> 32;
      word_[k] -= over << 32;
      word_[k + 1] += over;
    }
    terms_ = 0;
  }

  std::int64_t word_[words] = {};
  std::int64_t terms_ = 0;
  bool wrong_ = false;
};

} // namespace cairn
