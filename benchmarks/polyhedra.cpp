// Pairs of convex polyhedra a second and core, of 8 vertices unless another number is given; "flush": boxes face on
// face. Column random: pairs whose gap is within 2 % of their size, in random turns, seen for the first time. Column
// coherent: the same pairs a small motion later (a thousandth of the size; of flush ones a billionth), with what the
// step before left. CSV on standard output, best of the repetitions, CPU time.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "benchmarks/hull_pairs.hpp"

namespace {

double seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

} // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "8";
  const bool flush = what == "flush";
  cairn::Pairs pairs(flush ? 8 : std::atoi(what.c_str()), flush);
  double first = 1e300, again = 1e300;
  for (int repetition = 0; repetition < 20; ++repetition) {
    const double start = seconds();
    pairs.detect();
    first = std::min(first, seconds() - start);
  }
  const double random = cairn::Pairs::pairs / first;
  pairs.recalls = true;
  pairs.detect();
  for (int repetition = 0; repetition < 20; ++repetition) {
    pairs.move(flush ? 1e-9 : 1e-3);
    const double start = seconds();
    pairs.detect();
    again = std::min(again, seconds() - start);
  }
  std::printf("vertices,random_pairs_a_second,coherent_pairs_a_second\n%s,%.0f,%.0f\n", what.c_str(), random,
              cairn::Pairs::pairs / again);
  return 0;
}
