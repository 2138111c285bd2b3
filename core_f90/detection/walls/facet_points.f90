!> Contact points of a body with a triangle or tube while they are found, each with its own normal.
module facet_points
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  implicit none
  private
  public :: findings, add, settle

  integer, parameter :: most_found = 32
  integer(c_int32_t), parameter :: second_name = 2_c_int32_t**27

  !> From the centre of the body.
  type :: findings
    integer :: count = 0
    real(c_double) :: slack = 0                      !< points within this distance coincide [m]
    real(c_double) :: x(3, most_found), n(3, most_found), gap(most_found)
    integer(c_int32_t) :: name(most_found)
  end type findings

contains

  pure subroutine add(f, x, n, gap, name)
    type(findings), intent(inout) :: f
    real(c_double), intent(in) :: x(3), n(3), gap
    integer(c_int32_t), intent(in) :: name
    integer :: k
    do k = 1, f%count
      if (maxval(abs(f%x(:, k) - x)) <= f%slack .and. dot_product(f%n(:, k), n) > 0.5_c_double) return
    end do
    if (f%count == most_found) return
    f%count = f%count + 1
    f%x(:, f%count) = x
    f%n(:, f%count) = n
    f%gap(f%count) = gap
    f%name(f%count) = name
  end subroutine add

  !> Leaves the first `most` by depth, each under a name of its own, in the order of the names.
  pure subroutine settle(f, most, count, gap, normal, point, feature)
    type(findings), intent(inout) :: f
    integer, intent(in) :: most
    integer(c_int32_t), intent(out) :: count, feature(most)
    real(c_double), intent(out) :: gap(most), normal(3, most), point(3, most)
    integer :: i, k, low
    do k = 1, f%count
      do while (any(f%name(1:k - 1) == f%name(k)))
        f%name(k) = f%name(k) + second_name
      end do
    end do
    if (f%count > most) then
      do k = 1, most
        low = k - 1 + minloc(f%gap(k:f%count), 1)
        call swap(f, k, low)
      end do
      f%count = most
    end if
    do k = 2, f%count
      do i = k, 2, -1
        if (f%name(i - 1) <= f%name(i)) exit
        call swap(f, i, i - 1)
      end do
    end do
    count = f%count
    do k = 1, f%count
      gap(k) = f%gap(k)
      normal(:, k) = f%n(:, k)
      point(:, k) = f%x(:, k)
      feature(k) = f%name(k)
    end do
  end subroutine settle

  pure subroutine swap(f, i, k)
    type(findings), intent(inout) :: f
    integer, intent(in) :: i, k
    f%x(:, [i, k]) = f%x(:, [k, i])
    f%n(:, [i, k]) = f%n(:, [k, i])
    f%gap([i, k]) = f%gap([k, i])
    f%name([i, k]) = f%name([k, i])
  end subroutine swap

end module facet_points
