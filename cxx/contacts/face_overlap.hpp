// Faces of two bodies seen along the normal of a contact, and how much of them lies before each other.
#pragma once
#include <array>
#include <vector>

namespace cairn {

// A convex polygon, the disk at the end of a cylinder, or a plane without an end.
struct FaceOutline {
  std::vector<std::array<double, 2>> corner; // anticlockwise [m]
  std::array<double, 2> centre{};            // of the disk [m]
  double radius = 0;                         // of the disk [m], 0: none
  bool endless = false;
  double height = 0; // of one of its points along the normal [m]
  bool is_disk() const { return radius > 0; }
  void clear();
  void turn_left(); // corners in the order that is asked for
  double area() const;
};

inline constexpr int most_face_points = 64; // of a pair, that are looked at
inline constexpr double area_rounding = 1e-9;
inline constexpr double as_high = 1.0 / 1024;  // of the size of a body: largest distance of faces in contact
inline constexpr double flat_faces = 1 - 5e-5; // cosine of two faces that lie on each other

// Where a face is seen from: along a unit normal, from a point.
struct FaceView {
  const double *normal, *point;
  double size, gap; // size of the face seen there, and its distance from the other [m]
};

// Area of the convex polygon of some points (3, count) in the plane across a normal, none if they are on a line [m2].
double area_of_points(const double* point, int count, const double* normal);

// Part of a triangle that belongs to a corner, by the shares of its corners: a quadrilateral between the corner, a
// point of each edge there and an inner point. With equal shares these are the middles.
void part_of_corner(const FaceOutline& triangle, const double* share, int corner, FaceOutline& part);

// Area that two outlines share [m2].
double shared_area(const FaceOutline& a, const FaceOutline& b);

} // namespace cairn
