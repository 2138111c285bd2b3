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
  bool is_disk() const { return radius > 0; }
  void clear();
  void turn_left(); // corners in the order that is asked for
  double area() const;
};

inline constexpr int most_face_points = 64; // of a pair, that are looked at
inline constexpr double area_rounding = 1e-9;
inline constexpr double flat_faces = 1 - 5e-5; // cosine of two faces that lie on each other

// Area of the convex polygon of some points (3, count) in the plane across a normal, none if they are on a line [m2].
double area_of_points(const double* point, int count, const double* normal);

// Area that two outlines share [m2].
double shared_area(const FaceOutline& a, const FaceOutline& b);

} // namespace cairn
