/* Pressure on sides of second order through the C API: of a cell that is held everywhere each node bears its share of
 * the pressure, the integral of its shape function over the side. */
#include <cairn/cairn.h>
#include <math.h>
#include <stdio.h>

#define CHECK(condition)                                                                                               \
  if (!(condition)) {                                                                                                  \
    fprintf(stderr, "line %d: %s: %s\n", __LINE__, #condition, error.message);                                         \
    return 1;                                                                                                          \
  }

/* Nodes of a cell in halves of its sides, in the order of the element. */
static const double square[27] = {0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 1, 0, 0, 2, 1, 0, 1, 2, 0, 0, 1, 0, 1, 1, 0};
static const double cube[81] = {0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 0, 0, 2, 2, 0, 2, 2, 2, 2, 0, 2, 2, 1, 0, 0,
                                2, 1, 0, 1, 2, 0, 0, 1, 0, 1, 0, 2, 2, 1, 2, 1, 2, 2, 0, 1, 2, 0, 0, 1, 2, 0, 1,
                                2, 2, 1, 0, 2, 1, 0, 1, 1, 2, 1, 1, 1, 0, 1, 1, 2, 1, 1, 1, 0, 1, 1, 2, 1, 1, 1};
static const double tetrahedron[30] = {0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2, 1, 0, 0,
                                       1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1};

typedef struct {
  const char* element;
  int dim, nodes;
  const double* place;
  int side_nodes, axis; /* the pressure pushes along it, down where it is negative, -1: x */
  int32_t side[9];
  double share[9];
} Case;

static const Case cases[] = {
    {"q8", 2, 8, square, 3, -1, {1, 2, 5}, {1 / 6., 1 / 6., 4 / 6.}},
    {"q9", 2, 9, square, 3, -1, {1, 2, 5}, {1 / 6., 1 / 6., 4 / 6.}},
    {"hex20",
     3,
     20,
     cube,
     8,
     -3,
     {4, 5, 6, 7, 12, 13, 14, 15},
     {-1 / 12., -1 / 12., -1 / 12., -1 / 12., 1 / 3., 1 / 3., 1 / 3., 1 / 3.}},
    {"hex27",
     3,
     27,
     cube,
     9,
     -3,
     {4, 5, 6, 7, 12, 13, 14, 15, 25},
     {1 / 36., 1 / 36., 1 / 36., 1 / 36., 1 / 9., 1 / 9., 1 / 9., 1 / 9., 4 / 9.}},
    {"tet10", 3, 10, tetrahedron, 6, 3, {0, 2, 1, 6, 5, 4}, {0, 0, 0, 1 / 6., 1 / 6., 1 / 6.}},
};

static int press(const Case* c) {
  const double pressure = 1e3, values[2] = {1e7, 0.3};
  const char* const names[2] = {"young", "poisson"};
  cairn_error error = {0, 0, ""};
  cairn_scene* scene = NULL;
  cairn_mesh* mesh = NULL;
  cairn_simulation* simulation = NULL;
  cairn_report report;
  double place[81], reaction[81], most = 0;
  int32_t cell[27], rock = -1, number = -1, set = -1;
  int64_t count = 0;
  for (int i = 0; i < c->nodes; ++i) {
    cell[i] = i;
    for (int k = 0; k < c->dim; ++k) place[c->dim * i + k] = c->place[3 * i + k] / 2;
  }
  CHECK(cairn_scene_create(c->dim, &scene, &error) == cairn_ok)
  CHECK(cairn_scene_add_material(scene, "rock", &rock, &error) == cairn_ok)
  CHECK(cairn_mesh_create(c->dim, c->nodes, place, &mesh, &error) == cairn_ok)
  CHECK(cairn_mesh_add_solid_cells(mesh, c->element, 1, cell, "neo_hookean", 2, names, values, 1e3, "total_lagrangian",
                                   "strain", 0, 1, &error) == cairn_ok)
  CHECK(cairn_mesh_hold(mesh, c->nodes, cell, (uint8_t)(c->dim == 2 ? 3 : 7), &error) == cairn_ok)
  CHECK(cairn_scene_add_mesh(scene, mesh, "cell", rock, -1, NULL, &number, &error) == cairn_ok)
  CHECK(cairn_simulation_create(scene, NULL, &simulation, &error) == cairn_ok)
  CHECK(cairn_simulation_press_mesh(simulation, number, c->side_nodes, 1, c->side, &set, &error) == cairn_ok)
  CHECK(cairn_simulation_set_pressure(simulation, number, set, pressure, pressure, &error) == cairn_ok)
  CHECK(cairn_simulation_step(simulation, 1e-3, &report, &error) == cairn_ok)
  CHECK(report.status == cairn_converged)
  CHECK(cairn_simulation_mesh_field(simulation, number, "reaction", 81, reaction, &count, &error) == cairn_ok)
  CHECK(count == (int64_t)c->dim * c->nodes)
  const int axis = (c->axis < 0 ? -c->axis : c->axis) - 1;
  for (int i = 0; i < c->nodes; ++i)
    for (int k = 0; k < c->dim; ++k) {
      double wanted = 0;
      for (int j = 0; j < c->side_nodes; ++j)
        if (c->side[j] == i && k == axis) wanted = (c->axis < 0 ? 1 : -1) * c->share[j] * pressure;
      most = fmax(most, fabs(reaction[c->dim * i + k] - wanted));
    }
  printf("%s: shares of a pressure to %.1e\n", c->element, most / pressure);
  CHECK(most < 1e-12 * pressure)
  cairn_simulation_destroy(simulation);
  cairn_mesh_destroy(mesh);
  cairn_scene_destroy(scene);
  return 0;
}

int main(void) {
  for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i)
    if (press(&cases[i])) return 1;
  return 0;
}
