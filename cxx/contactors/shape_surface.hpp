// Surface of a shape where a contact sees it: contactors/shapes/NAME.cpp describes it for each row of shapes.def.
#pragma once
#include <cstdint>

#include "contactor.hpp"
#include "face_outline.hpp"

namespace cairn {

// Along t t, t s and s s of a contact, in 2D along t alone [1/m]: flat 0, hollow below 0. An edge is sharp along one
// direction of the plane, a corner along all; no number stands for that.
struct SurfaceCurvature {
  double k[3] = {0, 0, 0};
  int sharp = 0;      // directions
  bool rocks = false; // a flat face of a superquadric looks at the contact
  double across[2] = {1, 0};
  bool is_flat() const { return !(sharp || k[0] != 0 || k[1] != 0 || k[2] != 0); }
};

// A contact seen from one of its contactors, in the axes of the body that carries it.
struct CurvatureView {
  double outward[3], t[3], s[3], at[3]; // at: from the centre of the contactor [m]
  double size;
};

// Numbers that describe one contactor, in the axes of its body.
struct ShapeData {
  int dim;
  double radius;                 // [m]
  double direction[3];           // unit vector, 0 where the shape has none
  const Hulls* hulls;            // of the scene
  std::int32_t hull;             // read for shapes that are hulls
  const double* vertex() const { // (dim, vertices) [m]
    return &hulls->vertex[std::size_t(dim * hulls->first_vertex[std::size_t(hull)])];
  }
  const double* normal() const { // (dim, faces)
    return &hulls->normal[std::size_t(dim * hulls->first_face[std::size_t(hull)])];
  }
  const double* offset() const { return &hulls->offset[std::size_t(hulls->first_face[std::size_t(hull)])]; } // [m]
};

// Functions of a shape; null where it has nothing of the kind.
struct ShapeSurface {
  // Curvature at a contact; false where the shape does not tell.
  bool (*curvature)(const ShapeData&, const CurvatureView&, SurfaceCurvature&);
  // Outline of the flat face that looks along `sense` times the normal of a contact; false where none does.
  bool (*face)(const ShapeData&, const FaceSight&, int sense, FaceOutline&) = nullptr;
  // Radius of a ball as curved as the round end with this outward normal, in the axes of the body [m]; 0 where the
  // surface is flat or sharp.
  double (*round_end)(const ShapeData&, const double* normal) = nullptr;
};

const ShapeSurface& surface_of(Shape shape);
ShapeData data_of(const Contactors& contactors, std::int32_t contactor);

} // namespace cairn
