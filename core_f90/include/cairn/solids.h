/* Solids whose law is a batch over Gauss points: a part of core.h. */
#ifndef CAIRN_SOLIDS_H
#define CAIRN_SOLIDS_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Symmetric tensors are 11 22 33 12 23 13, strains with twice their shear. A material gets the strain (6, n) of a
 * measure, and gives the stress (6, n) conjugate to it and its derivative (6, 6, n); or the gradient of displacement
 * (3, 3, n), and gives the first Piola-Kirchhoff stress (3, 3, n) and its derivative by F (3, 3, 3, 3, n). status (n):
 * 0, 1 a volume is not positive, 2 no solution at the point, 3 its cell is too large, 4 it has softened to nothing.
 * length (n) of the cells [m]. */
typedef void cairn_bulk_material(int64_t n, double h, double theta, const double* params, const double* length,
                                 const double* measure, const double* state_begin, double* state, double* stress,
                                 double* tangent, double* energy, double* dissipated, int32_t* status);
/* measure: 0 linear, 1 Biot, 2 Green, 3 Hencky. */
void cairn_strain_measure(int32_t measure, int64_t n, const double* gradient, double* strain, int32_t* status);
void cairn_stress_of_measure(int32_t measure, int64_t n, const double* gradient, const double* stress,
                             const double* tangent, int32_t want, double* piola, double* by_gradient);
/* Laws that give Cauchy's stress by increments: strain (6, n) and rotation (3, 3, n) of a step from F - 1 at both ends,
 * and P with its derivative from the stress and the moduli (6, 6, n) of Jaumann's rate; see jaumann_rate.f90. */
void cairn_step_strain(int64_t n, const double* begin, const double* end, double* change, double* rotation,
                       int32_t* status);
void cairn_stress_of_rate(int64_t n, const double* gradient, const double* stress, const double* moduli, int32_t want,
                          double* piola, double* by_gradient);
/* n cells; plane: 0 strain, 1 stress, 2 axisymmetric round y; mean dilatation: 0 none, 1 small, 2 finite strain, 3, 4
 * linear over the cell. x, u (dim, nodes, n), d (dim, nodes, points, n), hoop (nodes, points, n), h (3, 3, points, n),
 * volume, status (points, n), share (points, points, n) of a linear dilatation alone. */
void cairn_solid_gradients(int32_t dim, int32_t plane, int32_t mean, int32_t nodes, int32_t points, const double* value,
                           const double* gradient, const double* weight, double thickness, int64_t n, const double* x,
                           const double* u, double* d, double* hoop, double* h, double* h_bar, double* volume,
                           double* share, int32_t* status);
void cairn_solid_forces(int32_t dim, int32_t plane, int32_t mean, int32_t nodes, int32_t points, int64_t n,
                        const double* d, const double* hoop, const double* h, const double* volume, const double* share,
                        const double* piola, const double* tangent, int32_t want, double* force, double* stiffness);
/* At most eight cells of Hooke's law and small strains: half (8, entries of the lower triangle), stress
 * (6, points, n). */
void cairn_linear_cells(int32_t dim, int32_t nodes, int32_t points, const double* gradient, const double* weight,
                        double thickness, double lambda, double shear, double across, int64_t n, const double* x,
                        const double* u, int32_t want, double* force, double* half, double* stress, double* energy,
                        int32_t* status);
/* Stress whose work over a step is the change of energy: R - 1 where the law is asked, then P and its derivative. */
void cairn_middle_stretch(int64_t n, const double* begin, const double* end, double* middle);
void cairn_stress_by_energy(int64_t n, const double* begin, const double* end, const double* middle,
                            const double* energy_begin, const double* energy_end, int32_t want, double* piola,
                            double* tangent);
/* Stretches (3, 3, n) at which laws have the stress (6, n), 11 22 33 12 13 23, of a body before it moves; see
 * initial_stress.f90. */
void cairn_stretch_of_stress(int32_t large, int64_t n, const double* stress, const double* piola,
                             const double* by_gradient, double* stretch, double* left);
void cairn_with_prestretch(int32_t large, int64_t n, const double* stretch, double* gradient);
void cairn_without_prestretch(int32_t large, int64_t n, const double* stretch, double* piola, int32_t want,
                              double* by_gradient, double* energy, double* dissipated);
void cairn_thickness_strain(int64_t n, const double* piola, double* tangent, double* h, int64_t* left);
void cairn_true_stress(int32_t finite, int64_t n, const double* h, const double* piola, double* stress);

#ifdef __cplusplus
}
#endif
#endif
