#include "mortar_pair.hpp"

#include <algorithm>
#include <cmath>

#include "../base/small_matrices.hpp"
#include "../base/vectors.hpp"

namespace cairn {
namespace {

constexpr double least_part = 1e-12;  // of a piece, that counts as common
constexpr double least_facing = 0.25; // cosine: sides at a corner, all but square to each other, have slivers in common
constexpr double least_share = 1e-6;  // of a side, that is worth dual functions of its own

double turn(const double* a, const double* b, const double* c) { // twice the area of a triangle
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Gauss's rules on (0, 1): two points for products of linear functions on triangles, five where sides are bilinear or
// of second order, whose products on parallelograms are of the eighth degree at most.
struct Rule {
  int points;
  double at[5], wide[5];
};
constexpr Rule two_points = {2, {0.21132486540518712, 0.78867513459481288}, {0.5, 0.5}};
constexpr Rule five_points = {
    5,
    {0.04691007703066800, 0.23076534494715845, 0.5, 0.76923465505284155, 0.95308992296933200},
    {0.11846344252809454, 0.23931433524968324, 0.28444444444444444, 0.23931433524968324, 0.11846344252809454}};

// The part of a convex polygon left of a line from a to b; both go anticlockwise.
int cut(const double (*in)[2], int n, const double* a, const double* b, double (*out)[2]) {
  int kept = 0;
  for (int i = 0; i < n; ++i) {
    const double *p = in[i], *q = in[(i + 1) % n];
    const double sp = turn(a, b, p), sq = turn(a, b, q);
    if (sp >= 0) out[kept][0] = p[0], out[kept++][1] = p[1];
    if ((sp > 0 && sq < 0) || (sp < 0 && sq > 0)) {
      const double t = sp / (sp - sq);
      for (int k = 0; k < 2; ++k) out[kept][k] = p[k] + t * (q[k] - p[k]);
      ++kept;
    }
  }
  return kept;
}

double area_of(const double (*x)[2], int n) {
  double twice = 0;
  for (int i = 2; i < n; ++i) twice += turn(x[0], x[i - 1], x[i]);
  return twice / 2;
}

// Where a point of the plane is on a whole side, by the piece that it is in.
void place_on(const MortarPiece& p, const double (*x)[2], const double* point, double* at) {
  double share[4] = {0, 0, 0, 0};
  if (p.corners == 3) {
    const double twice = turn(x[0], x[1], x[2]);
    share[1] = turn(x[0], point, x[2]) / twice;
    share[2] = turn(x[0], x[1], point) / twice;
    share[0] = 1 - share[1] - share[2];
  } else { // the bilinear map, by Newton's method
    double r[2] = {0, 0};
    constexpr double sa[4] = {-1, 1, 1, -1}, sb[4] = {-1, -1, 1, 1};
    constexpr int most = 20;
    for (int pass = 0; pass <= most; ++pass) {
      double wrong[2] = {point[0], point[1]}, j[2][2] = {{0, 0}, {0, 0}};
      for (int i = 0; i < 4; ++i) {
        share[i] = 0.25 * (1 + sa[i] * r[0]) * (1 + sb[i] * r[1]);
        for (int k = 0; k < 2; ++k) {
          wrong[k] -= share[i] * x[i][k];
          j[k][0] += 0.25 * sa[i] * (1 + sb[i] * r[1]) * x[i][k];
          j[k][1] += 0.25 * sb[i] * (1 + sa[i] * r[0]) * x[i][k];
        }
      }
      const double determinant = j[0][0] * j[1][1] - j[0][1] * j[1][0];
      const double da = (j[1][1] * wrong[0] - j[0][1] * wrong[1]) / determinant;
      const double db = (j[0][0] * wrong[1] - j[1][0] * wrong[0]) / determinant;
      if (!std::isfinite(da) || !std::isfinite(db)) break;
      if (std::max(std::abs(da), std::abs(db)) < 1e-14 || pass == most) break; // of a coordinate that goes from -1 to 1
      r[0] += da;
      r[1] += db;
    }
  }
  at[0] = at[1] = 0;
  for (int i = 0; i < p.corners; ++i)
    for (int k = 0; k < 2; ++k) at[k] += share[i] * p.at[i][k];
}

} // namespace

void MortarPair::start(const Nodes& nodes, const MeshBody& own, const MortarSurface& own_surface, const MeshBody& other,
                       const MortarSurface& other_surface) {
  nodes_ = &nodes;
  own_ = &own;
  other_ = &other;
  surface_ = &own_surface;
  other_surface_ = &other_surface;
  dim_ = own.model.dim;
  used_ = 0;
  place_of_node_.assign(std::size_t(own.model.nodes()), -1);
  met_.assign(other_surface.piece.size(), -1);
  now_ = 0;
}

bool frame_of(const Nodes& nodes, const MeshBody& mesh, const MortarPiece& p, PieceFrame& f) {
  const int dim = nodes.dim;
  const double* x[4];
  for (int i = 0; i < 4; ++i) x[i] = nodes.position[mesh.node(p.node[i < p.corners ? i : 0])];
  double e[3] = {0, 0, 0}, g[3] = {0, 0, 0};
  for (int k = 0; k < dim; ++k) {
    f.middle[k] = 0;
    for (int i = 0; i < p.corners; ++i) f.middle[k] += x[i][k] / p.corners;
    e[k] = x[p.corners == 4 ? 2 : 1][k] - x[0][k];
    g[k] = p.corners == 2 ? 0 : x[p.corners == 4 ? 3 : 2][k] - x[p.corners == 4 ? 1 : 0][k];
  }
  const double along = std::sqrt(dot(e, e, dim));
  if (!(along > 0)) return false;
  if (dim == 2) {
    for (int k = 0; k < 2; ++k) f.axis[0][k] = e[k] / along;
    f.normal[0] = f.axis[0][1]; // the body is on the left
    f.normal[1] = -f.axis[0][0];
    f.normal[2] = 0;
    f.size = along;
    return true;
  }
  cross(e, g, f.normal);
  const double square = std::sqrt(dot(f.normal, f.normal, 3));
  if (!(square > 0)) return false;
  for (int k = 0; k < 3; ++k) {
    f.normal[k] /= square;
    f.axis[0][k] = e[k] / along;
  }
  cross(f.normal, f.axis[0], f.axis[1]);
  f.size = std::sqrt(square / 2);
  return true;
}

bool face_each_other(const Nodes& nodes, const MeshBody& mesh, const MortarPiece& piece, const MeshBody& other_mesh,
                     const MortarPiece& other) {
  PieceFrame one, two;
  return frame_of(nodes, mesh, piece, one) && frame_of(nodes, other_mesh, other, two) &&
         dot(one.normal, two.normal, nodes.dim) < -least_facing;
}

MortarPair::Flat MortarPair::flat(const MeshBody& mesh, const MortarPiece& p, const PieceFrame& f) const {
  Flat out;
  out.corners = p.corners;
  for (int i = 0; i < p.corners; ++i) {
    const double* x = place(mesh, p.node[i]);
    double r[3] = {0, 0, 0};
    for (int k = 0; k < dim_; ++k) r[k] = (x[k] - f.middle[k]) / f.size;
    for (int k = 0; k < dim_ - 1; ++k) out.x[i][k] = dot(r, f.axis[k], dim_);
    if (dim_ == 2) out.x[i][1] = 0;
  }
  return out;
}

void MortarPair::add_sample(const MortarPiece& p, const PieceFrame& f, const MortarPiece& q, const double* at,
                            const double* at_there, double wide) {
  Sample s;
  side_basis(dim_, surface_->whole[std::size_t(p.whole)].nodes, at, s.own);
  side_shape(dim_, other_surface_->whole[std::size_t(q.whole)].nodes, at_there, s.there);
  s.wide = wide;
  s.whole = q.whole;
  std::copy_n(f.normal, 3, s.normal);
  samples_.push_back(s);
}

bool MortarPair::common_length(const MortarPiece& p, const PieceFrame& f, const Flat& here, const MortarPiece& q,
                               const Flat& there) {
  const double from = here.x[0][0], to = here.x[1][0], a = there.x[0][0], b = there.x[1][0];
  const double low = std::max(from, b), high = std::min(to, a); // the other goes the other way
  if (!(high - low > least_part * (to - from))) return false;
  for (int g = 0; g < five_points.points; ++g) {
    const double x = low + (high - low) * five_points.at[g];
    const double t = (x - from) / (to - from), s = (x - a) / (b - a);
    const double at[2] = {p.at[0][0] + t * (p.at[1][0] - p.at[0][0]), 0};
    const double at_there[2] = {q.at[0][0] + s * (q.at[1][0] - q.at[0][0]), 0};
    add_sample(p, f, q, at, at_there, five_points.wide[g] * (high - low) * f.size);
  }
  covered_ += (high - low) * f.size;
  return true;
}

// True if two pieces are beside each other: their gap is at most the width of the first.
bool MortarPair::beside(const Flat& one, const Flat& other) const {
  for (int k = 0; k < dim_ - 1; ++k) {
    double low[2], high[2];
    for (int of = 0; of < 2; ++of) {
      const Flat& flat = of == 0 ? one : other;
      low[of] = high[of] = flat.x[0][k];
      for (int i = 1; i < flat.corners; ++i) {
        low[of] = std::min(low[of], flat.x[i][k]);
        high[of] = std::max(high[of], flat.x[i][k]);
      }
    }
    const double wide = high[0] - low[0];
    if (low[1] > high[0] + wide || high[1] < low[0] - wide) return false;
  }
  return true;
}

// True if each piece is behind the other by over half a cell: far sides of two bodies that just interpenetrate face
// each other through both bodies, and share a strip as wide as the penetration.
bool MortarPair::deep_behind(const MortarPiece& p, const PieceFrame& f, const MortarPiece& q,
                             const PieceFrame& opposite) const {
  const double size = std::max(f.size, opposite.size);
  const auto behind = [&](const MortarPiece& piece, const MeshBody& mesh, const PieceFrame& of) {
    for (int i = 0; i < piece.corners; ++i) {
      const double* x = place(mesh, piece.node[i]);
      double away = 0;
      for (int k = 0; k < dim_; ++k) away += of.normal[k] * (x[k] - of.middle[k]);
      if (away > -0.5 * size) return false;
    }
    return true;
  };
  return behind(q, *other_, f) && behind(p, *own_, opposite);
}

// Adds the common part of a piece with a piece of the other mesh in front of it. True if that one is beside it or in
// front.
bool MortarPair::common(const MortarPiece& p, const PieceFrame& f, const Flat& here, const MortarPiece& q) {
  PieceFrame opposite;
  if (!frame_of(*nodes_, *other_, q, opposite) || !(dot(opposite.normal, f.normal, dim_) < -least_facing)) return false;
  const Flat there = flat(*other_, q, f);
  if (!beside(here, there)) return false;
  if (deep_behind(p, f, q, opposite)) return true;
  if (dim_ == 2) {
    if (common_length(p, f, here, q, there)) front_.push_back(std::int32_t(&q - other_surface_->piece.data()));
    return true;
  }
  double part[2][16][2];
  int n = there.corners, now = 0;
  for (int i = 0; i < n; ++i) std::copy_n(there.x[n - 1 - i], 2, part[0][i]); // anticlockwise as p sees it
  for (int e = 0; e < here.corners && n > 2; ++e) {
    n = cut(part[now], n, here.x[e], here.x[(e + 1) % here.corners], part[1 - now]);
    now = 1 - now;
  }
  const double area = n > 2 ? area_of(part[now], n) : 0;
  if (!(area > least_part * area_of(here.x, here.corners))) return true;
  covered_ += area * f.size * f.size;
  front_.push_back(std::int32_t(&q - other_surface_->piece.data()));
  const bool linear =
      surface_->whole[std::size_t(p.whole)].nodes == 3 && other_surface_->whole[std::size_t(q.whole)].nodes == 3;
  const Rule& rule = linear ? two_points : five_points;
  for (int i = 2; i < n; ++i) { // triangles, each as a square one side of which is a point
    const double *a = part[now][0], *b = part[now][i - 1], *c = part[now][i];
    const double twice = turn(a, b, c) * f.size * f.size;
    for (int g = 0; g < rule.points; ++g)
      for (int h = 0; h < rule.points; ++h) {
        const double u = rule.at[g], v = rule.at[h];
        double x[2], at[2], at_there[2];
        for (int k = 0; k < 2; ++k) x[k] = a[k] + u * ((b[k] - a[k]) + v * (c[k] - b[k]));
        place_on(p, here.x, x, at);
        place_on(q, there.x, x, at_there);
        add_sample(p, f, q, at, at_there, rule.wide[g] * rule.wide[h] * u * twice);
      }
  }
  return true;
}

// Pieces of the other mesh in front of one of its own: from seeds on over those that are beside it.
void MortarPair::search(const MortarPiece& p, std::span<const std::int32_t> seeds) {
  PieceFrame f;
  if (!frame_of(*nodes_, *own_, p, f)) return;
  whole_ += dim_ == 2 ? f.size : f.size * f.size;
  const Flat here = flat(*own_, p, f);
  ++now_;
  queue_.clear();
  const auto meet = [&](std::int32_t piece) {
    if (met_[std::size_t(piece)] == now_) return;
    met_[std::size_t(piece)] = now_;
    queue_.push_back(piece);
  };
  for (const std::int32_t seed : seeds) meet(seed);
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    const MortarPiece& q = other_surface_->piece[std::size_t(queue_[i])];
    if (!common(p, f, here, q)) continue;
    for (int j = 0; j < q.corners; ++j) {
      const auto node = std::size_t(q.node[j]);
      for (std::int32_t e = other_surface_->pieces_start[node]; e < other_surface_->pieces_start[node + 1]; ++e)
        meet(other_surface_->pieces_at[std::size_t(e)]);
    }
  }
}

bool MortarPair::add_side(std::int32_t whole, std::span<const std::int32_t> seeds, std::int64_t seen) {
  const MortarWhole& w = surface_->whole[std::size_t(whole)];
  samples_.clear();
  front_.clear();
  covered_ = whole_ = 0;
  for (std::int32_t k = w.first_piece; k < w.end_piece; ++k) search(surface_->piece[std::size_t(k)], seeds);
  return covered_ > least_share * whole_ && add_rows(w, seen);
}

// Dual functions of the part in common, psi = diag(int B) (int B B')^-1 B, so that int psi_j B_k = delta_jk int B_j
// there.
bool MortarPair::add_rows(const MortarWhole& w, std::int64_t seen) {
  const int n = w.nodes;
  double both[most_side_nodes][most_side_nodes] = {}, sum[most_side_nodes] = {};
  for (const Sample& s : samples_)
    for (int j = 0; j < n; ++j) {
      sum[j] += s.wide * s.own[j];
      for (int k = 0; k < n; ++k) both[j][k] += s.wide * s.own[j] * s.own[k];
    }
  constexpr double too_thin = 1e-13; // for this many functions
  if (!invert_symmetric(std::size_t(n), both, too_thin)) return false;
  for (int j = 0; j < n; ++j) {
    MortarRow& row = row_of(w.node[j], seen);
    row.diagonal += sum[j];
    for (const Sample& s : samples_) {
      for (int k = 0; k < dim_; ++k) row.normal[k] -= s.wide * s.own[j] * s.normal[k];
      double psi = 0;
      for (int k = 0; k < n; ++k) psi += both[j][k] * s.own[k];
      const MortarWhole& there = other_surface_->whole[std::size_t(s.whole)];
      for (int l = 0; l < there.nodes; ++l) {
        auto at = std::size_t(std::find(row.there.begin(), row.there.end(), there.node[l]) - row.there.begin());
        if (at == row.there.size()) {
          row.there.push_back(there.node[l]);
          row.weight.push_back(0);
        }
        row.weight[at] += s.wide * sum[j] * psi * s.there[l];
      }
    }
  }
  return true;
}

MortarRow& MortarPair::row_of(std::int32_t node, std::int64_t seen) {
  std::int32_t& at = place_of_node_[std::size_t(node)];
  if (at >= 0) return rows_[std::size_t(at)];
  at = std::int32_t(used_++);
  if (rows_.size() < used_) rows_.emplace_back();
  MortarRow& row = rows_[std::size_t(at)];
  row.node = node;
  row.seen = seen;
  row.diagonal = 0;
  std::fill_n(row.normal, 3, 0.0);
  row.there.clear();
  row.weight.clear();
  return row;
}

} // namespace cairn
