// Faces of two bodies seen along the normal of a contact, and how much of them lies before each other.
#pragma once
#include "../contactors/face_outline.hpp"

namespace cairn {

inline constexpr int most_face_points = 64; // of a pair, that are looked at
inline constexpr double area_rounding = 1e-9;

// Area of the convex polygon of some points (3, count) in the plane across a normal, none if they are on a line [m2].
double area_of_points(const double* point, int count, const double* normal);

// Part of a triangle that belongs to a corner, by the shares of its corners: a quadrilateral between the corner, a
// point of each edge there and an inner point. With equal shares these are the middles.
void part_of_corner(const FaceOutline& triangle, const double* share, int corner, FaceOutline& part);

// Area that two outlines share [m2].
double shared_area(const FaceOutline& a, const FaceOutline& b);

} // namespace cairn
