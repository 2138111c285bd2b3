/* Kernels of smooth scenes with bodies of unequal moments of inertia, and with laws that give moments. */
#ifndef CAIRN_SMOOTH_BODIES_H
#define CAIRN_SMOOTH_BODIES_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

void cairn_uneven_begin(int64_t n, const int64_t* body, double h, const double* inertia, const double* contact_force,
                        const double* rotation, double* velocity, double* angular_momentum, double* turned,
                        double* fastest, int64_t* unsolved, const double* force, const double* damping,
                        const int8_t* driven);
void cairn_uneven_end(int64_t n, const int64_t* body, double h, const double* inertia, const double* contact_force,
                      const double* rotation, const double* turned, double* velocity, double* angular_momentum,
                      int64_t* wrong, const double* force, const double* damping, const int8_t* driven,
                      double* reaction, double* terms);
void cairn_verlet_works(int32_t dim, int32_t nd, int64_t first, int64_t last, int32_t second, double h,
                        const double* gravity, const double* inverse_mass, const double* contact_force,
                        const double* velocity, double* terms, const double* force, const double* damping,
                        const int8_t* driven, const double* driven_velocity);
void cairn_verlet_works_spheres(int64_t first, int64_t last, int32_t second, double h, const double* gravity,
                                const double* inverse_mass, const double* contact_force, const double* velocity,
                                double* terms);
double cairn_verlet_speed(int32_t dim, int32_t nd, int64_t first, int64_t last, const double* velocity);
double cairn_uneven_kinetic(int64_t n, const int64_t* body, const double* velocity, const double* angular_momentum);
void cairn_local_damping(int32_t dim, int32_t nd, int64_t first, int64_t last, double h, double share,
                         const double* gravity, const double* mass, const double* velocity, double* contact_force,
                         double* spent, const double* force, const int8_t* driven);
void cairn_smooth_spins(int32_t dim, int32_t n, int32_t m, const int32_t* lane, const int32_t* body_a,
                        const int32_t* body_b, const double* velocity, const double* frame, double* spin);
void cairn_smooth_moments(int32_t dim, int32_t n, int32_t count, int32_t m, const int32_t* lane, const int32_t* body_a,
                          const int32_t* body_b, const double* frame, const double* moment, double* lane_moment,
                          double* force, double* other);
void cairn_clump_records(int64_t first, int64_t last, const int32_t* body, const double* centre, const double* radius,
                         const double* grain, const double* position, const double* velocity, double* record,
                         double* offset);
void cairn_sphere_gather_states(int32_t n, const int32_t* body_a, const int32_t* body_b, const double* record,
                                double reach, double h, int32_t scalars, int32_t vectors, int32_t states,
                                double* stored, int8_t* active, int32_t* lane, int32_t* count, int32_t* filled,
                                double* frame, double* arm, double* u, double* gap, double* geometry, double* state);
void cairn_sphere_scatter_states(int32_t n, int32_t count, int32_t m, const int32_t* lane, const int32_t* body_a,
                                 const int32_t* body_b, const double* frame, const double* arm, const double* f,
                                 int32_t scalars, int32_t vectors, int32_t states, const double* state, double* stored,
                                 double* lane_force, double* force, double* other, const double* moment,
                                 double* lane_moment, const int32_t* a, const int32_t* b, const double* offset);

#ifdef __cplusplus
}
#endif
#endif
