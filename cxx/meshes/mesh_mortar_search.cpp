// Search for slave sides of mortars near sides of other meshes where detection saw no node of the slave beside the
// other: a body narrower than the side of a cell fits between its nodes.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/cell.hpp"
#include "../bodies/body.hpp"
#include "../detection/interaction_handler.hpp"
#include "../laws/law_rules.hpp"
#include "mortar_contacts.hpp"
#include "mortar_work.hpp"

namespace cairn {
namespace {

using Box = MortarBox;

double share(const Margin& margin, std::int32_t contactor) { // of the alert distance of a pair
  return margin.per_contactor ? margin.per_contactor[contactor] : margin.constant / 2;
}

Box box_of(const Nodes& nodes, const MeshBody& mesh, const std::int32_t* node, int count, double wider) {
  Box box;
  for (int k = 0; k < nodes.dim; ++k) {
    box.low[k] = std::numeric_limits<double>::infinity();
    box.high[k] = -box.low[k];
    for (int j = 0; j < count; ++j) {
      const double x = nodes.position[mesh.node(node[j])][k];
      box.low[k] = std::min(box.low[k], x - wider);
      box.high[k] = std::max(box.high[k], x + wider);
    }
  }
  return box;
}

void take_in(Box& all, const Box& one, int dim) {
  for (int k = 0; k < dim; ++k) {
    all.low[k] = std::min(all.low[k], one.low[k]);
    all.high[k] = std::max(all.high[k], one.high[k]);
  }
}

Box empty_box() {
  Box box;
  for (int k = 0; k < 3; ++k) {
    box.low[k] = std::numeric_limits<double>::infinity();
    box.high[k] = -box.low[k];
  }
  return box;
}

bool meet(const Box& one, const Box& two, int dim) {
  for (int k = 0; k < dim; ++k)
    if (one.high[k] < two.low[k] || two.high[k] < one.low[k]) return false;
  return true;
}

// Calls use(i, j) for each two boxes that meet, i before j along the axis.
template <class Use>
void each_pair(std::vector<Box>& boxes, int dim, int axis, std::vector<std::int32_t>& open, Use&& use) {
  std::sort(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) { return a.low[axis] < b.low[axis]; });
  open.clear();
  for (std::size_t j = 0; j < boxes.size(); ++j) {
    std::size_t kept = 0;
    for (const std::int32_t i : open) {
      if (boxes[std::size_t(i)].high[axis] < boxes[j].low[axis]) continue;
      open[kept++] = i;
      if (meet(boxes[std::size_t(i)], boxes[j], dim)) use(boxes[std::size_t(i)], boxes[j]);
    }
    open.resize(kept);
    open.push_back(std::int32_t(j));
  }
}

} // namespace

void MortarContacts::seek_sides(const Nodes& nodes, const Search& search) {
  MortarWork& work = *work_;
  work.of_meshes.clear();
  Box all = empty_box();
  for (std::size_t m = 0; m < work.meshes.size(); ++m) {
    Box box = empty_box();
    for (std::size_t p = 0; p < work.surfaces[m].piece.size(); ++p) {
      const std::int32_t contactor = work.contactor_of_piece[m][p];
      if (contactor < 0) continue;
      const MortarPiece& piece = work.surfaces[m].piece[p];
      take_in(box, box_of(nodes, *work.meshes[m], piece.node, piece.corners, share(search.margin, contactor)),
              nodes.dim);
    }
    if (!(box.low[0] <= box.high[0])) continue;
    box.index = std::int32_t(m);
    take_in(all, box, nodes.dim);
    work.of_meshes.push_back(box);
  }
  int axis = 0;
  for (int k = 1; k < nodes.dim; ++k)
    if (all.high[k] - all.low[k] > all.high[axis] - all.low[axis]) axis = k;
  each_pair(work.of_meshes, nodes.dim, axis, work.open_meshes, [&](const Box& one, const Box& two) {
    seek_sides_of(nodes, search, one, two);
    seek_sides_of(nodes, search, two, one);
  });
}

// Pieces of another mesh that stand before sides of one that asks, no deeper behind each other than margins are.
void MortarContacts::seek_sides_of(const Nodes& nodes, const Search& search, const MortarBox& own_box,
                                   const MortarBox& other_box) {
  const std::int32_t own = own_box.index, other = other_box.index;
  if (!work_->meshes[std::size_t(own)]->model.mortar) return;
  MortarWork& work = *work_;
  const MeshBody &mesh = *work.meshes[std::size_t(own)], &other_mesh = *work.meshes[std::size_t(other)];
  const MortarSurface &surface = work.surfaces[std::size_t(own)], &there = work.surfaces[std::size_t(other)];
  const auto first_of = [&](const MortarWhole& w) { return work.contactor[std::size_t(own)][std::size_t(w.node[0])]; };
  work.boxes.clear();
  Box common = empty_box();
  for (std::size_t k = 0; k < surface.whole.size(); ++k) {
    if (!work.asks[std::size_t(own)][k]) continue;
    const MortarWhole& w = surface.whole[k];
    Box box = box_of(nodes, mesh, w.node, w.nodes, share(search.margin, first_of(w)));
    if (!meet(box, other_box, nodes.dim)) continue;
    box.index = std::int32_t(k);
    take_in(common, box, nodes.dim);
    work.boxes.push_back(box);
  }
  if (work.boxes.empty()) return;
  for (std::size_t p = 0; p < there.piece.size(); ++p) {
    const std::int32_t contactor = work.contactor_of_piece[std::size_t(other)][p];
    if (contactor < 0) continue;
    Box box = box_of(nodes, other_mesh, there.piece[p].node, there.piece[p].corners, share(search.margin, contactor));
    if (!meet(box, common, nodes.dim)) continue;
    box.index = -1 - std::int32_t(p);
    work.boxes.push_back(box);
  }
  int axis = 0;
  for (int k = 1; k < nodes.dim; ++k)
    if (common.high[k] - common.low[k] > common.high[axis] - common.low[axis]) axis = k;
  const auto& material = search.contactors.material.values;
  each_pair(work.boxes, nodes.dim, axis, work.open, [&](const Box& one, const Box& two) {
    if ((one.index < 0) == (two.index < 0)) return;
    const MortarWhole& w = surface.whole[std::size_t(std::max(one.index, two.index))];
    const std::int32_t p = -1 - std::min(one.index, two.index);
    const std::int32_t node = first_of(w), side = work.contactor_of_piece[std::size_t(other)][std::size_t(p)];
    if (!search.rules.all_meet() &&
        !search.rules.meets(search.rules.between(material[std::size_t(node)], material[std::size_t(side)])))
      return;
    PieceFrame f;
    if (!frame_of(nodes, other_mesh, there.piece[std::size_t(p)], f)) return;
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (int j = 0; j < w.nodes; ++j) {
      const double* x = nodes.position[mesh.node(w.node[j])];
      double away = 0;
      for (int k = 0; k < nodes.dim; ++k) away += f.normal[k] * (x[k] - f.middle[k]);
      least = std::min(least, away);
      most = std::max(most, away);
    }
    const double within = share(search.margin, node) + share(search.margin, side);
    if (least > within || most < -within) return;
    bool faces = false;
    for (std::int32_t k = w.first_piece; k < w.end_piece; ++k)
      faces =
          faces || face_each_other(nodes, mesh, surface.piece[std::size_t(k)], other_mesh, there.piece[std::size_t(p)]);
    // any candidate of a node is nearer than this
    if (faces)
      work.met.push_back({own, other, w.node[0], p, side, 0, own_image, std::numeric_limits<double>::infinity()});
  });
}

} // namespace cairn
