// A pile gives the same bits from one thread and from four, by strategy and solver; the thread sanitizer runs it, too.
// too.
#include <cstring>

#include "c_scene.hpp"

namespace {

struct CThreads : CScene {
  int most = 1000;
  void pile(int dim, int side) {
    make(dim);
    floor(dim);
    const double radius = 0.5;
    int row = 0;
    for (int k = 0; k < side; ++k)
      for (int j = 0; j < (dim == 3 ? side : 1); ++j)
        for (int i = 0; i < side; ++i, ++row) {
          std::vector<double> place{0.999 * i + 0.01 * k, 0.999 * j};
          place.resize(std::size_t(dim));
          place[std::size_t(dim) - 1] = 0.499 + 0.998 * k;
          ball(dim, body(place, 2.0, 0.2), radius, rock);
        }
  }
  void law(const char* name, std::vector<double> values) {
    ASSERT_EQ(cairn_scene_set_law(scene, -1, -1, name, int32_t(values.size()), values.data(), &error), 0)
        << error.message;
  }
  // velocities after some steps
  std::vector<double> velocities(int threads, const char* strategy, const char* solver) {
    start();
    EXPECT_EQ(cairn_simulation_set_option(simulation, "strategy", strategy, &error), 0) << error.message;
    if (*solver != '\0') {
      EXPECT_EQ(cairn_simulation_set_option(simulation, "solver", solver, &error), 0) << error.message;
    }
    EXPECT_EQ(cairn_simulation_set_number(simulation, "threads", threads, &error), 0) << error.message;
    if (std::string(strategy) != "smooth_dem") {
      EXPECT_EQ(cairn_simulation_set_number(simulation, "max_iter", most, &error), 0) << error.message;
    }
    steps(2, 1e-4);
    std::vector<double> out = field("velocity");
    cairn_simulation_destroy(simulation);
    simulation = nullptr;
    return out;
  }
  void same_bits(const char* strategy, const char* solver = "") {
    const std::vector<double> one = velocities(1, strategy, solver), four = velocities(4, strategy, solver);
    ASSERT_EQ(one.size(), four.size());
    EXPECT_EQ(std::memcmp(one.data(), four.data(), one.size() * sizeof(double)), 0) << strategy << " " << solver;
  }
};

TEST_F(CThreads, solvers_of_disks) {
  pile(2, 16);
  for (const char* solver : {"auto", "admm", "ppa_newton", "interior_point"}) same_bits("nscd", solver);
}

// Loops are shared out from some thousand bodies on.
TEST_F(CThreads, sweeps_of_disks) {
  most = 12;
  pile(2, 100);
  same_bits("nscd", "nlgs");
}

TEST_F(CThreads, sweeps_of_spheres) {
  most = 12;
  pile(3, 18);
  same_bits("nscd", "nlgs");
  same_bits("carpenter");
}

TEST_F(CThreads, smooth_spheres) {
  pile(3, 18);
  law("LinearSpring", {1e5, 0.3, 0.5, 0.5});
  same_bits("smooth_dem");
}

} // namespace
