// Descriptions and history variables of the stresses of a mesh of solids.
#include "bulk_model.hpp"

#include <algorithm>

#include "umat.hpp"

namespace cairn {

std::int64_t BulkModel::first_not_by_energy() const {
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const BulkCells& c = cells_[k];
    const bool plain =
        c.kinematics == Kinematics::small || (!c.mean_dilatation && !(dim_ == 2 && c.plane == Plane::stress));
    if (!plain || c.material->umat || !c.material->state.empty()) return std::int64_t(k);
  }
  return -1;
}

std::string BulkModel::not_by_energy(const std::string& mesh) const {
  const std::int64_t block = first_not_by_energy();
  if (block < 0) return {};
  const BulkCells& c = cells_[std::size_t(block)];
  const char* why = ", which keeps more than an energy";
  if (c.material->state.empty() && !c.material->umat)
    why = c.mean_dilatation ? " with mean dilatation" : " in plane stress";
  return "the " + std::string(c.element->cell) + " cells of the mesh '" + mesh + "' are of " + c.material->python_name +
         why;
}

bool BulkModel::knows_energy() const {
  return std::none_of(blocks_.begin(), blocks_.end(), [](const Block& b) { return b.silent; });
}

bool BulkModel::finite() const {
  return std::any_of(cells_.begin(), cells_.end(),
                     [](const BulkCells& c) { return c.kinematics != Kinematics::small; });
}

void BulkModel::commit() { state_begin_ = state_; }

void BulkModel::take_history(std::span<const double> history) {
  std::copy(history.begin(), history.end(), state_begin_.begin());
}

void BulkModel::forget_history() { state_begin_ = state_at_start(); }

std::shared_ptr<InternalForces> BulkModel::another() {
  auto made = std::make_shared<BulkModel>(dim_, place_, cells_);
  made->wide_ = wide_;
  for (std::size_t k = 0; k < blocks_.size(); ++k) made->blocks_[k].entry = blocks_[k].entry;
  return made;
}

std::string BulkModel::describe(const BulkResult& r) const {
  const BulkCells& c = cells_[std::size_t(r.block)];
  std::string text = std::string(c.element->cell) + " cell " + std::to_string(r.cell) + " with nodes";
  for (int a = 0; a < c.element->nodes; ++a)
    text.append(" ").append(std::to_string(c.node[std::size_t(r.cell * c.element->nodes + a)]));
  if (r.fault == 1) return text + " is flat or inside out";
  if (r.fault == 3)
    return text + " is too large for the fracture energy of " + c.material->python_name +
           ": give smaller cells, or a length of your own";
  if (r.fault == 4) return text + ": " + c.material->python_name + " has softened to a yield stress of zero";
  if (r.fault == umat_writes_beyond)
    return text + ": " + c.material->python_name + " writes beyond the NTENS = " +
           (c.material->plane_stress ? "3 stresses of plane stress, 11 22 12" : "4 stresses of the plane, 11 22 33 12");
  if (r.fault == umat_ends) return text + ": " + c.material->python_name + " " + last_words(*c.material);
  if (r.fault == umat_leaves) return text + ": " + c.material->python_name + " calls XIT";
  if (r.fault == umat_wants_less) return text + ": " + c.material->python_name + " asks for a smaller step, PNEWDT < 1";
  return text + ": " + c.material->python_name + " finds no finite stress";
}

bool BulkModel::shorter_helps(const BulkResult& r) const {
  return r.fault != umat_writes_beyond && r.fault != umat_ends;
}

std::string BulkModel::remedy_of(const BulkResult& r) const {
  if (r.fault == umat_writes_beyond) return "give a routine that goes by NDI, NSHR and NTENS";
  if (r.fault == umat_ends)
    return "mend the routine, or what it is given; a new process is begun when it is asked again";
  if (r.fault == 4) return "give isotropic nearer to zero, or a smaller load";
  if (r.fault == umat_leaves) return "look at what it prints, or give a smaller dt, or NSCD(cut_back=3) to halve steps";
  if (r.fault == umat_wants_less) return "give a smaller dt, or NSCD(cut_back=3), by which steps are halved";
  return InternalForces::remedy_of(r);
}

std::string BulkModel::place_of_node(std::int64_t node) const {
  const std::string named = "node " + std::to_string(node) + ", ";
  for (const BulkCells& c : cells_) {
    const auto at = std::find(c.node.begin(), c.node.end(), std::int32_t(node));
    if (at != c.node.end())
      return named + c.element->cell + " cell " + std::to_string((at - c.node.begin()) / c.element->nodes);
  }
  return named + "no cell";
}

namespace {

void means(const double* of_points, std::int64_t cells, int points, int numbers, double* out) {
  for (std::int64_t cell = 0; cell < cells; ++cell)
    for (int k = 0; k < numbers; ++k) {
      double sum = 0;
      for (int p = 0; p < points; ++p) sum += of_points[(cell * points + p) * numbers + k];
      out[cell * numbers + k] = sum / points;
    }
}

} // namespace

void BulkModel::cell_stress(std::size_t block, double* out) const {
  means(stress_.data() + blocks_[block].first_stress, cells_[block].count(), cells_[block].element->bulk_points, 6,
        out);
}

void BulkModel::cell_state(std::size_t block, double* out) const {
  means(state_begin_.data() + blocks_[block].first_state, cells_[block].count(), cells_[block].element->bulk_points,
        blocks_[block].states, out);
}

std::int64_t BulkModel::bytes() const {
  std::int64_t sum = 8 * std::int64_t(place_.capacity() + state_.capacity() + state_begin_.capacity() +
                                      stress_.capacity() + force_.capacity() + stiffness_.capacity());
  for (std::size_t k = 0; k < cells_.size(); ++k)
    sum += 4 * std::int64_t(cells_[k].node.capacity() + blocks_[k].entry.capacity()) +
           8 * std::int64_t(cells_[k].initial_stress.capacity() + blocks_[k].stretch.capacity());
  return sum;
}

} // namespace cairn
