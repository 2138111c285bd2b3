// Curvatures of simple surfaces, which the shapes are made of.
#pragma once
#include "shape_surface.hpp"

namespace cairn::surface {

inline constexpr double flatness = 1e-7; // of the size: vertices so near are as far out, as hull_flatness has it

// Adds a curvature along a unit vector of the plane [1/m].
void add(double curvature, const double along[2], double k[3]);
void make_even(double curvature, SurfaceCurvature& out);
void make_corner(SurfaceCurvature& out);
// A straight edge along a vector.
void make_edge(const CurvatureView& view, const double* along, SurfaceCurvature& out);
// Curved across a direction alone, `along` itself being straight.
void bend_across(const CurvatureView& view, const double* along, double curvature, SurfaceCurvature& out);
// Marks a contact point apart from the lowest point of a round body as sharp, since it lies on a rim or a face: an edge
// (1) if it is displaced along the direction `line` in which the surface is straight, a corner (2) otherwise.
void mark_off(const CurvatureView& view, const double lowest[3], const double* line, SurfaceCurvature& out);

// Principal values of a symmetric matrix of a plane (11, 12, 22) and the unit vector along which the first is.
void principal(const double m[3], double value[2], double along[2]);

// Surfaces that several shapes have.
bool ball(const ShapeData& shape, const CurvatureView& view, SurfaceCurvature& out);
bool half_space(const ShapeData& shape, const CurvatureView& view, SurfaceCurvature& out);
// By the vertices farthest out: a corner, an edge or a face.
bool corners(const ShapeData& shape, const CurvatureView& view, SurfaceCurvature& out);

} // namespace cairn::surface
