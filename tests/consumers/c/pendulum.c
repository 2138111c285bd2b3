/* A bob on a ball joint swings for 3 s through the C API: it keeps its distance and its energy, and the joint tells its
 * force. */
#include <cairn/cairn.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define CHECK(condition)                                                                                               \
  if (!(condition)) {                                                                                                  \
    fprintf(stderr, "line %d: %s: %s\n", __LINE__, #condition, error.message);                                         \
    return 1;                                                                                                          \
  }

static void print(const char* name, int n, const double* values) {
  printf("%s", name);
  for (int k = 0; k < n; ++k) printf(" %.16e", values[k]);
  printf("\n");
}

int main(void) {
  cairn_error error = {0, 0, ""};
  cairn_scene* scene = NULL;
  const double g = 9.81, gravity[3] = {g, 0, 0}, mass = 0.5, inertia[3] = {4e-4, 5e-4, 6e-4}, radius = 0.02;
  const double place[3] = {0.0995, 0, -0.01}, origin[3] = {0, 0, 0}, strength = 100;
  const char* names[] = {"strength"};
  int32_t rock = -1;
  int64_t bob = -1, ends[2] = {-1, -1};
  CHECK(cairn_scene_create(3, &scene, &error) == cairn_ok)
  CHECK(cairn_scene_set_gravity(scene, gravity, &error) == cairn_ok)
  CHECK(cairn_scene_add_material(scene, "rock", &rock, &error) == cairn_ok)
  CHECK(cairn_scene_add_bodies(scene, 1, place, NULL, NULL, &mass, inertia, &bob, &error) == cairn_ok)
  CHECK(cairn_scene_add_contactors(scene, "sphere", 1, &bob, &rock, &radius, NULL, NULL, NULL, &error) == cairn_ok)
  CHECK(cairn_scene_add_joint(scene, "Weld", bob, -1, origin, NULL, 0, NULL, NULL, NULL, &error) == cairn_wrong_input &&
        strstr(error.message, "there is no joint 'Weld'; there are Ball, Hinge, Pivot, Fixed, Slider, Distance"))
  CHECK(cairn_scene_add_joint(scene, "Ball", bob, -1, origin, NULL, 1, names, &strength, ends, &error) == cairn_ok)

  cairn_nscd options;
  cairn_nscd_defaults(&options);
  options.tolerance = 1e-11;
  options.max_iterations = 50000;
  cairn_simulation* simulation = NULL;
  CHECK(cairn_simulation_create(scene, &options, &simulation, &error) == cairn_ok)
  cairn_scene_destroy(scene);

  const double h = 1e-3, length = sqrt(place[0] * place[0] + place[2] * place[2]), lean = asin(0.01 / length);
  double position[6], velocity[12], before[12], key[4], beta, impulse[3], kinetic, potential, first = 0, drift = 0;
  int64_t count = 0, bodies[2];
  cairn_report report;
  memset(velocity, 0, sizeof velocity);
  for (int step = 0; step < 3000; ++step) {
    memcpy(before, velocity, sizeof velocity);
    CHECK(cairn_simulation_step(simulation, h, &report, &error) == cairn_ok && report.status == cairn_converged)
    CHECK(cairn_simulation_body_field(simulation, "position", 6, position, &count, &error) == cairn_ok && count == 6)
    CHECK(cairn_simulation_body_field(simulation, "velocity", 12, velocity, &count, &error) == cairn_ok && count == 12)
    CHECK(cairn_simulation_energy(simulation, "kinetic", &kinetic, &error) == cairn_ok)
    CHECK(cairn_simulation_energy(simulation, "potential", &potential, &error) == cairn_ok)
    if (step == 0) first = kinetic + potential;
    const double away = sqrt(position[0] * position[0] + position[1] * position[1] + position[2] * position[2]);
    drift = fmax(drift, fabs(away - length));
  }
  CHECK(drift < 1e-6 * 2 * length)
  CHECK(fabs(kinetic + potential - first) < 1e-4 * mass * g * length * lean * lean)

  /* the joint is a contact: of its two contactors, of the bob first */
  CHECK(cairn_simulation_contacts(simulation) == 1)
  CHECK(cairn_simulation_contact_field(simulation, "key", 4, key, &count, &error) == cairn_ok && count == 4)
  CHECK(key[0] == (double)ends[0] && key[1] == (double)ends[1])
  CHECK(cairn_simulation_contact_field(simulation, "beta", 1, &beta, &count, &error) == cairn_ok && beta == 1)
  CHECK(cairn_simulation_contact_arrays(simulation, bodies, NULL, NULL, NULL, impulse, &error) == cairn_ok)
  CHECK(bodies[0] == bob)
  for (int k = 0; k < 3; ++k)
    CHECK(fabs(impulse[k] - mass * (velocity[k] - before[k] - h * gravity[k])) < 1e-10 * mass * g * h)
  print("position", 3, position);
  print("velocity", 6, velocity);
  print("impulse", 3, impulse);
  cairn_simulation_destroy(simulation);
  return 0;
}
