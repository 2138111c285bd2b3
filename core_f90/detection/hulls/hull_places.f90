!> Hulls where they stand: turned with their bodies, the boxes that hold them, and which pairs have boxes that meet.
module hull_places
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_hull_place, cairn_box_search

contains

  !> Turns the hulls of contactors first to last-1 and bounds all of these contactors by boxes around their centres.
  pure subroutine cairn_hull_place(dim, first, last, body, hull, place, first_vertex, first_face, vertex, normal, &
                                   offset, has_rotation, rotation, radius, reach, turned, box) bind(c)
    integer(c_int32_t), value :: dim                      !< 2 or 3
    integer(c_int64_t), value :: first, last              !< contactors to treat
    integer(c_int32_t), intent(in) :: body(0:last - 1)    !< body that carries the contactor
    integer(c_int32_t), intent(in) :: hull(0:last - 1)    !< -1: none
    integer(c_int64_t), intent(in) :: place(0:last - 1)   !< in turned
    integer(c_int32_t), intent(in) :: first_vertex(0:*)   !< of the hulls
    integer(c_int32_t), intent(in) :: first_face(0:*)     !< of the hulls
    real(c_double), intent(in) :: vertex(dim, 0:*)        !< from the centre of the hull, in the axes of the body [m]
    real(c_double), intent(in) :: normal(dim, 0:*)        !< of the faces, unit
    real(c_double), intent(in) :: offset(0:*)             !< of the faces [m]
    integer(c_int32_t), value :: has_rotation             !< 0: rotation is not read
    real(c_double), intent(in) :: rotation(3*dim - 5, 0:*) !< angle [rad] or unit quaternion (w, x, y, z)
    real(c_double), intent(in) :: radius(0:*), reach(0:*) !< of the contactors, without and with margin [m]
    real(c_double), intent(inout) :: turned(0:*)          !< vertices (n, dim) [m], then normals (n, dim) of each contactor
    real(c_double), intent(inout) :: box(dim, 2, 0:last - 1) !< low and high from the centre, with margin [m]
    integer(c_int64_t) :: i, p
    integer :: h, nv, nf
    real(c_double) :: r(dim, dim), share

    r = unturned(dim)
    do i = first, last - 1
      box(:, 1, i) = -reach(i)
      box(:, 2, i) = reach(i)
      h = hull(i)
      if (h < 0) cycle
      if (has_rotation /= 0) r = turning(dim, rotation(:, body(i)))
      nv = first_vertex(h + 1) - first_vertex(h)
      nf = first_face(h + 1) - first_face(h)
      p = place(i)
      call turn_all(dim, nv, r, vertex(1, first_vertex(h)), turned(p))
      share = reach(i) - radius(i)
      if (nv == 2) share = share + offset(first_face(h)) ! a capsule or cylinder around its axis
      ! of a facet the vertices around it are none of it
      call bound(dim, nv, merge(min(nv, 3), nv, dim == 3 .and. nf == 1), turned(p), share, box(1, 1, i))
      call turn_all(dim, nf, r, normal(1, first_face(h)), turned(p + int(nv, c_int64_t)*dim))
    end do
  end subroutine cairn_hull_place

  pure function unturned(dim) result(r)
    integer(c_int32_t), intent(in) :: dim
    real(c_double) :: r(dim, dim)
    integer :: k
    r = 0
    do k = 1, dim
      r(k, k) = 1
    end do
  end function unturned

  !> Matrix of an angle or a quaternion, body to space.
  pure function turning(dim, rotation) result(r)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in) :: rotation(3*dim - 5)
    real(c_double) :: r(dim, dim), w, x, y, z
    if (dim == 2) then
      r(1, :) = [cos(rotation(1)), -sin(rotation(1))]
      r(2, :) = [sin(rotation(1)), cos(rotation(1))]
      return
    end if
    w = rotation(1)
    x = rotation(2)
    y = rotation(3)
    z = rotation(4)
    r(1, :) = [1 - 2*(y*y + z*z), 2*(x*y - w*z), 2*(x*z + w*y)]
    r(2, :) = [2*(x*y + w*z), 1 - 2*(x*x + z*z), 2*(y*z - w*x)]
    r(3, :) = [2*(x*z - w*y), 2*(y*z + w*x), 1 - 2*(x*x + y*y)]
  end function turning

  pure subroutine turn_all(dim, n, r, x, y)
    integer(c_int32_t), intent(in) :: dim
    integer, intent(in) :: n
    real(c_double), intent(in) :: r(dim, dim), x(dim, n)
    real(c_double), intent(out) :: y(n, dim)
    integer :: i, k
    do k = 1, dim
      do i = 1, n
        y(i, k) = r(k, 1)*x(1, i) + r(k, 2)*x(2, i)
        if (dim == 3) y(i, k) = y(i, k) + r(k, 3)*x(3, i)
      end do
    end do
  end subroutine turn_all

  pure subroutine bound(dim, n, used, x, share, box)
    integer(c_int32_t), intent(in) :: dim
    integer, intent(in) :: n, used
    real(c_double), intent(in) :: x(n, dim), share
    real(c_double), intent(out) :: box(dim, 2)
    integer :: k
    do k = 1, dim
      box(k, 1) = minval(x(:used, k)) - share
      box(k, 2) = maxval(x(:used, k)) + share
    end do
  end subroutine bound

  !> Keeps the pairs whose boxes meet. Works in place. Any pair that is dropped is farther apart than its margin.
  pure subroutine cairn_box_search(dim, n, a, b, image, centre, box, vectors, kept) bind(c)
    integer(c_int32_t), value :: dim                    !< 2 or 3
    integer(c_int64_t), value :: n                      !< pairs
    integer(c_int32_t), intent(inout) :: a(n), b(n), image(n)
    real(c_double), intent(in) :: centre(dim, 0:*)      !< of the contactors [m]
    real(c_double), intent(in) :: box(dim, 2, 0:*)      !< [m]
    real(c_double), intent(in) :: vectors(3, 3)         !< of the periodic cell, in columns [m]
    integer(c_int64_t), intent(out) :: kept
    integer(c_int32_t), parameter :: own_image = 512 + 1024*(512 + 1024*512)
    real(c_double), parameter :: slack = 8*epsilon(1.0_c_double)
    integer(c_int64_t) :: k
    integer :: j
    real(c_double) :: d(dim), rounding(dim)

    kept = 0
    do k = 1, n
      d = centre(:, a(k)) - centre(:, b(k))
      if (image(k) /= own_image) then
        do j = 1, dim
          d = d - (iand(shiftr(image(k), 10*(j - 1)), 1023) - 512)*vectors(1:dim, j)
        end do
      end if
      rounding = slack*(abs(centre(:, a(k))) + abs(centre(:, b(k))) + box(:, 2, a(k)) - box(:, 1, a(k)))
      if (image(k) >= 0) then ! others are refused later
        if (any(d + box(:, 1, a(k)) > box(:, 2, b(k)) + rounding)) cycle
        if (any(d + box(:, 2, a(k)) < box(:, 1, b(k)) - rounding)) cycle
      end if
      kept = kept + 1
      a(kept) = a(k)
      b(kept) = b(k)
      image(kept) = image(k)
    end do
  end subroutine cairn_box_search

end module hull_places
