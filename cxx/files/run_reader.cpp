#include "run_reader.hpp"

#include <algorithm>
#include <cmath>

#include "stored_tree.hpp"

namespace cairn {

namespace {

[[noreturn]] void damaged(const Hdf5Node& root, const std::string& what) {
  throw FileError(root.path(), "the file is damaged: " + what, "copy it again from where it was made");
}

template <class T>
std::vector<T> column(const Hdf5Node& root, const std::string& path) {
  try {
    return numbers_of<T>(root.at(path).read(), path);
  } catch (const std::invalid_argument& e) { damaged(root, e.what()); }
}

} // namespace

RunReader::RunReader(const std::string& path) : root_(Hdf5Node::open(path)) {
  const auto attribute = [&](const char* name) -> std::optional<StoredArray> {
    return root_.contains("cairn") ? root_.at("cairn").attribute(name) : std::nullopt;
  };
  const std::optional<StoredArray> format = attribute("format"), version = attribute("version"), dim = attribute("dim");
  const std::string name = "cairn-run";
  if (!format || format->bytes.size() < name.size() || !std::equal(name.begin(), name.end(), format->bytes.begin()))
    throw FileError(path, "this HDF5 file is not a cairn-run file", "give a file that Cairn wrote for this purpose");
  try {
    if (!version || numbers_of<std::int64_t>(*version, "version").at(0) > 1)
      throw FileError(path, "the file has a later format version, this Cairn reads up to 1", "use a newer Cairn");
    dim_ = dim ? int(numbers_of<std::int64_t>(*dim, "dim").at(0)) : 0;
  } catch (const std::logic_error& e) { damaged(root_, e.what()); }
  if (dim_ != 2 && dim_ != 3) damaged(root_, "dim is " + std::to_string(dim_) + ": 2 and 3 are known");
  times_ = column<double>(root_, "cairn/steps/time");
  steps_ = column<std::int64_t>(root_, "cairn/steps/step");
  if (steps_.size() != times_.size()) damaged(root_, "steps are not as many as times");
  first_[0] = column<std::int64_t>(root_, "cairn/steps/first_body");
  first_[1] = column<std::int64_t>(root_, "cairn/steps/first_contact");
  count_[0] = column<std::int64_t>(root_, "cairn/steps/bodies");
  count_[1] = column<std::int64_t>(root_, "cairn/steps/contacts");
  if (root_.at("cairn/steps").contains("nodes")) { // of a run with meshes
    first_[2] = column<std::int64_t>(root_, "cairn/steps/first_node");
    count_[2] = column<std::int64_t>(root_, "cairn/steps/nodes");
  } else {
    first_[2].assign(times_.size(), 0);
    count_[2].assign(times_.size(), 0);
  }
  for (const auto* columns : {first_, count_})
    for (int k : {0, 1, 2})
      if (columns[k].size() != times_.size()) damaged(root_, "the outputs are not told by columns of one length");
}

std::vector<std::string> RunReader::fields(const std::string& what) const {
  std::vector<std::string> names = {what == "contacts" ? "point" : "position"};
  if (outputs() > 0 && root_.at("VTKHDF").contains(what))
    for (const std::string& name : root_.at("VTKHDF/" + what + "/PointData").names())
      if (name != "spin") names.push_back(name);
  return names;
}

std::vector<double> RunReader::field(std::int64_t output, const std::string& what, const std::string& name) const {
  if (output < 0 || output >= outputs())
    throw FileError(root_.path(),
                    "output " + std::to_string(output) + " was asked for; it holds " + std::to_string(outputs()),
                    "count from 0");
  const std::vector<std::string> known = fields(what);
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    std::string list;
    for (const std::string& k : known) list += (list.empty() ? "" : ", ") + k;
    throw FileError(root_.path(), what + " have no field '" + name + "'", "it has " + list);
  }
  const auto at = std::size_t(output);
  const int which = what == "bodies" ? 0 : what == "contacts" ? 1 : 2;
  if (!root_.at("VTKHDF").contains(what)) return {};
  const Hdf5Node block = root_.at("VTKHDF/" + what);
  const auto rows = [&](const std::string& field) { // (components, n)
    const bool points = field == known[0];
    std::int64_t first = first_[which][at];
    if (!points) {
      const auto offsets = column<std::int64_t>(block, "Steps/PointDataOffsets/" + field);
      if (at >= offsets.size()) damaged(root_, field + " has no place in output " + std::to_string(output));
      first = offsets[at];
    }
    const Hdf5Node array = block.at(points ? "Points" : "PointData/" + field);
    try {
      return std::pair(numbers_of<double>(array.rows(first, count_[which][at]), field),
                       array.shape().size() > 1 ? array.shape()[1] : 1);
    } catch (const std::invalid_argument& e) { damaged(root_, e.what()); }
  };
  auto [values, stored] = rows(name);
  const std::int64_t n = count_[which][at];
  const bool vector = stored == 3 && (name == known[0] || name == "normal" || name == "impulse" || name == "velocity");
  if (vector && dim_ == 2) {
    for (std::int64_t i = 0; i < n; ++i)
      for (int c = 0; c < 2; ++c) values[std::size_t(2 * i + c)] = values[std::size_t(3 * i + c)];
    values.resize(std::size_t(2 * n));
  }
  if (name != "velocity" || what == "nodes") return values;
  if (!vector) damaged(root_, "velocity has " + std::to_string(stored) + " components: 3 are due");
  const auto [spin, components] = rows("spin");
  std::vector<double> out;
  for (std::int64_t i = 0; i < n; ++i) {
    out.insert(out.end(), values.begin() + dim_ * i, values.begin() + dim_ * (i + 1));
    out.insert(out.end(), spin.begin() + components * i, spin.begin() + components * (i + 1));
  }
  return out;
}

std::vector<double> RunReader::history(const std::string& name) const {
  return column<double>(root_, "cairn/history/" + name);
}

bool RunReader::has_history(const std::string& name) const { return root_.contains("cairn/history/" + name); }

std::optional<std::string> RunReader::scene_text(const std::string& name) const {
  const std::string path = "cairn/scene/" + name;
  if (!root_.contains(path)) return {};
  const StoredArray text = root_.at(path).read();
  if (text.type.kind != 'S') return {};
  return std::string(text.bytes.begin(), std::find(text.bytes.begin(), text.bytes.end(), 0));
}

} // namespace cairn
