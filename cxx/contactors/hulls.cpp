#include "hulls.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <tuple>

#include "../base/call.hpp"
#include "../base/vectors.hpp"

namespace cairn {
namespace {

using Vector = std::array<double, 3>;
using Loop = std::vector<std::int32_t>;

Vector operator-(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector scaled(const Vector& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }

struct Plane {
  Vector normal;
  double offset;
};

[[noreturn]] void refuse(std::int64_t hull, const std::string& what) {
  throw Error("hull " + std::to_string(hull) + ": " + what);
}

// Corners of the convex hull of points in a plane, counterclockwise, no three in line (Andrew 1979).
Loop outline(const std::vector<std::array<double, 2>>& x, const Loop& points, double size) {
  Loop sorted = points;
  std::sort(sorted.begin(), sorted.end(), [&](auto i, auto j) { return x[i] != x[j] ? x[i] < x[j] : i < j; });
  const auto turns = [&](std::int32_t i, std::int32_t j, std::int32_t k) {
    const double ex = x[k][0] - x[i][0], ey = x[k][1] - x[i][1], fx = x[j][0] - x[i][0], fy = x[j][1] - x[i][1];
    return fx * ey - fy * ex > 1e-13 * size * std::hypot(ex, ey);
  };
  Loop chain;
  for (int half = 0; half < 2; ++half) {
    const std::size_t start = chain.size();
    for (const std::int32_t k : sorted) {
      while (chain.size() >= start + 2 && !turns(chain[chain.size() - 2], chain.back(), k)) chain.pop_back();
      chain.push_back(k);
    }
    chain.pop_back();
    std::reverse(sorted.begin(), sorted.end());
  }
  return chain;
}

// The polyhedron of one hull while it is made.
struct Builder {
  std::int64_t which;
  std::vector<Vector> x;
  double size = 0;
  std::vector<std::int32_t> first; // vertex in the same place with the lowest number
  std::vector<Plane> planes;
  std::vector<Loop> loops; // vertices of each plane: at first corners of its faces, then in order round it

  void take_vertices(std::span<const double> values);
  void take_face(std::span<const std::int64_t> corners, std::int64_t face);
  void check_convex(const Plane& plane, std::int64_t face) const;
  double thickness() const;
  void make_loops();
  void drop_vertices_in_edges();
};

void Builder::take_vertices(std::span<const double> values) {
  for (std::size_t i = 0; i < values.size() / 3; ++i)
    x.push_back({values[3 * i], values[3 * i + 1], values[3 * i + 2]});
  Vector low = x.empty() ? Vector{} : x[0], high = low;
  for (const Vector& v : x)
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], v[k]);
      high[k] = std::max(high[k], v[k]);
    }
  for (int k = 0; k < 3; ++k) size = std::max(size, high[k] - low[k]);
  std::map<Vector, std::int32_t> places;
  for (const Vector& v : x) first.push_back(places.try_emplace(v, std::int32_t(first.size())).first->second);
}

// Adds a face; coplanar faces share their plane.
void Builder::take_face(std::span<const std::int64_t> corners, std::int64_t face) {
  const std::string name = "face " + std::to_string(face);
  if (corners.size() < 3)
    refuse(which, name + " has " + std::to_string(corners.size()) + " corners; give three or more");
  Vector area{};
  double longest = 0;
  for (const std::int64_t corner : corners) // all of them, before any is looked up
    if (corner < 0 || corner >= std::int64_t(x.size()))
      refuse(which, name + " names vertex " + std::to_string(corner) + " of " + std::to_string(x.size()) +
                        "; number vertices from 0");
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vector &v = x[corners[k]], &next = x[corners[(k + 1) % corners.size()]];
    const Vector c = cross(v - x[corners[0]], next - x[corners[0]]);
    longest = std::max(longest, std::sqrt(dot(next - v, next - v)) / size);
    for (int i = 0; i < 3; ++i) area[i] += c[i] / size / size;
  }
  const double twice = std::sqrt(dot(area, area));
  if (!(twice > 0.1 * hull_flatness * longest))
    return; // a sliver has no plane of its own; the gap that it leaves shows as an open edge
  Plane plane{scaled(area, 1 / twice), 0};
  plane.offset = dot(plane.normal, x[corners[0]]);
  for (const auto c : corners) plane.offset = std::max(plane.offset, dot(plane.normal, x[c]));
  for (std::size_t p = 0; p < planes.size(); ++p) {
    const Plane& known = planes[p];
    if (dot(known.normal, plane.normal) < 0.999) continue;
    const bool same = std::all_of(corners.begin(), corners.end(), [&](std::int64_t c) {
      return std::abs(dot(known.normal, x[c]) - known.offset) <= hull_flatness * size;
    });
    if (!same) continue;
    for (const auto c : corners) loops[p].push_back(first[c]);
    return;
  }
  check_convex(plane, face);
  for (const Vector& v : x) plane.offset = std::max(plane.offset, dot(plane.normal, v));
  planes.push_back(plane);
  loops.emplace_back();
  for (const auto c : corners) loops.back().push_back(first[c]);
}

void Builder::check_convex(const Plane& plane, std::int64_t face) const {
  double high = 0, low = 0;
  std::size_t highest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double h = dot(plane.normal, x[i]) - plane.offset;
    low = std::min(low, h);
    if (h > high) {
      high = h;
      highest = i;
    }
  }
  if (high <= hull_flatness * size) return;
  if (low >= -hull_flatness * size)
    refuse(which, "face " + std::to_string(face) + " looks inward; turn the order of its vertices round");
  refuse(which, "vertex " + std::to_string(highest) + " stands " + std::to_string(high / size) +
                    " of the size out of face " + std::to_string(face) +
                    ": it is not convex; give it as several convex parts of one body (cairn.pre.convex_parts)");
}

// The least distance between a face and the vertex farthest behind it.
double Builder::thickness() const {
  double least = std::numeric_limits<double>::infinity();
  for (const Plane& plane : planes) {
    double low = 0;
    for (const Vector& v : x) low = std::min(low, dot(plane.normal, v) - plane.offset);
    least = std::min(least, -low);
  }
  return least;
}

// Orders the vertices of each plane around it. Vertices of other faces do not belong to it, however near: a face of one
// of two nearly equal planes would else be two faces of the other.
void Builder::make_loops() {
  for (std::size_t p = 0; p < planes.size(); ++p) {
    const Vector& normal = planes[p].normal;
    const int k = std::abs(normal[0]) > 0.7 ? 1 : 0;
    Vector axis{};
    axis[k] = 1;
    Vector t = cross(axis, normal);
    t = scaled(t, 1 / std::sqrt(dot(t, t)));
    const Vector s = cross(normal, t);
    std::vector<std::array<double, 2>> seen(x.size());
    Loop& on = loops[p];
    std::sort(on.begin(), on.end());
    on.erase(std::unique(on.begin(), on.end()), on.end());
    for (const auto i : on) seen[i] = {dot(t, x[i]), dot(s, x[i])};
    on = outline(seen, on, size);
  }
  drop_vertices_in_edges();
}

// Drops vertices where fewer than three faces meet.
void Builder::drop_vertices_in_edges() {
  std::vector<int> meet(x.size(), 0);
  for (const Loop& loop : loops)
    for (const auto i : loop) ++meet[i];
  std::size_t kept = 0;
  for (std::size_t f = 0; f < loops.size(); ++f) {
    std::erase_if(loops[f], [&](std::int32_t i) { return meet[i] < 3; });
    if (loops[f].size() < 3) continue;
    if (kept < f) loops[kept] = std::move(loops[f]);
    planes[kept++] = planes[f];
  }
  loops.resize(kept);
  planes.resize(kept);
}

} // namespace

void Hulls::add_polygon(std::span<const double> values, std::int64_t which) {
  std::vector<std::array<double, 2>> x;
  for (std::size_t i = 0; i < values.size() / 2; ++i) x.push_back({values[2 * i], values[2 * i + 1]});
  double low[2], high[2], size = 0;
  for (int k = 0; k < 2; ++k) {
    low[k] = high[k] = x.empty() ? 0 : x[0][k];
    for (const auto& v : x) {
      low[k] = std::min(low[k], v[k]);
      high[k] = std::max(high[k], v[k]);
    }
    size = std::max(size, high[k] - low[k]);
  }
  Loop all(x.size());
  std::iota(all.begin(), all.end(), 0);
  if (x.size() < 3) refuse(which, "a polygon of " + std::to_string(x.size()) + " vertices; give three or more");
  const Loop loop = outline(x, all, size);
  if (loop.size() < 3) refuse(which, "its vertices are in line: it has no area");
  std::vector<char> kept(x.size(), 0);
  for (const auto i : loop) kept[i] = 1;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const auto &a = x[loop[k]], &b = x[loop[(k + 1) % loop.size()]];
    const double dx = b[0] - a[0], dy = b[1] - a[1], length = std::hypot(dx, dy);
    vertex.insert(vertex.end(), a.begin(), a.end());
    normal.insert(normal.end(), {dy / length, -dx / length});
    offset.push_back(std::max((dy * a[0] - dx * a[1]) / length, (dy * b[0] - dx * b[1]) / length));
    for (std::size_t i = 0; i < x.size(); ++i)
      if (!kept[i] && std::abs((x[i][0] - a[0]) * dy - (x[i][1] - a[1]) * dx) <= hull_flatness * size * length)
        kept[i] = 1;
  }
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!kept[i])
      refuse(which, "vertex " + std::to_string(i) +
                        " is inside the others: it is not convex; give it as several convex parts of one body "
                        "(cairn.pre.convex_parts)");
  first_vertex.push_back(std::int32_t(vertex.size()) / 2);
  first_face.push_back(std::int32_t(offset.size()));
  first_edge.push_back(0);
}

void Hulls::add_polyhedron(const HullBatch& batch, std::int64_t which) {
  Builder b{which, {}, 0, {}, {}, {}};
  b.take_vertices(batch.vertex.subspan(3 * batch.first_vertex[which],
                                       3 * (batch.first_vertex[which + 1] - batch.first_vertex[which])));
  if (b.x.size() < 4) refuse(which, "a polyhedron of " + std::to_string(b.x.size()) + " vertices; give four or more");
  for (std::int64_t f = batch.first_face[which]; f < batch.first_face[which + 1]; ++f)
    b.take_face(batch.corner.subspan(batch.first_corner[f], batch.first_corner[f + 1] - batch.first_corner[f]),
                f - batch.first_face[which]);
  const std::size_t planes = b.planes.size();
  const double thick = b.thickness();
  b.make_loops();
  if (b.planes.size() < 4 && thick <= hull_flatness * b.size) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "it is %.3g m thick and %.3g m long: it counts as flat; give it more than %g of that", thick, b.size,
                  hull_flatness);
    refuse(which, text);
  }
  if (b.planes.size() < 4 && planes > 3)
    refuse(which,
           "its faces leave vertices with fewer than three planes: it is not closed; add the missing faces or fill "
           "the holes");
  if (b.planes.size() < 4)
    refuse(which, "its faces lie in " + std::to_string(b.planes.size()) + " planes: it has no volume");

  std::vector<std::int32_t> number(b.x.size(), 0);
  const auto base_vertex = std::int64_t(vertex.size()) / 3;
  std::map<std::array<std::int32_t, 2>, std::int32_t> edge_of; // (low, high) of the new numbers
  const std::size_t base_edge = edge.size() / 4;
  for (std::size_t f = 0; f < b.loops.size(); ++f) {
    const Loop& loop = b.loops[f];
    if (std::int64_t(loop.size()) > most_face_corners)
      refuse(which, "a face has " + std::to_string(loop.size()) + " corners; give at most " +
                        std::to_string(most_face_corners));
    for (const auto i : loop) {
      if (number[i]) continue;
      vertex.insert(vertex.end(), b.x[i].begin(), b.x[i].end());
      number[i] = std::int32_t(std::int64_t(vertex.size()) / 3 - base_vertex);
    }
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::int32_t from = number[loop[k]], to = number[loop[(k + 1) % loop.size()]];
      const auto [at, fresh] =
          edge_of.try_emplace({std::min(from, to), std::max(from, to)}, std::int32_t(edge.size() / 4 - base_edge) + 1);
      if (fresh) {
        edge.insert(edge.end(), {from, to, std::int32_t(f) + 1, 0});
      } else {
        std::int32_t* e = &edge[4 * (base_edge + at->second - 1)];
        if (e[3] != 0 || e[0] != to)
          refuse(which, "more than two faces meet in an edge; give a closed surface, each edge between two faces");
        e[3] = std::int32_t(f) + 1;
      }
      corner_vertex.push_back(from);
      corner_edge.push_back(at->second);
    }
    first_corner.push_back(std::int32_t(corner_vertex.size()));
    normal.insert(normal.end(), b.planes[f].normal.begin(), b.planes[f].normal.end());
    offset.push_back(b.planes[f].offset);
  }
  for (std::size_t k = base_edge; k < edge.size() / 4; ++k)
    if (edge[4 * k + 3] == 0)
      refuse(which, "the edge between two of its vertices belongs to one face only: it is not closed; add the missing "
                    "faces or fill the holes");
  if (edge.size() / 4 - base_edge > std::size_t(most_hull_edges))
    refuse(which, std::to_string(edge.size() / 4 - base_edge) + " edges are more than " +
                      std::to_string(most_hull_edges) + "; simplify it");
  first_vertex.push_back(std::int32_t(vertex.size()) / 3);
  first_face.push_back(std::int32_t(offset.size()));
  first_edge.push_back(std::int32_t(edge.size()) / 4);
}

// See facet_view.f90 for what the edges of a facet hold.
void Hulls::add_facet(const HullBatch& batch, std::int64_t which) {
  const std::int64_t base = batch.first_vertex[which], end = batch.first_vertex[which + 1];
  std::vector<std::array<std::int64_t, 3>> triangles;
  std::size_t own = 0;
  bool found = false;
  for (std::int64_t f = batch.first_face[which]; f < batch.first_face[which + 1]; ++f) {
    const auto c = batch.corner.subspan(batch.first_corner[f], batch.first_corner[f + 1] - batch.first_corner[f]);
    if (c.size() != 3 || std::any_of(c.begin(), c.end(), [&](auto i) { return i < 0 || i >= end - base; }))
      refuse(which, "a surface has faces that are no triangles of its vertices; give three vertices each");
    if (c[0] == 0 && c[1] == 1 && c[2] == 2) own = triangles.size(), found = true;
    triangles.push_back({c[0], c[1], c[2]});
  }
  if (!found) refuse(which, "a facet is missing among the triangles around it; give it as 0, 1, 2");
  std::vector<Vector> x;
  for (std::int64_t i = base; i < end; ++i)
    x.push_back({batch.vertex[3 * i], batch.vertex[3 * i + 1], batch.vertex[3 * i + 2]});
  const Vector area = cross(x[1] - x[0], x[2] - x[0]);
  const double size = std::sqrt(dot(area, area)),
               longest = std::max(dot(x[1] - x[0], x[1] - x[0]), dot(x[2] - x[0], x[2] - x[0]));
  if (!(size > 1e-12 * longest)) refuse(which, "this facet has no area; drop it and merge its vertices");
  const auto at = [&](std::size_t t, std::int64_t vertex) {
    return std::find(triangles[t].begin(), triangles[t].end(), vertex) - triangles[t].begin();
  };
  for (std::int64_t k = 0; k < 3; ++k) {
    const std::int64_t next = (k + 1) % 3;
    std::int32_t opposite = 0, owner = 1;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const auto i = at(t, k);
      if (t == own || i == 3 || at(t, next) == 3) continue;
      if (opposite != 0 || triangles[t][(i + 1) % 3] == next)
        refuse(which,
               "its edge from vertex " + std::to_string(k) +
                   " belongs to more than two triangles, or to one that looks the other way; split the surface or "
                   "turn the triangle round");
      opposite = std::int32_t(triangles[t][(i + 1) % 3]) + 1;
      owner = own < t;
    }
    edge.insert(edge.end(), {std::int32_t(k) + 1, std::int32_t(next) + 1, owner, opposite});
  }
  for (std::int64_t k = 0; k < 3; ++k) {
    bool owner = true;
    for (std::size_t t = 0; t < own; ++t) owner = owner && at(t, k) == 3;
    edge.insert(edge.end(), {std::int32_t(k) + 1, std::int32_t(k) + 1, std::int32_t(owner), 0});
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::int64_t k = 0; k < 3 && t != own; ++k) {
      const auto i = at(t, k);
      if (i == 3) continue;
      edge.insert(edge.end(), {std::int32_t(k) + 1, std::int32_t(triangles[t][(i + 1) % 3]) + 1, 0,
                               std::int32_t(triangles[t][(i + 2) % 3]) + 1});
    }
  for (const Vector& v : x) vertex.insert(vertex.end(), v.begin(), v.end());
  const Vector n = scaled(area, 1 / size);
  normal.insert(normal.end(), n.begin(), n.end());
  offset.push_back(dot(n, x[0]));
  for (std::int32_t k = 1; k <= 3; ++k) {
    corner_vertex.push_back(k);
    corner_edge.push_back(k);
  }
  first_corner.push_back(std::int32_t(corner_vertex.size()));
  first_vertex.push_back(std::int32_t(vertex.size()) / 3);
  first_face.push_back(std::int32_t(offset.size()));
  first_edge.push_back(std::int32_t(edge.size()) / 4);
}

void Hulls::add_round(const HullBatch& batch, std::int64_t which) {
  const auto x = batch.vertex.subspan(3 * batch.first_vertex[which],
                                      3 * (batch.first_vertex[which + 1] - batch.first_vertex[which]));
  const auto planes =
      batch.plane.subspan(4 * batch.first_face[which], 4 * (batch.first_face[which + 1] - batch.first_face[which]));
  const bool axial = planes.size() == 4 && x.size() == 6, superquadric = planes.size() == 20 && x.size() == 24;
  if (!axial && !superquadric)
    refuse(which, "a round shape of " + std::to_string(x.size() / 3) + " vertices and " +
                      std::to_string(planes.size() / 4) + " planes; give 2 and 1, or 8 and 5");
  for (std::size_t f = 0; f < planes.size(); f += 4) {
    if (!(planes[f + 3] > 0)) refuse(which, "a radius, half axis or exponent is not above 0");
    normal.insert(normal.end(), planes.begin() + f, planes.begin() + f + 3);
    offset.push_back(planes[f + 3]);
    first_corner.push_back(std::int32_t(corner_vertex.size()));
  }
  vertex.insert(vertex.end(), x.begin(), x.end());
  first_vertex.push_back(std::int32_t(vertex.size()) / 3);
  first_face.push_back(std::int32_t(offset.size()));
  first_edge.push_back(std::int32_t(edge.size()) / 4);
  radius.push_back(batch.ball[which]);
  inner.push_back(-batch.ball[which]);
}

Hulls::Form Hulls::form(std::int32_t hull) const {
  if (dim == 2) return Form::polygon;
  if (first_edge[hull + 1] > first_edge[hull]) return faces(hull) == 1 ? Form::facet : Form::polyhedron;
  return faces(hull) == 1 ? Form::axial : Form::superquadric;
}

// Radius of the ball around 0 that holds a hull.
double Hulls::measure(std::int32_t h, bool facet) const {
  double most = 0;
  for (std::int32_t i = first_vertex[h]; i < (facet ? first_vertex[h] + 3 : first_vertex[h + 1]); ++i) {
    double square = 0;
    for (int k = 0; k < dim; ++k) square += vertex[dim * i + k] * vertex[dim * i + k];
    most = std::max(most, std::sqrt(square));
  }
  return most * (1 + 4 * std::numeric_limits<double>::epsilon());
}

void Hulls::move_facet(std::int32_t h, std::span<const double> x) {
  std::copy(x.begin(), x.end(), vertex.begin() + 3 * first_vertex[h]);
  const double* v = &vertex[std::size_t(3) * first_vertex[h]];
  const Vector first{v[0], v[1], v[2]}, e{v[3] - v[0], v[4] - v[1], v[5] - v[2]},
      f{v[6] - v[0], v[7] - v[1], v[8] - v[2]};
  const Vector area = cross(e, f);
  const double size = std::sqrt(dot(area, area));
  if (!(size > 1e-12 * std::max(dot(e, e), dot(f, f)))) refuse(h, "this facet has no area any more");
  const Vector n = scaled(area, 1 / size);
  std::copy(n.begin(), n.end(), normal.begin() + 3 * first_face[h]);
  offset[first_face[h]] = dot(n, first);
  radius[h] = measure(h, true);
  inner[h] = -radius[h];
  for (std::size_t k = 3; k < 6; ++k) edge[4 * (std::size_t(first_edge[h]) + k) + 3] = 1;
}

std::int32_t Hulls::add(const HullBatch& batch) {
  const std::int64_t n = std::int64_t(batch.first_vertex.size()) - 1;
  if (n < 0) throw Error("first_vertex is empty; give one number more than hulls");
  if (dim == 3 && std::int64_t(batch.first_face.size()) != n + 1)
    throw Error("first_face holds " + std::to_string(batch.first_face.size()) + " numbers; " + std::to_string(n) +
                " hulls need " + std::to_string(n + 1));
  for (std::size_t i = 0; i < batch.vertex.size(); ++i)
    if (!std::isfinite(batch.vertex[i]))
      throw Error("vertex[" + std::to_string(i / dim) + "] is " + std::to_string(batch.vertex[i]) +
                  "; give finite numbers");
  const auto rises = [](std::span<const std::int64_t> first, std::size_t size) {
    if (first.empty() || first.front() != 0 || first.back() != std::int64_t(size)) return false;
    return std::is_sorted(first.begin(), first.end());
  };
  const bool round = !batch.plane.empty();
  if (round && (dim == 2 || std::int64_t(batch.ball.size()) != n || !rises(batch.first_face, batch.plane.size() / 4)))
    throw Error("hulls: round shapes are of 3D scenes, with a ball each and first_face from 0 to the number of planes");
  for (std::size_t i = 0; i < batch.plane.size(); ++i)
    if (!std::isfinite(batch.plane[i])) throw Error("plane[" + std::to_string(i / 4) + "] holds no finite number");
  for (std::size_t i = 0; i < batch.ball.size(); ++i)
    if (!(batch.ball[i] > 0) || !std::isfinite(batch.ball[i]))
      throw Error("ball[" + std::to_string(i) + "] is " + std::to_string(batch.ball[i]) +
                  "; give a finite radius above 0");
  if (!rises(batch.first_vertex, batch.vertex.size() / dim) ||
      (dim == 3 && !round &&
       (batch.first_corner.empty() || !rises(batch.first_face, batch.first_corner.size() - 1) ||
        !rises(batch.first_corner, batch.corner.size()))))
    throw Error("hulls: first_vertex, first_face or first_corner does not rise from 0 to the number of items it cuts");
  const std::int32_t first = count();
  const auto sizes = [this](auto&& f) {
    std::apply([&](auto&... v) { (f(v), ...); },
               std::tie(first_vertex, first_face, first_edge, first_corner, corner_vertex, corner_edge, edge, vertex,
                        normal, offset, inner, radius));
  };
  std::vector<std::size_t> before;
  sizes([&](auto& v) { before.push_back(v.size()); });
  try {
    for (std::int64_t i = 0; i < n; ++i) {
      if (!batch.plane.empty()) {
        add_round(batch, i);
        continue;
      }
      if (dim == 2)
        add_polygon(
            batch.vertex.subspan(2 * batch.first_vertex[i], 2 * (batch.first_vertex[i + 1] - batch.first_vertex[i])),
            i);
      else
        batch.facets ? add_facet(batch, i) : add_polyhedron(batch, i);
      const std::int32_t h = count() - 1;
      radius.push_back(measure(h, batch.facets));
      const double least = *std::min_element(offset.begin() + first_face[h], offset.begin() + first_face[h + 1]);
      inner.push_back(least > 0 && !batch.facets ? least
                                                 : -radius[h]); // 0 outside: no ball, and no direction without reach
    }
  } catch (...) {
    std::size_t k = 0;
    sizes([&](auto& v) { v.resize(before[k++]); });
    throw;
  }
  return first;
}

std::size_t Hulls::bytes() const {
  std::size_t total = 0;
  for (const auto* v : {&first_vertex, &first_face, &first_edge, &first_corner, &corner_vertex, &corner_edge, &edge})
    total += v->capacity() * sizeof(std::int32_t);
  for (const auto* v : {&vertex, &normal, &offset, &inner, &radius}) total += v->capacity() * sizeof(double);
  return total;
}

} // namespace cairn
