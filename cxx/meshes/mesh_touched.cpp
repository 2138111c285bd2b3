// Order in which nodes came into contact, where rounding depends on it: the compliance of two nodes is taken from the
// column of the later node, and columns are solved several at once. A restart from a file touches nodes in the same
// order.
#include <algorithm>

#include "../base/call.hpp"
#include "mesh_body.hpp"

namespace cairn {

namespace {

constexpr std::size_t keys = 5; // of factors
constexpr std::size_t most_exact = std::size_t(1) << 53;

// Reads counts and nodes of a list of numbers, each of which is whole and in its bounds.
class Reader {
public:
  Reader(std::span<const double> of, const std::string& mesh) : of_(of), mesh_(mesh) {}
  bool ended() const { return at_ == of_.size(); }
  double number() {
    if (ended()) refuse();
    return of_[at_++];
  }
  std::size_t whole(std::size_t least, std::size_t most) {
    const double x = number();
    if (!(x >= double(least) && x <= double(std::min(most, most_exact)))) refuse();
    const auto n = std::size_t(x);
    if (double(n) < x) refuse();
    return n;
  }
  [[noreturn]] void refuse() const {
    throw Error("the nodes of the mesh '" + mesh_ +
                "' that came to touch, one after the other, are not such a list: give the file of this scene");
  }

private:
  std::span<const double> of_;
  const std::string& mesh_;
  std::size_t at_ = 0;
};

} // namespace

bool MeshBody::by_units(const Factors& f) const {
  return f.soe && model.ties.empty() && f.modal_factor.empty() && !has_part(f.mixed);
}

bool MeshBody::by_units() const { return by_units(*now_); }

std::vector<double> MeshBody::touched() const {
  std::vector<double> out;
  const bool all_by_units = std::all_of(factors_.begin(), factors_.end(),
                                        [&](const auto& f) { return f->again.ends.empty() && f->order.empty(); });
  if (all_by_units) return out;
  for (const auto& f : factors_) {
    if (f->spare) continue;
    const bool later = !f->again.ends.empty();
    const std::vector<std::int32_t>& ends = later ? f->again.ends : f->order;
    const std::vector<std::int32_t>& nodes = later ? f->again.nodes : f->active;
    out.insert(out.end(), {f->h, f->damping, f->stiffness, f->largest, f->mixed, double(ends.size())});
    out.insert(out.end(), ends.begin(), ends.end());
    if (!ends.empty()) out.insert(out.end(), nodes.begin(), nodes.begin() + ends.back());
  }
  return out;
}

// Factors that the list names are made when they are asked for, if they are not there; others stay, as spare ones that
// go first.
void MeshBody::restore_touched(std::span<const double> of) {
  std::vector<std::unique_ptr<Factors>> named;
  const auto nodes = std::size_t(model.nodes());
  for (Reader read(of, model.name); !read.ended();) {
    auto f = std::make_unique<Factors>();
    f->place.assign(nodes, -1);
    for (double* key : {&f->h, &f->damping, &f->stiffness, &f->largest, &f->mixed}) *key = read.number();
    std::size_t last = 0;
    for (std::size_t left = read.whole(0, nodes); left > 0; --left) {
      last = read.whole(last + 1, nodes);
      f->again.ends.push_back(std::int32_t(last));
    }
    std::vector<std::uint8_t> seen(nodes, 0);
    for (std::size_t k = 0; k < last; ++k) {
      const std::size_t node = read.whole(0, nodes - 1);
      if (seen[node]) read.refuse();
      seen[node] = 1;
      f->again.nodes.push_back(std::int32_t(node));
    }
    named.push_back(std::move(f));
  }
  std::vector<std::unique_ptr<Factors>> all;
  for (auto& there : factors_) {
    const auto same = std::find_if(named.begin(), named.end(), [&](const auto& f) { return there->same_as(*f); });
    if (same == named.end()) {
      if (!by_units(*there)) there->forget(model.nodes());
      there->spare = true;
      all.push_back(std::move(there));
      continue;
    }
    const bool stands = (*same)->again.ends == there->order && there->again.ends.empty() &&
                        std::equal((*same)->again.nodes.begin(), (*same)->again.nodes.end(), there->active.begin());
    if (!stands) {
      if (!by_units(*there)) there->forget(model.nodes());
      there->again = std::move((*same)->again);
    }
    there->spare = false;
    *same = std::move(there);
  }
  for (auto& f : named) all.push_back(std::move(f));
  if (all.size() > most_factors) all.erase(all.begin(), all.end() - std::ptrdiff_t(most_factors));
  factors_ = std::move(all);
}

void MeshBody::touch_again() {
  const Touches again = std::move(now_->again);
  now_->again = {};
  std::size_t from = 0;
  for (const std::int32_t end : again.ends) {
    touch({again.nodes.begin() + std::ptrdiff_t(from), again.nodes.begin() + end});
    from = std::size_t(end);
  }
}

} // namespace cairn
