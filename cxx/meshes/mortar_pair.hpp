// Mortar of the slave sides of one mesh with the master sides of another: D_jk = int psi_j B_k on the slave side,
// diagonal by dual functions psi, and M_jl = int psi_j N_l on the master side, over their common parts (Wohlmuth 2000;
// Puso & Laursen 2004; Popp et al. 2012).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "../bodies/nodes.hpp"
#include "mesh_body.hpp"
#include "mortar_surface.hpp"

namespace cairn {

struct MortarRow { // of a node of its own
  std::int32_t node = -1;
  std::int64_t seen = -1;          // what the caller keeps with it
  double diagonal = 0;             // D_jj [m2], in 2D of a metre across the plane
  double normal[3] = {0, 0, 0};    // sum of those of its sides, inward, by their share of D_jj
  std::vector<std::int32_t> there; // nodes of the other mesh
  std::vector<double> weight;      // M_jl
};

struct PieceFrame { // its middle, its normal, and axes along it
  double middle[3], normal[3], axis[2][3], size;
};
bool frame_of(const Nodes& nodes, const MeshBody& mesh, const MortarPiece& piece, PieceFrame& frame); // false: no size
// True if pieces of two meshes face each other by their normals, at any distance.
bool face_each_other(const Nodes& nodes, const MeshBody& mesh, const MortarPiece& piece, const MeshBody& other_mesh,
                     const MortarPiece& other);

class MortarPair {
public:
  void start(const Nodes& nodes, const MeshBody& own, const MortarSurface& own_surface, const MeshBody& other,
             const MortarSurface& other_surface);
  // Adds the common part of a whole side with the other mesh, searched from some of its pieces; `seen` goes to new
  // rows. True if there is a common part; front() then has the pieces of the other mesh.
  bool add_side(std::int32_t whole, std::span<const std::int32_t> seeds, std::int64_t seen);
  std::span<const std::int32_t> front() const { return front_; }
  std::span<const MortarRow> rows() const { return {rows_.data(), used_}; }

private:
  struct Sample { // a point of a rule on a part that two pieces have in common
    double own[most_side_nodes], there[most_side_nodes], wide, normal[3];
    std::int32_t whole; // there
  };
  struct Flat { // a piece on the plane, or line, on which parts in common are sought
    int corners = 0;
    double x[4][2] = {};
  };
  const double* place(const MeshBody& mesh, std::int32_t node) const { return nodes_->position[mesh.node(node)]; }
  Flat flat(const MeshBody& mesh, const MortarPiece& p, const PieceFrame& f) const;
  void search(const MortarPiece& p, std::span<const std::int32_t> seeds);
  bool common(const MortarPiece& p, const PieceFrame& f, const Flat& here, const MortarPiece& q);
  bool beside(const Flat& one, const Flat& other) const;
  bool deep_behind(const MortarPiece& p, const PieceFrame& f, const MortarPiece& q, const PieceFrame& opposite) const;
  bool common_length(const MortarPiece& p, const PieceFrame& f, const Flat& here, const MortarPiece& q,
                     const Flat& there);
  void add_sample(const MortarPiece& p, const PieceFrame& f, const MortarPiece& q, const double* at,
                  const double* at_there, double wide);
  bool add_rows(const MortarWhole& w, std::int64_t seen);
  MortarRow& row_of(std::int32_t node, std::int64_t seen);

  const Nodes* nodes_ = nullptr;
  const MeshBody *own_ = nullptr, *other_ = nullptr;
  const MortarSurface *surface_ = nullptr, *other_surface_ = nullptr;
  int dim_ = 2;
  double covered_ = 0, whole_ = 0; // of the side at hand
  std::vector<Sample> samples_;
  std::vector<std::int32_t> queue_, front_, place_of_node_;
  std::vector<std::int64_t> met_; // when each piece of the other was last seen
  std::int64_t now_ = 0;
  std::vector<MortarRow> rows_;
  std::size_t used_ = 0;
};

} // namespace cairn
