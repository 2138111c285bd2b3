/* Kernels of the meshless fluid: see core_f90/fluid. */
#ifndef CAIRN_FLUID_H
#define CAIRN_FLUID_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Particles of a liquid, points on the surfaces of bodies and half-spaces. A record of a particle is its position [m],
 * velocity [m/s], volume [m3 | m2] and pressure [Pa]; of a point of a surface its position, velocity, normal out of the
 * body, depth below the surface [m], volume and slip: 1 holds the liquid, 2 lets it slide. A half-space is a point of
 * its surface, the normal out of it, the centre of its body, velocity and spin of that, and slip. */
enum { cairn_fluid_record = 8, cairn_fluid_surface_record = 12, cairn_fluid_plane_record = 16 };
typedef struct cairn_fluid {
  int32_t dim, planes;
  double smoothing, spacing;             /* length of the kernel and distance of particles [m] */
  double mass, density;                  /* of a particle [kg | kg/m], at rest [kg/m3] */
  double sound_speed, viscosity;         /* [m/s], [Pa s] */
  double diffusion, limiter, artificial; /* of density, of approach, of sound [-] */
  double gravity[3], resting[3];         /* [m/s2], resting: along axes that are not periodic */
  double period[3];                      /* lengths of the periodic cell, 0: none [m] */
  const double* record;                  /* (8, particles) */
  const int64_t* first;                  /* (particles + 1) in neighbour */
  const int32_t* neighbour;              /* numbers of particles, from 0 */
  const double* surface;                 /* (12, points) */
  const int64_t* first_point;            /* (particles + 1) in point */
  const int32_t* point;                  /* numbers of points, from 0 */
  const double* plane;                   /* (16, planes) */
  const int8_t* open; /* (particles) 2 at a free surface, 1 beside one, 0 within: of the step before */
} cairn_fluid;

void cairn_fluid_density_rate(const cairn_fluid* f, int64_t first, int64_t last, double* rate);
void cairn_fluid_acceleration(const cairn_fluid* f, int64_t first, int64_t last, double* acceleration, double* drift,
                              int8_t* open, double* on_planes);
void cairn_fluid_on_points(const cairn_fluid* f, int64_t first, int64_t last, const int64_t* first_of,
                           const int32_t* particle, double* force);

#ifdef __cplusplus
}
#endif
#endif
