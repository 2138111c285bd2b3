// Matrices of a mesh from its elements, and the sides of its boundary.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "../base/call.hpp"
#include "../bodies/rigid_motion.hpp"
#include "../meshes/mortar_surface.hpp"
#include "mesh_parts.hpp"

namespace cairn {
const ElementInfo& element_named(const std::string& name) {
  std::string known;
  for (const ElementInfo& e : element_infos()) {
    if (name == e.name || name == e.cell) return e;
    known += std::string(known.empty() ? "" : ", ") + e.name;
  }
  throw Error("there is no element '" + name + "'; there are " + known);
}

std::vector<double> isotropic(int dim, double young, double poisson, bool plane_stress) {
  if (!(young > 0) || !std::isfinite(young))
    throw Error("young is " + std::to_string(young) + "; give a finite modulus > 0 [Pa]");
  const bool flat = dim == 2 && plane_stress;
  if (!(poisson > -1 && (poisson < 0.5 || (flat && poisson <= 0.5))))
    throw Error("poisson is " + std::to_string(poisson) + "; give a value above -1 and below 1/2");
  const double shear = young / (2 * (1 + poisson));
  const double lame =
      flat ? young * poisson / (1 - poisson * poisson) : young * poisson / ((1 + poisson) * (1 - 2 * poisson));
  const int size = 3 * dim - 3;
  std::vector<double> out(std::size_t(size * size), 0.0);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; i < dim && j < dim; ++j) out[i * size + j] = lame;
    out[i * size + i] += i < dim ? 2 * shear : shear;
  }
  return out;
}

void MeshDraft::check_node(std::int64_t node) const {
  if (node < 0 || node >= nodes())
    throw Error("there is no node " + std::to_string(node) + "; there are " + std::to_string(nodes()) +
                ", counted from 0");
}

void MeshDraft::add_elastic(const std::string& element, std::int64_t n, const std::int32_t* node, double young,
                            double poisson, double density, bool plane_stress, double thickness) {
  const ElementInfo& e = element_named(element);
  if (e.dim != dim)
    throw Error(std::string(e.name) + " cells have " + std::to_string(e.dim) + " dimensions, the mesh " +
                std::to_string(dim));
  if (!(density > 0) || !std::isfinite(density))
    throw Error("density is " + std::to_string(density) + "; give a finite number > 0 [kg/m3]");
  if (dim == 2 && (!(thickness > 0) || !std::isfinite(thickness)))
    throw Error("thickness is " + std::to_string(thickness) + "; give a finite length > 0 [m]");
  const double t = dim == 2 ? thickness : 1;
  Cells added{&e, {node, node + e.nodes * n}, isotropic(dim, young, poisson, plane_stress), density * t, {}};
  for (double& a : added.elasticity) a *= t;
  added.solid.params = {young, poisson};
  added.solid.plane = plane_stress ? Plane::stress : Plane::strain;
  added.solid.thickness = t;
  for (const std::int32_t i : added.node) check_node(i);
  cells.push_back(std::move(added));
}

namespace {

template <class E>
E choice(const std::string& what, const std::string& given, std::initializer_list<std::pair<const char*, E>> known) {
  std::string names;
  for (const auto& [name, value] : known) {
    if (given == name) return value;
    names.append(names.empty() ? "" : ", ").append(name);
  }
  throw Error(what + " is '" + given + "'; give one of " + names);
}

Plane plane_named(const std::string& name) {
  return choice<Plane>("plane", name,
                       {{"strain", Plane::strain}, {"stress", Plane::stress}, {"axisymmetric", Plane::axisymmetric}});
}

} // namespace

void MeshDraft::add_solid(const std::string& element, std::int64_t n, const std::int32_t* node,
                          const std::string& material, std::span<const std::string> names,
                          std::span<const double> values, double density, const std::string& kinematics,
                          const std::string& plane, bool mean_dilatation, double thickness) {
  const BulkMaterialInfo& law = bulk_material_named(material);
  add_elastic(element, n, node, 1, 0, density, false, thickness);
  Cells& added = cells.back();
  added.solid.element = added.element;
  added.solid.material = &law;
  added.solid.params =
      law.umat ? std::vector<double>(values.begin(), values.end()) : bulk_parameters(law, names, values);
  added.solid.kinematics = choice<Kinematics>("kinematics", kinematics,
                                              {{"small", Kinematics::small},
                                               {"corotational", Kinematics::corotational},
                                               {"total_lagrangian", Kinematics::total_lagrangian},
                                               {"logarithmic", Kinematics::logarithmic}});
  added.solid.plane = plane_named(plane);
  if (dim == 2 && added.solid.plane == Plane::axisymmetric) added.density = density; // of the way round, not of a slice
  added.solid.mean_dilatation = mean_dilatation;
}

void MeshDraft::set_initial_stress(std::int64_t n, const double* stress) {
  std::int64_t of_cells = 0, of_points = 0;
  for (const Cells& c : cells) {
    of_cells += std::int64_t(c.node.size()) / c.element->nodes;
    of_points += std::int64_t(c.node.size()) / c.element->nodes * c.element->bulk_points;
  }
  if (n != of_cells && n != of_points)
    throw Error("stress is of " + std::to_string(n) + " cells; give that of the " + std::to_string(of_cells) +
                " cells of the mesh, or of their " + std::to_string(of_points) + " points");
  for (Cells& c : cells) {
    const int points = c.element->bulk_points, each = n == of_cells ? points : 1;
    const std::int64_t count = std::int64_t(c.node.size()) / c.element->nodes;
    c.solid.initial_stress.clear();
    for (std::int64_t p = 0; p < count * points; p += each, stress += 6)
      for (int k = 0; k < each; ++k) c.solid.initial_stress.insert(c.solid.initial_stress.end(), stress, stress + 6);
  }
}

std::vector<double> MeshDraft::stress_points() const {
  std::vector<double> out;
  for (const Cells& c : cells) {
    const ElementInfo& e = *c.element;
    std::vector<double> xi(std::size_t(dim * e.bulk_points)), weight(std::size_t(e.bulk_points)),
        value(std::size_t(e.nodes)), unused(std::size_t(dim * e.nodes));
    e.bulk_rule(xi.data(), weight.data());
    for (std::size_t first = 0; first < c.node.size(); first += std::size_t(e.nodes))
      for (int p = 0; p < e.bulk_points; ++p) {
        e.shape(&xi[std::size_t(dim * p)], value.data(), unused.data());
        for (int k = 0; k < dim; ++k) {
          double at = 0;
          for (int a = 0; a < e.nodes; ++a)
            at += value[std::size_t(a)] * reference[std::size_t(dim * c.node[first + std::size_t(a)] + k)];
          out.push_back(at);
        }
      }
  }
  return out;
}

double MeshDraft::initial_force(std::vector<double>& force) const {
  const auto stressed = [](const Cells& c) { return !c.solid.initial_stress.empty(); };
  if (bulk() || std::none_of(cells.begin(), cells.end(), stressed)) return 0;
  const std::shared_ptr<BulkModel> model = all_cells();
  const std::vector<double> none(reference.size(), 0.0);
  force.resize(reference.size());
  const BulkResult found = model->evaluate(none.data(), 1, 1, force.data(), nullptr);
  if (!found.ok()) throw Error(model->told(found) + ", at the start");
  return found.energy;
}

std::shared_ptr<BulkModel> MeshDraft::bulk() const {
  if (std::none_of(cells.begin(), cells.end(), [](const Cells& c) { return c.solid.material != nullptr; })) return {};
  return all_cells();
}

std::shared_ptr<BulkModel> MeshDraft::all_cells() const {
  std::vector<BulkCells> all;
  for (const Cells& c : cells) {
    all.push_back(c.solid);
    all.back().element = c.element;
    all.back().node = c.node;
    if (!c.solid.material) all.back().material = &bulk_material_named("isotropic_elastic");
  }
  return std::make_shared<BulkModel>(dim, reference, std::move(all));
}

void MeshDraft::take_called(std::shared_ptr<CalledForces> forces, const double* on_pattern, const double* of_nodes) {
  SparseMatrix m = forces->lower();
  forces->fit(m);
  SparseMatrix k = m, c = m;
  if (on_pattern) forces->add(on_pattern, m.value.data());
  for (std::int64_t i = 0; i < m.n && of_nodes; ++i) m.value[std::size_t(m.start[std::size_t(i)])] = of_nodes[i / dim];
  forces->find_stiffness(k);
  mass = std::move(m);
  stiffness = std::move(k);
  damping = std::move(c);
  called = std::move(forces);
}

void MeshDraft::take_sides(std::span<const std::int32_t> given, const std::string& plane, double across) {
  if (!called)
    throw Error("sides are of a mesh whose forces another code finds: give these first, by calls or a library");
  if (!(across > 0) || !std::isfinite(across))
    throw Error("thickness is " + std::to_string(across) + "; give a finite number > 0 [m]");
  const bool round = plane_named(plane) == Plane::axisymmetric && dim == 2;
  const std::int64_t n = mass.n;
  std::vector<std::vector<std::int32_t>> more(static_cast<std::size_t>(n)); // rows of columns
  for (std::size_t s = 0; s < given.size(); s += 4)
    for (const std::int32_t one : given.subspan(s, 4))
      for (const std::int32_t two : given.subspan(s, 4))
        for (int k = 0; k < dim * dim && one >= 0 && two >= 0; ++k) {
          const std::int32_t row = dim * one + k % dim, column = dim * two + k / dim;
          if (row > column && place_of(mass, row, column) < 0) more[std::size_t(column)].push_back(row);
        }
  for (SparseMatrix* m : {&mass, &stiffness, &damping}) {
    SparseMatrix wide;
    wide.n = n;
    wide.start = {0};
    for (std::int64_t c = 0; c < n; ++c) {
      std::map<std::int32_t, double> column;
      for (const std::int32_t row : more[std::size_t(c)]) column[row] = 0;
      for (std::int64_t e = m->start[c]; e < m->start[c + 1]; ++e) column[m->row[e]] = m->value[e];
      for (const auto& [row, value] : column) wide.row.push_back(row), wide.value.push_back(value);
      wide.start.push_back(std::int64_t(wide.row.size()));
    }
    *m = std::move(wide);
  }
  called->fit(mass);
  sides.assign(given.begin(), given.end());
  ring = round;
  thickness = dim == 2 && !ring ? across : 1;
}

std::vector<std::int32_t> MeshDraft::boundary() const {
  if (!sides.empty()) return sides;
  std::map<CellSide, int> times;
  std::vector<CellSide> all, keys;
  for (const Cells& c : cells) {
    const std::vector<CellSide>& sides = sides_of(*c.element);
    for (std::size_t first = 0; first < c.node.size(); first += c.element->nodes)
      for (const CellSide& local : sides) {
        CellSide side = local;
        for (std::int32_t& i : side)
          if (i >= 0) i = c.node[first + std::size_t(i)];
        all.push_back(side);
        std::sort(side.begin(), side.end());
        keys.push_back(side);
        ++times[side];
      }
  }
  std::vector<std::int32_t> out;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (times[keys[i]] == 1) out.insert(out.end(), all[i].begin(), all[i].end());
  return out;
}

std::vector<std::int32_t> MeshDraft::whole_sides(std::span<const std::int32_t> pieces) const {
  const auto second = [](const Cells& c) { return c.element->order > 1; };
  if (pieces.empty() || std::none_of(cells.begin(), cells.end(), second)) return {};
  std::vector<std::int32_t> out(pieces.size() / 4 * most_side_nodes, -1);
  std::map<CellSide, std::vector<std::size_t>> places; // by the nodes of a piece, in their order; a face has two halves
  for (std::size_t i = 0; i < pieces.size() / 4; ++i) {
    CellSide key;
    std::copy_n(&pieces[4 * i], 4, key.begin());
    std::copy(key.begin(), key.end(), &out[most_side_nodes * i]);
    std::sort(key.begin(), key.end());
    places[key].push_back(i);
  }
  for (const Cells& c : cells) {
    if (!second(c)) continue;
    const std::vector<WholeSide> wholes = whole_sides_of(*c.element);
    for (std::size_t first = 0; first < c.node.size(); first += std::size_t(c.element->nodes))
      for (const WholeSide& whole : wholes)
        for (CellSide piece : whole.pieces) {
          for (std::int32_t& i : piece)
            if (i >= 0) i = c.node[first + std::size_t(i)];
          std::sort(piece.begin(), piece.end());
          const auto found = places.find(piece);
          if (found == places.end()) continue;
          for (const std::size_t at : found->second)
            for (std::size_t k = 0; k < whole.node.size(); ++k)
              out[most_side_nodes * at + k] = c.node[first + std::size_t(whole.node[k])];
        }
  }
  return out;
}

void MeshDraft::assemble(SparseMatrix& m, SparseMatrix& k, SparseMatrix& c, std::vector<double>& node_mass) const {
  node_mass.clear();
  for (const Cells& some : cells)
    if (some.element->order > 1) node_mass.assign(std::size_t(nodes()), 0.0);
  std::vector<std::int64_t> start{0};
  std::vector<std::int32_t> unknown;
  for (const Cells& some : cells)
    for (std::size_t i = 0; i < some.node.size(); ++i) {
      for (int axis = 0; axis < dim; ++axis) unknown.push_back(dim * some.node[i] + axis);
      if ((i + 1) % some.element->nodes == 0) start.push_back(std::int64_t(unknown.size()));
    }
  m = lower_pattern(std::int64_t(reference.size()), start, unknown);
  k = m;
  std::size_t clique = 0;
  for (const Cells& some : cells) {
    const ElementInfo& e = *some.element;
    const ElementShape shape(e);
    const int dofs = dim * e.nodes;
    std::vector<double> x(dofs, 0.0), stiffness(dofs * dofs, 0.0), mass(dofs * dofs, 0.0), of_nodes(e.nodes, 0.0);
    for (std::size_t first = 0; first < some.node.size(); first += e.nodes, ++clique) {
      for (int i = 0; i < dofs; ++i) x[i] = reference[dim * some.node[first + i / dim] + i % dim];
      std::int32_t wrong = 0;
      cairn_elastic_matrices(dim, e.nodes, e.points, shape.value.data(), shape.gradient.data(), shape.weight.data(), 1,
                             x.data(), some.density, some.elasticity.data(), stiffness.data(), mass.data(), &wrong);
      if (wrong)
        throw Error(std::string(e.name) + " cell " + std::to_string(first / e.nodes) + " with first node " +
                    std::to_string(some.node[first]) + " is flat or inside out: turn its nodes the other way round");
      if (dim == 2 && some.solid.material && some.solid.plane == Plane::axisymmetric)
        ring_mass(e, x.data(), some.density, mass.data());
      const std::int32_t* dof = &unknown[start[clique]];
      const bool by_diagonal = e.order > 1;
      if (!node_mass.empty()) {
        if (by_diagonal) {
          lump_by_diagonal(e, mass.data(), of_nodes.data());
        } else {
          std::fill(of_nodes.begin(), of_nodes.end(), 0.0);
          for (int j = 0; j < dofs; j += dim)
            for (int i = 0; i < dofs; i += dim) of_nodes[j / dim] += mass[j * dofs + i];
        }
        for (int j = 0; j < e.nodes; ++j) node_mass[some.node[first + j]] += of_nodes[j];
      }
      for (int j = 0; j < dofs && lumped && by_diagonal; ++j) m.value[m.start[dof[j]]] += of_nodes[j / dim];
      for (int j = 0; j < dofs; ++j)
        for (int i = 0; i < dofs; ++i) {
          if (lumped && !by_diagonal) m.value[m.start[dof[j]]] += mass[j * dofs + i];
          if (dof[i] < dof[j]) continue;
          const std::int64_t place = place_of(m, dof[i], dof[j]);
          k.value[place] += stiffness[j * dofs + i];
          if (!lumped) m.value[place] += mass[j * dofs + i];
        }
    }
  }
  if (const std::shared_ptr<BulkModel> solid = bulk()) { // the stiffness at the start
    std::vector<double> none(reference.size(), 0.0), force(reference.size());
    solid->fit(m);
    std::fill(k.value.begin(), k.value.end(), 0.0);
    if (const BulkResult found =
            solid->evaluate(none.data(), std::numeric_limits<double>::infinity(), 1, force.data(), k.value.data());
        !found.ok())
      throw Error(solid->told(found) + ", at the start");
  }
  c = m;
  for (std::size_t i = 0; i < c.value.size(); ++i) c.value[i] = by_mass * m.value[i] + by_stiffness * k.value[i];
}

double MeshDraft::volume() const {
  MeshDraft filled = *this; // with 1 kg in each m3
  for (Cells& some : filled.cells) some.density = some.solid.thickness;
  SparseMatrix m, k, c;
  std::vector<double> node_mass;
  filled.assemble(m, k, c, node_mass);
  double sum = 0;
  for (const double weight : node_weights(dim, m)) sum += weight;
  return sum;
}

} // namespace cairn
