// Works of loads on a mesh.
#pragma once
#include <vector>

#include "mesh_step.hpp"

namespace cairn {

// Measures works in the mean of both ends of a step.
class MeshWorks {
public:
  MeshWorks(const MeshModel& model, MeshLoads& loads, const MeshStep& step, std::vector<double>& reaction,
            MeshWork& work)
      : model_(model), loads_(loads), step_(step), reaction_(reaction), work_(work) {}
  std::vector<double> mean, drag; // (dofs) elastic and damping forces in the mean of both ends [N]
  std::vector<double> taken;      // (dofs) their sum as the scheme has it [N]

  bool weighs_an_end() const; // the scheme takes forces elsewhere than in the mean of both ends of a step
  void account_means(const std::vector<double>& way);
  void find_loads_beyond(const std::vector<double>& way);
  void account_ties(); // after the reactions, before what follows hands its own on

private:
  const MeshModel& model_;
  MeshLoads& loads_;
  const MeshStep& step_;
  std::vector<double>& reaction_;
  MeshWork& work_;
  std::vector<double> beyond_; // (dofs) of loads [N]; empty: none act
};

} // namespace cairn
