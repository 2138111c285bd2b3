!> Length and direction of vectors, safe where their squares leave the range of a double.
module separation
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  implicit none
  private
  public :: separate

  ! Between these lengths neither the squares nor their sum overflow, nor lose digits that count.
  real(c_double), parameter :: shortest = 2.0_c_double**(-480), longest = 2.0_c_double**510

contains

  !> normal = v/|v|, and the first axis where v vanishes.
  pure subroutine separate(n, dim, v, length, normal)
    integer(c_int32_t), intent(in) :: n               !< vectors
    integer(c_int32_t), intent(in) :: dim             !< 2 or 3
    real(c_double), intent(in) :: v(n, dim)
    real(c_double), intent(out) :: length(n)
    real(c_double), intent(out) :: normal(n, dim)     !< unit
    integer(c_int32_t) :: i
    real(c_double) :: low, high, one(3), unit(3)

    low = longest
    high = shortest
    if (dim == 2) then
      do i = 1, n
        length(i) = sqrt(v(i, 1)*v(i, 1) + v(i, 2)*v(i, 2))
        normal(i, 1) = v(i, 1)/length(i)
        normal(i, 2) = v(i, 2)/length(i)
      end do
    else
      do i = 1, n
        length(i) = sqrt(v(i, 1)*v(i, 1) + v(i, 2)*v(i, 2) + v(i, 3)*v(i, 3))
        normal(i, 1) = v(i, 1)/length(i)
        normal(i, 2) = v(i, 2)/length(i)
        normal(i, 3) = v(i, 3)/length(i)
      end do
    end if
    do i = 1, n
      low = min(low, length(i))
      high = max(high, length(i))
    end do
    if (low >= shortest .and. high <= longest) return
    do i = 1, n
      if (length(i) >= shortest .and. length(i) <= longest) cycle
      one(1:dim) = v(i, :)
      call separate_scaled(dim, one, length(i), unit)
      normal(i, :) = unit(1:dim)
    end do
  end subroutine separate

  pure subroutine separate_scaled(dim, v, length, normal)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in) :: v(dim)
    real(c_double), intent(out) :: length, normal(dim)
    real(c_double) :: unscaled
    integer :: power

    if (.not. any(abs(v) > 0)) then
      length = 0
      normal = 0
      normal(1) = 1
      return
    end if
    power = exponent(maxval(abs(v)))
    normal = scale(v, -power)
    unscaled = sqrt(dot_product(normal, normal))
    normal = normal/unscaled
    length = scale(unscaled, power)
  end subroutine separate_scaled

end module separation
