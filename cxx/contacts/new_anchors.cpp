// Anchors of bonds or joints that begin.
#include "new_bonds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "../contactors/shapes.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "body_axes.hpp"

namespace cairn {

// Makes the anchor of candidate i, for the last key of the memory. Shapes are taken as they are: a bent body carries
// the point as one of its present shape.
void NewBonds::anchor(std::int64_t i, const LawInfo& law) {
  const Candidates& c = *in_.candidates;
  const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
  const auto flat = [&](std::int32_t of) { return info(Shape(*in_.contactors->shape[of])).is_hull(); };
  const bool of_bodies = !(classes_.is_mapped(ca) || classes_.is_mapped(cb)) && flat(ca);
  // An anchor fixes the point on the flat side: detection would move the contact of a node near a rim to the corner.
  const bool of_node = classes_.is_mapped(ca) && !classes_.is_mapped(cb) && flat(cb) && !in_.meshes->turns(ca);
  const bool of_side =
      !law.spans && !classes_.is_mapped(ca) && classes_.is_mapped(cb) && flat(ca) && in_.meshes->turns(cb);
  if (!law.joins && !of_bodies && !of_side && !(of_node && !(*in_.contactors->radius[ca] > 0))) return;
  Anchor made;
  memory_.joints_came |= law.joins;
  law.joins ? anchor_joint(i, made) : anchor_bond(i, law, made);
  memory_.keys.back().feature = ~memory_.keys.back().feature; // none of those that detection gives
  memory_.anchors.resize(memory_.keys.size());
  memory_.anchors.back() = made;
}

void NewBonds::anchor_bond(std::int64_t i, const LawInfo& law, Anchor& made) const {
  const Candidates& c = *in_.candidates;
  const std::int32_t ca = c.contactor_a[i], cb = c.contactor_b[i];
  const int d = in_.dim() == 2 ? 2 : 3;
  double shift[3] = {0, 0, 0}, from_a[3] = {}, from_b[3] = {};
  if (in_.cell->any()) image_shift(*in_.cell, c.image[i], shift);
  const double* point = &c.point[d * i];
  double xa[3] = {}, xb[3] = {}, normal[3] = {}, gap = c.gap[i];
  std::copy_n(&c.normal[d * i], d, normal);
  in_.carrier_at(ca, xa);
  if (in_.body(cb) >= 0) in_.carrier_at(cb, xb);
  for (int k = 0; k < d; ++k) {
    from_a[k] = point[k] + gap / 2 * normal[k] - xa[k];
    from_b[k] = point[k] - gap / 2 * normal[k] - (xb[k] + shift[k]);
  }
  if (in_.body(ca) < 0) face_of_node(ca, cb, shift, normal, from_b);
  if (in_.body(ca) >= 0)
    to_body_axes(*in_.bodies, d, in_.body(ca), from_a, made.a); // nodes carry their end without a lever
  if (in_.body(cb) >= 0) {
    to_body_axes(*in_.bodies, d, in_.body(cb), from_b, made.b);
    to_body_axes(*in_.bodies, d, in_.body(cb), normal, made.normal);
  } else {
    const Mapping at = in_.meshes->mapping(*in_.nodes, cb, from_b, ca);
    std::copy_n(at.weight, 3, made.b);
  }
  std::copy_n(made.a, 3, made.shape_a);
  std::copy_n(made.b, 3, made.shape_b);
  made.reach = law.spans ? 0 : std::numeric_limits<double>::max();
  made.siblings = 1;
  if (!law.holds) return;
  made.length = 1; // it knows how its bodies stood
  frames_.keep_turn(ca, cb, made);
}

// A node on the rim of a hull lies on several of its faces, and rounding says which detection took: it is held by the
// one that a side of its mesh lies on. normal: in space axes, from: the end on B, from its centre in space axes.
void NewBonds::face_of_node(std::int32_t node, std::int32_t hull, const double* shift, double* normal,
                            double* from) const {
  const int d = in_.dim();
  const Hulls& hulls = in_.contactors->hulls;
  const MappedContactors& mapped_sides = in_.meshes->mapped();
  const std::int32_t which = *in_.contactors->hull[hull], place = mapped_sides.place[std::size_t(node)];
  if (hulls.form(which) != Hulls::Form::polygon && hulls.form(which) != Hulls::Form::polyhedron) return;
  if (mapped_sides.sides_start.empty()) return;
  const auto facing = [&](const double* face) { // how squarely a side at the node looks at it
    double most = -1;
    for (std::int64_t k = mapped_sides.sides_start[std::size_t(place)];
         k < mapped_sides.sides_start[std::size_t(place) + 1]; ++k) {
      double side[3], along = 0;
      in_.normal_of_side(mapped_sides.sides[std::size_t(k)], side);
      for (int l = 0; l < d; ++l) along -= face[l] * side[l];
      most = std::max(most, along);
    }
    return most;
  };
  double x[3] = {}, centre[3] = {}, at_node[3] = {}, best = facing(normal) + 1.0 / 64;
  if (in_.contactors->offset.active)
    to_space_axes(*in_.bodies, d, in_.body(hull), in_.contactors->offset[hull], centre);
  in_.carrier_at(node, at_node);
  for (int k = 0; k < d; ++k) x[k] = at_node[k] - (in_.bodies->position[in_.body(hull)][k] + shift[k]) - centre[k];
  const double near =
      2 * touch * std::max(*in_.contactors->radius[hull], in_.meshes->meshes[in_.meshes->mesh_of(node)].size());
  for (std::int32_t f = hulls.first_face[which]; f < hulls.first_face[which + 1]; ++f) {
    double face[3] = {}, distance = -hulls.offset[std::size_t(f)];
    to_space_axes(*in_.bodies, d, in_.body(hull), &hulls.normal[std::size_t(d) * std::size_t(f)], face);
    for (int k = 0; k < d; ++k) distance += face[k] * x[k];
    if (std::abs(distance) > near || !(facing(face) > best)) continue;
    best = facing(face);
    std::copy_n(face, d, normal);
    for (int k = 0; k < d; ++k) from[k] = x[k] + centre[k] - distance * face[k];
  }
}

// Half the way to the next anchored point of the pair. A rod stands for no point where bodies touch.
void NewBonds::space_anchors(std::size_t first) {
  if (memory_.anchors.empty()) return;
  memory_.anchors.resize(memory_.keys.size());
  const auto same_pair = [&](std::size_t i, std::size_t j) {
    const ContactKey &a = memory_.keys[i], &b = memory_.keys[j];
    return std::tie(a.contactor_a, a.contactor_b, a.image) == std::tie(b.contactor_a, b.contactor_b, b.image);
  };
  for (std::size_t i = first; i < memory_.keys.size(); ++i)
    for (std::size_t j = i + 1; j < memory_.keys.size() && same_pair(i, j); ++j) { // points of a pair stand together
      Anchor &one = memory_.anchors[i], &other = memory_.anchors[j];
      ++one.siblings;
      ++other.siblings;
      if (!(one.reach > 0) || !(other.reach > 0)) continue;
      double square = 0;
      for (int k = 0; k < in_.dim(); ++k) square += (one.a[k] - other.a[k]) * (one.a[k] - other.a[k]);
      one.reach = std::min(one.reach, std::sqrt(square) / 2);
      other.reach = std::min(other.reach, std::sqrt(square) / 2);
    }
}

// Its points are the middles of its ends, its axis is given as bodies stand when they come in.
void NewBonds::anchor_joint(std::int64_t i, Anchor& made) const {
  const Candidates& c = *in_.candidates;
  const int d = in_.dim();
  const double* params = classes_.rule(i).params;
  const std::int32_t B = in_.body(c.contactor_b[i]);
  double a[3] = {}, b[3] = {}, xa[3] = {}, xb[3] = {}, axis[3] = {}, shift[3] = {0, 0, 0}, square = 0;
  for (const auto& [contactor, to] : {std::pair{c.contactor_a[i], made.a}, std::pair{c.contactor_b[i], made.b}}) {
    std::fill_n(to, 3, 0.0);
    if (in_.contactors->offset.active && in_.body(contactor) >= 0)
      std::copy_n(in_.contactors->offset[contactor], d, to);
  }
  if (in_.cell->any()) image_shift(*in_.cell, c.image[i], shift);
  in_.carried(c.contactor_a[i], made.a, a);
  in_.carried(c.contactor_b[i], made.b, b);
  in_.carrier_at(c.contactor_a[i], xa);
  in_.carrier_at(c.contactor_b[i], xb);
  std::copy_n(params + joint_axis, d, axis);
  for (int k = 0; k < d; ++k) {
    const double between = xa[k] + a[k] - (xb[k] + shift[k] + b[k]);
    square += between * between;
    if (params[joint_spans] > 0) axis[k] = between;
  }
  made.length = std::sqrt(square);
  if (params[joint_spans] > 0)
    for (int k = 0; k < d; ++k) axis[k] /= made.length;
  B < 0 ? void(std::copy_n(axis, 3, made.normal)) : to_body_axes(*in_.bodies, d, B, axis, made.normal);
  std::copy_n(made.a, 3, made.shape_a);
  std::copy_n(made.b, 3, made.shape_b);
  made.reach = std::numeric_limits<double>::max();
  made.siblings = 1;
  frames_.keep_turn(c.contactor_a[i], c.contactor_b[i], made);
}

} // namespace cairn
