/* Kernels that rows of the lists name, in the forms of core.h. Apart from it, so that a new row compiles those alone
 * that read the list: its registry, and whoever names a row. Slots that a row does not offer are declared too: nobody
 * calls them. */
#ifndef CAIRN_ROWS_H
#define CAIRN_ROWS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A cohesive zone as an element of a solid: r = -(spring u + pull) beside a contact of friction mu (n), with the
 * intensity beta (n) that the velocity u (n, c), bias included, allows. fall (n, c): relative change of the intensity
 * of the springs with the velocity, rise (n, c): change of the friction. params, state as solve has them. */
typedef void cairn_law_zone(int32_t n, int32_t c, const double* u, const double* params, const double* state,
                            double* spring, double* pull, double* fall, double* mu, double* rise, double* beta);
#define CAIRN_LAW(name, ...)                                                                                           \
  cairn_law_prepare cairn_law_##name##_prepare;                                                                        \
  cairn_law_solve cairn_law_##name##_solve;                                                                            \
  cairn_law_commit cairn_law_##name##_commit;                                                                          \
  cairn_law_residual cairn_law_##name##_residual;                                                                      \
  cairn_law_energy cairn_law_##name##_energy;                                                                          \
  cairn_law_zone cairn_law_##name##_zone;                                                                              \
  cairn_law_force cairn_law_##name##_force;                                                                            \
  cairn_law_stiffness cairn_law_##name##_stiffness;
#include "../../contact_laws/laws.def"
#undef CAIRN_LAW
#define CAIRN_POSE(name, python) cairn_pose cairn_pose_##name;
#include "../../poses/poses.def"
#undef CAIRN_POSE
#define CAIRN_MAPPED_SIDE(name, dimension, lever, width) cairn_side_gather cairn_side_##name##_gather;
#define CAIRN_SIDE(name, dimension, lever, width)                                                                      \
  cairn_side_gather cairn_side_##name##_gather;                                                                        \
  cairn_side_scatter cairn_side_##name##_scatter;                                                                      \
  cairn_side_delassus cairn_side_##name##_delassus;
#include "../../sides/sides.def"
#undef CAIRN_SIDE
#undef CAIRN_MAPPED_SIDE
#define CAIRN_PAIR(name, a, b, most) cairn_pair_contact cairn_pair_##name;
#define CAIRN_HULL_PAIR(name, a, b, most) cairn_hull_contact cairn_pair_##name;
#include "../../detection/pairs.def"
#define CAIRN_INTEGRATOR(name, python, parameters, meaning) cairn_integrator cairn_integrator_##name;
#include "../../integrators/integrators.def"
#undef CAIRN_INTEGRATOR
#define CAIRN_CONDUCTANCE(name, python, parameters, reads, meaning) cairn_conductance cairn_conductance_##name;
#include "../../networks/networks.def"
#define CAIRN_ELEMENT(name, cell, dim, nodes, points, bulk_points, order)                                              \
  cairn_element_rule cairn_element_##name##_rule;                                                                      \
  cairn_element_rule cairn_element_##name##_bulk_rule;                                                                 \
  cairn_element_shape cairn_element_##name##_shape;
#include "../../elements/elements.def"
#undef CAIRN_ELEMENT
#define CAIRN_BULK_MATERIAL(name, python, given, parameters, state, symmetric) cairn_bulk_material cairn_bulk_##name;
#include "../../bulk_materials/bulk_materials.def"
#undef CAIRN_BULK_MATERIAL
/* Of n cells whose points share one damage; volume (points, n), drive (6, points, n), growth (n), the others as of a
 * cairn_bulk_material that gets strains. */
void cairn_damage_of_cells(int32_t points, int64_t n, const double* params, const double* length, const double* volume,
                           const double* strain, const double* state_begin, double* state, double* stress,
                           double* tangent, double* drive, double* growth, double* energy, double* dissipated,
                           int32_t* status);
/* Contacts with sides of bodies that others cover: see detection/seams.f90. Contacts come in runs of one pair and one
 * normal, and runs stand with both of their contactors: those of contactor i from start[i] to start[i + 1] in entry,
 * each the number of the run times 2, and 1 where the contactor is B. verdict and turned (dim) are of each entry. */
enum cairn_seam_shape {
  cairn_seam_ball,
  cairn_seam_hull,
  cairn_seam_bar,
  cairn_seam_capsule,
  cairn_seam_cylinder,
  cairn_seam_superquadric,
  cairn_seam_half_space,
  cairn_seam_facet,
  cairn_seam_other
};
typedef struct cairn_seams {
  int32_t dim, periodic;
  const int16_t* shape;    /* (contactors) */
  const int32_t* seen;     /* (shapes) enum cairn_seam_shape */
  const double* centre;    /* (dim, contactors) [m] */
  const double* radius;    /* (contactors) [m] */
  const double* direction; /* (dim + 1, contactors) unit, then half length [m]; null: nothing has one */
  const double* vectors;   /* (3, 3) of the periodic cell, in columns [m] */
  cairn_hulls hulls;
  const int32_t *a, *b, *image;  /* (contacts) */
  const double* gap;             /* (contacts) [m] */
  const double *normal, *point;  /* (dim, contacts) [-], [m] */
  const int64_t* run;            /* (runs + 1) first contacts of the runs */
  const int32_t* body;           /* (contactors) negative: of a mesh */
  const double* position;        /* (dim, bodies) [m] */
  const double *velocity, *free; /* (3 | 6, bodies) now, and at the end of the step without contacts [m/s rad/s] */
} cairn_seams;
enum cairn_seam_verdict { cairn_seam_stays = 0, cairn_seam_none = 1, cairn_seam_turned = 2 };
void cairn_seam_closing(const cairn_seams* given, int64_t first, int64_t last, int8_t* closing);
void cairn_seam_contacts(const cairn_seams* given, int32_t first, int32_t last, const int32_t* start,
                         const int32_t* entry, const int8_t* closing, int8_t* verdict, double* turned);

#ifdef __cplusplus
}
#endif
#endif
