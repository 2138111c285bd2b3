// The C API of shapes that are hulls: polygons, polyhedra, facets of surfaces, capsules, cylinders, superquadrics.
#include <cmath>

#include "../contactors/hull_shapes.hpp"
#include "objects.hpp"

using cairn::Error;
using namespace cairn::api;

namespace {

void hand_back(std::int32_t first, std::int32_t* out) {
  if (out) *out = first;
}

void check_dim(const cairn_scene& scene, int dim, const char* what) {
  if (scene.scene.dim != dim)
    throw Error(std::string(what) + " are of " + std::to_string(dim) + "D scenes, and this one has " +
                std::to_string(scene.scene.dim) + " dimensions");
}

} // namespace

extern "C" {

int32_t cairn_scene_add_polygons(cairn_scene* scene, int64_t n, const int64_t* first_vertex, const double* vertex,
                                 int32_t* first, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(first_vertex, "first_vertex");
    require(vertex, "vertex");
    check_dim(*scene, 2, "polygons");
    cairn::HullBatch batch;
    batch.first_vertex = span_of(first_vertex, counted(n) + 1);
    batch.vertex = span_of(vertex, 2 * first_vertex[n]);
    hand_back(scene->scene.contactors.hulls.add(batch), first);
  });
}

int32_t cairn_scene_add_polyhedra(cairn_scene* scene, int64_t n, const int64_t* first_vertex, const double* vertex,
                                  const int64_t* first_face, const int64_t* first_corner, const int64_t* corner,
                                  int32_t* first, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(first_vertex, "first_vertex");
    require(vertex, "vertex");
    require(first_face, "first_face");
    require(first_corner, "first_corner");
    require(corner, "corner");
    check_dim(*scene, 3, "polyhedra");
    cairn::HullBatch batch;
    batch.first_vertex = span_of(first_vertex, counted(n) + 1);
    batch.vertex = span_of(vertex, 3 * first_vertex[n]);
    batch.first_face = span_of(first_face, n + 1);
    batch.first_corner = span_of(first_corner, first_face[n] + 1);
    batch.corner = span_of(corner, first_corner[first_face[n]]);
    hand_back(scene->scene.contactors.hulls.add(batch), first);
  });
}

int32_t cairn_scene_add_round_hulls(cairn_scene* scene, const char* shape, int64_t n, const double* sizes,
                                    int32_t* first, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(shape, "shape");
    require(sizes, "sizes");
    check_dim(*scene, 3, "capsules, cylinders and superquadrics");
    hand_back(cairn::add_round_hulls(scene->scene.contactors.hulls, shape, counted(n), sizes), first);
  });
}

int32_t cairn_scene_add_surface(cairn_scene* scene, int64_t body, int32_t material, int64_t vertices,
                                const double* vertex, int64_t triangles, const int32_t* triangle, cairn_error* error) {
  return guarded(error, [&] {
    require(scene, "scene");
    require(vertex, "vertex");
    require(triangle, "triangle");
    check_dim(*scene, 3, "surfaces");
    check_materials(1, &material, scene->matter.materials.size());
    cairn::Scene changed = scene->scene;
    cairn::add_surface(changed, body, material, span_of(vertex, 3 * counted(vertices)),
                       span_of(triangle, 3 * counted(triangles)));
    scene->scene = std::move(changed);
  });
}

} // extern "C"
