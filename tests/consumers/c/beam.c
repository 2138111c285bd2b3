/* An elastic beam on two rigid blocks through the C API: it bends under its weight and a load, and the blocks carry
 * both. */
#include <cairn/cairn.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define CHECK(condition)                                                                                               \
  if (!(condition)) {                                                                                                  \
    fprintf(stderr, "line %d: %s: %s\n", __LINE__, #condition, error.message);                                         \
    return 1;                                                                                                          \
  }

enum { ALONG = 20, UP = 2, NODES = (ALONG + 1) * (UP + 1), CELLS = ALONG * UP };

/* A simulation of the scene with a load on the middle of the top of the beam; NULL if it cannot be. */
static cairn_simulation* start(const cairn_scene* scene, int32_t beam, double load, cairn_error* error) {
  cairn_simulation* simulation = NULL;
  double force[2 * NODES] = {0};
  force[2 * (UP * (ALONG + 1) + ALONG / 2) + 1] = -load;
  if (cairn_simulation_create(scene, NULL, &simulation, error) == cairn_ok &&
      cairn_simulation_set_option(simulation, "solver", "auto", error) == cairn_ok &&
      cairn_simulation_set_number(simulation, "tol", 1e-8, error) == cairn_ok &&
      cairn_simulation_set_number(simulation, "theta", 1, error) == cairn_ok &&
      cairn_simulation_load_mesh(simulation, beam, force, NULL, NULL, error) == cairn_ok)
    return simulation;
  cairn_simulation_destroy(simulation);
  return NULL;
}

int main(void) {
  const double length = 2, height = 0.2, density = 2000, g = 9.81, load = 1e3, h = 2e-3;
  cairn_error error = {0, 0, ""};
  cairn_scene* scene = NULL;
  int32_t stone = -1;
  const double gravity[2] = {0, -g}, mu = 0.5;
  CHECK(cairn_scene_create(2, &scene, &error) == cairn_ok)
  CHECK(cairn_scene_set_gravity(scene, gravity, &error) == cairn_ok)
  CHECK(cairn_scene_add_material(scene, "stone", &stone, &error) == cairn_ok)
  CHECK(cairn_scene_set_rule(scene, "*", "*", "Coulomb", 1, &mu, &error) == cairn_ok)

  /* two blocks of one shape, under the ends of the beam */
  const double place[4] = {0, -0.1, length, -0.1}, mass[2] = {INFINITY, INFINITY};
  const double corner[8] = {-0.15, -0.1, 0.15, -0.1, 0.15, 0.1, -0.15, 0.1};
  const int64_t first_vertex[2] = {0, 4};
  int64_t first = -1;
  int32_t hull = -1;
  CHECK(cairn_scene_add_bodies(scene, 2, place, NULL, NULL, mass, mass, &first, &error) == cairn_ok)
  CHECK(cairn_scene_add_polygons(scene, 1, first_vertex, corner, &hull, &error) == cairn_ok)
  const int64_t blocks[2] = {first, first + 1};
  const int32_t of_stone[2] = {stone, stone}, hulls[2] = {hull, hull};
  CHECK(cairn_scene_add_hull_contactors(scene, "polygon", 2, blocks, of_stone, hulls, NULL, NULL, &error) == cairn_ok)

  /* the beam: its nodes row by row, quadrilaterals, the bottom touches */
  double node[2 * NODES];
  int32_t cell[4 * CELLS], bottom[ALONG + 1];
  for (int j = 0; j <= UP; ++j)
    for (int i = 0; i <= ALONG; ++i) {
      node[2 * (j * (ALONG + 1) + i)] = length * i / ALONG;
      node[2 * (j * (ALONG + 1) + i) + 1] = height * j / UP;
      if (j == 0) bottom[i] = i;
    }
  for (int j = 0; j < UP; ++j)
    for (int i = 0; i < ALONG; ++i) {
      const int32_t a = j * (ALONG + 1) + i, corners[4] = {a, a + 1, a + ALONG + 2, a + ALONG + 1};
      memcpy(cell + 4 * (j * ALONG + i), corners, sizeof corners);
    }
  cairn_mesh* mesh = NULL;
  int32_t beam = -1;
  CHECK(cairn_mesh_create(2, NODES, node, &mesh, &error) == cairn_ok)
  CHECK(cairn_mesh_add_elastic_cells(mesh, "q4", CELLS, cell, -1e9, 0.2, density, 0, 1, &error) == cairn_wrong_input)
  CHECK(strstr(error.message, "young"))
  CHECK(cairn_mesh_add_elastic_cells(mesh, "q4", CELLS, cell, 1e9, 0.2, density, 0, 1, &error) == cairn_ok)
  CHECK(cairn_mesh_set_damping(mesh, 0, 1e-3, 0, &error) == cairn_ok)
  CHECK(cairn_mesh_touch_nodes(mesh, ALONG + 1, bottom, &error) == cairn_ok)
  CHECK(cairn_scene_add_mesh(scene, mesh, "beam", stone, -1, NULL, &beam, &error) == cairn_ok)
  cairn_mesh_destroy(mesh);

  cairn_simulation* simulation = start(scene, beam, load, &error);
  CHECK(simulation)

  /* a run file with an output every 50 steps, and a checkpoint half way */
  const char *run_file = "beam.vtkhdf", *saved = "beam.checkpoint.h5";
  cairn_run_writer* writer = NULL;
  CHECK(cairn_run_writer_create(simulation, run_file, cairn_replace, &writer, &error) == cairn_ok)
  char text[256];
  for (int step = 1; step <= 300; ++step) {
    CHECK(cairn_simulation_step(simulation, h, NULL, &error) == cairn_ok)
    CHECK(cairn_simulation_report_text(simulation, "status", sizeof text, text, &error) == cairn_ok)
    CHECK(strcmp(text, "converged") == 0)
    CHECK(cairn_run_writer_step(writer, simulation, &error) == cairn_ok)
    if (step % 50 == 0) CHECK(cairn_run_writer_output(writer, simulation, &error) == cairn_ok)
    if (step == 150) CHECK(cairn_simulation_write_checkpoint(simulation, saved, &error) == cairn_ok)
  }
  CHECK(cairn_run_writer_close(writer, &error) == cairn_ok)

  /* another simulation of the scene goes on from the checkpoint to the same bits */
  cairn_simulation* again = start(scene, beam, load, &error);
  CHECK(again)
  CHECK(cairn_simulation_restart(again, saved, &error) == cairn_ok)
  for (int step = 150; step < 300; ++step) CHECK(cairn_simulation_step(again, h, NULL, &error) == cairn_ok)
  double here[2 * NODES], there[2 * NODES];
  int64_t numbers = 0;
  for (int k = 0; k < 2; ++k) {
    const char* name = k == 0 ? "position" : "velocity";
    CHECK(cairn_simulation_mesh_field(simulation, beam, name, 2 * NODES, here, &numbers, &error) == cairn_ok)
    CHECK(cairn_simulation_mesh_field(again, beam, name, 2 * NODES, there, &numbers, &error) == cairn_ok)
    CHECK(memcmp(here, there, sizeof here) == 0)
  }
  cairn_simulation_destroy(again);
  cairn_scene_destroy(scene);

  /* the file holds what was written */
  cairn_run* run = NULL;
  double times[6], position[2 * NODES], stored_last[300];
  CHECK(cairn_run_open(run_file, &run, &error) == cairn_ok)
  CHECK(cairn_run_outputs(run) == 6)
  CHECK(cairn_run_times(run, 6, times, &numbers, &error) == cairn_ok && fabs(times[5] - 300 * h) < 1e-9)
  CHECK(cairn_run_node_field(run, 5, "position", 2 * NODES, position, &numbers, &error) == cairn_ok)
  CHECK(numbers == 2 * NODES)
  CHECK(cairn_simulation_mesh_field(simulation, beam, "position", 2 * NODES, here, &numbers, &error) == cairn_ok)
  CHECK(memcmp(position, here, sizeof here) == 0)
  CHECK(cairn_simulation_node_field(simulation, "position", 2 * NODES, position, &numbers, &error) == cairn_ok)
  CHECK(cairn_simulation_nodes(simulation) == NODES && memcmp(position, here, sizeof here) == 0)
  CHECK(cairn_run_body_field(run, 5, "id", 2 * NODES, position, &numbers, &error) == cairn_ok && numbers == 2)
  CHECK(cairn_run_history(run, "energy_stored", 300, stored_last, &numbers, &error) == cairn_ok && numbers == 300)
  CHECK(cairn_run_body_field(run, 5, "colour", 0, NULL, &numbers, &error) == cairn_file_error)
  cairn_run_close(run);
  remove(run_file);
  remove(saved);

  /* what the contacts give is what comes down */
  double impulse[2 * (ALONG + 1)], status[ALONG + 1], up = 0, velocity[2 * NODES], u[2 * NODES], fastest = 0;
  int64_t count = 0;
  CHECK(cairn_simulation_contact_field(simulation, "impulse", 2 * (ALONG + 1), impulse, &count, &error) == cairn_ok)
  CHECK(count == 2 * cairn_simulation_contacts(simulation) && count > 0)
  for (int64_t i = 0; i < count / 2; ++i) up += impulse[2 * i + 1];
  const double weight = length * height * density * g;
  CHECK(fabs(up / h / (weight + load) - 1) < 1e-6)
  CHECK(cairn_simulation_contact_field(simulation, "status", ALONG + 1, status, &count, &error) == cairn_ok)
  CHECK(cairn_simulation_mesh_field(simulation, beam, "velocity", 2 * NODES, velocity, &count, &error) == cairn_ok)
  for (int i = 0; i < 2 * NODES; ++i) fastest = fmax(fastest, fabs(velocity[i]));
  CHECK(count == 2 * NODES && fastest < 1e-6)

  /* energy: the beam is strained, and the balance closes */
  double stored = 0, kinetic = 0, closure = 0, in_play = 0, worst = 0;
  CHECK(cairn_simulation_energy(simulation, "stored", &stored, &error) == cairn_ok)
  CHECK(cairn_simulation_energy(simulation, "kinetic", &kinetic, &error) == cairn_ok)
  CHECK(cairn_simulation_energy(simulation, "closure", &closure, &error) == cairn_ok)
  CHECK(cairn_simulation_energy(simulation, "in_play", &in_play, &error) == cairn_ok)
  CHECK(cairn_simulation_report(simulation, "worst_contact", &worst, &error) == cairn_ok)
  CHECK(cairn_simulation_mesh_field(simulation, beam, "displacement", 2 * NODES, u, &count, &error) == cairn_ok)
  const double sag = -u[ALONG + 1]; /* of the middle of its bottom: between beams of 1.7 m and 2 m by Euler */
  CHECK(sag > 6e-4 && sag < 1.3e-3 && stored > 0 && kinetic < 1e-9 * stored)
  CHECK(fabs(closure) < 1e-9 * in_play)
  CHECK(cairn_simulation_energy(simulation, "lost", &stored, &error) == cairn_wrong_input)
  CHECK(strstr(error.message, "kinetic"))
  cairn_simulation_destroy(simulation);
  printf("the beam sags by %.3g mm\n", 1e3 * sag);
  return 0;
}
