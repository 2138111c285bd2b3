#include "tied_sides.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include "../base/call.hpp"
#include "../base/small_matrices.hpp"
#include "../base/vectors.hpp"
#include "../meshes/mortar_surface.hpp"

namespace cairn {
namespace {

constexpr double least = 1e-12;   // of a face, that counts as common
constexpr double rounding = 1e-9; // of a side, that counts as nothing

using Point = std::array<double, 3>;
using Flat = std::array<double, 3>; // along two axes of a face and across it, over its size
using Side = std::array<std::int32_t, 4>;

struct Whole { // the side of a cell that a flat piece is a part of: corners, the middles of edges, the middle
  std::array<std::int32_t, most_side_nodes> node{};
  int nodes = 0;
  double at[4][2] = {}; // where the corners of the piece are on it
  // Where on it a point of the piece is, by the shape functions of that.
  std::array<double, 2> place(const double* share, int corners) const {
    std::array<double, 2> out{0, 0};
    for (int j = 0; j < corners; ++j)
      for (std::size_t k = 0; k < 2; ++k) out[k] += share[j] * at[j][k];
    return out;
  }
};

struct Sample { // Quadrature point on the overlap of two sides
  const Whole* lead = nullptr;
  double lead_shape[most_side_nodes] = {}, shape[most_side_nodes] = {}; // of the slave side: the dual basis
  double wide = 0;
};

struct Met { // A slave piece: its nodes, its size, and its overlaps with master sides
  Side own{};
  const Whole* whole = nullptr;
  int nodes = 0;
  double size = 0; // length or area, that wide is over
  std::vector<Sample> samples;
  double covered = 0, opposite = 0, far = 0, around = 0; // of it within reach, at any distance; ends over size
};

int nodes_of(const Side& side) {
  return int(std::count_if(side.begin(), side.end(), [](auto n) { return n >= 0; }));
}

Side side_at(std::span<const std::int32_t> sides, std::size_t i) {
  return {sides[4 * i], sides[4 * i + 1], sides[4 * i + 2], sides[4 * i + 3]};
}

std::vector<Whole> wholes_of(const MeshDraft& d, std::span<const std::int32_t> sides) {
  const std::vector<std::int32_t> found = d.whole_sides(sides);
  std::vector<Whole> out(sides.size() / 4);
  for (std::size_t i = 0; i < out.size(); ++i) {
    Whole& w = out[i];
    w.node.fill(-1);
    if (found.empty())
      std::copy_n(&sides[4 * i], 4, w.node.begin());
    else
      std::copy_n(&found[most_side_nodes * i], most_side_nodes, w.node.begin());
    w.nodes = int(std::find(w.node.begin(), w.node.end(), -1) - w.node.begin());
    const Side piece = side_at(sides, i);
    for (int j = 0; j < nodes_of(piece); ++j) {
      const auto in = std::find(w.node.begin(), w.node.begin() + w.nodes, piece[std::size_t(j)]) - w.node.begin();
      std::copy_n(place_on_side(d.dim, w.nodes, int(in)), 2 - (d.dim == 2), w.at[j]);
    }
  }
  return out;
}

// Sides of second order follow with all of their nodes.
void check_whole(const std::vector<Whole>& wholes, std::span<const std::int32_t> sides) {
  std::vector<std::int32_t> given(sides.begin(), sides.end());
  std::sort(given.begin(), given.end());
  for (const Whole& w : wholes)
    for (int j = 0; j < w.nodes; ++j)
      if (const std::int32_t node = w.node[std::size_t(j)]; !std::binary_search(given.begin(), given.end(), node))
        throw Error("ties: the side of node " + std::to_string(w.node[0]) + " is of second order, and its node " +
                    std::to_string(node) + " is on no piece that follows: give all pieces of their sides");
}

std::string as_text(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

void check_covered(const std::vector<Met>& sides, double within, bool edges) {
  const auto wrong = [&](const Met& s) {
    const double gone = 1 - s.covered;
    return !(-rounding <= gone && gone <= std::max(rounding, std::min(within * s.around, 0.5)));
  };
  const Met* worst = nullptr;
  for (const Met& s : sides)
    if (wrong(s) && (!worst || std::abs(1 - s.covered) > std::abs(1 - worst->covered))) worst = &s;
  if (!worst) return;
  std::string text = "ties: " + as_text(worst->covered) + " of the " + (edges ? "edge" : "face") + " of nodes ";
  for (int j = 0; j < worst->nodes; ++j) text += (j ? ", " : "") + std::to_string(worst->own[std::size_t(j)]);
  text += " lies on sides that lead, within " + as_text(within) + " of its size, ";
  if (worst->covered > 1)
    throw Error(text + as_text(worst->covered - 1) + " more than once: leave one of the layers out");
  double needed = 0;
  bool wider = true;
  for (const Met& s : sides) {
    if (!wrong(s)) continue;
    wider = wider && s.covered < 1 && s.opposite >= 0.5;
    needed = std::max({needed, s.far, (1 - s.opposite) / s.around});
  }
  text += as_text(1 - worst->covered) + " is missing: move it over the other, ";
  if (!wider) throw Error(text + "or let the finer side follow");
  throw Error(text + "let the finer side follow, or give a larger within, " + as_text(1.01 * needed) + " or more");
}

Met met_by_edge(const MeshDraft& d, const Side& own, const Whole& whole, std::span<const std::int32_t> lead,
                const std::vector<Whole>& wholes, double within) {
  constexpr double at[3] = {-0.7745966692414834, 0, 0.7745966692414834}, weight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  Met out;
  out.own = own;
  out.whole = &whole;
  out.nodes = 2;
  out.around = 2;
  const double *a = &d.reference[std::size_t(2 * own[0])], *b = &d.reference[std::size_t(2 * own[1])];
  const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
  if (!(length > 0))
    throw Error("ties: the edge of nodes " + std::to_string(own[0]) + ", " + std::to_string(own[1]) + " has no length");
  out.size = length;
  const double along[2] = {(b[0] - a[0]) / length, (b[1] - a[1]) / length};
  for (std::size_t k = 0; k < lead.size() / 4; ++k) {
    const Side other = side_at(lead, k);
    double end[2], gap[2]; // of the edge that leads, on this one
    for (int e = 0; e < 2; ++e) {
      const double* x = &d.reference[std::size_t(2 * other[std::size_t(e)])];
      end[e] = ((x[0] - a[0]) * along[0] + (x[1] - a[1]) * along[1]) / length;
      gap[e] = ((x[0] - a[0]) * along[1] - (x[1] - a[1]) * along[0]) / length;
    }
    const double low = std::max(std::min(end[0], end[1]), 0.0), high = std::min(std::max(end[0], end[1]), 1.0);
    if (!(high - low > 1e-14)) continue;
    Sample samples[3];
    double off = 0;
    for (int g = 0; g < 3; ++g) {
      const double s = low + (high - low) * (at[g] + 1) / 2, eta = (s - end[0]) / (end[1] - end[0]);
      off = std::max(off, std::abs(gap[0] + (gap[1] - gap[0]) * eta));
      const double there[2] = {1 - eta, eta}, here[2] = {1 - s, s};
      samples[g].lead = &wholes[k];
      side_shape(2, wholes[k].nodes, wholes[k].place(there, 2).data(), samples[g].lead_shape);
      side_basis(2, whole.nodes, whole.place(here, 2).data(), samples[g].shape);
      samples[g].wide = weight[g] * (high - low);
    }
    out.opposite += high - low;
    out.far = std::max(out.far, off);
    if (off > within) continue;
    out.covered += high - low;
    out.samples.insert(out.samples.end(), samples, samples + 3);
  }
  return out;
}

double area_of(const std::vector<Flat>& x) {
  double twice = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Flat& b = x[(i + 1) % x.size()];
    twice += x[i][0] * b[1] - x[i][1] * b[0];
  }
  return twice / 2;
}

// The part of two convex polygons that is common, anticlockwise; empty where there is none.
std::vector<Flat> common(const std::vector<Flat>& one, const std::vector<Flat>& other) {
  std::vector<Flat> part = other;
  if (!(area_of(part) > 0)) std::reverse(part.begin(), part.end());
  for (std::size_t i = 0; i < one.size(); ++i) {
    const Flat &a = one[i], &b = one[(i + 1) % one.size()];
    const auto inside = [&](const Flat& p) { return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]); };
    std::vector<Flat> kept;
    for (std::size_t j = 0; j < part.size(); ++j) {
      const Flat &p = part[j], &q = part[(j + 1) % part.size()];
      const double s = inside(p), t = inside(q);
      if (s >= 0) kept.push_back(p);
      if (s * t < 0) kept.push_back({p[0] + s / (s - t) * (q[0] - p[0]), p[1] + s / (s - t) * (q[1] - p[1]), 0});
    }
    if (kept.size() < 3) return {};
    part = std::move(kept);
  }
  return area_of(part) > least * area_of(one) ? part : std::vector<Flat>{};
}

// Shape functions of a triangle or a quadrilateral in the plane at a place.
void shapes_at(const std::vector<Flat>& x, double px, double py, double* n) {
  if (x.size() == 3) {
    const double ax = x[1][0] - x[0][0], ay = x[1][1] - x[0][1], bx = x[2][0] - x[0][0], by = x[2][1] - x[0][1];
    const double cx = px - x[0][0], cy = py - x[0][1], twice = ax * by - ay * bx;
    n[1] = (cx * by - cy * bx) / twice;
    n[2] = (ax * cy - ay * cx) / twice;
    n[0] = 1 - n[1] - n[2];
    n[3] = 0;
    return;
  }
  constexpr double corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  double r = 0, s = 0;
  for (int turn = 0; turn < 20; ++turn) { // Newton's method on the bilinear map
    double j[2][2] = {}, miss[2] = {px, py};
    for (std::size_t a = 0; a < 4; ++a) {
      const double along = 1 + corner[a][0] * r, across = 1 + corner[a][1] * s;
      for (std::size_t k = 0; k < 2; ++k) {
        miss[k] -= along * across / 4 * x[a][k];
        j[k][0] += corner[a][0] * across / 4 * x[a][k];
        j[k][1] += corner[a][1] * along / 4 * x[a][k];
      }
    }
    const double whole = j[0][0] * j[1][1] - j[0][1] * j[1][0];
    const double dr = (miss[0] * j[1][1] - miss[1] * j[0][1]) / whole;
    const double ds = (j[0][0] * miss[1] - j[1][0] * miss[0]) / whole;
    r += dr, s += ds;
    if (std::max(std::abs(dr), std::abs(ds)) < 1e-14) break;
  }
  for (int a = 0; a < 4; ++a) n[a] = (1 + corner[a][0] * r) * (1 + corner[a][1] * s) / 4;
}

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double norm(const Point& a) { return std::hypot(a[0], a[1], a[2]); }
Point scaled(const Point& a, double by) { return {a[0] * by, a[1] * by, a[2] * by}; }

std::vector<Point> corners(const MeshDraft& d, const Side& side) {
  std::vector<Point> out;
  for (int j = 0; j < nodes_of(side); ++j) {
    const double* x = &d.reference[std::size_t(3 * side[std::size_t(j)])];
    out.push_back({x[0], x[1], x[2]});
  }
  return out;
}

struct Ball { // round the corners of a face
  Point middle{};
  double reach = 0;
};

Ball ball_of(const std::vector<Point>& x) {
  Ball out;
  for (const Point& p : x)
    for (std::size_t k = 0; k < 3; ++k) out.middle[k] += p[k] / double(x.size());
  for (const Point& p : x) out.reach = std::max(out.reach, norm(minus(p, out.middle)));
  return out;
}

// A rule on the common part: triangles from its first corner, each a square one side of which is a point.
void sample(const std::vector<Flat>& part, const Whole& other, const std::vector<Flat>& lead,
            const std::vector<Flat>& own, double within, Met& out) {
  constexpr double four_at[4] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263};
  constexpr double four[4] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693};
  // products of functions of second order are of the eighth degree
  constexpr double five_at[5] = {0.04691007703066800, 0.23076534494715845, 0.5, 0.76923465505284155,
                                 0.95308992296933200};
  constexpr double five[5] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444, 0.23931433524968324,
                              0.11846344252809454};
  const bool second = std::max(other.nodes, out.whole->nodes) > 4;
  const double *at = second ? five_at : four_at, *weight = second ? five : four;
  const int points = second ? 5 : 4;
  std::vector<Sample> samples;
  double wide = 0, off = 0;
  for (std::size_t c = 2; c < part.size(); ++c) {
    const Flat &a = part[0], &b = part[c - 1], &e = part[c];
    const double twice = (b[0] - a[0]) * (e[1] - a[1]) - (b[1] - a[1]) * (e[0] - a[0]);
    for (int i = 0; i < points; ++i)
      for (int j = 0; j < points; ++j) {
        const double px = a[0] + at[i] * ((b[0] - a[0]) + at[j] * (e[0] - b[0]));
        const double py = a[1] + at[i] * ((b[1] - a[1]) + at[j] * (e[1] - b[1]));
        Sample s;
        s.lead = &other;
        s.wide = weight[i] * weight[j] * at[i] * twice;
        double there[4], here[4], apart = 0;
        shapes_at(lead, px, py, there);
        shapes_at(own, px, py, here);
        side_shape(3, other.nodes, other.place(there, int(lead.size())).data(), s.lead_shape);
        side_basis(3, out.whole->nodes, out.whole->place(here, int(own.size())).data(), s.shape);
        for (std::size_t k = 0; k < lead.size(); ++k) apart += there[k] * lead[k][2];
        off = std::max(off, std::abs(apart));
        wide += s.wide;
        samples.push_back(s);
      }
  }
  out.opposite += wide;
  out.far = std::max(out.far, off);
  if (off > within) return;
  out.covered += wide;
  out.samples.insert(out.samples.end(), samples.begin(), samples.end());
}

Met met_by_face(const MeshDraft& d, const Side& own, const Whole& side, std::span<const std::int32_t> lead,
                const std::vector<Whole>& wholes, const std::vector<Ball>& balls, double within) {
  Met out;
  out.own = own;
  out.whole = &side;
  out.nodes = nodes_of(own);
  const std::vector<Point> x = corners(d, own);
  const Ball ball = ball_of(x);
  const Point one = x.size() == 4 ? minus(x[2], x[0]) : minus(x[1], x[0]);
  const Point two = x.size() == 4 ? minus(x[3], x[1]) : minus(x[2], x[0]), normal = cross(one, two);
  const double size = std::sqrt(norm(normal) / 2);
  if (!(size > 0)) throw Error("ties: the face of node " + std::to_string(own[0]) + " has no area");
  const Point first = scaled(one, 1 / norm(one)), up = scaled(normal, 1 / norm(normal)), second = cross(up, first);
  const auto flat = [&](const std::vector<Point>& places) {
    std::vector<Flat> made;
    for (const Point& p : places) {
      const Point from = minus(p, ball.middle);
      made.push_back({dot(from, first) / size, dot(from, second) / size, dot(from, up) / size});
    }
    return made;
  };
  const std::vector<Flat> mine = flat(x);
  for (std::size_t k = 0; k < balls.size(); ++k) {
    if (!(norm(minus(balls[k].middle, ball.middle)) < balls[k].reach + ball.reach)) continue;
    const Side other = side_at(lead, k);
    const std::vector<Flat> theirs = flat(corners(d, other)), part = common(mine, theirs);
    if (!part.empty()) sample(part, wholes[k], theirs, mine, within, out);
  }
  const double whole = area_of(mine);
  for (std::size_t j = 0; j < mine.size(); ++j) {
    const Flat& b = mine[(j + 1) % mine.size()];
    out.around += std::hypot(b[0] - mine[j][0], b[1] - mine[j][1], b[2] - mine[j][2]) / whole;
  }
  out.covered /= whole;
  out.opposite /= whole;
  out.size = size * size;
  return out;
}

// Rows of diag(D) (int B B')^-1: the dual functions by the basis of a side, over all of its pieces.
struct Duals {
  double by[most_side_nodes][most_side_nodes], of[most_side_nodes];
};

Duals duals_of(const std::vector<const Met*>& pieces) {
  const int n = pieces.front()->whole->nodes;
  Duals out;
  double both[most_side_nodes][most_side_nodes] = {};
  for (int j = 0; j < n; ++j) {
    out.of[j] = 0;
    for (const Met* met : pieces)
      for (const Sample& s : met->samples) {
        out.of[j] += s.wide * met->size * s.shape[j];
        for (int i = 0; i < n; ++i) both[j][i] += s.wide * met->size * s.shape[j] * s.shape[i];
      }
  }
  invert_symmetric(std::size_t(n), both, 0);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) out.by[j][i] = out.of[j] * both[j][i];
  return out;
}

// How the value of node k of a side is made of those in the basis that duals are of: the other way round of side_basis.
double share_of_basis(int dim, int nodes, int k, int j) {
  const int corners = dim == 2 ? 2 : nodes == 3 || nodes == 6 ? 3 : 4;
  if (k < corners) return k == j;
  if (k == 8) return j < 4 ? 1.0 / 16 : j < 8 ? 1.0 / 8 : 1.0 / 4;
  const int e = k - corners;
  return j == k ? 0.5 : j == e || j == (e + 1) % corners ? 0.25 : 0;
}

struct Row { // of a node that follows
  double diagonal = 0;
  std::vector<std::pair<std::int32_t, double>> lead;
  void add(std::int32_t node, double part) {
    for (auto& [known, sum] : lead)
      if (known == node) {
        sum += part;
        return;
      }
    lead.emplace_back(node, part);
  }
};

} // namespace

void tie_sides(MeshDraft& d, std::span<const std::int32_t> follow, std::span<const std::int32_t> lead, double within) {
  if (!(within >= 0) || !std::isfinite(within))
    throw Error("within is " + std::to_string(within) + "; give a finite number from 0 on");
  if (follow.empty() || lead.empty()) throw Error("ties: give at least one side that follows and one that leads");
  std::vector<Ball> balls;
  for (std::size_t k = 0; d.dim == 3 && k < lead.size() / 4; ++k)
    balls.push_back(ball_of(corners(d, side_at(lead, k))));
  const std::vector<Whole> own = wholes_of(d, follow), other = wholes_of(d, lead);
  check_whole(own, follow);
  std::vector<Met> sides;
  for (std::size_t k = 0; k < follow.size() / 4; ++k)
    sides.push_back(d.dim == 2 ? met_by_edge(d, side_at(follow, k), own[k], lead, other, within)
                               : met_by_face(d, side_at(follow, k), own[k], lead, other, balls, within));
  check_covered(sides, within, d.dim == 2);
  std::vector<std::vector<const Met*>> wholes; // the pieces of each
  std::map<std::array<std::int32_t, most_side_nodes>, std::size_t> number;
  for (const Met& met : sides) {
    const auto [at, fresh] = number.try_emplace(met.whole->node, wholes.size());
    if (fresh) wholes.emplace_back();
    wholes[at->second].push_back(&met);
  }
  std::map<std::int32_t, Row> rows; // of values in the basis
  for (const std::vector<const Met*>& pieces : wholes) {
    const Duals duals = duals_of(pieces);
    const Whole& whole = *pieces.front()->whole;
    for (int j = 0; j < whole.nodes; ++j) {
      Row& row = rows[whole.node[std::size_t(j)]];
      row.diagonal += duals.of[j];
      for (const Met* met : pieces)
        for (const Sample& s : met->samples) {
          double psi = 0;
          for (int i = 0; i < whole.nodes; ++i) psi += duals.by[j][i] * s.shape[i];
          for (int l = 0; l < s.lead->nodes; ++l)
            row.add(s.lead->node[std::size_t(l)], s.wide * met->size * psi * s.lead_shape[l]);
        }
    }
  }
  std::vector<std::int32_t> order;
  std::map<std::int32_t, Row> values;
  for (const std::vector<const Met*>& pieces : wholes) {
    const Whole& whole = *pieces.front()->whole;
    for (int k = 0; k < whole.nodes; ++k) {
      const auto [at, fresh] = values.try_emplace(whole.node[std::size_t(k)]);
      if (!fresh) continue; // the middle of an edge has the same rule on both of its sides
      order.push_back(at->first);
      for (int j = 0; j < whole.nodes; ++j) {
        const double share = share_of_basis(d.dim, whole.nodes, k, j);
        if (!(share > 0)) continue;
        const Row& row = rows[whole.node[std::size_t(j)]];
        for (const auto& [leader, part] : row.lead) at->second.add(leader, share * part / row.diagonal);
      }
    }
  }
  for (const std::int32_t node : order)
    for (int k = 0; k < d.dim; ++k) {
      d.ties.dof.push_back(d.dim * node + k);
      for (const auto& [leader, weight] : values[node].lead) {
        if (!(std::abs(weight) > 1e-14)) continue;
        d.ties.master.push_back(d.dim * leader + k);
        d.ties.weight.push_back(weight);
      }
      d.ties.first.push_back(std::int64_t(d.ties.master.size()));
    }
}

} // namespace cairn
