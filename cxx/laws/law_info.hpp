// Contact laws as the list declares them: parameters, state and kernels.
#pragma once
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "cairn/core.h"

namespace cairn {

// Rows of laws.def, in its order; their names stand in laws/law_names.hpp.
enum class Law : std::int16_t;

// Row of laws.def, read once.
struct LawParameter {
  std::string name;
  bool required = false; // no default
  double standard = 0, smallest = 0, largest = 0;
};
struct LawInfo {
  std::string name, python_name;
  int components2 = 0, components3 = 0;
  std::vector<LawParameter> parameters;
  std::vector<std::string> state;  // "name*": a vector in the tangent plane
  std::vector<double> state_begin; // of a contact that is new
  bool has_prepare = false, has_solve = false, has_commit = false;
  bool normal_bias = false; // no bias of tangential velocities
  bool yields = false;      // may have a compliance: its contacts keep room for one
  // A pair stays a contact while its first state variable is above 0, which is 1 where bodies came in together and
  // touched; holds: it is then held fast, and under Coulomb's cone, with the first parameter, where it is 0.
  bool keeps = false, holds = false;
  // Where bodies with sides are kept, it is at points that they carry: along the normal there, or along the line
  // between.
  bool anchored = false, joins = false, spans = false;
  // Rows of law_traits.def.
  bool sheds_overlap = false, brittle_face = false, attracts = false, bonds = false, holds_broken = false;
  bool keeps_area = false; // as the state "area": solve and residual ask for no geometry in params
  // The parameter that says up to which gap the law acts, "reach", or a place from which it counts; -1: none.
  int reach = -1;
  bool reaches_back = false; // that parameter times -1
  int within = -1;           // the parameter "within": a gap up to which bodies that come in together touch; -1: none
  cairn_law_prepare* prepare = nullptr;
  cairn_law_solve* solve = nullptr;
  cairn_law_commit* commit = nullptr;
  cairn_law_residual* residual = nullptr; // with solve: how far from it
  cairn_law_energy* energy = nullptr;
  cairn_law_force* force = nullptr; // serves smooth strategies, as prepare serves NSCD
  cairn_law_stiffness* stiffness = nullptr;
  // Laws from a user's library only: its path, whether threads may call it at once, its message after a failure.
  std::string library;
  bool thread_safe = true;
  const char* (*complaint)() = nullptr;
  bool plugged() const { return !library.empty(); }
  double acts_from(const double* params) const { // a gap [m]
    return reach < 0 ? 0 : std::max(0.0, reaches_back ? -params[reach] : params[reach]);
  }
  // Numbers of the state as the law sees it, and as it is kept: vectors in space axes.
  int state_columns(int dim) const { return state_numbers(dim - 1); }
  int state_kept(int dim) const { return state_numbers(dim == 2 ? 1 : 3); }
  int state_numbers(int of_vector) const {
    int all = 0;
    for (const std::string& name : state) all += name.back() == '*' ? of_vector : 1;
    return all;
  }
  // Where a state variable begins among the columns that the law sees; -1: it has none of that name.
  int state_column(const std::string& variable, int dim) const {
    int column = 0;
    for (const std::string& name : state) {
      if (name == variable) return column;
      column += name.back() == '*' ? dim - 1 : 1;
    }
    return -1;
  }
  int components(int dim) const { return dim == 2 ? components2 : components3; }
};
// Rows of laws.def, then the laws that were plugged in, in their order. References stay valid.
const std::vector<LawInfo>& law_infos();
// Adds a law, or replaces the one of the same name if `replace` says so. Throws std::invalid_argument.
Law register_law(LawInfo law, bool replace);
// Parameters "name:default:smallest:largest" and state "name:value of a new contact", separated by blanks.
// Throws std::invalid_argument for a word that cannot be read.
void declare_law(LawInfo& law, const std::string& parameters, const std::string& state);

} // namespace cairn
