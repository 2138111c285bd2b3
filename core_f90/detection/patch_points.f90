!> The few points that stand for a patch of contact, each with a name that follows it from step to step.
module patch_points
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  implicit none
  private
  public :: patch, clear_patch, add_point, add_deepest, reduce_patch, name_points, name_of_edges, vertex_of_b

  integer, parameter :: most_points = 64
  !> Names: vertices of A from 1, of B from `vertex_of_b`, crossings of edges from `crossing`.
  integer(c_int32_t), parameter :: vertex_of_b = 2_c_int32_t**28, crossing = 2_c_int32_t**29, edge_names = 2_c_int32_t**14
  integer(c_int32_t), parameter :: second_name = 2_c_int32_t**27
  ! Of the size of the smaller body: points closer than `same` are one, names of vertices hold within `near`.
  real(c_double), parameter :: same = 1e-7_c_double, near = 1e-5_c_double

  type :: patch
    integer :: count = 0
    real(c_double) :: size = 0                                    !< of the smaller body [m]
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

  !> The nearest features, where the patch holds none as near but for `slack`, what rounding makes of it.
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
      if (p%gap(k) < p%gap(best) - 1e-9_c_double*p%size) best = k
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

  !> Names points after a vertex that is near, of A before B, so that a corner keeps its name while rounding moves it in and
  !> out of the other face; then sorts by name. xa (2, na), xb (2, nb): vertices of the two faces, across the normal.
  pure subroutine name_points(p, na, xa, name_a, nb, xb, name_b)
    type(patch), intent(inout) :: p
    integer, intent(in) :: na, nb
    real(c_double), intent(in) :: xa(:, :), xb(:, :)
    integer(c_int32_t), intent(in) :: name_a(:), name_b(:)
    integer(c_int32_t) :: own, name
    real(c_double) :: x(3), gap
    integer :: i, k
    do k = 1, p%count
      own = p%name(k)
      name = 0
      do i = 1, na
        if (max(abs(xa(1, i) - p%x(1, k)), abs(xa(2, i) - p%x(2, k))) <= near*p%size) name = name_a(i)
      end do
      do i = 1, nb
        if (name > 0) exit
        if (max(abs(xb(1, i) - p%x(1, k)), abs(xb(2, i) - p%x(2, k))) <= near*p%size) name = vertex_of_b + name_b(i)
      end do
      if (name == 0) name = own
      if (any(p%name(1:k - 1) == name)) name = own
      do while (any(p%name(1:k - 1) == name))
        name = name + second_name
      end do
      p%name(k) = name
    end do
    do k = 2, p%count
      x = p%x(:, k)
      gap = p%gap(k)
      name = p%name(k)
      do i = k - 1, 1, -1
        if (p%name(i) <= name) exit
        p%x(:, i + 1) = p%x(:, i)
        p%gap(i + 1) = p%gap(i)
        p%name(i + 1) = p%name(i)
      end do
      p%x(:, i + 1) = x
      p%gap(i + 1) = gap
      p%name(i + 1) = name
    end do
  end subroutine name_points

end module patch_points
