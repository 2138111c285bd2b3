/* Kernels of contacts with sides of bodies that others cover. */
#ifndef CAIRN_SEAMS_H
#define CAIRN_SEAMS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

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
  double step;                   /* [s] */
} cairn_seams;
enum cairn_seam_motion { cairn_seam_slow = -1, cairn_seam_by_forces = 1, cairn_seam_by_speed = 2 };
enum cairn_seam_verdict { cairn_seam_stays = 0, cairn_seam_none = 1, cairn_seam_turned = 2 };
void cairn_seam_closing(const cairn_seams* given, int64_t first, int64_t last, int8_t* closing, double* speed);
void cairn_seam_contacts(const cairn_seams* given, int32_t first, int32_t last, const int32_t* start,
                         const int32_t* entry, const int8_t* closing, const double* speed, int8_t* verdict,
                         double* turned);

#ifdef __cplusplus
}
#endif
#endif
