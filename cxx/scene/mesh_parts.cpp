#include "mesh_parts.hpp"
#include "../contactors/shapes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "../base/call.hpp"
#include "../contactors/hull_shapes.hpp"

namespace cairn {
namespace {

std::vector<std::int64_t> numbers(std::int64_t first, std::int64_t n) {
  std::vector<std::int64_t> out(std::size_t(n), first);
  std::iota(out.begin(), out.end(), first);
  return out;
}

std::vector<double> masses_of(const MeshModel& m) {
  if (!m.node_mass.empty()) return m.node_mass;
  std::vector<double> mass(std::size_t(m.nodes()), 0.0);
  for (std::int64_t column = 0; column < m.mass.n; ++column)
    for (std::int64_t e = m.mass.start[column]; e < m.mass.start[column + 1]; ++e) {
      const std::int64_t row = m.mass.row[e];
      if (row % m.dim == 0) mass[row / m.dim] += m.mass.value[e];
      if (row != column && column % m.dim == 0) mass[column / m.dim] += m.mass.value[e];
    }
  for (std::size_t i = 0; i < mass.size(); ++i)
    if (!(mass[i] > 0))
      throw Error("node " + std::to_string(i) + " of the mesh '" + m.name + "' has mass " + std::to_string(mass[i]) +
                  " kg: give a density above 0, and leave out nodes without cells");
  return mass;
}

// Numbers of parts of a mesh, and their contactors.
std::vector<std::int64_t> add_numbers(Scene& scene, const MeshModel& m, std::int64_t n) {
  return numbers(scene.add_parts(m.number, n), n);
}

// Nodes at their places (dim, nodes), and contactors on them and on points between them.
void add_nodes(Scene& scene, const MeshDraft& d, MeshModel& m, const std::vector<double>& place,
               const std::vector<double>& mass, std::int32_t material) {
  const int dim = m.dim;
  const std::int64_t first = scene.add_nodes(m.number, place, d.velocity, mass);
  m.node_ids = numbers(first, m.nodes());
  m.point_ids = add_numbers(scene, m, std::int64_t(d.point_nodes.size()) / 4);
  std::vector<std::int64_t> touching;
  std::vector<std::int32_t> nodes = d.contact_nodes;
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  touching.reserve(nodes.size() + m.point_ids.size());
  for (const std::int32_t i : nodes) touching.push_back(first + i);
  m.contact_nodes = nodes;
  touching.insert(touching.end(), m.point_ids.begin(), m.point_ids.end());
  if (touching.empty()) return;
  const std::vector<double> radius(touching.size(), 0.0);
  const std::int32_t materials[] = {material};
  scene.add_contactors(
      {std::int64_t(touching.size()), dim == 2 ? Shape::disk : Shape::sphere, touching, materials, radius, {}, {}});
}

// Bars between two nodes: as thick, inside the body, as a twentieth of the shortest, so that a point that went in is
// still pushed out.
void add_edges(Scene& scene, const MeshDraft& d, MeshModel& m, const std::vector<double>& place,
               std::int32_t material) {
  const std::int64_t n = std::int64_t(d.side_nodes.size()) / 4;
  std::vector<double> length, direction;
  for (std::int64_t s = 0; s < n; ++s) {
    const double *a = &place[2 * d.side_nodes[4 * s]], *b = &place[2 * d.side_nodes[4 * s + 1]];
    const double x = b[0] - a[0], y = b[1] - a[1], size = std::sqrt(x * x + y * y);
    if (!(size > 0)) throw Error("side " + std::to_string(s) + " of the mesh '" + m.name + "' has no length");
    direction.insert(direction.end(), {x / size, y / size, size / 2});
    length.push_back(size);
  }
  const std::vector<double> radius(std::size_t(n), 0.05 * *std::min_element(length.begin(), length.end()));
  m.side_ids = add_numbers(scene, m, n);
  m.side_nodes = d.side_nodes;
  m.whole_nodes = d.whole_sides(m.side_nodes);
  const std::int32_t materials[] = {material};
  scene.add_contactors({n, Shape::segment, m.side_ids, materials, radius, {}, direction});
}

// A facet for each triangle, two for a face of four nodes, in the order of the faces and then their second halves.
void add_faces(Scene& scene, const MeshDraft& d, MeshModel& m, const std::vector<double>& place,
               std::int32_t material) {
  const std::int64_t faces = std::int64_t(d.side_nodes.size()) / 4;
  std::vector<std::int32_t> triangle, used;
  for (int half = 0; half < 2; ++half)
    for (std::int64_t s = 0; s < faces; ++s) {
      const std::int32_t* f = &d.side_nodes[4 * s];
      if (half == 1 && f[3] < 0) continue;
      triangle.insert(triangle.end(), {f[0], f[1 + half], f[2 + half]});
      m.side_nodes.insert(m.side_nodes.end(), {f[0], f[1 + half], f[2 + half], -1});
      m.face_nodes.insert(m.face_nodes.end(), f, f + 4);
    }
  m.whole_nodes = d.whole_sides(m.face_nodes);
  used = triangle;
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::vector<double> x;
  for (const std::int32_t i : used) x.insert(x.end(), &place[3 * i], &place[3 * i] + 3);
  for (std::int32_t& i : triangle) i = std::int32_t(std::lower_bound(used.begin(), used.end(), i) - used.begin());
  const SurfaceFacets facets = add_facets(scene.contactors.hulls, x, triangle);
  const std::int64_t n = std::int64_t(triangle.size()) / 3;
  std::vector<std::int32_t> hull(static_cast<std::size_t>(n));
  std::iota(hull.begin(), hull.end(), facets.first);
  for (const std::int32_t v : facets.around) m.around.push_back(used[std::size_t(v)]);
  m.around_start = facets.around_start;
  m.side_ids = add_numbers(scene, m, n);
  const std::int32_t materials[] = {material};
  scene.add_contactors({n, Shape::facet, m.side_ids, materials, {}, {}, {}, hull});
}

// Throws Error if a mesh has self-contact or mortars without both contact nodes and sides.
void check_contact(const MeshDraft& d, const std::string& name) {
  const std::string sides = d.dim == 2 ? "edges" : "faces", give = ": give both (touch_nodes, touch_sides)";
  if (d.self_contact && (d.side_nodes.empty() || (d.contact_nodes.empty() && d.point_nodes.empty())))
    throw Error("self-contact of the mesh '" + name + "' is of its points and its " + sides + give);
  if (d.mortar && (d.side_nodes.empty() || d.contact_nodes.empty()))
    throw Error("the mortar of the mesh '" + name + "' is of contact nodes and the " + sides + " between them" + give);
}

} // namespace

MeshModel add_mesh_parts(Scene& scene, const MeshDraft& d, const std::string& name, std::int32_t node_material,
                         std::int32_t side_material) {
  if (d.dim != scene.dim)
    throw Error("the mesh has " + std::to_string(d.dim) + " dimensions, the scene " + std::to_string(scene.dim));
  check_contact(d, name);
  MeshModel m;
  m.dim = d.dim;
  m.name = name;
  m.number = scene.new_mesh();
  m.around_start = {0};
  if (d.mass.n > 0) {
    m.mass = d.mass;
    m.stiffness = d.stiffness;
    m.damping = d.damping;
    if (!d.moving) {
      m.initial_force = d.frame_force;
      m.initial_energy = d.frame_energy;
    }
    if (d.called || d.frame)
      for (std::size_t e = 0; e < m.damping.value.size(); ++e)
        m.damping.value[e] = d.by_mass * m.mass.value[e] + d.by_stiffness * m.stiffness.value[e];
    if (d.moving) {
      m.bulk = d.moving;
      d.moving->stiffen(m.stiffness);
    }
    if (d.called) {
      m.bulk = d.called;
      m.ring = d.ring;
      m.thickness = d.thickness;
    }
  } else if (!d.cells.empty()) {
    d.assemble(m.mass, m.stiffness, m.damping, m.node_mass);
    if ((m.bulk = d.bulk())) m.bulk->fit(m.mass);
    for (const MeshDraft::Cells& c : d.cells)
      if (!m.bulk) m.cells.push_back({c.element, c.node, c.elasticity});
    m.initial_energy = d.initial_force(m.initial_force);
    const auto& solid = d.cells.front().solid;
    m.ring = d.dim == 2 && solid.material && solid.plane == Plane::axisymmetric;
    m.thickness = d.dim == 2 && !m.ring ? solid.thickness : 1;
  } else {
    throw Error("the mesh has neither cells nor matrices: give one of them");
  }
  m.axis = -scene.origin[0];
  m.held = d.held;
  m.ties = d.ties;
  m.ties.turns = m.bulk && (!m.bulk->solid() || m.bulk->solid()->finite());
  m.self_contact = d.self_contact;
  m.mortar = d.mortar;
  m.point_nodes = d.point_nodes;
  m.point_weights = d.point_weights;
  m.reference = d.reference;
  std::vector<double> place = d.reference;
  for (std::size_t i = 0; i < d.displacement.size(); ++i) place[i] += d.displacement[i];
  const std::vector<double> mass = masses_of(m);
  add_nodes(scene, d, m, place, mass, node_material);
  if (!d.side_nodes.empty()) (d.dim == 2 ? add_edges : add_faces)(scene, d, m, place, side_material);
  for (std::size_t i = 0; i < m.reference.size(); ++i) m.reference[i] -= scene.origin[i % d.dim];
  return m;
}

void add_surface(Scene& scene, std::int64_t body, std::int32_t material, std::span<const double> vertex,
                 std::span<const std::int32_t> triangle) {
  if (triangle.empty()) throw Error("a surface has no triangles: give at least one");
  std::map<std::array<double, 3>, std::int32_t> known;
  std::vector<double> x;
  std::vector<std::int32_t> welded, number;
  for (std::size_t i = 0; i < vertex.size(); i += 3) {
    const std::array<double, 3> at = {vertex[i] + 0.0, vertex[i + 1] + 0.0, vertex[i + 2] + 0.0};
    for (const double c : at)
      if (!std::isfinite(c)) throw Error("vertex " + std::to_string(i / 3) + " of a surface is not finite");
    const auto [found, is_new] = known.try_emplace(at, std::int32_t(x.size() / 3));
    if (is_new) x.insert(x.end(), at.begin(), at.end());
    number.push_back(found->second);
  }
  for (const std::int32_t i : triangle) {
    if (i < 0 || std::size_t(i) >= number.size())
      throw Error("a triangle names vertex " + std::to_string(i) + " of " + std::to_string(number.size()) +
                  "; number vertices from 0");
    welded.push_back(number[std::size_t(i)]);
  }
  const SurfaceFacets facets = add_facets(scene.contactors.hulls, x, welded);
  const std::size_t n = welded.size() / 3;
  std::vector<std::int32_t> hull(n);
  std::iota(hull.begin(), hull.end(), facets.first);
  const std::vector<std::int64_t> bodies(n, body);
  const std::int32_t materials[] = {material};
  scene.add_contactors({std::int64_t(n), Shape::facet, bodies, materials, {}, facets.centre, {}, hull});
}

} // namespace cairn
