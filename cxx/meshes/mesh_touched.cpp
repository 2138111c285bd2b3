// Order in which nodes came into contact, where rounding depends on it: the compliance of two nodes is taken from the
// column of the later node, and columns are solved several at once. A restart from a file touches nodes in the same
// order.
#include <algorithm>

#include "../base/call.hpp"
#include "mesh_compliance.hpp"

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

std::vector<double> MeshCompliance::touched() const {
  std::vector<double> out;
  const bool all_by_units = std::all_of(factors_.kept.begin(), factors_.kept.end(), [](const auto& f) {
    return f->contact.again.ends.empty() && f->contact.order.empty();
  });
  if (all_by_units) return out;
  for (const auto& f : factors_.kept) {
    if (f->undone) continue;
    const bool later = !f->contact.again.ends.empty();
    const std::vector<std::int32_t>& ends = later ? f->contact.again.ends : f->contact.order;
    const std::vector<std::int32_t>& nodes = later ? f->contact.again.nodes : f->contact.active;
    out.insert(out.end(), {f->h, f->damping, f->stiffness, f->largest, f->mixed, double(ends.size())});
    out.insert(out.end(), ends.begin(), ends.end());
    if (!ends.empty()) out.insert(out.end(), nodes.begin(), nodes.begin() + ends.back());
  }
  return out;
}

// Factors that the list names are made when they are asked for, if they are not there; others stay, as undone ones that
// go first.
void MeshCompliance::restore_touched(std::span<const double> of) {
  std::vector<std::unique_ptr<IterationFactors>> named;
  const auto nodes = std::size_t(model_.nodes());
  for (Reader read(of, model_.name); !read.ended();) {
    auto f = std::make_unique<IterationFactors>();
    f->contact.place.assign(nodes, -1);
    for (double* key : {&f->h, &f->damping, &f->stiffness, &f->largest, &f->mixed}) *key = read.number();
    std::size_t last = 0;
    for (std::size_t left = read.whole(0, nodes); left > 0; --left) {
      last = read.whole(last + 1, nodes);
      f->contact.again.ends.push_back(std::int32_t(last));
    }
    std::vector<std::uint8_t> seen(nodes, 0);
    for (std::size_t k = 0; k < last; ++k) {
      const std::size_t node = read.whole(0, nodes - 1);
      if (seen[node]) read.refuse();
      seen[node] = 1;
      f->contact.again.nodes.push_back(std::int32_t(node));
    }
    named.push_back(std::move(f));
  }
  std::vector<std::unique_ptr<IterationFactors>> all;
  for (auto& there : factors_.kept) {
    const auto same = std::find_if(named.begin(), named.end(), [&](const auto& f) { return there->same_as(*f); });
    if (same == named.end()) {
      if (!factors_.by_units(*there)) there->contact.forget(model_.nodes());
      there->undone = true;
      all.push_back(std::move(there));
      continue;
    }
    const bool stands = (*same)->contact.again.ends == there->contact.order && there->contact.again.ends.empty() &&
                        std::equal((*same)->contact.again.nodes.begin(), (*same)->contact.again.nodes.end(),
                                   there->contact.active.begin());
    if (!stands) {
      if (!factors_.by_units(*there)) there->contact.forget(model_.nodes());
      there->contact.again = std::move((*same)->contact.again);
    }
    there->undone = false;
    *same = std::move(there);
  }
  for (auto& f : named) all.push_back(std::move(f));
  if (all.size() > MeshFactors::most) all.erase(all.begin(), all.end() - std::ptrdiff_t(MeshFactors::most));
  factors_.kept = std::move(all);
}

void MeshCompliance::touch_again() {
  const ContactNodes::Touches again = std::move(factors_.now->contact.again);
  factors_.now->contact.again = {};
  std::size_t from = 0;
  for (const std::int32_t end : again.ends) {
    touch({again.nodes.begin() + std::ptrdiff_t(from), again.nodes.begin() + end});
    from = std::size_t(end);
  }
}

} // namespace cairn
