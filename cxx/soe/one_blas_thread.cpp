#include "one_blas_thread.hpp"

#include <dlfcn.h>
#include <omp.h>

#include <mutex>

#include "lapack.hpp"

namespace cairn {

namespace {

struct BlasControls {
  void (*set_openblas)(int) = nullptr;
  int (*get_openblas)() = nullptr;
  int (*set_mkl)(int) = nullptr; // of this thread; returns the number before, 0 for the process's
  void (*set_blis)(long) = nullptr;
  long (*get_blis)() = nullptr;
};

template <class Function>
void look_up(void* library, const char* name, Function& found) {
  found = reinterpret_cast<Function>(dlsym(library, name));
}

BlasControls find_controls() {
  Dl_info place{};
  void* library = nullptr;
  if (dladdr(reinterpret_cast<void*>(&dgemm_), &place) != 0 && place.dli_fname != nullptr)
    library = dlopen(place.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
  void* const where = library != nullptr ? library : RTLD_DEFAULT; // a program that holds its BLAS itself
  BlasControls found;
  look_up(where, "openblas_set_num_threads", found.set_openblas);
  look_up(where, "openblas_get_num_threads", found.get_openblas);
  look_up(where, "MKL_Set_Num_Threads_Local", found.set_mkl);
  look_up(where, "bli_thread_set_num_threads", found.set_blis);
  look_up(where, "bli_thread_get_num_threads", found.get_blis);
  return found;
}

const BlasControls& controls() {
  static const BlasControls found = find_controls();
  return found;
}

std::mutex guard;
int alive = 0, openblas_before = 0;

} // namespace

OneBlasThread::OneBlasThread() {
  const BlasControls& blas = controls();
  if (blas.set_openblas != nullptr && blas.get_openblas != nullptr) {
    const int team = omp_get_max_threads(); // OpenBLAS over OpenMP would set that, too
    const std::lock_guard<std::mutex> lock(guard);
    if (alive++ == 0) {
      openblas_before = blas.get_openblas();
      if (openblas_before > 1) blas.set_openblas(1);
    }
    omp_set_num_threads(team);
  }
  if (blas.set_mkl != nullptr) before_ = blas.set_mkl(1);
  if (blas.set_blis != nullptr && blas.get_blis != nullptr) {
    before_ = int(blas.get_blis());
    blas.set_blis(1);
  }
}

OneBlasThread::~OneBlasThread() {
  const BlasControls& blas = controls();
  if (blas.set_openblas != nullptr && blas.get_openblas != nullptr) {
    const int team = omp_get_max_threads();
    const std::lock_guard<std::mutex> lock(guard);
    if (--alive == 0 && openblas_before > 1) blas.set_openblas(openblas_before);
    omp_set_num_threads(team);
  }
  if (blas.set_mkl != nullptr) blas.set_mkl(before_);
  if (blas.set_blis != nullptr && blas.get_blis != nullptr) blas.set_blis(before_);
}

} // namespace cairn
