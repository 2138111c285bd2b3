// The share of a rank: a simulation of the bodies that it owns, of ghosts, and of bodies that are everywhere.
#pragma once
#include <memory>
#include <vector>

#include "../simulation/simulation.hpp"
#include "exchange.hpp"

namespace cairn {

// Rows that follow each other in the whole and in a part.
struct Run {
  std::int64_t whole, part, rows;
};

struct Part {
  int rank = 0;
  std::unique_ptr<Simulation> simulation;
  Strategy* strategy = nullptr;                // its own
  std::vector<std::int32_t> bodies;            // internal numbers in the whole, rising: local body i is bodies[i]
  std::vector<std::uint8_t> own;               // (bodies)
  std::vector<Run> runs, own_runs, ghost_runs; // of all, of own ones, and of the others
  std::vector<std::int32_t> owner;             // (bodies) rank
  std::vector<std::uint8_t> fixed;             // (bodies) 1: contacts do not move it
  std::vector<double> position_then;           // (dim, bodies) when bodies were given to ranks [m]
  std::vector<double> radius_then;             // (bodies) of balls about centres that hold contactors, likewise [m]
  bool has_joints = false;                     // all that there are
  bool has_meshes = false;                     // it makes their step; contacts with them are on one rank alone
  std::vector<double> node_then;               // (dim, nodes) as position_then [m]
  Array<double> velocity, node_velocity; // (3 | 6, bodies), (dim, nodes) at the end of the step, as contacts leave it
};

// Deformable bodies in a part: none, their nodes, or nodes and contactors.
enum class MeshShare { none, nodes, all };
// Arrays of the whole that its parts hold or fill, one number for each array of bodies, then of contactors.
using Arrays = std::vector<std::uint8_t>;
// Rows of bodies of a new part, from the parts of their owners.
struct Arrived {
  Arrays arrays; // that they have
  std::vector<Parcel> rows;
};
// Part of the bodies of `whole`, which are named by internal numbers, with a strategy of the same settings. arrived:
// what the whole does not have of them; null: it has all.
Part make_part(const Simulation& whole, const Strategy& model, int rank, std::vector<std::int32_t> bodies,
               MeshShare meshes = MeshShare::none, const Arrived* arrived = nullptr);
// To be called when it is known which bodies are its own.
void find_runs(Part& part);
// State of nodes to the whole; the part has meshes.
void take_nodes(const Part& part, Simulation& whole);

// Holders of the present state of bodies.
enum class Known {
  whole,   // the whole alone, since somebody changed it
  by_both, // own bodies of the part stand as the whole has them
  parts    // the parts alone: the whole is as of an earlier step, or released
};
// State, loads and drives of bodies of the whole to those of the part.
void bring(const Simulation& whole, Part& part, Known known);

// Marks of arrays that are with the parts alone, or newer there.
Arrays arrays_of_parts(Simulation& whole);
// Released arrays, with `state` those of the state, with `workspace` those of the workspace, too. The whole has room
// for them afterwards.
Arrays arrays_to_fill(Simulation& whole, bool state, bool workspace);
// Rows of the bodies that the part owns to the whole.
void take(const Part& part, Simulation& whole, const Arrays& arrays);
// The same over processes: what take() would read, as bytes, and back.
void pack_own(const Part& part, const Simulation& whole, const Arrays& arrays, Packer& packer);
void take_packed(Piece bytes, Simulation& whole, const Arrays& arrays);
// The same of bodies of the part in any order, with their contactors: for make_part().
void pack_rows(const Part& part, const std::vector<std::int32_t>& bodies, const Simulation& whole, const Arrays& arrays,
               Packer& packer);
// Frees numbers of the whole that its parts hold too, and gives their memory back to the operating system. loads:
// somebody writes loads and drives of the whole, which stay.
void release(Simulation& whole, bool loads);
// Gives memory that was freed back to the operating system.
void return_freed_memory();
// Frees the workspace of the whole, which its parts have for their own bodies.
void release_workspace(Scene& whole);

} // namespace cairn
