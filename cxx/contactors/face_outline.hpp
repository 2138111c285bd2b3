// Outline of a flat face seen along the normal of a contact.
#pragma once
#include <array>
#include <vector>

#include "../base/vectors.hpp"

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

// Area of a polygon, positive if its corners run anticlockwise [m2].
double signed_area(const std::vector<std::array<double, 2>>& corner);

inline constexpr double as_high = 1.0 / 1024;  // of the size of a body: largest distance of faces in contact
inline constexpr double flat_faces = 1 - 5e-5; // cosine of two faces that lie on each other

// Where a face is seen from: along a unit normal, from a point.
struct FaceView {
  const double *normal, *point;
  double size, gap; // size of the face seen there, and its distance from the other [m]
};

// The plane across the normal of a contact, from its point, in the axes of a body.
struct FaceSight {
  double normal[3], tangents[2][3], centre[3]; // centre of the contactor [m]
  double size, gap;                            // as in FaceView
  std::array<double, 3> place(const double* vertex) const {
    return {centre[0] + vertex[0], centre[1] + vertex[1], centre[2] + vertex[2]};
  }
  std::array<double, 2> corner(const double* vertex) const {
    const auto x = place(vertex);
    return {dot(tangents[0], x.data()), dot(tangents[1], x.data())};
  }
};

} // namespace cairn
