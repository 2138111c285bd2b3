/* Kernels of the meshless fluid: see core_f90/fluid. */
#ifndef CAIRN_FLUID_H
#define CAIRN_FLUID_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Particles of a liquid, points on the surfaces of bodies and half-spaces. A record of a particle is its position [m],
 * velocity [m/s], volume [m3 | m2] and pressure [Pa]; of a point of a surface its position, velocity, normal out of the
 * body, depth below the surface [m], volume, slip: 1 holds the liquid, 2 lets it slide, how far behind the surface
 * particles see it at most, which thin bodies limit [m], and how far below the point, along the normal, the centre of
 * curvature lies [m]: pressure acts there, so that it has no moment about the axis of a round body; 0 on flat sides. A
 * half-space is a point of its surface, the normal out of it, the centre of its body, velocity and spin of that, and
 * slip. */
enum { cairn_fluid_record = 8, cairn_fluid_surface_record = 14, cairn_fluid_plane_record = 16 };
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
  const double* surface;                 /* (14, points) */
  const int64_t* first_point;            /* (particles + 1) in point */
  const int32_t* point;                  /* numbers of points, from 0 */
  const double* plane;                   /* (16, planes) */
  const int8_t* open;   /* (particles) 2 at a free surface, 1 beside one, 0 within: of the step before */
  const double* masses; /* (particles) [kg | kg/m], null: all have `mass` */
  /* (6, particles) correction of gradients less 1, xx xy xz yy yz zz; null: pressure takes none */
  const double* gradient_correction;
} cairn_fluid;

/* gradient_correction: written where the liquid has one. */
void cairn_fluid_density_rate(const cairn_fluid* f, int64_t first, int64_t last, double* rate,
                              double* gradient_correction);
void cairn_fluid_acceleration(const cairn_fluid* f, int64_t first, int64_t last, double* acceleration, double* drift,
                              int8_t* open, double* on_planes);
void cairn_fluid_on_points(const cairn_fluid* f, int64_t first, int64_t last, const int64_t* first_of,
                           const int32_t* particle, double* force, double* shear, double* side);

/* The free surface: share of space that is filled; (4, particles) gradient of the color and its size [1/m]; curvature
 * [1/m]; coefficient of tension over the sum of the gradient across a flat surface [N/m]. */
void cairn_fluid_fill(const cairn_fluid* f, int64_t first, int64_t last, double* fill);
void cairn_fluid_color(const cairn_fluid* f, int64_t first, int64_t last, double* color);
void cairn_fluid_normals(const cairn_fluid* f, int64_t first, int64_t last, const double* color, double* normal);
void cairn_fluid_curvature(const cairn_fluid* f, int64_t first, int64_t last, const double* normal, double* curvature);
void cairn_fluid_tension(const cairn_fluid* f, double tension, int64_t first, int64_t last, const double* color,
                         const double* normal, const double* curvature, double* acceleration);

/* Rows of the divergence of an incompressible fluid. A pair is the gradient of the kernel times the volume of the
 * neighbour, and - W'/r times it; a wall sums over the points of a body beside a particle: twice the gradient, its
 * moment about the centre of the body, the force by the pressure that gravity adds at the points, its moment, the
 * viscous coefficient and where it acts from that centre. */
enum { cairn_fluid_wall_record = 16 };
typedef struct cairn_fluid_rows {
  int32_t dim, bodies;
  double step, density, volume; /* [s], [kg/m3], of a particle [m3 | m2] */
  const int64_t* first;         /* (particles + 1) where the pairs of a particle begin */
  int32_t* used;                /* (particles) how many it has */
  int32_t* near;                /* numbers of particles, from 0 */
  float* pair;                  /* (dim + 1, pairs): memory limits products, and both ends round alike */
  const int64_t* first_wall;    /* (particles + 1) */
  int32_t* used_wall;           /* (particles) */
  int32_t* wall_body;           /* numbers of bodies, from 0 */
  double* wall;                 /* (16, walls) */
  const int32_t* body_of_point; /* of each point of a surface */
  const int32_t* body_of_plane; /* of each half-space */
  const double* centre;         /* (3, bodies) [m] */
  double* shape;                /* (3 | 6, particles) inverse second moment of the gradients: xx yy [zz] xy [xz yz] */
} cairn_fluid_rows;

void cairn_fluid_fill_rows(const cairn_fluid* f, const cairn_fluid_rows* rows, int64_t first, int64_t last,
                           int8_t* open);
void cairn_fluid_push(const cairn_fluid_rows* rows, const int8_t* filtered, int64_t first, int64_t last,
                      const double* pressure, const double* load, double* change, double* laplacian);
void cairn_fluid_divergence(const cairn_fluid_rows* rows, int64_t first, int64_t last, const double* velocity,
                            const double* of_body, double* divergence);
void cairn_fluid_viscous(const cairn_fluid_rows* rows, double viscosity, int64_t first, int64_t last,
                         const double* velocity, const double* of_body, double* acceleration);

/* Damping of the motion of particles between each other that no slope of the velocity explains: slopes by component and
 * direction (3, 3, particles) [1/s], viscosity [Pa s], spacing [m], changes of velocities [m/s]. */
void cairn_fluid_velocity_slopes(const cairn_fluid_rows* rows, int64_t first, int64_t last, const double* velocity,
                                 double* slope);
void cairn_fluid_damp(const cairn_fluid_rows* rows, double viscosity, double spacing, int64_t first, int64_t last,
                      const double* velocity, const double* slope, const double* pressure, double* change);

/* Grains smaller than a particle. A record is position [m], velocity [m/s], volume [m3 | m2], diameter of a sphere of
 * it [m], number of the law of drag, inverse masses along the axes [1/kg | m/kg]. Pairs stand by grains; particles name
 * theirs by place. */
enum { cairn_fluid_grain_record = 12 };
typedef struct cairn_fluid_grains {
  int32_t grains;
  const double* grain;     /* (12, grains) */
  const int64_t* first_of; /* (grains + 1) in particle */
  const int32_t* particle; /* numbers of particles, from 0 */
  double* weight;          /* (pairs) */
  const int64_t* first;    /* (particles + 1) in grain_of */
  const int32_t* grain_of; /* (pairs) numbers of grains, from 0 */
  const int64_t* pair;     /* (pairs) places in weight, from 0 */
  double* wet;             /* (grains) share under the free surface */
  double* solid;           /* (particles) share of their volume that grains take */
  const double* mass;      /* (particles) [kg | kg/m] */
} cairn_fluid_grains;

void cairn_fluid_grain_weights(const cairn_fluid* f, const cairn_fluid_grains* g, int64_t first, int64_t last);
void cairn_fluid_grain_solids(const cairn_fluid* f, const cairn_fluid_grains* g, int64_t first, int64_t last,
                              double* swift);
void cairn_fluid_grain_push(const cairn_fluid* f, const cairn_fluid_grains* g, int64_t first, int64_t last,
                            double* force, double* of_pair);
void cairn_fluid_grain_bear(const cairn_fluid_grains* g, int64_t first, int64_t last, const double* of_pair,
                            double* acceleration);
void cairn_fluid_grain_drag(const cairn_fluid* f, const cairn_fluid_grains* g, double time, int64_t first, int64_t last,
                            const double* velocity, double* impulse);
void cairn_fluid_grain_react(const cairn_fluid_grains* g, int64_t first, int64_t last, const double* impulse,
                             double* velocity, double* lost);
/* Lattice of the particles among grains. shape: (6, particles) xx xy xz yy yz zz. */
void cairn_fluid_grain_shapes(const cairn_fluid* f, int64_t first, int64_t last, double* shape, int8_t* within);
void cairn_fluid_grain_align(const cairn_fluid* f, int64_t first, int64_t last, const double* shape,
                             const int8_t* within, double* acceleration, double* uneven);
void cairn_fluid_grain_stir(const cairn_fluid_grains* g, int64_t first, int64_t last, const double* velocity,
                            double* speed);

#ifdef __cplusplus
}
#endif
#endif
