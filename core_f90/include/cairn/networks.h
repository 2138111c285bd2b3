/* What conductances of contacts read and give, oxide films, solids that swell: a part of core.h. */
#ifndef CAIRN_NETWORKS_H
#define CAIRN_NETWORKS_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Conductances of contacts [S | W/K], rows of networks.def; contact (n, columns): see module contact_spot [SI]. */
enum cairn_contact_column {
  cairn_column_gap,
  cairn_column_force,
  cairn_column_radius,
  cairn_column_modulus,
  cairn_column_conductivity_a,
  cairn_column_conductivity_b,
  cairn_column_hardness,
  cairn_column_area,
  cairn_column_intact,
  cairn_column_depth,
  cairn_contact_columns
};
typedef void cairn_conductance(int32_t n, const double* contact, int32_t parameters, const double* params,
                               double* conductance);
void cairn_film_conductance(int64_t n, double film, const double* clean, const int8_t* broken, double* conductance);
void cairn_film_break(int64_t n, double power, double ratio, const double* radius, const double* force,
                      const double* conductance, const double* current, int8_t* broken, int64_t* switched);
/* What free strains do to gradients and stresses of solids, see swelling.f90. */
void cairn_without_swelling(int32_t large, int64_t n, const double* free, double* gradient);
void cairn_with_swelling(int32_t large, int64_t n, const double* free, double* gradient, double* piola, int32_t want,
                         double* by_gradient, double* energy, double* dissipated);

#ifdef __cplusplus
}
#endif
#endif
