!> An order of contacts drawn anew for each sweep, from a seed: what a fixed order may cycle on, a drawn one leaves.
module nlgs_random
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_shuffle
  integer(c_int64_t), parameter :: modulus = 2147483647_c_int64_t, multiplier = 48271_c_int64_t ! Park & Miller 1993
contains

  !> Fisher & Yates's shuffle (Durstenfeld 1964).
  subroutine cairn_shuffle(n, state, order) bind(c)
    integer(c_int64_t), value         :: n        !< numbers
    integer(c_int64_t), intent(inout) :: state    !< of the generator, 1 to 2^31 - 2
    integer(c_int32_t), intent(inout) :: order(n) !< permuted
    integer(c_int64_t) :: i, j
    integer(c_int32_t) :: held
    do i = n, 2, -1
      state = mod(multiplier*state, modulus)
      j = 1 + mod(state, i)
      held = order(i)
      order(i) = order(j)
      order(j) = held
    end do
  end subroutine cairn_shuffle
end module nlgs_random
