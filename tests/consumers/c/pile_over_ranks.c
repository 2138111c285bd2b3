/* Disks that fall onto a floor, over the ranks of MPI: mpirun -n 4 ./pile_over_ranks libcairn_mpi.so */
#include <cairn/ranks.h>
#include <math.h>
#include <mpi.h>
#include <stdio.h>

enum { side = 8, n = side * side };

#define CHECK(call)                                                                                                    \
  if ((call) != cairn_ok) {                                                                                            \
    fprintf(stderr, "line %d: %s\n", __LINE__, error.message);                                                         \
    MPI_Abort(MPI_COMM_WORLD, 1);                                                                                      \
  }

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  cairn_error error = {0, 0, ""};
  cairn_scene* scene = NULL;
  const double gravity[2] = {-6, -9.81}, friction = 0.4, infinite = INFINITY, still[3] = {0, 0, 0};
  const double normal[2][3] = {{0, 1, 0}, {1, 0, 0}}, corner[2] = {0, 0};
  double center[2 * n], mass[n], inertia[n], radius[n];
  int64_t first = 0, body[n], wall = 0;
  int32_t rock = 0, material[n];
  CHECK(cairn_scene_create(2, &scene, &error))
  CHECK(cairn_scene_set_gravity(scene, gravity, &error))
  CHECK(cairn_scene_add_material(scene, "rock", &rock, &error))
  CHECK(cairn_scene_set_law(scene, rock, rock, "Coulomb", 1, &friction, &error))
  for (int k = 0; k < n; ++k) {
    center[2 * k] = 0.6 + k % side + 0.01 * (k * 7 % 5);
    center[2 * k + 1] = 0.6 + k / side;
    radius[k] = 0.42 + 0.01 * (k * 3 % 7);
    mass[k] = 2600 * 3.141592653589793 * radius[k] * radius[k];
    inertia[k] = 0.5 * mass[k] * radius[k] * radius[k];
    material[k] = rock;
  }
  CHECK(cairn_scene_add_bodies(scene, n, center, NULL, NULL, mass, inertia, &first, &error))
  for (int k = 0; k < n; ++k) body[k] = first + k;
  CHECK(cairn_scene_add_contactors(scene, "disk", n, body, material, radius, NULL, NULL, NULL, &error))
  for (int k = 0; k < 2; ++k) {
    CHECK(cairn_scene_add_bodies(scene, 1, corner, NULL, NULL, &infinite, &infinite, &wall, &error))
    CHECK(cairn_scene_add_contactors(scene, "half_plane", 1, &wall, &rock, NULL, NULL, normal[k], NULL, &error))
    CHECK(cairn_scene_drive(scene, 1, &wall, 7, still, &error))
  }

  cairn_nscd options;
  cairn_nscd_defaults(&options);
  options.tolerance = 1e-6;
  cairn_simulation* simulation = NULL;
  CHECK(cairn_simulation_create(scene, &options, &simulation, &error))
  cairn_scene_destroy(scene);
  CHECK(cairn_simulation_set_option(simulation, "solver", "nlgs", &error))
  CHECK(cairn_simulation_over_mpi(simulation, MPI_Comm_c2f(MPI_COMM_WORLD), argc > 1 ? argv[1] : NULL, 0, &error))
  cairn_report report;
  for (int step = 0; step < 40; ++step) CHECK(cairn_simulation_step(simulation, 4e-3, &report, &error))
  CHECK(cairn_simulation_gather(simulation, &error))
  int32_t rank = 0, ranks = 0;
  CHECK(cairn_simulation_ranks(simulation, &rank, &ranks, &error))
  double position[2 * (n + 2)], kinetic = 0;
  int64_t count = 0;
  CHECK(cairn_simulation_body_field(simulation, "position", 2 * (n + 2), position, &count, &error))
  CHECK(cairn_simulation_energy(simulation, "kinetic", &kinetic, &error))
  if (rank == 0)
    printf("ranks %d contacts %d place %.17g %.17g kinetic %.17g\n", (int)ranks,
           (int)cairn_simulation_contacts(simulation), position[0], position[2 * n - 1], kinetic);
  cairn_simulation_destroy(simulation);
  MPI_Finalize();
  return 0;
}
