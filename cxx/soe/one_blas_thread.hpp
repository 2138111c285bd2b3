// While an object of it lives, BLAS runs in a single thread, so that the bits of its sums do not depend on the number
// of threads.
#pragma once

namespace cairn {

// Found when first needed, in the library that LAPACK's calls go to: OpenBLAS keeps one number for a whole process, so
// it is set when the first of these begins and put back when the last ends; MKL and BLIS keep one for the calling
// thread. The reference BLAS has but one. Another copy of BLAS in the process, as numpy brings its own, is not touched.
class OneBlasThread {
public:
  OneBlasThread();
  ~OneBlasThread();
  OneBlasThread(const OneBlasThread&) = delete;
  OneBlasThread& operator=(const OneBlasThread&) = delete;

private:
  int before_ = 0; // of the calling thread
};

} // namespace cairn
