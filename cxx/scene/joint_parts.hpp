// Joints before they are part of a scene: their kinds and numbers by name, the law between their ends, and the marks on
// bodies that this law is of.
#pragma once
#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "scene.hpp"

namespace cairn {

enum class Law : std::int16_t;

// A row of joints.def. In 2D, then in 3D.
struct JointKind {
  const char* name;
  int blocked[2], coordinate[2], points;
  bool has_axis, turns, has_limits, has_spring, has_motor;
  const char* instead;
};
std::span<const JointKind> joint_kinds();

struct JointDraft {
  std::string kind;              // the name of a row of joints.def
  std::int64_t a = 0, b = -1;    // ids of rigid bodies or of nodes of meshes; b -1: the world
  std::span<const double> point; // (dim, joint_points(kind)) [m], absolute
  std::span<const double> axis;  // (dim), or empty
  std::vector<std::pair<std::string, double>>
      numbers; // lowest, highest, speed, effort, stiffness, damping, rest, strength; length and pulley, a body's id
};

// Number of points of a kind: Cable has its ends and the pulley between, Distance a point on each body, all others a
// shared point. Throws Error for an unknown kind, naming the known ones.
int joint_points(const std::string& kind);

// The law between the ends of a joint, and its parameters. Throws Error naming the problem and the remedy.
Law joint_law();
std::vector<double> joint_parameters(const Scene& scene, const JointDraft& draft);

// Puts the marks of a joint that was checked on its bodies, that of a first, so that a is the first body of its
// contact; the world gets a body that does not move. Returns the ids of both contactors of its contact, of a Cable that
// of an end and that of its pulley.
std::array<std::int64_t, 2> add_joint_ends(Scene& scene, const JointDraft& draft, std::int32_t material);

} // namespace cairn
