#include "unit_fronts.hpp"

#include <algorithm>
#include <utility>

#include "cairn/core.h"

namespace cairn {

namespace {

constexpr std::int64_t lanes_at_once = 128; // of cairn_unit_products

// Calls use(first, end) for as many right sides as are taken at once.
template <class Use>
void each_chunk(std::int64_t lanes, int threads, Use&& use) {
  const std::int64_t chunks = (lanes + lanes_at_once - 1) / lanes_at_once;
  const int team = int(std::clamp<std::int64_t>(chunks, 1, std::max(threads, 1)));
#pragma omp parallel for num_threads(team) schedule(dynamic) if (team > 1)
  for (std::int64_t k = chunks - 1; k >= 0; --k) // the last has most products
    use(k * lanes_at_once, std::min((k + 1) * lanes_at_once, lanes));
}

// Nodes that places reach, each behind those that hand on to it, subtree by subtree.
std::vector<std::int32_t> reached(const SoeTree& tree, const std::vector<UnitFronts::Wanted>& wanted) {
  std::vector<std::int32_t> size(tree.parent.size(), 0), rising, order;
  const auto node = [&](std::int32_t place) { return tree.node.empty() ? place : tree.node[std::size_t(place)]; };
  for (const UnitFronts::Wanted& w : wanted)
    for (std::int32_t i = node(w.place); i >= 0 && size[std::size_t(i)] == 0; i = tree.parent[std::size_t(i)]) {
      size[std::size_t(i)] = 1;
      rising.push_back(i);
    }
  std::sort(rising.begin(), rising.end()); // parents stand behind their children
  for (const std::int32_t i : rising)
    if (const std::int32_t p = tree.parent[std::size_t(i)]; p >= 0) size[std::size_t(p)] += size[std::size_t(i)];
  order.resize(rising.size());
  std::vector<std::int32_t> end(tree.parent.size(), 0); // end of the free part of a node's interval in the order
  std::int32_t left = std::int32_t(rising.size());
  for (auto i = rising.rbegin(); i != rising.rend(); ++i) {
    const std::int32_t p = tree.parent[std::size_t(*i)];
    std::int32_t& from = p >= 0 ? end[std::size_t(p)] : left;
    end[std::size_t(*i)] = from - 1;
    order[std::size_t(from - 1)] = *i;
    from -= size[std::size_t(*i)];
  }
  return order;
}

} // namespace

UnitFronts::Batch UnitFronts::batch_of(const SoeTree& tree, const std::vector<Wanted>& wanted) {
  Batch batch;
  std::vector<std::int32_t> at(tree.parent.size(), -1);
  for (const std::int32_t i : reached(tree, wanted)) {
    at[std::size_t(i)] = std::int32_t(batch.nodes.size());
    batch.nodes.emplace_back().node = i;
  }
  const auto node = [&](const Wanted& w) {
    return at[std::size_t(tree.node.empty() ? w.place : tree.node[std::size_t(w.place)])];
  };
  batch.wanted = wanted;
  std::stable_sort(batch.wanted.begin(), batch.wanted.end(), [&](const Wanted& a, const Wanted& b) {
    return node(a) != node(b) ? node(a) < node(b) : a.place < b.place;
  });
  std::size_t k = 0;
  std::vector<std::int64_t> least(batch.nodes.size(), -1);
  for (std::size_t i = 0; i < batch.nodes.size(); ++i) {
    Node& n = batch.nodes[i];
    n.own = std::int64_t(k);
    while (k < batch.wanted.size() && node(batch.wanted[k]) == std::int32_t(i)) ++k;
    n.begin = least[i] >= 0 ? least[i] : n.own;
    n.end = std::int64_t(k);
    const std::int32_t p = tree.parent[std::size_t(n.node)];
    if (p >= 0 && least[std::size_t(at[std::size_t(p)])] < 0) least[std::size_t(at[std::size_t(p)])] = n.begin;
  }
  for (const Wanted& w : batch.wanted) batch.index.push_back(w.index);
  return batch;
}

bool UnitFronts::room_to_keep(const SoeFactors& factors, const Batch& batch) const {
  std::int64_t numbers = 0;
  for (const Batch& b : batches_) numbers += std::int64_t(b.value.size());
  return 2 * (numbers + numbers_of(factors, batch)) <= factors.entries();
}

std::int64_t UnitFronts::numbers_of(const SoeFactors& factors, const Batch& batch) {
  std::int64_t numbers = 0;
  for (const Node& n : batch.nodes) numbers += (n.end - n.begin) * factors.block(n.node).columns;
  return numbers;
}

void UnitFronts::add(const SoeFactors& factors, const std::vector<Wanted>& more, double* out, std::int64_t leading,
                     int threads) {
  if (more.empty()) return;
  const SoeTree& tree = *factors.tree();
  std::vector<Wanted> wanted = more;
  const auto absorb = [&] {
    wanted.insert(wanted.end(), batches_.back().wanted.begin(), batches_.back().wanted.end());
    batches_.pop_back();
  };
  const bool first = batches_.empty();
  while (!batches_.empty() && batches_.back().wanted.size() <= 2 * wanted.size()) absorb();
  if (!batches_.empty() && batches_[0].value.empty()) { // the first: whether more would come was not known
    if (room_to_keep(factors, batches_[0])) {
      Batch again = std::move(batches_[0]);
      batches_.clear();
      solve(factors, again, true, nullptr, 0, threads);
      batches_.push_back(std::move(again));
    } else {
      absorb();
    }
  }
  Batch batch = batch_of(tree, wanted);
  bool keep = !first && room_to_keep(factors, batch);
  if (!first && !keep && !batches_.empty()) {
    while (!batches_.empty()) absorb();
    batch = batch_of(tree, wanted);
  }
  solve(factors, batch, keep, out, leading, threads);
  batches_.push_back(std::move(batch));
}

void UnitFronts::each_front(const SoeFactors& factors, const std::vector<Wanted>& wanted, int threads,
                            const UseFront& use) {
  if (wanted.empty()) return;
  Batch batch = batch_of(*factors.tree(), wanted);
  solve(factors, batch, false, nullptr, 0, threads, use);
}

// Finds for each node of the batch the same node in each earlier batch.
void UnitFronts::find_twins(std::int64_t nodes, const Batch& batch) {
  twin_.assign(batch.nodes.size() * batches_.size(), -1);
  if (batches_.empty()) return;
  number_.assign(std::size_t(nodes), -1);
  for (std::size_t i = 0; i < batch.nodes.size(); ++i) number_[std::size_t(batch.nodes[i].node)] = std::int32_t(i);
  for (std::size_t b = 0; b < batches_.size(); ++b)
    for (std::size_t i = 0; i < batches_[b].nodes.size(); ++i)
      if (const std::int32_t mine = number_[std::size_t(batches_[b].nodes[i].node)]; mine >= 0)
        twin_[std::size_t(mine) * batches_.size() + b] = std::int32_t(i);
}

// Units at the own columns of a node, and what its children hand on.
void UnitFronts::assemble(const SoeFactors& factors, const SoeBlock& block, const Batch& batch, const Node& node) {
  const std::int64_t lanes = node.end - node.begin;
  front_.assign(std::size_t(lanes * (block.columns + block.below)), 0.0);
  for (std::int64_t c = 0; c < block.columns; ++c) row_[std::size_t(block.first + c)] = c;
  for (std::int64_t r = 0; r < block.below; ++r) row_[std::size_t(block.row[r])] = block.columns + r;
  for (std::int64_t k = node.own; k < node.end; ++k)
    front_[std::size_t(lanes * (batch.wanted[std::size_t(k)].place - block.first) + k - node.begin)] = 1;
  const std::vector<std::int32_t>& parent = factors.tree()->parent;
  for (; !stack_.empty() && parent[std::size_t(stack_.back().node)] == node.node; stack_.pop_back()) {
    const Pending& child = stack_.back();
    const SoeBlock of = factors.block(child.node);
    const std::int64_t width = child.end - child.begin;
    for (std::int64_t r = 0; r < of.below; ++r) {
      const double* given = &pending_[std::size_t(child.first + width * r)];
      double* taken = &front_[std::size_t(lanes * row_[std::size_t(of.row[r])] + child.begin - node.begin)];
      for (std::int64_t k = 0; k < width; ++k) taken[k] += given[k];
    }
    pending_.resize(std::size_t(child.first));
  }
}

void UnitFronts::hand_on(const SoeBlock& block, const Node& node) {
  if (block.below == 0) return;
  stack_.push_back({node.node, node.begin, node.end, std::int64_t(pending_.size())});
  pending_.insert(pending_.end(), front_.begin() + (node.end - node.begin) * block.columns, front_.end());
}

// Products of the right sides from `from` to `end` with those before them and with those of earlier batches.
void UnitFronts::multiply(const SoeBlock& block, const Batch& batch, std::size_t at, std::int64_t from,
                          std::int64_t end, double* out, std::int64_t leading) const {
  const Node& node = batch.nodes[at];
  const std::int64_t lanes = node.end - node.begin, zeros = node.zeros(batch.wanted, node.begin + from, block);
  const std::int64_t* place = batch.index.data() + node.begin;
  cairn_unit_products(end - from, lanes, front_.data() + from, end, lanes, front_.data(), block.columns, zeros,
                      place + from, place, leading, out);
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    const std::int32_t twin = twin_[at * batches_.size() + b];
    if (twin < 0) continue;
    const Node& other = batches_[b].nodes[std::size_t(twin)];
    cairn_unit_products(end - from, lanes, front_.data() + from, other.end - other.begin, other.end - other.begin,
                        batches_[b].value.data() + other.value, block.columns, zeros, place + from,
                        batches_[b].index.data() + other.begin, leading, out);
  }
}

// Allocates the pending numbers at once: a heap that grows holds more than twice as many.
void UnitFronts::make_room(const SoeFactors& factors, const Batch& batch) {
  const std::vector<std::int32_t>& parent = factors.tree()->parent;
  std::vector<std::pair<std::int32_t, std::int64_t>> handed; // who hands on how many numbers
  std::int64_t most = 0, waiting = 0, most_waiting = 0;
  for (const Node& node : batch.nodes) {
    const SoeBlock block = factors.block(node.node);
    const std::int64_t lanes = node.end - node.begin;
    most = std::max(most, lanes * (block.columns + block.below));
    for (; !handed.empty() && parent[std::size_t(handed.back().first)] == node.node; handed.pop_back())
      waiting -= handed.back().second;
    handed.emplace_back(node.node, lanes * block.below);
    waiting += lanes * block.below;
    most_waiting = std::max(most_waiting, waiting);
  }
  front_.reserve(std::size_t(most));
  pending_.reserve(std::size_t(most_waiting));
}

// L Z = E', and products with Z of this batch and of earlier ones; out: null for none.
void UnitFronts::solve(const SoeFactors& factors, Batch& batch, bool keep, double* out, std::int64_t leading,
                       int threads, const UseFront& use) {
  const SoeTree& tree = *factors.tree();
  find_twins(std::int64_t(tree.parent.size()), batch);
  make_room(factors, batch);
  if (keep) batch.value.reserve(std::size_t(numbers_of(factors, batch)));
  row_.resize(std::size_t(tree.node.empty() ? tree.parent.size() : tree.node.size()));
  for (const Wanted& w : batch.wanted) {
    const auto clear = [&](std::int64_t i) { out[leading * w.index + i] = out[leading * i + w.index] = 0; };
    if (out == nullptr) break;
    for (const std::int64_t i : batch.index) clear(i);
    for (const Batch& b : batches_) std::for_each(b.index.begin(), b.index.end(), clear);
  }
  for (std::size_t i = 0; i < batch.nodes.size(); ++i) {
    Node& node = batch.nodes[i];
    const SoeBlock block = factors.block(node.node);
    const std::int64_t lanes = node.end - node.begin;
    assemble(factors, block, batch, node);
    each_chunk(lanes, threads, [&](std::int64_t from, std::int64_t end) {
      double* y = front_.data() + from;
      if (block.pivot > 0)
        cairn_unit_column(end - from, lanes, block.below, block.pivot, block.value, y);
      else
        cairn_unit_front(end - from, lanes, block.columns + block.below, block.columns,
                         node.zeros(batch.wanted, node.begin + from, block), block.value, y);
    });
    if (out != nullptr)
      each_chunk(lanes, threads,
                 [&](std::int64_t from, std::int64_t end) { multiply(block, batch, i, from, end, out, leading); });
    if (use)
      each_chunk(lanes, threads, [&](std::int64_t from, std::int64_t end) {
        for (std::int64_t k = from; k < end; ++k)
          use(block, batch.wanted[std::size_t(node.begin + k)], front_.data() + k, lanes);
      });
    if (keep) {
      node.value = std::int64_t(batch.value.size());
      batch.value.insert(batch.value.end(), front_.begin(), front_.begin() + lanes * block.columns);
    }
    hand_on(block, node);
  }
  std::vector<double>().swap(front_); // as large as the entries may be
  std::vector<double>().swap(pending_);
  if (out != nullptr) finish(batch, out, leading);
}

// Entries in their units, on both sides of the diagonal.
void UnitFronts::finish(const Batch& batch, double* out, std::int64_t leading) const {
  const auto both = [&](const Wanted& a, const Wanted& b) {
    const double x = b.right * out[leading * b.index + a.index] * a.left;
    out[leading * b.index + a.index] = out[leading * a.index + b.index] = x;
  };
  for (std::size_t i = 0; i < batch.wanted.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) both(batch.wanted[i], batch.wanted[j]);
    for (const Batch& b : batches_)
      for (const Wanted& other : b.wanted) both(batch.wanted[i], other);
  }
}

std::int64_t UnitFronts::bytes() const {
  std::size_t numbers = front_.capacity() + pending_.capacity() + row_.capacity();
  for (const Batch& b : batches_)
    numbers += b.value.capacity() + b.index.capacity() +
               (sizeof(Wanted) * b.wanted.capacity() + sizeof(Node) * b.nodes.capacity()) / 8;
  return std::int64_t(8 * numbers);
}

} // namespace cairn
