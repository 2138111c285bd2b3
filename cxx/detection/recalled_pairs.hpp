// Memory of separating axes: features of the last axis of each pair of polyhedra, by the pair's contactors and image.
// The kernel starts from them and proves or replaces them, with the same result, so that a checkpoint needs none.
#pragma once
#include <algorithm>
#include <cstdint>

#include "../base/field.hpp"

namespace cairn::detection {

class RecalledPairs {
public:
  // The pairs of a call, in order of a, then b.
  void begin(std::int64_t pairs, const std::int32_t* a, const std::int32_t* b, const std::int32_t* image) {
    std::swap(now_, last_);
    fit(now_.a, pairs);
    fit(now_.b, pairs);
    fit(now_.image, pairs);
    fit(now_.feature, 2 * pairs);
    if (pairs == 0) return;
    std::copy_n(a, pairs, now_.a.begin());
    std::copy_n(b, pairs, now_.b.begin());
    std::copy_n(image, pairs, now_.image.begin());
  }

  // Features of n pairs from `first` on: two numbers each, 0 where the pair is new; the kernel writes its result there.
  std::int32_t* features(std::int64_t first, std::int32_t n) {
    std::int32_t* feature = now_.feature.data() + 2 * first;
    const std::int64_t known = std::int64_t(last_.a.size());
    const auto before = [](const List& x, std::int64_t i, const List& y, std::int64_t j) {
      return x.a[i] != y.a[j] ? x.a[i] < y.a[j] : x.b[i] < y.b[j];
    };
    std::int64_t at = 0;
    for (std::int64_t end = known; n > 0 && at < end;) { // the first that is not before
      const std::int64_t middle = (at + end) / 2;
      if (before(last_, middle, now_, first))
        at = middle + 1;
      else
        end = middle;
    }
    for (std::int64_t i = first; i < first + n; ++i, feature += 2) {
      while (at < known && before(last_, at, now_, i)) ++at;
      feature[0] = feature[1] = 0;
      for (std::int64_t k = at; k < known && last_.a[k] == now_.a[i] && last_.b[k] == now_.b[i]; ++k)
        if (last_.image[k] == now_.image[i]) std::copy_n(&last_.feature[2 * k], 2, feature);
    }
    return now_.feature.data() + 2 * first;
  }

  std::size_t bytes() const {
    std::size_t total = 0;
    for (const List* list : {&now_, &last_})
      for (const auto* v : {&list->a, &list->b, &list->image, &list->feature})
        total += v->capacity() * sizeof(std::int32_t);
    return total;
  }

private:
  struct List {
    Array<std::int32_t> a, b, image, feature;
  };
  List now_, last_;
};

} // namespace cairn::detection
