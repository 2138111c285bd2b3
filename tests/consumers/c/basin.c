/* Water at rest in a basin, solved together with the contacts, and a block whose points below its surface the program
 * gives: the forces of the water on the floor and on the block, level and pressure. */
#include <cairn/cairn.h>
#include <cairn/fluids.h>
#include <math.h>
#include <stdio.h>

#define CHECK(call)                                                                                                    \
  if ((call) != cairn_ok) {                                                                                            \
    fprintf(stderr, "line %d: %s\n", __LINE__, error.message);                                                         \
    return 1;                                                                                                          \
  }

enum { ACROSS = 20, UP = 8, LAYERS = 3 };
static cairn_error error;
static const double spacing = 0.05, half = 0.15;

/* Rows of points along the sides of a square, a spacing apart, half of one below the surface and deeper. */
static int64_t points_of_square(double* offset, double* normal, double* depth, double* volume) {
  int64_t n = 0;
  for (int layer = 0; layer < LAYERS; ++layer) {
    const double reach = half - (layer + 0.5) * spacing, outer = 2 * (reach + 0.5 * spacing),
                 inner = outer - 2 * spacing;
    const int along = (int)lround(2 * reach / spacing);
    const int64_t first = n;
    for (int side = 0; side < 4; ++side)
      for (int k = 0; k < along; ++k, ++n) {
        const double way = -reach + k * 2 * reach / along;
        const double out[4][2] = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};
        for (int c = 0; c < 2; ++c) {
          normal[2 * n + c] = out[side][c];
          offset[2 * n + c] = reach * out[side][c] + way * (c == 0 ? -out[side][1] : out[side][0]);
        }
        depth[n] = (layer + 0.5) * spacing;
      }
    for (int64_t k = first; k < n; ++k) volume[k] = (outer * outer - inner * inner) / (double)(n - first);
  }
  return n;
}

int main(void) {
  cairn_scene* scene = NULL;
  cairn_simulation* simulation = NULL;
  int32_t stone = -1;
  int64_t id = -1, block = -1;
  const double gravity[2] = {0, -9.81}, mu = 0.4, inf = INFINITY,
               corner[8] = {-half, -half, half, -half, half, half, -half, half};
  const int64_t first_vertex[2] = {0, 4};
  const double up[3][3] = {{0, 1, 0}, {1, 0, 0}, {-1, 0, 0}}, wall[3][2] = {{0, 0}, {0, 0}, {1, 0}};
  CHECK(cairn_scene_create(2, &scene, &error))
  CHECK(cairn_scene_set_gravity(scene, gravity, &error))
  CHECK(cairn_scene_add_material(scene, "stone", &stone, &error))
  CHECK(cairn_scene_set_law(scene, -1, -1, "Coulomb", 1, &mu, &error))
  for (int k = 0; k < 3; ++k) {
    CHECK(cairn_scene_add_bodies(scene, 1, wall[k], NULL, NULL, &inf, &inf, &id, &error))
    CHECK(cairn_scene_add_contactors(scene, "half_plane", 1, &id, &stone, NULL, NULL, up[k], NULL, &error))
  }
  const double centre[2] = {0.5, 0.4}, mass = 500 * 4 * half * half, inertia = mass * 4 * half * half / 6;
  int32_t square = -1;
  CHECK(cairn_scene_add_bodies(scene, 1, centre, NULL, NULL, &mass, &inertia, &block, &error))
  CHECK(cairn_scene_add_polygons(scene, 1, first_vertex, corner, &square, &error))
  CHECK(cairn_scene_add_hull_contactors(scene, "polygon", 1, &block, &stone, &square, NULL, NULL, &error))

  static double offset[256], normal[256], depth[128], volume[128], place[2 * ACROSS * UP];
  const int64_t points = points_of_square(offset, normal, depth, volume);
  CHECK(cairn_scene_add_fluid_points(scene, block, points, offset, normal, depth, volume, &error))
  int64_t n = 0;
  for (int i = 0; i < ACROSS; ++i)
    for (int j = 0; j < UP; ++j) {
      const double x = (i + 0.5) * spacing, y = (j + 0.5) * spacing;
      if (fabs(x - centre[0]) < half && fabs(y - centre[1]) < half) continue;
      place[2 * n] = x;
      place[2 * n++ + 1] = y;
    }
  cairn_fluid_settings water;
  cairn_fluid_defaults(&water);
  water.spacing = spacing;
  water.incompressible = 1;
  CHECK(cairn_scene_set_fluid(scene, &water, n, place, NULL, NULL, &error))
  CHECK(cairn_scene_set_fluid_rule(scene, "stone", "free_slip", &error))
  CHECK(cairn_simulation_create(scene, NULL, &simulation, &error))
  cairn_scene_destroy(scene);
  for (int k = 0; k < 100; ++k) CHECK(cairn_simulation_step(simulation, 4e-3, NULL, &error))
  double force[6], pressure = 0, level = 0;
  const double gauge[2] = {0.1, 0.1};
  CHECK(cairn_simulation_fluid_force(simulation, block, force, &error))
  CHECK(cairn_simulation_fluid_force(simulation, 0, force + 3, &error))
  CHECK(cairn_simulation_fluid_pressure(simulation, 1, gauge, &pressure, &error))
  CHECK(cairn_simulation_fluid_level(simulation, 1, gauge, &level, &error))
  printf("block %.16e %.16e %.16e\nfloor %.16e %.16e %.16e\n", force[0], force[1], force[2], force[3], force[4],
         force[5]);
  printf("pressure %.16e\nlevel %.16e\n", pressure, level);
  cairn_simulation_destroy(simulation);
  return 0;
}
