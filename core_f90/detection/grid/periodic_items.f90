!> Items for the search in a periodic scene: every contactor wrapped into the cell, and ghosts of those near its faces.
module periodic_items
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_periodic_items, cairn_periodic_ghosts

  ! what a fraction of the cell may be off by, in units of its size
  real(c_double), parameter :: slack = 64*epsilon(1.0_c_double)
  integer(c_int32_t), parameter :: farthest_image = 511

contains

  !> Places of the listed contactors within the cell, and the lattice point each is moved by. Reaches are widened by what
  !> moving may round.
  pure subroutine cairn_periodic_items(dim, n, listed, centre, reach, periodic, vectors, corner, x, x_reach, lattice) bind(c)
    integer(c_int32_t), value :: dim                    !< 2 or 3
    integer(c_int64_t), value :: n                      !< contactors in the list
    integer(c_int32_t), intent(in) :: listed(0:n - 1)   !< their numbers
    real(c_double), intent(in) :: centre(dim, 0:*)      !< of all contactors [m]
    real(c_double), intent(in) :: reach(0:*)            !< of all contactors [m]
    integer(c_int32_t), intent(in) :: periodic(3)       !< 1: along this cell vector
    real(c_double), intent(in) :: vectors(3, 3)         !< of the cell, in columns, upper triangular [m]
    real(c_double), intent(in) :: corner(3)             !< of the cell [m]
    real(c_double), intent(inout) :: x(dim, 0:n - 1)    !< [m]
    real(c_double), intent(inout) :: x_reach(0:n - 1)   !< [m]
    integer(c_int32_t), intent(inout) :: lattice(3, 0:n - 1)
    real(c_double) :: p(3), rest(3), f, size
    integer(c_int64_t) :: i
    integer(c_int32_t) :: k

    do i = 0, n - 1
      p = 0
      p(1:dim) = centre(:, listed(i))
      size = sum(abs(p)) + sum(abs(corner(1:dim)))
      rest = p
      rest(1:dim) = rest(1:dim) - corner(1:dim)
      lattice(:, i) = 0
      do k = dim, 1, -1
        if (periodic(k) == 0) cycle
        f = rest(k)/vectors(k, k)
        rest(1:k) = rest(1:k) - f*vectors(1:k, k)
        f = floor_of(f)
        p(1:k) = p(1:k) - f*vectors(1:k, k)
        lattice(k, i) = -int(f, c_int32_t)
        size = size + abs(f)*sum(abs(vectors(1:k, k)))
      end do
      x(:, i) = p(1:dim)
      x_reach(i) = reach(listed(i)) + slack*size
    end do
  end subroutine cairn_periodic_items

  !> Ghosts of items first to last-1: their images that are nearer to the cell than twice their own reach, which is as far as
  !> an item of no larger reach can be met. `found` is their number, the first `capacity` are given.
  pure subroutine cairn_periodic_ghosts(dim, first, last, x, reach, lattice, periodic, vectors, corner, capacity, ghost_of, &
                                        ghost_x, ghost_reach, ghost_lattice, found, too_wide) bind(c)
    integer(c_int32_t), value :: dim                    !< 2 or 3
    integer(c_int64_t), value :: first, last            !< items to treat
    real(c_double), intent(in) :: x(dim, 0:last - 1)    !< within the cell [m]
    real(c_double), intent(in) :: reach(0:last - 1)     !< [m]
    integer(c_int32_t), intent(in) :: lattice(3, 0:last - 1)
    integer(c_int32_t), intent(in) :: periodic(3)       !< 1: along this cell vector
    real(c_double), intent(in) :: vectors(3, 3)         !< of the cell, in columns, upper triangular [m]
    real(c_double), intent(in) :: corner(3)             !< of the cell [m]
    integer(c_int64_t), value :: capacity               !< of the ghosts
    integer(c_int32_t), intent(inout) :: ghost_of(0:capacity - 1) !< item
    real(c_double), intent(inout) :: ghost_x(dim, 0:capacity - 1) !< [m]
    real(c_double), intent(inout) :: ghost_reach(0:capacity - 1) !< [m]
    integer(c_int32_t), intent(inout) :: ghost_lattice(3, 0:capacity - 1)
    integer(c_int64_t), intent(out) :: found
    integer(c_int64_t), intent(out) :: too_wide         !< an item that meets images farther than can be numbered, else -1
    real(c_double) :: depth(3), f(3), p(3), s
    integer(c_int64_t) :: i
    integer(c_int32_t) :: k, low(3), high(3), m1, m2, m3

    depth = depth_of_cell(periodic, vectors)
    found = 0
    too_wide = -1
    do i = first, last - 1
      p = 0
      p(1:dim) = x(:, i) - corner(1:dim)
      low = 0
      high = 0
      f = 0
      do k = dim, 1, -1
        if (periodic(k) == 0) cycle
        f(k) = p(k)/vectors(k, k)
        p(1:k) = p(1:k) - f(k)*vectors(1:k, k)
        s = 2*reach(i)/depth(k)*(1 + slack) + slack
        low(k) = int(-floor_of(f(k) + s), c_int32_t)
        high(k) = int(floor_of(1 + s - f(k)), c_int32_t)
      end do
      if (max(maxval(-low), maxval(high)) > farthest_image) then
        too_wide = i
        return
      end if
      do m3 = low(3), high(3)
        do m2 = low(2), high(2)
          do m1 = low(1), high(1)
            if (m1 == 0 .and. m2 == 0 .and. m3 == 0) cycle
            found = found + 1
            if (found > capacity) cycle
            ghost_of(found - 1) = int(i, c_int32_t)
            p = m1*vectors(:, 1) + m2*vectors(:, 2) + m3*vectors(:, 3)
            ghost_x(:, found - 1) = x(:, i) + p(1:dim)
            ghost_reach(found - 1) = reach(i)
            ghost_lattice(:, found - 1) = lattice(:, i) + [m1, m2, m3]
          end do
        end do
      end do
    end do
  end subroutine cairn_periodic_ghosts

  !> Distance between opposite faces: the inverse of the length of a row of the inverse of the vectors. Along an axis that is
  !> not periodic the cell has its unit vector.
  pure function depth_of_cell(periodic, vectors) result(depth)
    integer(c_int32_t), intent(in) :: periodic(3)
    real(c_double), intent(in) :: vectors(3, 3)
    real(c_double) :: depth(3), lean12, lean23, lean13

    ! row k of the inverse, times vectors(k, k): (1, -l12, l12 l23 - l13), (0, 1, -l23), (0, 0, 1)
    lean12 = 0
    lean13 = 0
    lean23 = 0
    if (periodic(2) /= 0) lean12 = vectors(1, 2)/vectors(2, 2)
    if (periodic(3) /= 0) lean13 = vectors(1, 3)/vectors(3, 3)
    if (periodic(3) /= 0) lean23 = vectors(2, 3)/vectors(3, 3)
    depth(1) = vectors(1, 1)/sqrt(1 + lean12**2 + (lean12*lean23 - lean13)**2)
    depth(2) = vectors(2, 2)/sqrt(1 + lean23**2)
    depth(3) = vectors(3, 3)
  end function depth_of_cell

  !> Floor of x, clamped to the range of image counts.
  elemental function floor_of(x) result(whole)
    real(c_double), intent(in) :: x
    real(c_double) :: whole
    whole = real(floor(max(-1.0e9_c_double, min(x, 1.0e9_c_double)), c_int32_t), c_double)
  end function floor_of

end module periodic_items
