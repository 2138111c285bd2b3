!> Place of points along a Hilbert curve (Hilbert 1891), by the transposed index of Skilling (2004).
module hilbert_keys
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_hilbert_keys

contains

  !> Keys of n points; those outside the box count as on its faces.
  pure subroutine cairn_hilbert_keys(dim, n, position, low, width, key) bind(c)
    integer(c_int32_t), value :: dim                   !< 2 or 3
    integer(c_int64_t), value :: n                     !< points
    real(c_double), intent(in) :: position(dim, n)     !< [m]
    real(c_double), intent(in) :: low(dim), width(dim) !< corner and sides of the box [m]; width positive
    integer(c_int64_t), intent(out) :: key(n)          !< 21 bits an axis in 2D, 20 in 3D
    integer(c_int32_t) :: bits, k
    integer(c_int64_t) :: i, x(dim)
    real(c_double) :: f

    bits = merge(21, 20, dim == 2)
    do i = 1, n
      do k = 1, dim
        f = (position(k, i) - low(k))/width(k)
        x(k) = min(int(scale(max(0.0_c_double, min(1.0_c_double, f)), bits), c_int64_t), shiftl(1_c_int64_t, bits) - 1)
      end do
      call to_hilbert(dim, bits, x)
      key(i) = interleaved(dim, bits, x)
    end do
  end subroutine cairn_hilbert_keys

  !> Turns coordinates into the transposed Hilbert index.
  pure subroutine to_hilbert(dim, bits, x)
    integer(c_int32_t), intent(in) :: dim, bits
    integer(c_int64_t), intent(inout) :: x(dim)
    integer(c_int64_t) :: q, below, t
    integer(c_int32_t) :: k, b

    do b = bits - 1, 1, -1
      q = shiftl(1_c_int64_t, b)
      below = q - 1
      do k = 1, dim
        if (iand(x(k), q) /= 0) then
          x(1) = ieor(x(1), below)
        else
          t = iand(ieor(x(1), x(k)), below)
          x(1) = ieor(x(1), t)
          x(k) = ieor(x(k), t)
        end if
      end do
    end do
    do k = 2, dim ! Gray code
      x(k) = ieor(x(k), x(k - 1))
    end do
    t = 0
    do b = bits - 1, 1, -1
      if (btest(x(dim), b)) t = ieor(t, shiftl(1_c_int64_t, b) - 1)
    end do
    x = ieor(x, t)
  end subroutine to_hilbert

  pure function interleaved(dim, bits, x) result(key)
    integer(c_int32_t), intent(in) :: dim, bits
    integer(c_int64_t), intent(in) :: x(dim)
    integer(c_int64_t) :: key
    integer(c_int32_t) :: k, b
    key = 0
    do b = bits - 1, 0, -1
      do k = 1, dim
        key = ior(shiftl(key, 1), ibits(x(k), b, 1))
      end do
    end do
  end function interleaved

end module hilbert_keys
