// Reads a run: its outputs, bodies and contacts of each, its history. The file may still be written.
#pragma once
#include <optional>

#include "hdf5_node.hpp"

namespace cairn {

class RunReader {
public:
  explicit RunReader(const std::string& path); // FileError if it is none, or damaged
  int dim() const { return dim_; }
  std::int64_t outputs() const { return std::int64_t(times_.size()); }
  const std::vector<double>& times() const { return times_; }
  const std::vector<std::int64_t>& steps() const { return steps_; } // their numbers
  // Names and values of a field of an output, what: "bodies", "nodes" or "contacts"; vectors have the components of the
  // scene, "velocity" of bodies has the spin behind. A run without meshes, and one of before version 1.2, has no nodes.
  // FileError for names and outputs that there are not.
  std::vector<std::string> fields(const std::string& what) const;
  std::vector<double> field(std::int64_t output, const std::string& what, const std::string& name) const;
  // A column of the history; words by the places in their list.
  std::vector<double> history(const std::string& name) const;
  bool has_history(const std::string& name = "step") const;
  std::optional<std::string>
  scene_text(const std::string& name) const; // what the file says of the scene; none: nothing

private:
  Hdf5Node root_;
  int dim_ = 2;
  std::vector<double> times_;
  std::vector<std::int64_t> steps_, first_[3], count_[3];
};

} // namespace cairn
