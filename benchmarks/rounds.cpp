// Pairs of round shapes a second and core, their gap within 0.02 of bodies of half sizes 0.3 to 0.9 in random turns; or
// the pairs of two shapes named: sphere, capsule, cylinder, ellipsoid, superquadric (exponents 0.3 to 1.5), box,
// polyhedron (8 vertices). Column far: the same with gaps of 0.02 to 0.3, all out of reach. CSV on standard output,
// best of the repetitions, CPU time.
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

struct Kind {
  const char *first, *second;
};
constexpr Kind kinds[] = {
    {"sphere", "capsule"},
    {"sphere", "cylinder"},
    {"sphere", "ellipsoid"},
    {"sphere", "superquadric"},
    {"capsule", "capsule"},
    {"capsule", "cylinder"},
    {"capsule", "ellipsoid"},
    {"capsule", "superquadric"},
    {"capsule", "box"},
    {"cylinder", "cylinder"},
    {"cylinder", "ellipsoid"},
    {"cylinder", "superquadric"},
    {"cylinder", "box"},
    {"cylinder", "polyhedron"},
    {"ellipsoid", "ellipsoid"},
    {"superquadric", "superquadric"},
    {"ellipsoid", "box"},
    {"superquadric", "box"},
    {"superquadric", "polyhedron"},
    {"box", "box"},
};

double rate(cairn::Pairs& pairs, int repetitions) {
  double best = 1e300;
  for (int repetition = 0; repetition < repetitions; ++repetition) {
    const double start = seconds();
    pairs.detect();
    best = std::min(best, seconds() - start);
  }
  return cairn::Pairs::pairs / best;
}

} // namespace

int main(int argc, char** argv) {
  std::printf("first,second,pairs_a_second,far_pairs_a_second\n");
  for (const Kind& kind : kinds) {
    if (argc > 2 && (argv[1] != std::string(kind.first) || argv[2] != std::string(kind.second))) continue;
    cairn::Pairs pairs(kind.first, kind.second);
    const double near = rate(pairs, 5);
    pairs.bring_near(0.02, 0.3);
    std::printf("%s,%s,%.0f,%.0f\n", kind.first, kind.second, near, rate(pairs, 5));
    std::fflush(stdout);
  }
  return 0;
}
