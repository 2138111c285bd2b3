/* What integrators fill, and what they keep of a step: a part of core.h. */
#ifndef CAIRN_INTEGRATORS_H
#define CAIRN_INTEGRATORS_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { cairn_most_history = 4 }; /* derivatives of the displacement that a scheme may keep, from the second on */
/* A step as a linear map, see linear_scheme.f90; update by columns. */
typedef struct cairn_scheme {
  double h, impulse, end_share, implicit, damping, stiffness, share, elastic_velocity;
  double position[cairn_most_history], velocity[cairn_most_history], elastic[cairn_most_history],
      damping_history[cairn_most_history];
  double update[cairn_most_history * cairn_most_history], gain[cairn_most_history];
  double largest;
  int32_t histories, by_energy;
} cairn_scheme;
typedef void cairn_integrator(double h, const double* params, cairn_scheme* scheme);
/* a2 to a5: history, NULL beyond what the scheme keeps. */
void cairn_gear_predict(int32_t dim, int32_t nd, int64_t first, int64_t last, const cairn_scheme* scheme,
                        double* velocity, double* position, double* fastest, const double* a2, const double* a3,
                        const double* a4, const double* a5, double* angle, const int8_t* driven,
                        const double* driven_velocity);
void cairn_gear_correct(int32_t dim, int32_t nd, int64_t first, int64_t last, const cairn_scheme* scheme,
                        const double* gravity, const double* inverse_mass, const double* contact_force,
                        double* velocity, double* position, int64_t* wrong, double* farthest, double* a2, double* a3,
                        double* a4, double* a5, double* angle, const double* force, const double* damping,
                        const int8_t* driven, const double* driven_velocity, double* reaction, double* terms);
void cairn_history_velocity(int32_t nd, int64_t nb, const cairn_scheme* scheme, int32_t k, const double* derivative,
                            const double* inverse_mass, double* velocity_free, const double* damping);
void cairn_smooth_change(int32_t dim, int32_t nd, int64_t nb, const cairn_scheme* scheme, const double* gravity,
                         const double* mass, const double* inertia, const double* velocity_begin,
                         const double* velocity, double* change, const double* a2, const double* a3, const double* a4,
                         const double* a5, const double* force, const double* damping, const int8_t* driven);
void cairn_history_way(int32_t nd, int64_t nb, const cairn_scheme* scheme, const double* velocity_begin,
                       const double* velocity, const double* change, double* way, const double* a2, const double* a3,
                       const double* a4, const double* a5);
void cairn_history_update(int32_t dim, int32_t nd, int64_t nb, const cairn_scheme* scheme, const double* change,
                          const double* inertia, double* a2, double* a3, double* a4, double* a5);
void cairn_history_start(int32_t dim, int32_t nd, int64_t nb, const int8_t* known, const double* gravity,
                         const double* mass, const double* inertia, const double* velocity, double* a2, double* a3,
                         double* a4, double* a5, const double* force, const double* damping, const int8_t* driven);

#ifdef __cplusplus
}
#endif
#endif
