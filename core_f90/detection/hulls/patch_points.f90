!> The few points that stand for a patch of contact, each with a name that follows it from step to step.
module patch_points
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  implicit none
  private
  public :: patch, clear_patch, add_point, add_deepest, reduce_patch, name_points, name_of_edges, sort_by_name, &
            vertex_of_b

  integer, parameter :: most_points = 64
  integer, parameter :: few = 4 !< points that a pair whose points are named may have
  !> Names: vertices of A from 1, of B from `vertex_of_b`, crossings of edges from `crossing`.
  integer(c_int32_t), parameter :: vertex_of_b = 2_c_int32_t**28, crossing = 2_c_int32_t**29, edge_names = 2_c_int32_t**14
  integer(c_int32_t), parameter :: second_name = 2_c_int32_t**27
  ! Tolerances relative to the size of the smaller body: points closer than `same` coincide, names of vertices hold within `near`.
  real(c_double), parameter :: same = 1e-7_c_double, near = 1e-5_c_double

  type :: patch
    integer :: count = 0
    real(c_double) :: size = 0                                    !< of the smaller body [m]
    real(c_double) :: tie = 0                                     !< depths that hardly differ [m]
    real(c_double) :: x(3, most_points) = 0                       !< across the normal, then along it the middle of the gap [m]
    real(c_double) :: gap(most_points) = 0                        !< [m]
    integer(c_int32_t) :: name(most_points) = 0
  end type patch

contains

  pure subroutine clear_patch(p, size)
    type(patch), intent(inout) :: p
    real(c_double), intent(in) :: size
    p%count = 0
    p%size = size
    p%tie = 1e-9_c_double*size
  end subroutine clear_patch

  pure elemental function name_of_edges(edge_a, edge_b) result(name)
    integer, intent(in) :: edge_a, edge_b
    integer(c_int32_t) :: name
    name = crossing + edge_names*edge_a + edge_b
  end function name_of_edges

  !> Adds a point unless it is there already.
  pure subroutine add_point(p, x, gap, name)
    type(patch), intent(inout) :: p
    real(c_double), intent(in) :: x(3), gap
    integer(c_int32_t), intent(in) :: name
    if (place_of(p, x(1:2)) > 0) return
    if (p%count == most_points) call reduce_patch(p, 4)
    p%count = p%count + 1
    p%x(:, p%count) = x
    p%gap(p%count) = gap
    p%name(p%count) = name
  end subroutine add_point

  !> Adds the nearest features unless a point of the patch is as near within `slack`, the rounding error.
  pure subroutine add_deepest(p, x, gap, slack, name)
    type(patch), intent(inout) :: p
    real(c_double), intent(in) :: x(3), gap, slack
    integer(c_int32_t), intent(in) :: name
    integer :: k
    real(c_double) :: low
    low = huge(low)
    do k = 1, p%count
      low = min(low, p%gap(k))
    end do
    if (low <= gap + slack) return
    k = place_of(p, x(1:2))
    if (k == 0) then
      call add_point(p, x, gap, name)
    else
      p%gap(k) = gap
      p%x(3, k) = x(3)
    end if
  end subroutine add_deepest

  pure function place_of(p, x) result(k)
    type(patch), intent(in) :: p
    real(c_double), intent(in) :: x(2)
    integer :: k
    do k = 1, p%count
      if (max(abs(p%x(1, k) - x(1)), abs(p%x(2, k) - x(2))) <= same*p%size) return
    end do
    k = 0
  end function place_of

  !> Leaves at most `most` points: the deepest, the farthest from it, and those that make the largest triangle and quadrangle,
  !> then whatever adds most. Near ties are broken by order, not by rounding.
  pure subroutine reduce_patch(p, most)
    type(patch), intent(inout) :: p
    integer, intent(in) :: most
    integer :: chosen(most), n, k
    logical :: taken(most_points)
    if (p%count <= most) return
    taken = .false.
    chosen(1) = deepest(p)
    taken(chosen(1)) = .true.
    do n = 2, most
      k = most_added(p, n - 1, chosen, taken)
      if (k == 0) exit
      chosen(n) = k
      taken(k) = .true.
    end do
    p%count = n - 1
    p%x(:, 1:n - 1) = p%x(:, chosen(1:n - 1))
    p%gap(1:n - 1) = p%gap(chosen(1:n - 1))
    p%name(1:n - 1) = p%name(chosen(1:n - 1))
  end subroutine reduce_patch

  !> Where depths hardly differ, the first in order.
  pure function deepest(p) result(best)
    type(patch), intent(in) :: p
    integer :: best, k
    best = 1
    do k = 2, p%count
      if (p%gap(k) < p%gap(best) - p%tie) best = k
    end do
  end function deepest

  !> The point that adds most to what n points span: length to one, area to more.
  pure function most_added(p, n, chosen, taken) result(best)
    type(patch), intent(in) :: p
    integer, intent(in) :: n, chosen(:)
    logical, intent(in) :: taken(:)
    integer :: best, k, i, j
    real(c_double) :: gain, high
    best = 0
    high = 0
    do k = 1, p%count
      if (taken(k)) cycle
      gain = 0
      if (n == 1) then
        gain = sum((p%x(1:2, k) - p%x(1:2, chosen(1)))**2)
      else if (n == 2) then
        gain = abs(area(p, chosen(1), chosen(2), k))
      else
        ! outside the polygon of the chosen: the largest triangle on a pair of them that has all others on its other side
        do i = 1, n
          do j = 1, n
            if (i == j) cycle
            if (all_left(p, n, chosen, i, j)) gain = max(gain, -area(p, chosen(i), chosen(j), k))
          end do
        end do
      end if
      if (gain > high*(1 + 1e-6_c_double)) then
        high = gain
        best = k
      end if
    end do
  end function most_added

  pure function all_left(p, n, chosen, i, j)
    type(patch), intent(in) :: p
    integer, intent(in) :: n, chosen(:), i, j
    logical :: all_left
    integer :: m
    all_left = .true.
    do m = 1, n
      if (m /= i .and. m /= j) all_left = all_left .and. area(p, chosen(i), chosen(j), chosen(m)) >= 0
    end do
  end function all_left

  pure function area(p, i, j, k)
    type(patch), intent(in) :: p
    integer, intent(in) :: i, j, k
    real(c_double) :: area, d(2), e(2)
    d = p%x(1:2, j) - p%x(1:2, i)
    e = p%x(1:2, k) - p%x(1:2, i)
    area = d(1)*e(2) - d(2)*e(1)
  end function area

  !> Names points after a vertex that is near, of A before B, so that a corner keeps its name while rounding moves it in and out of
  !> the other face; then sorts by name. Of at most a few points. xa (2, na), xb (2, nb): vertices of the two faces, across the
  !> normal. The loops run over all places, used or not, without branches.
  pure subroutine name_points(p, na, xa, name_a, nb, xb, name_b)
    type(patch), intent(inout) :: p
    integer, intent(in) :: na, nb
    real(c_double), intent(in) :: xa(2, na), xb(2, nb)
    integer(c_int32_t), intent(in) :: name_a(na), name_b(nb)
    integer(c_int32_t), dimension(few) :: of_a, of_b, name
    integer :: i, k
    logical :: twice
    call reduce_patch(p, few)
    call names_near(p, na, xa, name_a, of_a)
    call names_near(p, nb, xb, name_b, of_b)
    do k = 1, few
      name(k) = merge(vertex_of_b + of_b(k), p%name(k), of_b(k) > 0)
      name(k) = merge(of_a(k), name(k), of_a(k) > 0)
      name(k) = merge(name(k), huge(name) - k, k <= p%count)
    end do
    twice = .false.
    do k = 2, few
      do i = 1, k - 1
        twice = twice .or. name(i) == name(k)
      end do
    end do
    if (twice) call tell_apart(p, name)
    call sort_points(p, name)
  end subroutine name_points

  !> The name of a vertex that is near each point, the first of them; 0: none.
  pure subroutine names_near(p, n, x, name, of)
    type(patch), intent(in) :: p
    integer, intent(in) :: n
    real(c_double), intent(in) :: x(2, n)
    integer(c_int32_t), intent(in) :: name(n)
    integer(c_int32_t), intent(out) :: of(few)
    real(c_double) :: away(few), found(few)
    integer :: i, k
    found = 0
    do i = n, 1, -1
      do k = 1, few
        away(k) = max(abs(x(1, i) - p%x(1, k)), abs(x(2, i) - p%x(2, k)))
      end do
      do k = 1, few
        found(k) = merge(real(name(i), c_double), found(k), away(k) <= near*p%size)
      end do
    end do
    of = int(found, c_int32_t)
  end subroutine names_near

  !> Makes names unique: a point whose name is already taken gets its counterpart in a second series of names.
  pure subroutine tell_apart(p, name)
    type(patch), intent(in) :: p
    integer(c_int32_t), intent(inout) :: name(few)
    integer :: k
    do k = 2, p%count
      if (any(name(1:k - 1) == name(k))) name(k) = p%name(k)
      do while (any(name(1:k - 1) == name(k)))
        name(k) = name(k) + second_name
      end do
    end do
  end subroutine tell_apart

  !> By name, which are all different.
  pure subroutine sort_points(p, name)
    type(patch), intent(inout) :: p
    integer(c_int32_t), intent(in) :: name(few)
    real(c_double) :: x(3, few), gap(few)
    integer :: i, k, place(few)
    place = 1
    do i = 1, few
      do k = 1, few
        place(k) = place(k) + merge(1, 0, name(i) < name(k))
      end do
    end do
    x = p%x(:, 1:few)
    gap = p%gap(1:few)
    do k = 1, few
      p%x(:, place(k)) = x(:, k)
      p%gap(place(k)) = gap(k)
      p%name(place(k)) = name(k)
    end do
  end subroutine sort_points

  !> The same of any number of points by the names that they have.
  pure subroutine sort_by_name(p)
    type(patch), intent(inout) :: p
    integer :: i, k
    do k = 2, p%count
      do i = k, 2, -1
        if (p%name(i - 1) <= p%name(i)) exit
        p%x(:, [i - 1, i]) = p%x(:, [i, i - 1])
        p%gap([i - 1, i]) = p%gap([i, i - 1])
        p%name([i - 1, i]) = p%name([i, i - 1])
      end do
    end do
  end subroutine sort_by_name

end module patch_points
