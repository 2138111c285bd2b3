// Sums of a sweep over ranks: whole numbers, whichever contacts stand in a batch together.
#include <gtest/gtest.h>

#include <limits>

#include "cairn/rows/ranked_sweep.h"
#include "contact_scene.hpp"
#include "contacts/interaction.hpp"
#include "solvers/sweeps/batch.hpp"

namespace cairn::test {
namespace {

constexpr std::int64_t most = std::int64_t(1) << 51; // units of a term

struct Sums {
  std::int64_t change = 0, along = 0;
};

class RankedSweep : public testing::TestWithParam<int> {
protected:
  void SetUp() override {
    scene_.step(contacts_, coulomb(0.4), {1e-20, 1, 3, 1});
    system().load(scene_.bodies.velocity_free);
    before_.resize(std::size_t(dim_) * std::size_t(system().places()));
    for (double& r : before_) r = scene_.uniform(-1, 1);
  }
  ContactSystem& system() { return contacts_.system(); }

  // Contacts of a packed batch from a lane on.
  static cairn_batch part(cairn_batch b, int first, int end) {
    b.first += first;
    b.contacts = std::min(b.contacts, end) - first;
    b.count = (b.contacts + 7) / 8 * 8;
    b.frame += std::ptrdiff_t(first) * b.pack;
    b.body_a += first;
    b.body_b += first;
    return b;
  }

  // A sweep over some batches; all is then as before.
  Sums sums(const std::vector<cairn_batch>& batches, double unit) {
    const Array<cairn_record> record = system().record;
    std::vector<double> before = before_, kept;
    for (const cairn_batch& b : batches) kept.insert(kept.end(), b.frame, b.frame + std::ptrdiff_t(b.count) * b.pack);
    const std::int32_t first_task[] = {0, 1}, first_batch[] = {0, std::int32_t(batches.size())};
    cairn_schedule schedule = system().schedule(1);
    schedule.stages = 1;
    schedule.batches = first_batch[1];
    schedule.first_task = first_task;
    schedule.first_batch = first_batch;
    schedule.batch = batches.data();
    std::vector<std::int64_t> change(batches.size()), along(batches.size());
    cairn_ranked_sweep(&schedule, 0.5, dim_, before.data(), unit, unit, change.data(), along.data());
    system().record = record;
    std::size_t at = 0;
    Sums all;
    for (std::size_t k = 0; k < batches.size(); ++k) {
      const auto numbers = std::size_t(batches[k].count) * std::size_t(batches[k].pack);
      std::copy_n(kept.begin() + std::ptrdiff_t(at), numbers, batches[k].frame);
      at += numbers;
      all.change += change[k];
      all.along += along[k];
    }
    return all;
  }

  int dim_ = GetParam();
  ContactScene scene_ = heap(dim_, dim_ == 2 ? 60 : 12);
  Interactions contacts_{dim_};
  std::vector<double> before_;
};

TEST_P(RankedSweep, HasTheSameSumsHoweverContactsAreBatched) {
  int tried = 0;
  for (const cairn_batch& b : system().batches) {
    if (!b.pack || b.contacts < 64) continue;
    ++tried;
    // the largest terms are near the most units, so that sums of a batch go beyond what doubles hold
    const double unit = 0x1p56 / double(std::max<std::int64_t>(sums({b}, 0x1p20).change, 1)) * 0x1p20;
    const Sums whole = sums({b}, unit), parts = sums({part(b, 0, 16), part(b, 16, 40), part(b, 40, b.contacts)}, unit);
    EXPECT_GT(whole.change, most);
    EXPECT_EQ(whole.change, parts.change);
    EXPECT_EQ(whole.along, parts.along);
  }
  EXPECT_GT(tried, 3);
}

TEST_P(RankedSweep, CountsNoNumberAsTheLargestTerm) {
  for (const cairn_batch& b : system().batches) {
    if (!b.pack) continue;
    const double unit = 0x1p20 / double(std::max<std::int64_t>(sums({b}, 0x1p20).change, 1)) * 0x1p20;
    const std::int64_t usual = sums({b}, unit).change;
    EXPECT_LT(std::abs(usual), most / 4);
    const double r = at(b, b.r, 0, 0);
    at(b, b.r, 0, 0) = std::numeric_limits<double>::quiet_NaN();
    const Sums wrong = sums({b}, unit);
    at(b, b.r, 0, 0) = r;
    EXPECT_GT(wrong.change, most - most / 4);
    EXPECT_LT(wrong.change, most + most / 4);
    EXPECT_LE(sums({b}, std::numeric_limits<double>::max()).change, std::int64_t(b.contacts) * most);
    return;
  }
  FAIL() << "no batch is packed";
}

INSTANTIATE_TEST_SUITE_P(Dimension, RankedSweep, testing::Values(2, 3));

} // namespace
} // namespace cairn::test
