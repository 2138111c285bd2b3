// The routines of LAPACK and BLAS that are called, as Fortran compilers name them.
#pragma once
#include <cstddef>

extern "C" {
void dpotrf_(const char* triangle, const int* n, double* a, const int* stride, int* info, std::size_t);
void dpbtrf_(const char* triangle, const int* n, const int* half, double* a, const int* stride, int* info, std::size_t);
void dsyev_(const char* job, const char* triangle, const int* n, double* a, const int* stride, double* eigenvalues,
            double* work, const int* size, int* info, std::size_t, std::size_t);
void dsterf_(const int* n, double* diagonal, double* beside, int* info);
// its address alone is taken, to find the library that all others are in
void dgemm_(const char*, const char*, const int*, const int*, const int*, const double*, const double*, const int*,
            const double*, const int*, const double*, double*, const int*, std::size_t, std::size_t);
}
