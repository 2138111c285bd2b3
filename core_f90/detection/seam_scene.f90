!> Runs of contacts as the search for seams reads them, and the bodies that they are of: see seams.f90.
module seam_scene
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int16_t, c_int32_t, c_int64_t, c_ptr
  use hull_view, only: cairn_hulls, hulls_view, open_hulls, solid, view_solid
  use convex_shape, only: convex, reach, see_capsule, see_cylinder, see_superquadric
  implicit none
  private
  public :: cairn_seams, scene, meeting, open_scene, meet, reach_of, size_of
  public :: bar, cylinder, facet, half_space, hull

  !> Kinds of shapes: these are the values of enum cairn_seam_shape of rows.h.
  integer, parameter :: ball = 0, hull = 1, bar = 2, capsule = 3, cylinder = 4, superquadric = 5, half_space = 6, facet = 7

  !> See cairn/rows.h.
  type, bind(C) :: cairn_seams
    integer(c_int32_t) :: dim             !< 2 or 3
    integer(c_int32_t) :: periodic        !< 0: images are not read
    type(c_ptr) :: shape                  !< (contactors)
    type(c_ptr) :: seen                   !< (shapes) kind of each
    type(c_ptr) :: centre                 !< (dim, contactors) [m]
    type(c_ptr) :: radius                 !< (contactors) [m]
    type(c_ptr) :: direction              !< (dim + 1, contactors) unit, then half length [m]; null: nothing has one
    type(c_ptr) :: vectors                !< (3, 3) of the periodic cell, in columns [m]
    type(cairn_hulls) :: hulls            !< read where a contactor has one
    type(c_ptr) :: a, b, image            !< (contacts)
    type(c_ptr) :: gap                    !< (contacts) [m]
    type(c_ptr) :: normal, point          !< (dim, contacts) from b to a; middle of the gap [m]
    type(c_ptr) :: run                    !< (runs + 1) first contact of each run
    type(c_ptr) :: body                   !< (contactors) negative: of a mesh
    type(c_ptr) :: position               !< (dim, bodies) [m]
    type(c_ptr) :: velocity, free         !< (3 | 6, bodies) now, and at the end of the step without contacts [m/s rad/s]
    real(c_double) :: step                !< [s]
  end type cairn_seams

  type :: scene
    integer :: dim = 3
    logical :: periodic = .false.
    real(c_double) :: step = 0
    type(hulls_view) :: view
    integer(c_int16_t), pointer, contiguous :: shape(:) => null()
    integer(c_int32_t), pointer, contiguous :: seen(:) => null(), a(:) => null(), b(:) => null(), image(:) => null()
    integer(c_int64_t), pointer, contiguous :: run(:) => null()
    real(c_double), pointer, contiguous :: centre(:, :) => null(), radius(:) => null(), direction(:, :) => null()
    integer(c_int32_t), pointer, contiguous :: body(:) => null()
    real(c_double), pointer, contiguous :: position(:, :) => null(), velocity(:, :) => null(), free(:, :) => null()
    real(c_double), pointer, contiguous :: vectors(:, :) => null(), gap(:) => null(), normal(:, :) => null(), point(:, :) => null()
  end type scene

  integer, parameter :: most_points = 8 !< of one run, see pairs.def

  !> A run of contacts seen from one of its bodies, X. All vectors start at the centre of X, and the normal points from Y to X.
  type :: meeting
    integer(c_int64_t) :: first = 0, last = 0
    integer :: points = 0
    real(c_double) :: q(3, most_points) = 0 !< points of the contacts on Y [m]
    integer(c_int32_t) :: x = 0, y = 0
    real(c_double) :: n(3) = 0, at(3) = 0 !< centre of Y from that of X [m]
    real(c_double) :: sense = 1           !< 1: X is A
    real(c_double) :: height = 0          !< of the plane across n through the farthest of the points on Y [m]
    real(c_double) :: sunk = 0, far = 0   !< how deep X is in Y, and the largest gap without its sign [m]
    logical :: many = .false.             !< others than Y have this plane too
    logical :: mixed = .false.            !< several bodies have this plane
    integer :: closing = 0                !< 1 by the forces on the bodies, 2 by their speed, -1 by one that may be an error
    real(c_double) :: speed = 0           !< greatest along the normal [m/s]
  end type meeting

contains

  subroutine open_scene(given, s)
    type(cairn_seams), intent(in) :: given
    type(scene), intent(out) :: s
    integer, parameter :: many = huge(0)
    s%dim = given%dim
    s%periodic = given%periodic /= 0
    s%step = given%step
    if (c_associated(given%hulls%hull)) call open_hulls(given%hulls, s%view)
    call c_f_pointer(given%shape, s%shape, [many])
    call c_f_pointer(given%seen, s%seen, [many])
    call c_f_pointer(given%centre, s%centre, [s%dim, many])
    call c_f_pointer(given%radius, s%radius, [many])
    if (c_associated(given%direction)) call c_f_pointer(given%direction, s%direction, [s%dim + 1, many])
    call c_f_pointer(given%vectors, s%vectors, [3, 3])
    call c_f_pointer(given%a, s%a, [many])
    call c_f_pointer(given%b, s%b, [many])
    call c_f_pointer(given%image, s%image, [many])
    call c_f_pointer(given%gap, s%gap, [many])
    call c_f_pointer(given%normal, s%normal, [s%dim, many])
    call c_f_pointer(given%point, s%point, [s%dim, many])
    call c_f_pointer(given%run, s%run, [many])
    call c_f_pointer(given%body, s%body, [many])
    call c_f_pointer(given%position, s%position, [s%dim, many])
    call c_f_pointer(given%velocity, s%velocity, [3*s%dim - 3, many])
    call c_f_pointer(given%free, s%free, [3*s%dim - 3, many])
  end subroutine open_scene

  subroutine meet(s, entry, m)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: entry
    type(meeting), intent(inout) :: m
    real(c_double) :: shift(3)
    integer(c_int64_t) :: k
    integer(c_int32_t) :: a, b
    integer :: j, d, lattice
    d = s%dim
    k = entry/2 + 1
    m%first = s%run(k) + 1
    m%last = s%run(k + 1)
    a = s%a(m%first)
    b = s%b(m%first)
    m%at = 0
    m%n = 0
    m%many = .false.
    m%mixed = .false.
    shift = 0
    if (s%periodic) then
      do j = 1, d
        lattice = iand(shiftr(s%image(m%first), 10*(j - 1)), 1023) - 512
        if (lattice /= 0) shift = shift + lattice*s%vectors(:, j)
      end do
    end if
    m%sense = merge(1, -1, iand(entry, 1) == 0)
    m%x = merge(a, b, iand(entry, 1) == 0)
    m%y = merge(b, a, iand(entry, 1) == 0)
    m%at(1:d) = m%sense*(s%centre(:, b + 1) + shift(1:d) - s%centre(:, a + 1))
    m%n(1:d) = m%sense*s%normal(:, m%first)
    m%height = -huge(m%height)
    m%sunk = 0
    m%far = 0
    m%points = int(min(m%last - m%first + 1, int(most_points, c_int64_t)))
    do j = 1, m%points
      k = m%first + j - 1
      m%q(3, j) = 0
      m%q(1:d, j) = s%point(:, k) - s%centre(:, a + 1) - s%gap(k)/2*m%n(1:d) ! from the centre of A in the primary cell
      if (m%sense < 0) m%q(:, j) = m%q(:, j) + m%at
      m%height = max(m%height, m%n(1)*m%q(1, j) + m%n(2)*m%q(2, j) + m%n(3)*m%q(3, j))
      m%sunk = max(m%sunk, -s%gap(k))
      m%far = max(m%far, abs(s%gap(k)))
    end do
  end subroutine meet

  !> How far contactor c reaches along d, unit, from its centre [m].
  real(c_double) function reach_of(s, c, d)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: c
    real(c_double), intent(in) :: d(3)
    type(solid) :: p
    type(convex) :: body
    integer :: i, k
    k = s%dim
    select case (s%seen(s%shape(c + 1) + 1))
    case (ball)
      reach_of = s%radius(c + 1)
    case (hull, facet)
      call view_solid(s%view, c, s%radius(c + 1), p)
      reach_of = -huge(reach_of)
      do i = 1, merge(3, p%vertices, s%seen(s%shape(c + 1) + 1) == facet)
        reach_of = max(reach_of, dot_product(d(1:k), p%v(i, :)))
      end do
    case (bar)
      reach_of = s%direction(3, c + 1)*abs(dot_product(s%direction(1:2, c + 1), d(1:2))) + s%radius(c + 1)
    case (capsule)
      call see_capsule(s%view, c, s%radius(c + 1), body)
      reach_of = reach(body, d) + body%layer
    case (cylinder)
      call see_cylinder(s%view, c, s%radius(c + 1), body)
      reach_of = reach(body, d)
    case (superquadric)
      call see_superquadric(s%view, c, s%radius(c + 1), body)
      reach_of = reach(body, d)
    case default
      reach_of = huge(reach_of)
    end select
  end function reach_of

  !> Radius of the ball around a contactor [m]; the largest number of walls.
  pure real(c_double) function size_of(s, c)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: c
    size_of = s%radius(c + 1)
    if (s%seen(s%shape(c + 1) + 1) == bar) size_of = size_of + s%direction(3, c + 1)
    if (s%seen(s%shape(c + 1) + 1) == half_space .or. .not. size_of > 0) size_of = huge(size_of)
  end function size_of

end module seam_scene
