// Parts of Interactions, in the order in which a step uses them. No source but those of Interactions reads this.
#pragma once
#include "../solvers/sweeps/moving_cell.hpp"
#include "batch_assembly.hpp"
#include "body_records.hpp"
#include "contact_plan.hpp"
#include "contact_recorder.hpp"
#include "contact_work.hpp"
#include "impulse_transfer.hpp"
#include "interaction.hpp"
#include "joint_projection.hpp"
#include "law_commit.hpp"

namespace cairn {

struct Interactions::State {
  explicit State(int dim) : in(dim) { system.dim = dim; }
  void look_at(const Bodies& bodies, const Contactors& contactors, const Candidates& candidates, const LawTable& laws,
               const Cell& cell, MeshSet* meshes, Nodes* nodes) {
    in.bodies = &bodies;
    in.contactors = &contactors;
    in.candidates = &candidates;
    in.laws = &laws;
    in.cell = &cell;
    in.meshes = meshes && !meshes->empty() ? meshes : nullptr;
    in.nodes = nodes;
  }

  Scratch scratch; // data from assembly to the next detection
  ContactSystem system;
  ContactMemory memory;
  ContactEnergy energy;
  AssemblyInput in;
  MovingCell moving_cell;

  // contacts that are held by more than touch
  Ropes ropes{in, system};
  AnchoredContacts anchors{in, ropes, memory};
  // plan: which contact stands where
  ContactClasses classes{in, scratch};
  ContactPlan plan{in, classes, ropes, system, scratch};
  ContactMatcher matcher{in, classes, anchors, memory, system, scratch};
  BatchStorage storage{in, classes, ropes, system, scratch};
  // measures of a contact
  ContactCurvature curvature{in, classes, system};
  ContactAreas areas{in, classes, anchors, curvature};
  MidpointMotion motion{in, classes, anchors, curvature, ropes, system};
  // joints and bonds
  AnchorFrames frames{in, classes, anchors, ropes, motion, system};
  JointDrift drift{in, classes, anchors, frames, ropes, system};
  JointProjection projection{in, classes, anchors, frames, drift, memory, system};
  JointSwing swing{in, classes, anchors, frames, ropes, system};
  NewBonds new_bonds{in, classes, ropes, curvature, areas, frames, memory};
  // assembly: numbers of batches
  BodyRecords records{in, system, classes, frames};
  PluggedLawChecks plugged{in, classes, system};
  OverlapLimit overlap{in, system};
  ContactGrowth growth{in, storage, matcher, memory, system, energy};
  AppliedPose pose{in, storage, matcher, memory, system};
  WarmStart warm_start{in, matcher, motion, new_bonds, memory, system};
  PackedBatches packs{in, classes, storage, areas, curvature, motion, growth, warm_start, plugged, system};
  LawPreparation preparation{in,     classes, storage, areas, curvature, motion, anchors,
                             frames, growth,  pose,    packs, plugged,   system};
  BatchAssembly assembly{in, classes, ropes, swing, warm_start, overlap, packs, preparation, plugged, system};
  // what a solution leaves
  ImpulseTransfer transfer{in, system};
  ContactWork work{in, system, energy};
  LawCommit commit{in, classes, storage, plugged, system, energy};
  ContactRecorder recorder{in, classes, anchors, storage, matcher, memory, system};
  // faces to strategies and files
  StepJoints joints{in, drift, projection, swing, memory, system};
  ContactViews views{in, storage, system};
  std::vector<ContactKey> kept_keys;
};

} // namespace cairn
