#include "batch_assembly.hpp"

#include <algorithm>
#include <omp.h>

#include "../laws/law_info.hpp"
#include "../solvers/sweeps/batch.hpp"

namespace cairn {

void BatchAssembly::fill() {
  const int n = int(system_.batches.size()), threads = system_.schedule(omp_get_max_threads()).threads;
  double deepest = 0;
  plugged_.begin();
#pragma omp parallel for num_threads(threads) schedule(static) reduction(max : deepest) if (threads > 1)
  for (int b = 0; b < n; ++b) fill_batch(b, omp_get_thread_num(), deepest);
  system_.penetration = deepest;
  system_.clumps = classes_.all_balls();
  system_.drift = deepest > in_.options.overlap_limit ? overlap_.deepest_drift() : 0;
  plugged_.refuse_noted();
}

void BatchAssembly::fill_batch(int which, int thread, double& deepest) {
  cairn_batch& batch = system_.batches[which];
  batch.solve = local_solver(batch, in_.dim());
  // of a bond, a dummy would pull: it would count in how much a sweep changes, and in the size of the impulses
  batch.repeats = law_infos()[batch.law].has_solve && batch.contacts < batch.count;
  if (batch.pack) {
    in_.dim() == 2 ? packs_.fill<2>(batch, deepest) : packs_.fill<3>(batch, deepest);
    if (law_infos()[batch.law].plugged()) preparation_.forget_open(batch);
    return;
  }
  cairn_schedule schedule{};
  schedule.batches = 1;
  schedule.threads = thread + 1;
  schedule.first_task = system_.first_task.data();
  schedule.first_batch = system_.first_batch.data();
  schedule.batch = &batch;
  schedule.side = sides();
  schedule.record = system_.record.data();
  schedule.general = system_.general.empty() ? system_.record.data() : system_.general.data();
  schedule.work = system_.work.data();
  geometry_.fill(batch, deepest);
  ropes_.fill(batch);
  if (batch.stride_a || batch.stride_b) cairn_mapped_responses(&batch, in_.dim());
  warm_start_.fill(batch);
  if (law_infos()[batch.law].joins) swing_.fill(batch);
  preparation_.fill(schedule, batch, thread);
}

} // namespace cairn
