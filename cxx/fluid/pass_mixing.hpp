// Anderson's acceleration (Walker & Ni 2011) of passes in which pressure and contacts are solved in turn.
#pragma once
#include <vector>

namespace cairn {

class PassMixing {
public:
  void forget(); // passes so far were of another system
  // from: what the pass began with; found: what it gave, which becomes what the next one begins with. weight: of each
  // in the square of their difference (n each).
  void next(const std::vector<double>& weight, const std::vector<double>& from, std::vector<double>& found);

private:
  static constexpr int memory = 8;
  static constexpr int gram_rows = 32; // of the kernel
  std::vector<double> f_, f_last_, g_, g_last_, df_, dg_, work_;
  std::vector<double> gram_ = std::vector<double>(std::size_t(gram_rows * gram_rows));
  int columns_ = 0, stored_ = 0;
  bool has_last_ = false, mixed_ = false;
  double square_last_ = 0;
};

} // namespace cairn
