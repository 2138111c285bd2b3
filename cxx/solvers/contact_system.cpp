#include "contact_system.hpp"

#include <algorithm>

namespace cairn {

const cairn_side* sides() {
  static const cairn_side rows[] = {
#define CAIRN_SIDE(name, dimension, lever, width) \
  {cairn_side_##name##_gather, cairn_side_##name##_scatter, cairn_side_##name##_delassus, lever, width},
#include "../../core_f90/kinematics/sides.def"
#undef CAIRN_SIDE
  };
  return rows;
}

cairn_schedule ContactSystem::schedule(int threads) {
  work.resize(std::max(work.size(), std::size_t(cairn_batch_workspace) * threads));
  sums.resize(std::max(sums.size(), 6 * batches.size()));
  change.resize(std::max(change.size(), batches.size()));
  cairn_schedule s{};
  s.stages = std::int32_t(first_task.size()) - 1;
  s.batches = std::int32_t(batches.size());
  s.threads = threads;
  s.relaxation = 1;
  s.first_task = first_task.data();
  s.first_batch = first_batch.data();
  s.batch = batches.data();
  s.side = sides();
  s.record = record.data();
  s.general = general.empty() ? record.data() : general.data();
  s.work = work.data();
  return s;
}

void ContactSystem::load(const Field<double>& velocity) {
  const int n = velocities();
  for (std::int64_t b = 0; b < bodies; ++b) std::copy_n(velocity[b], n, record[b].x);
}

} // namespace cairn
