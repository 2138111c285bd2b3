// Materials of solids: rows of bulk_materials.def with their kernels, then those that users' libraries brought.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "cairn/core.h"

namespace cairn {

struct BulkParameter {
  std::string name;
  bool required = false; // no default
  double standard = 0, smallest = 0, largest = 0;
};

// A routine of Abaqus's interface UMAT, as Fortran compilers call it.
using UmatRoutine = void(double* stress, double* state, double* tangent, double* elastic, double* plastic,
                         double* creep, double* heat, double* stress_by_temperature, double* heat_by_strain,
                         double* heat_by_temperature, const double* strain, const double* strain_change,
                         const double* time, const double* dt, const double* temperature,
                         const double* temperature_change, const double* field, const double* field_change,
                         const char* name, const int* direct, const int* shear, const int* components,
                         const int* states, const double* params, const int* parameters, const double* place,
                         const double* rotation, double* new_dt, const double* length, const double* gradient_begin,
                         const double* gradient, const int* cell, const int* point, const int* layer,
                         const int* section, const int* step, const int* increment, std::size_t name_length);

struct BulkMaterialInfo {
  std::string name, python_name;
  bool takes_gradient = false; // of deformation; else a strain
  std::vector<BulkParameter> parameters;
  std::vector<std::string> state;
  bool symmetric = true;
  cairn_bulk_material* kernel = nullptr;
  // Routine of a user's library; takes any number of parameters, and states of its own beside those of the call.
  UmatRoutine* umat = nullptr;
  bool plane_stress = false; // routine for plane stress: two direct stresses; finds the strain across
  double time_limit = 0;     // of a call in a process of its own [s]; 0: it is called in this one
  std::string library;
};
// References stay valid.
const std::vector<BulkMaterialInfo>& bulk_material_infos();
const BulkMaterialInfo& bulk_material_named(const std::string& name); // throws Error with those that there are
const BulkMaterialInfo& register_umat(const std::string& name, UmatRoutine* routine, int states,
                                      const std::string& library, bool plane_stress, double time_limit = 0);
// Parameters in their order from those given by name; throws Error naming parameter, value and range.
std::vector<double> bulk_parameters(const BulkMaterialInfo& material, std::span<const std::string> names,
                                    std::span<const double> values);

} // namespace cairn
