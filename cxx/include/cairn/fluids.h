/* A meshless liquid among the bodies of a scene: a part of the C API, to be included beside cairn/cairn.h. See
 * docs/fluid.md for the method.
 *
 * A scene has one liquid; each simulation that is made of the scene has its own copy. Disks, spheres, rings and
 * half-spaces have points below their surfaces by themselves, bodies of other shapes those that the program gives.
 * Deformable bodies beside the liquid and its warnings are Python's alone. */
#ifndef CAIRN_FLUIDS_H
#define CAIRN_FLUIDS_H
#include <stdint.h>

#include "cairn/cairn.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct cairn_fluid_settings {
  double spacing;         /* of the particles [m] */
  double density;         /* at rest [kg/m3] */
  double viscosity;       /* dynamic [Pa s] */
  double sound_speed;     /* [m/s]; 0: ten times the speed of a fall over the height of the liquid; of the
                             incompressible form: that of the liquid itself, 0: it does not give way */
  double surface_tension; /* [N/m] */
  double smoothing;       /* length of the kernel over the spacing, 1 to 3 */
  double artificial;      /* viscosity of Monaghan, where particles approach [-] */
  double depth;           /* of a plane scene [m] */
  int32_t incompressible; /* 0: sub-steps in the step of the bodies; 1: in the step of the contacts of NSCD */
} cairn_fluid_settings;

/* Spacing 0, which is to be given; water of no viscosity: 1000, 0, 0, 0, 1.5, 0, 1, 0. settings may be NULL. */
void cairn_fluid_defaults(cairn_fluid_settings* settings);
/* n particles: position (dim, n) [m], outside bodies and walls, one spacing apart; velocity (dim, n) [m/s], may be
 * NULL: rest; pressure (n) [Pa], may be NULL: that of rest below the highest particle. A second call takes the place of
 * the first one; n of 0: no liquid. */
int32_t cairn_scene_set_fluid(cairn_scene* scene, const cairn_fluid_settings* settings, int64_t n,
                              const double* position, const double* velocity, const double* pressure,
                              cairn_error* error);
/* How the liquid meets contactors of a material or group, "*": all: "no_slip", the default, "free_slip", "none": it
 * flows through; of disks and spheres at most a spacing wide the drag "di_felice", "ergun" or "gidaspow". Rules of
 * groups go before those of materials, these before "*"; the later one of two counts. */
int32_t cairn_scene_set_fluid_rule(cairn_scene* scene, const char* name, const char* rule, cairn_error* error);
/* Points below the surface of a body, in its axes: offset (dim, n) from its centre of mass [m], normal (dim, n) out of
 * the body at the nearest point of the surface, depth (n) below it [m], volume (n), in 2D area, of each [m3 or m2]. A
 * layer a spacing thick has its points half a spacing deep; layers reach twice the smoothing deep, or through the body.
 * Calls add up. They stand for all of its shapes that are no half-spaces. */
int32_t cairn_scene_add_fluid_points(cairn_scene* scene, int64_t body, int64_t n, const double* offset,
                                     const double* normal, const double* depth, const double* volume,
                                     cairn_error* error);

/* Open ends of the weakly compressible form without grains: boxes between low and high (dim) [m], along an axis (from
 * 0), as long as particles reach or longer. Out of an inflow particles come in rows, which end at the liquid in whole
 * spacings; speed (rows) [m/s], < 0: down the axis: of each row, in the order of the other axes, the last of them
 * fastest, or one for all. In an outflow, up its axis (sign 1) or down (-1), particles keep their velocity along it and
 * are gone at the far end; pressure in it [Pa], NaN: that of each goes on. The number of particles changes. */
int32_t cairn_scene_add_inflow(cairn_scene* scene, const double* low, const double* high, int32_t axis, int64_t rows,
                               const double* speed, cairn_error* error);
int32_t cairn_scene_add_outflow(cairn_scene* scene, const double* low, const double* high, int32_t axis, int32_t sign,
                                double pressure, cairn_error* error);

int64_t cairn_simulation_particles(const cairn_simulation* simulation); /* 0 without a liquid */
/* Values (components, n) in the order in which particles were given: "position" (absolute), "velocity", "pressure",
 * "density", "mass" [kg], "porosity", "open" (2 at the free surface, 1 next to it, 0 inside), "end" (1 and more: in a
 * row of an inflow, -1 and less: in an outflow). *count numbers, written if capacity is enough; either pointer may be
 * NULL. */
int32_t cairn_simulation_fluid_field(cairn_simulation* simulation, const char* name, int64_t capacity, double* values,
                                     int64_t* count, cairn_error* error);
/* Of the last step: "sub_steps", "passes" of pressure and contacts, "products" and "residual" of the pressure, "misfit"
 * of the velocities between both; "speed" [m/s], "compression", "volume" over that of the mass, "drag_loss" [J];
 * "came_in" and "left" by open ends since the start [kg], "back_flow": particles that stand in an inflow;
 * "stable_step" [s] and "sound_speed" [m/s] of now. */
int32_t cairn_simulation_fluid_number(cairn_simulation* simulation, const char* name, double* value,
                                      cairn_error* error);
/* Mean force of the liquid on a body over the last step and its torque about the centre of mass: (nd) [N, N m]. */
int32_t cairn_simulation_fluid_force(cairn_simulation* simulation, int64_t body, double* force, cairn_error* error);
/* Gauges at n places (dim, n) [m], may be within a step: mean pressure about each, 0 outside the liquid (n) [Pa]; the
 * height against gravity, or along the last axis without, of the highest free surface above or below each, NaN
 * where there is none (n) [m]. */
int32_t cairn_simulation_fluid_pressure(cairn_simulation* simulation, int64_t n, const double* place, double* pressure,
                                        cairn_error* error);
int32_t cairn_simulation_fluid_level(cairn_simulation* simulation, int64_t n, const double* place, double* level,
                                     cairn_error* error);

#ifdef __cplusplus
}
#endif
#endif
