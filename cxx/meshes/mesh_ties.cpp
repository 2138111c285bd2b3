#include "mesh_ties.hpp"

#include <algorithm>
#include <cmath>

#include "../base/call.hpp"
#include "../base/vectors.hpp"

namespace cairn {

void MeshTies::start(int dim, const std::vector<double>& place, const SparseMatrix& pattern,
                     const SoeOptions& options) {
  dim_ = dim;
  dofs_ = std::int64_t(place.size());
  const auto parts = std::int64_t(rigid_first.size()) - 1;
  unknowns_ = dofs_ + parts * (3 * dim - 3);
  options_ = options;
  take_rows();
  arm_.resize(std::size_t(dim) * rigid_node.size());
  set_arms(place.data(), nullptr, 0);
  options_.held.resize(std::size_t(unknowns_), 0);
  options_.last.resize(std::size_t(unknowns_), 1); // rigid parts are wide
  for (std::int64_t i = 0; i < dofs_; ++i)
    if (follows_[std::size_t(i)]) options_.held[std::size_t(i)] = 1;
  take_pattern(pattern);
  work_.resize(std::size_t(unknowns_));
}

// Rows of T: a 1 where a dof follows nothing, weights of ties, and places for those of rigid parts.
void MeshTies::take_rows() {
  follows_.assign(std::size_t(dofs_), 0);
  bound_ = follows_;
  const auto name = [&](std::int64_t i) {
    return "node " + std::to_string(i / dim_) + ", dof " + std::string(1, "xyz"[i % dim_]);
  };
  const auto take = [&](std::int64_t i) {
    if (i < 0 || i >= dofs_) throw Error("ties name dof " + std::to_string(i) + " of " + std::to_string(dofs_));
    if (follows_[std::size_t(i)]) throw Error("ties: " + name(i) + " follows twice: tie it, or let it be rigid, once");
    if (options_.held[std::size_t(i)])
      throw Error("ties: " + name(i) + " follows others and is held: hold what it follows, or leave it out of one");
    follows_[std::size_t(i)] = bound_[std::size_t(i)] = 1;
  };
  for (const std::int32_t i : dof) take(i);
  for (const std::int32_t n : rigid_node)
    for (int k = 0; k < dim_; ++k) take(dim_ * std::int64_t(n) + k);
  for (const std::int32_t i : master) {
    if (i < 0 || i >= dofs_) throw Error("ties name dof " + std::to_string(i) + " of " + std::to_string(dofs_));
    if (follows_[std::size_t(i)]) throw Error("ties: " + name(i) + " is followed and follows: tie to what is free");
    bound_[std::size_t(i)] = 1;
  }
  std::vector<std::int64_t> tie(std::size_t(dofs_), -1), part(std::size_t(dofs_), -1);
  for (std::size_t t = 0; t < dof.size(); ++t) tie[std::size_t(dof[t])] = std::int64_t(t);
  for (std::size_t p = 0; p + 1 < rigid_first.size(); ++p)
    for (std::int64_t j = rigid_first[p]; j < rigid_first[p + 1]; ++j)
      for (int k = 0; k < dim_; ++k) part[std::size_t(dim_ * rigid_node[std::size_t(j)] + k)] = std::int64_t(p);
  start_.assign(1, 0);
  for (std::int64_t i = 0; i < dofs_; ++i) {
    if (const std::int64_t t = tie[std::size_t(i)]; t >= 0) {
      for (std::int64_t e = first[std::size_t(t)]; e < first[std::size_t(t) + 1]; ++e) {
        column_.push_back(master[std::size_t(e)]);
        value_.push_back(weight[std::size_t(e)]);
      }
    } else if (const std::int64_t p = part[std::size_t(i)]; p >= 0) {
      const auto of_part = std::int32_t(dofs_ + p * (3 * dim_ - 3));
      const auto k = std::int32_t(i % dim_);
      column_.push_back(of_part + k); // then its spins: the one of the plane, or the two across the axis
      value_.push_back(1);
      for (int s = 0; s < dim_ - 1; ++s) {
        column_.push_back(of_part + dim_ + (dim_ == 2 ? 0 : (k + 1 + s) % 3));
        value_.push_back(0);
        if (dim_ == 2) break;
      }
    } else {
      column_.push_back(std::int32_t(i));
      value_.push_back(1);
    }
    start_.push_back(std::int64_t(column_.size()));
  }
}

void MeshTies::take_pattern(const SparseMatrix& a) {
  std::vector<std::pair<std::int32_t, std::int32_t>> keys; // column, row
  const auto each = [&](auto&& found) {
    for (std::int64_t j = 0; j < a.n; ++j)
      for (std::int64_t e = a.start[std::size_t(j)]; e < a.start[std::size_t(j) + 1]; ++e) {
        const std::int64_t i = a.row[std::size_t(e)];
        for (std::int64_t p = start_[std::size_t(i)]; p < start_[std::size_t(i) + 1]; ++p)
          for (std::int64_t q = start_[std::size_t(j)]; q < start_[std::size_t(j) + 1]; ++q) {
            const std::int32_t r = column_[std::size_t(p)], c = column_[std::size_t(q)];
            if (i == j && r < c) continue; // the other of the two
            found(e, p, q, std::max(r, c), std::min(r, c), i != j && r == c ? 2.0 : 1.0);
          }
      }
  };
  each([&](std::int64_t, std::int64_t, std::int64_t, std::int32_t r, std::int32_t c, double) {
    keys.emplace_back(c, r);
  });
  for (std::int32_t i = 0; i < unknowns_; ++i) keys.emplace_back(i, i);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  pattern_ = {};
  pattern_.n = unknowns_;
  pattern_.start.assign(std::size_t(unknowns_) + 1, 0);
  for (const auto& [c, r] : keys) {
    ++pattern_.start[std::size_t(c) + 1];
    pattern_.row.push_back(r);
  }
  for (std::size_t c = 0; c < std::size_t(unknowns_); ++c) pattern_.start[c + 1] += pattern_.start[c];
  pattern_.value.assign(pattern_.row.size(), 0.0);
  terms_.clear();
  each([&](std::int64_t e, std::int64_t p, std::int64_t q, std::int32_t r, std::int32_t c, double times) {
    terms_.push_back({e, place_of(pattern_, r, c), p, q, times});
  });
}

const double* MeshTies::reduced(const double* value) {
  std::fill(pattern_.value.begin(), pattern_.value.end(), 0.0);
  for (const Term& t : terms_)
    pattern_.value[std::size_t(t.place)] +=
        t.times * (value_[std::size_t(t.one)] * value_[std::size_t(t.two)]) * value[t.entry];
  return pattern_.value.data();
}

void MeshTies::solve(const Soe& soe, double* b) {
  std::fill(work_.begin(), work_.end(), 0.0);
  for (std::size_t i = 0; i < std::size_t(dofs_); ++i)
    for (std::int64_t e = start_[i]; e < start_[i + 1]; ++e)
      if (const auto c = std::size_t(column_[std::size_t(e)]); !options_.held[c])
        work_[c] += value_[std::size_t(e)] * b[i];
  for (std::size_t i = 0; i < std::size_t(dofs_); ++i) // held dofs: the given x; slaves have no equation
    if (options_.held[i]) work_[i] = follows_[i] ? 0 : b[i];
  soe.solve(work_.data());
  for (std::size_t i = 0; i < std::size_t(dofs_); ++i) {
    double sum = 0;
    for (std::int64_t e = start_[i]; e < start_[i + 1]; ++e)
      sum += value_[std::size_t(e)] * work_[std::size_t(column_[std::size_t(e)])];
    b[i] = sum;
  }
}

// Mean velocity of a part, and the spin that is nearest to the velocities of its nodes.
void MeshTies::fit(std::size_t part, const double* v, double* mean, double* spin) const {
  const std::int64_t begin = rigid_first[part], end = rigid_first[part + 1];
  std::fill_n(mean, dim_, 0.0);
  for (std::int64_t j = begin; j < end; ++j)
    for (int k = 0; k < dim_; ++k) mean[k] += v[dim_ * rigid_node[std::size_t(j)] + k] / double(end - begin);
  double moment[3] = {0, 0, 0}, square = 0, a[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  for (std::int64_t j = begin; j < end; ++j) {
    const double* r = &arm_[std::size_t(dim_ * j)];
    double w[3], turned[3];
    for (int k = 0; k < dim_; ++k) w[k] = v[dim_ * rigid_node[std::size_t(j)] + k] - mean[k];
    if (dim_ == 2) {
      moment[0] += r[0] * w[1] - r[1] * w[0];
      square += r[0] * r[0] + r[1] * r[1];
      continue;
    }
    cross(r, w, turned);
    const double rr = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    for (int i = 0; i < 3; ++i) {
      moment[i] += turned[i];
      for (int k = 0; k < 3; ++k) a[i][k] += (i == k ? rr : 0) - r[i] * r[k];
    }
  }
  if (dim_ == 2) {
    spin[0] = moment[0] / square;
    return;
  }
  double first[3], second[3], third[3]; // columns of the adjugate
  cross(a[1], a[2], first);
  cross(a[2], a[0], second);
  cross(a[0], a[1], third);
  const double determinant = a[0][0] * first[0] + a[0][1] * first[1] + a[0][2] * first[2];
  for (int k = 0; k < 3; ++k)
    spin[k] = (first[k] * moment[0] + second[k] * moment[1] + third[k] * moment[2]) / determinant;
}

// Arms of the nodes of rigid parts at place + half * way, and with them their rows of T.
void MeshTies::set_arms(const double* place, const double* way, double half) {
  const int axes = dim_ == 2 ? 2 : 3;
  for (std::size_t p = 0; p + 1 < rigid_first.size(); ++p) {
    const std::int64_t begin = rigid_first[p], end = rigid_first[p + 1];
    double mean[3] = {0, 0, 0};
    for (int turn = 0; turn < 2; ++turn)
      for (std::int64_t j = begin; j < end; ++j)
        for (int k = 0; k < axes; ++k) {
          const std::int64_t i = dim_ * std::int64_t(rigid_node[std::size_t(j)]) + k;
          const double x = place[i] + (way ? half * way[i] : 0);
          if (turn == 0)
            mean[k] += x / double(end - begin);
          else
            arm_[std::size_t(dim_ * j + k)] = x - mean[k];
        }
    for (std::int64_t j = begin; j < end; ++j) {
      const double* r = &arm_[std::size_t(dim_ * j)];
      for (int k = 0; k < axes; ++k) {
        double* row = &value_[std::size_t(start_[std::size_t(dim_ * rigid_node[std::size_t(j)] + k)])];
        if (dim_ == 2) {
          row[1] = k == 0 ? -r[1] : r[0];
        } else { // (spin x r)_k = spin_(k+1) r_(k+2) - spin_(k+2) r_(k+1)
          row[1] = r[(k + 2) % 3];
          row[2] = -r[(k + 1) % 3];
        }
      }
    }
  }
}

void MeshTies::follow(double* v) const {
  const int axes = dim_ == 2 ? 2 : 3;
  for (std::size_t t = 0; t < dof.size(); ++t) {
    double sum = 0;
    for (std::int64_t e = first[t]; e < first[t + 1]; ++e) sum += weight[std::size_t(e)] * v[master[std::size_t(e)]];
    v[dof[t]] = sum;
  }
  for (std::size_t p = 0; !turns && p + 1 < rigid_first.size(); ++p) {
    double mean[3], spin[3];
    fit(p, v, mean, spin);
    for (std::int64_t j = rigid_first[p]; j < rigid_first[p + 1]; ++j) {
      const double* r = &arm_[std::size_t(dim_ * j)];
      double turned[3] = {0, 0, 0};
      if (dim_ == 2)
        turned[0] = -spin[0] * r[1], turned[1] = spin[0] * r[0];
      else
        cross(spin, r, turned);
      for (int k = 0; k < axes; ++k) v[dim_ * rigid_node[std::size_t(j)] + k] = mean[k] + turned[k];
    }
  }
}

void MeshTies::centripetal(const double* v, double* out) const {
  const int axes = dim_ == 2 ? 2 : 3;
  std::fill_n(out, dofs_, 0.0);
  for (std::size_t p = 0; p + 1 < rigid_first.size(); ++p) {
    double mean[3], spin[3], once[3], twice[3];
    fit(p, v, mean, spin);
    for (std::int64_t j = rigid_first[p]; j < rigid_first[p + 1]; ++j) {
      const double* r = &arm_[std::size_t(dim_ * j)];
      if (dim_ == 2) {
        twice[0] = -spin[0] * spin[0] * r[0], twice[1] = -spin[0] * spin[0] * r[1];
      } else {
        cross(spin, r, once);
        cross(spin, once, twice);
      }
      for (int k = 0; k < axes; ++k) out[dim_ * rigid_node[std::size_t(j)] + k] = twice[k];
    }
  }
}

// A part that turns by Cayley's rotation of its spin has, over the step, velocities that are those of the spin about
// where its nodes are in the middle.
void MeshTies::turn(double* way, const double* place, double h) {
  const int axes = dim_ == 2 ? 2 : 3;
  set_arms(place, way, h / 2);
  for (std::size_t p = 0; p + 1 < rigid_first.size(); ++p) {
    const std::int64_t begin = rigid_first[p], end = rigid_first[p + 1];
    double mean[3], spin[3], centre[3] = {0, 0, 0};
    fit(p, way, mean, spin);
    for (std::int64_t j = begin; j < end; ++j)
      for (int k = 0; k < axes; ++k) centre[k] += place[dim_ * rigid_node[std::size_t(j)] + k] / double(end - begin);
    double a[3] = {0, 0, 0}, square = 0;
    for (int k = 0; k < (dim_ == 2 ? 1 : 3); ++k) a[k] = h / 2 * spin[k], square += a[k] * a[k];
    for (std::int64_t j = begin; j < end; ++j) {
      const std::int64_t i = dim_ * std::int64_t(rigid_node[std::size_t(j)]);
      double r[3] = {0, 0, 0}, once[3] = {0, 0, 0}, twice[3] = {0, 0, 0};
      for (int k = 0; k < axes; ++k) r[k] = place[i + k] - centre[k];
      if (dim_ == 2) {
        once[0] = -a[0] * r[1], once[1] = a[0] * r[0];
        twice[0] = -square * r[0], twice[1] = -square * r[1];
      } else {
        cross(a, r, once);
        cross(a, once, twice);
      }
      for (int k = 0; k < axes; ++k) way[i + k] = mean[k] + 2 / (1 + square) * (once[k] + twice[k]) / h;
    }
  }
  set_arms(place, way, h / 2);
}

} // namespace cairn
