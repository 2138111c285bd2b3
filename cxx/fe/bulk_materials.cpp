#include "bulk_materials.hpp"

#include <cmath>
#include <map>
#include <sstream>

#include "../base/call.hpp"
#include "cairn/rows/bulk_material.h"
#include "shared_damage.hpp"

namespace cairn {
namespace {

BulkMaterialInfo declared(const char* name, const char* python, const char* given, const char* parameters,
                          const char* state, bool symmetric, cairn_bulk_material* kernel) {
  BulkMaterialInfo m;
  m.name = name;
  m.python_name = python;
  m.takes_gradient = std::string(given) == "gradient";
  m.symmetric = symmetric;
  m.kernel = kernel;
  std::istringstream words(parameters);
  for (std::string word; words >> word;) {
    std::istringstream parts(word);
    std::string part[4];
    for (std::string& p : part) std::getline(parts, p, ':');
    m.parameters.push_back(
        {part[0], part[1].empty(), part[1].empty() ? 0 : std::stod(part[1]), std::stod(part[2]), std::stod(part[3])});
  }
  std::istringstream states(state);
  for (std::string word; states >> word;) m.state.push_back(word);
  return m;
}

std::vector<BulkMaterialInfo>& all() {
  static std::vector<BulkMaterialInfo> rows = [] {
    std::vector<BulkMaterialInfo> made;
    made.reserve(256); // so that references stay valid
#define CAIRN_BULK_MATERIAL(name, python, given, parameters, state, symmetric)                                         \
  made.push_back(declared(#name, #python, #given, parameters, state, symmetric != 0, cairn_bulk_##name));
#include "../../core_f90/bulk_materials/bulk_materials.def"
#undef CAIRN_BULK_MATERIAL
    return made;
  }();
  return rows;
}

// Rows of UMATs by the names that they have now: a routine that takes a name leaves the row that had it to the meshes
// that are there, whose states are as many as that has.
std::map<std::string, std::size_t>& plugged() {
  static std::map<std::string, std::size_t> rows;
  return rows;
}

} // namespace

const std::vector<BulkMaterialInfo>& bulk_material_infos() { return all(); }

const BulkMaterialInfo& bulk_material_named(const std::string& name) {
  if (const auto at = plugged().find(name); at != plugged().end()) return all()[at->second];
  std::string known;
  for (const BulkMaterialInfo& m : all()) {
    if (m.umat) continue;
    if (m.name == name || m.python_name == name) return m;
    known += (known.empty() ? "" : ", ") + m.name;
  }
  for (const auto& [umat, row] : plugged()) known += ", " + umat;
  throw Error("there is no material of solids '" + name + "'; there are " + known);
}

const BulkMaterialInfo& register_umat(const std::string& name, UmatRoutine* routine, int states,
                                      const std::string& library, bool plane_stress, double time_limit) {
  if (name.empty() || name.size() > 80) throw Error("the name of a UMAT has 1 to 80 characters: give a shorter one");
  if (states < 0) throw Error("a UMAT has " + std::to_string(states) + " states: give a whole number >= 0");
  BulkMaterialInfo m;
  m.name = m.python_name = name;
  m.symmetric = false;
  m.umat = routine;
  m.plane_stress = plane_stress;
  m.library = library;
  m.time_limit = time_limit;
  // what Abaqus keeps between increments: stress, strain, gradient of displacement, time, energies, how many there were
  for (int k = 1; k <= 6; ++k) m.state.push_back("stress" + std::to_string(k));
  for (int k = 1; k <= 6; ++k) m.state.push_back("strain" + std::to_string(k));
  for (int k = 1; k <= 9; ++k) m.state.push_back("gradient" + std::to_string(k));
  m.state.insert(m.state.end(), {"time", "elastic", "plastic", "creep", "increment"});
  for (int k = 1; k <= states; ++k) m.state.push_back("statev" + std::to_string(k));
  for (std::size_t row = 0; row < all().size(); ++row) {
    const BulkMaterialInfo& known = all()[row];
    if (known.name != name && known.python_name != name) continue;
    if (!known.umat) throw Error("'" + name + "' is a material of the list: give the UMAT another name");
    if (known.umat != routine || known.state.size() != m.state.size() || known.library != library ||
        known.plane_stress != plane_stress || known.time_limit < time_limit || known.time_limit > time_limit)
      continue;
    plugged()[name] = row; // it is the same again
    return all()[row];
  }
  if (all().size() == all().capacity()) throw Error("there are too many materials: at most 256");
  all().push_back(m);
  plugged()[name] = all().size() - 1;
  return all().back();
}

std::vector<double> bulk_parameters(const BulkMaterialInfo& material, std::span<const std::string> names,
                                    std::span<const double> values) {
  std::vector<double> out;
  std::string known;
  for (const BulkParameter& p : material.parameters) {
    known += (known.empty() ? "" : ", ") + p.name;
    double value = p.standard;
    bool given = false;
    for (std::size_t k = 0; k < names.size(); ++k)
      if (names[k] == p.name) value = values[k], given = true;
    std::ostringstream range;
    range << p.smallest << " to " << p.largest;
    if (!given && p.required)
      throw Error(material.python_name + " needs " + p.name + ": give a value from " + range.str());
    if (!(value >= p.smallest && value <= p.largest))
      throw Error(p.name + " of " + material.python_name + " is " + std::to_string(value) + ": give a value from " +
                  range.str());
    out.push_back(value);
  }
  for (const std::string& name : names) {
    bool fits = false;
    for (const BulkParameter& p : material.parameters) fits = fits || p.name == name;
    if (!fits)
      throw Error(std::string(material.python_name)
                      .append(" has no parameter '")
                      .append(name)
                      .append("'; it has ")
                      .append(known));
  }
  return out;
}

DamageOfCells* damage_of_cells() { return cairn_damage_of_cells; }

} // namespace cairn
