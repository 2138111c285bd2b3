// A liquid before the start, and how it meets the bodies of a scene: points below surfaces, half-spaces and grains.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "fluid.hpp"
#include "fluid_end_draft.hpp"

namespace cairn {

// Points in layers below the surface of a shape, in its axes (3, n) [m], (3, n), (n) [m], (n) [m3 | m2], and how far
// below each the centre of curvature lies (n) [m].
struct SurfacePoints {
  std::vector<double> place, normal, depth, volume, centre;
  std::size_t count() const { return depth.size(); }
};

// Shells within a disk or a sphere, one spacing thick each; hollow: behind the surface of a ring.
SurfacePoints points_in_ball(int dim, double radius, double spacing, int layers, bool hollow);

// Ten times the greatest speed of a liquid that falls over its own height, with v, and 2 sigma / (rho R) of a drop as
// wide as it is; 0: nothing tells a speed. position (dim, n) [m], velocity (dim, m) [m/s], gravity (dim) along axes
// that are not periodic [m/s2].
double natural_sound_speed(int dim, const FluidSettings& settings, std::span<const double> position,
                           std::span<const double> velocity, std::span<const double> gravity);

void check_settings(const FluidSettings& settings); // throws Error for values that are wrong

// How the liquid meets contactors of a material or of a group; "*": of all.
struct FluidRule {
  std::string word;
  std::int8_t kind = 0; // Slip, or more: the drag of grains, see fluid_grains.f90
};

struct FluidDraft {
  FluidSettings settings;
  std::vector<double> position, velocity, pressure; // (dim, n) [m], absolute; (dim, n) [m/s]; (n) [Pa], none: of rest
  std::vector<FluidRule> rules;
  FluidSurface points; // of bodies of other shapes, given by the program; slip by the rules
  FluidEndDraft ends;

  // Rules of groups precede those of materials and "*"; the later of two counts. Without one it sticks.
  std::int8_t kind_of(const std::string& material, const std::string& group) const;
};

// The names of the materials of contactors, by number.
struct FluidMaterials {
  const std::vector<std::string>&materials, &groups;
};

// Throws Error if the liquid cannot meet new contactors, of a shape by its name.
void check_contactors(const FluidDraft& draft, const FluidMaterials& names, const std::string& shape,
                      std::span<const std::int64_t> body, const std::int32_t* material, const double* radius);

// Gives the liquid the surfaces of all contactors that it meets. Throws Error for shapes without points.
void give_surfaces(Fluid& fluid, const FluidDraft& draft, const Scene& scene, const FluidMaterials& names);

// The liquid of a draft. Throws Error for values that are wrong, and for particles in
// half-spaces, disks and spheres; those in other bodies are not looked for.
std::unique_ptr<Fluid> made_fluid(const FluidDraft& draft, const Scene& scene, const FluidMaterials& names);

} // namespace cairn
