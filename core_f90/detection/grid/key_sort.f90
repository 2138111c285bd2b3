!> Sorting of integer keys, digit by digit (Hollerith 1889): stable, and linear in their number.
module key_sort
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_sort_keys

  integer, parameter :: widest_digit = 11

contains

  !> Sorts keys of at most `largest`; order(i) is the place that the i-th of them had, from 0.
  pure subroutine cairn_sort_keys(n, largest, key, order, key_work, order_work) bind(c)
    integer(c_int64_t), value :: n                          !< keys
    integer(c_int64_t), value :: largest                    !< bound of the keys
    integer(c_int64_t), intent(inout) :: key(n)             !< at least 0
    integer(c_int32_t), intent(out) :: order(n)
    integer(c_int64_t), intent(inout) :: key_work(n)
    integer(c_int32_t), intent(inout) :: order_work(n)
    integer(c_int32_t) :: i, pass, passes, digit, bits

    bits = max(1, 64 - leadz(largest))
    passes = (bits + widest_digit - 1)/widest_digit
    digit = (bits + passes - 1)/passes
    do i = 1, int(n, c_int32_t)
      order(i) = i - 1
    end do
    do pass = 0, passes - 1, 2
      call sort_by_digit(n, pass*digit, digit, key, order, key_work, order_work)
      if (pass + 1 < passes) then
        call sort_by_digit(n, (pass + 1)*digit, digit, key_work, order_work, key, order)
      else
        key = key_work
        order = order_work
      end if
    end do
  end subroutine cairn_sort_keys

  pure subroutine sort_by_digit(n, shift, digit, key, order, key_sorted, order_sorted)
    integer(c_int64_t), intent(in) :: n
    integer(c_int32_t), intent(in) :: shift, digit
    integer(c_int64_t), intent(in) :: key(n)
    integer(c_int32_t), intent(in) :: order(n)
    integer(c_int64_t), intent(inout) :: key_sorted(n)
    integer(c_int32_t), intent(inout) :: order_sorted(n)
    integer(c_int32_t) :: place(0:2**widest_digit - 1), i, d, here, count
    integer(c_int64_t) :: mask

    mask = 2_c_int64_t**digit - 1
    place(0:2**digit - 1) = 0
    do i = 1, int(n, c_int32_t)
      d = int(iand(shiftr(key(i), shift), mask), c_int32_t)
      place(d) = place(d) + 1
    end do
    here = 1
    do d = 0, 2**digit - 1
      count = place(d)
      place(d) = here
      here = here + count
    end do
    do i = 1, int(n, c_int32_t)
      d = int(iand(shiftr(key(i), shift), mask), c_int32_t)
      here = place(d)
      place(d) = here + 1
      key_sorted(here) = key(i)
      order_sorted(here) = order(i)
    end do
  end subroutine sort_by_digit

end module key_sort
