/* A ball falls on a plane through the C API: it lands, and at rest the plane carries its weight. */
#include <cairn/cairn.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define CHECK(condition)                                                                                               \
  if (!(condition)) {                                                                                                  \
    fprintf(stderr, "line %d: %s: %s\n", __LINE__, #condition, error.message);                                         \
    return 1;                                                                                                          \
  }

int main(void) {
  cairn_error error = {0, 0, ""};
  cairn_scene* scene = NULL;
  CHECK(cairn_scene_create(4, &scene, &error) == cairn_wrong_input && strstr(error.message, "dim is 4"))
  CHECK(cairn_scene_create(3, &scene, &error) == cairn_ok)

  const double gravity[3] = {0, 0, -9.81};
  int32_t rock = -1;
  CHECK(cairn_scene_set_gravity(scene, gravity, &error) == cairn_ok)
  CHECK(cairn_scene_add_material(scene, "rock", &rock, &error) == cairn_ok)
  const double mu = 0.5, wrong_mu = -1;
  CHECK(cairn_scene_set_law(scene, rock, rock, "Coulomb", 1, &wrong_mu, &error) == cairn_wrong_input)
  CHECK(cairn_scene_set_law(scene, rock, rock, "Coulomb", 1, &mu, &error) == cairn_ok)

  const double position[6] = {0, 0, 0, 0, 0, 0.6}, mass[2] = {INFINITY, 2}, radius[1] = {0.5};
  const double inertia[6] = {INFINITY, INFINITY, INFINITY, 0.2, 0.2, 0.2}, up[4] = {0, 0, 1, 0}, no_mass[2] = {1, 0};
  int64_t first = -1;
  CHECK(cairn_scene_add_bodies(scene, 2, position, NULL, NULL, no_mass, inertia, &first, &error) == cairn_wrong_input)
  CHECK(cairn_scene_add_bodies(scene, 2, position, NULL, NULL, mass, inertia, &first, &error) == cairn_ok)
  const int64_t floor_id = first, ball = first + 1;
  CHECK(cairn_scene_add_contactors(scene, "cube", 1, &ball, &rock, radius, NULL, NULL, NULL, &error) ==
        cairn_wrong_input)
  CHECK(cairn_scene_add_contactors(scene, "plane", 1, &floor_id, &rock, NULL, NULL, up, NULL, &error) == cairn_ok)
  CHECK(cairn_scene_add_contactors(scene, "sphere", 1, &ball, &rock, radius, NULL, NULL, NULL, &error) == cairn_ok)

  cairn_simulation* simulation = NULL;
  cairn_report report;
  const double h = 1e-3;
  CHECK(cairn_simulation_create(scene, NULL, &simulation, &error) == cairn_ok)
  cairn_scene_destroy(scene);
  CHECK(cairn_simulation_step(simulation, -h, &report, &error) == cairn_wrong_input)
  for (int step = 0; step < 500; ++step)
    CHECK(cairn_simulation_step(simulation, h, &report, &error) == cairn_ok && report.status == cairn_converged)

  double place[6], impulse[3];
  int64_t count = 0, bodies[2];
  CHECK(cairn_simulation_bodies(simulation) == 2 && cairn_simulation_contacts(simulation) == 1)
  CHECK(cairn_simulation_body_field(simulation, "position", 6, place, &count, &error) == cairn_ok && count == 6)
  CHECK(fabs(place[5] - 0.5) < 2 * h * h * 9.81 / 0.5)
  CHECK(cairn_simulation_contact_arrays(simulation, bodies, NULL, NULL, NULL, impulse, &error) == cairn_ok)
  CHECK(bodies[0] == ball && bodies[1] == floor_id && fabs(impulse[2] / (2 * 9.81 * h) - 1) < 1e-9)
  cairn_simulation_destroy(simulation);
  printf("cairn %s: the ball rests\n", cairn_version());
  return 0;
}
