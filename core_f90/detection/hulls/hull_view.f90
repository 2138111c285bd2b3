!> Convex polygons and polyhedra as kernels see them: what many contactors share, and the copy of each where it is turned to.
module hull_view
  use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_int32_t, c_int64_t, c_ptr
  implicit none
  private
  public :: cairn_hulls, hulls_view, solid, open_hulls, view_solid

  !> See cairn/core.h. Numbers inside a hull count from 1.
  type, bind(C) :: cairn_hulls
    integer(c_int32_t) :: dim           !< 2 or 3
    integer(c_int32_t) :: most          !< contacts a pair may have
    integer(c_int32_t) :: seen_a, seen_b !< what convex_pair sees A and B as
    type(c_ptr) :: hull                 !< (contactors) which hull, -1: none
    type(c_ptr) :: first_vertex         !< (hulls + 1)
    type(c_ptr) :: first_face           !< (hulls + 1); sides in 2D
    type(c_ptr) :: first_edge           !< (hulls + 1); none in 2D
    type(c_ptr) :: first_corner         !< (faces + 1); none in 2D
    type(c_ptr) :: corner_vertex        !< (corners) of a face, counterclockwise from outside
    type(c_ptr) :: corner_edge          !< (corners) edge from a corner to the next
    type(c_ptr) :: edge                 !< (4, edges) vertices from and to, face left and right of it
    type(c_ptr) :: offset               !< (faces) of the planes from the centre of the hull [m]
    type(c_ptr) :: inner                !< (hulls) radius of the ball around the centre that a hull holds [m]
    type(c_ptr) :: place                !< (contactors) where the turned copy begins
    type(c_ptr) :: turned               !< of each contactor: vertices (n, dim) from its centre [m], then normals (n, dim)
    type(c_ptr) :: recalled             !< (2, pairs of the call) features of the axis last time, then of this; null: none
  end type cairn_hulls

  type :: hulls_view
    integer :: dim = 3, most = 4
    integer(c_int32_t), pointer, contiguous :: hull(:) => null(), first_vertex(:) => null(), first_face(:) => null()
    integer(c_int32_t), pointer, contiguous :: first_edge(:) => null(), first_corner(:) => null()
    integer(c_int32_t), pointer, contiguous :: corner_vertex(:) => null(), corner_edge(:) => null(), edge(:, :) => null()
    real(c_double), pointer, contiguous :: offset(:) => null(), inner(:) => null(), turned(:) => null()
    integer(c_int64_t), pointer, contiguous :: place(:) => null()
  end type hulls_view

  !> One contactor's hull, turned, from its centre.
  type :: solid
    integer :: vertices = 0, faces = 0, edges = 0
    real(c_double) :: size = 0, inner = 0                              !< radii of the balls that hold it, that it holds [m]
    real(c_double), pointer, contiguous :: v(:, :) => null()           !< (vertices, dim) [m]
    real(c_double), pointer, contiguous :: normal(:, :) => null()      !< (faces, dim) unit, outward
    real(c_double), pointer, contiguous :: offset(:) => null()         !< (faces) [m]
    integer(c_int32_t), pointer, contiguous :: first_corner(:) => null() !< (faces + 1) from 0, in all corners
    integer(c_int32_t), pointer, contiguous :: corner_vertex(:) => null(), corner_edge(:) => null() !< all corners
    integer(c_int32_t), pointer, contiguous :: edge(:, :) => null()    !< (4, edges)
  end type solid

  integer, parameter :: many = huge(0)
  integer(c_int64_t), parameter :: many_numbers = 2_c_int64_t**58

contains

  subroutine open_hulls(hulls, view)
    type(cairn_hulls), intent(in) :: hulls
    type(hulls_view), intent(out) :: view
    view%dim = hulls%dim
    view%most = hulls%most
    call c_f_pointer(hulls%hull, view%hull, [many])
    call c_f_pointer(hulls%first_vertex, view%first_vertex, [many])
    call c_f_pointer(hulls%first_face, view%first_face, [many])
    call c_f_pointer(hulls%first_edge, view%first_edge, [many])
    call c_f_pointer(hulls%first_corner, view%first_corner, [many])
    call c_f_pointer(hulls%corner_vertex, view%corner_vertex, [many])
    call c_f_pointer(hulls%corner_edge, view%corner_edge, [many])
    call c_f_pointer(hulls%edge, view%edge, [4, many])
    call c_f_pointer(hulls%offset, view%offset, [many])
    call c_f_pointer(hulls%inner, view%inner, [many])
    call c_f_pointer(hulls%place, view%place, [many])
    call c_f_pointer(hulls%turned, view%turned, [many_numbers])
  end subroutine open_hulls

  !> The hull of contactor i, counted from 0.
  subroutine view_solid(view, i, radius, s)
    type(hulls_view), intent(in) :: view
    integer(c_int32_t), intent(in) :: i
    real(c_double), intent(in) :: radius !< of the contactor [m]
    type(solid), intent(inout) :: s
    integer :: h, f
    integer(c_int64_t) :: p, q
    h = view%hull(i + 1) + 1
    f = view%first_face(h)
    s%vertices = view%first_vertex(h + 1) - view%first_vertex(h)
    s%faces = view%first_face(h + 1) - f
    s%size = radius
    s%inner = view%inner(h)
    p = view%place(i + 1)
    q = p + int(s%vertices, c_int64_t)*view%dim
    s%v(1:s%vertices, 1:view%dim) => view%turned(p + 1:q)
    s%normal(1:s%faces, 1:view%dim) => view%turned(q + 1:q + int(s%faces, c_int64_t)*view%dim)
    s%offset => view%offset(f + 1:f + s%faces)
    if (view%dim == 2) return
    s%edges = view%first_edge(h + 1) - view%first_edge(h)
    s%first_corner => view%first_corner(f + 1:f + s%faces + 1)
    s%corner_vertex => view%corner_vertex
    s%corner_edge => view%corner_edge
    s%edge(1:4, 1:s%edges) => view%edge(:, view%first_edge(h) + 1:view%first_edge(h + 1))
  end subroutine view_solid

end module hull_view
