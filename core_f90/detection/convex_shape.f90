!> Convex shapes by what they reach in a direction: points, segments, cylinders, superquadrics, polyhedra, each with a layer of
!> even thickness around it. A sphere is a point, a capsule a segment in such a layer.
!> A hull without edges is round: of capsules and cylinders it holds the ends of the axis, which is its only normal, with the
!> radius as offset; of superquadrics the corners of its box, and as normals the axes, twice (0, 0, 0), with the three
!> half axes and the two exponents as offsets.
module convex_shape
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: hulls_view, solid, view_solid
  implicit none
  private
  public :: convex, see_point, see_capsule, see_cylinder, see_superquadric, see_polyhedron, support, guesses

  integer, parameter, public :: is_point = 0, is_segment = 1, is_cylinder = 2, is_superquadric = 3, is_polyhedron = 4
  integer, parameter, public :: most_guesses = 6
  !> Of the largest component: what is less is rounding, where the point of a superquadric like a box jumps across its face.
  real(c_double), parameter :: level = 1e-14_c_double

  type :: convex
    integer :: kind = is_point
    real(c_double) :: size = 0                 !< radius of the ball around it, without the layer [m]
    real(c_double) :: layer = 0                !< [m]
    real(c_double) :: frame(3, 3) = 0          !< axes in space, in columns; the axis of segments and cylinders is the third
    real(c_double) :: half(3) = 0              !< along them; of cylinders radius, radius, half length [m]
    real(c_double) :: dual(2) = 2              !< of superquadrics: exponents of the norm that is their reach
    type(solid) :: hull
  end type convex

contains

  pure subroutine see_point(radius, c)
    real(c_double), intent(in) :: radius
    type(convex), intent(inout) :: c
    c%kind = is_point
    c%size = 0
    c%layer = radius
  end subroutine see_point

  subroutine see_capsule(view, i, radius, c)
    type(hulls_view), intent(in) :: view
    integer(c_int32_t), intent(in) :: i
    real(c_double), intent(in) :: radius !< of the ball around it [m]
    type(convex), intent(inout) :: c
    call see_cylinder(view, i, radius, c)
    c%kind = is_segment
    c%layer = c%half(1)
    c%half(1:2) = 0
    c%size = c%half(3)
  end subroutine see_capsule

  subroutine see_cylinder(view, i, radius, c)
    type(hulls_view), intent(in) :: view
    integer(c_int32_t), intent(in) :: i
    real(c_double), intent(in) :: radius
    type(convex), intent(inout) :: c
    call view_solid(view, i, radius, c%hull)
    c%kind = is_cylinder
    c%size = radius
    c%layer = 0
    c%frame(:, 3) = c%hull%normal(1, :)
    c%half = [c%hull%offset(1), c%hull%offset(1), dot_product(c%frame(:, 3), c%hull%v(2, :))]
  end subroutine see_cylinder

  subroutine see_superquadric(view, i, radius, c)
    type(hulls_view), intent(in) :: view
    integer(c_int32_t), intent(in) :: i
    real(c_double), intent(in) :: radius
    type(convex), intent(inout) :: c
    integer :: k
    call view_solid(view, i, radius, c%hull)
    c%kind = is_superquadric
    c%size = radius
    c%layer = 0
    do k = 1, 3
      c%frame(:, k) = c%hull%normal(k, :)
    end do
    c%half = c%hull%offset(1:3)
    c%dual = 2/(2 - c%hull%offset(4:5))
  end subroutine see_superquadric

  subroutine see_polyhedron(view, i, radius, c)
    type(hulls_view), intent(in) :: view
    integer(c_int32_t), intent(in) :: i
    real(c_double), intent(in) :: radius
    type(convex), intent(inout) :: c
    call view_solid(view, i, radius, c%hull)
    c%kind = is_polyhedron
    c%size = radius
    c%layer = 0
  end subroutine see_polyhedron

  !> The point of c, without its layer, that reaches farthest along d, from its centre.
  pure function support(c, d) result(x)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: d(3)
    real(c_double) :: x(3), reach, high, w(3), length
    integer :: k, best
    x = 0
    select case (c%kind)
    case (is_segment)
      x = sign(c%half(3), dot_product(c%frame(:, 3), d))*c%frame(:, 3)
    case (is_cylinder)
      high = dot_product(c%frame(:, 3), d)
      w = d - high*c%frame(:, 3)
      w = w - dot_product(w, c%frame(:, 3))*c%frame(:, 3) ! what rounding left
      length = sqrt(dot_product(w, w))
      x = sign(c%half(3), high)*c%frame(:, 3)
      if (length > 4*epsilon(length)*abs(high)) x = x + (c%half(1)/length)*w
    case (is_superquadric)
      x = matmul(c%frame, farthest_of_superquadric(c, matmul(d, c%frame)))
    case (is_polyhedron)
      best = 1
      high = -huge(high)
      do k = 1, c%hull%vertices
        reach = d(1)*c%hull%v(k, 1) + d(2)*c%hull%v(k, 2) + d(3)*c%hull%v(k, 3)
        if (reach > high) then
          high = reach
          best = k
        end if
      end do
      x = c%hull%v(best, :)
    end select
  end function support

  !> ((|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1) <= 1 (Barr 1981) is the unit ball of a norm within a norm, and what
  !> it reaches is the dual norm: exponents 2/(2 - e). The point is the slope of the reach.
  pure function farthest_of_superquadric(c, d) result(x)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: d(3)
    real(c_double) :: x(3), u(3), high, g, h, p, q
    u = abs(c%half*d)
    x = 0
    high = maxval(u)
    if (.not. high > 0) return
    u = u/high
    where (u < level) u = 0
    p = c%dual(1) ! of z against the section
    q = c%dual(2) ! within the section
    g = norm_of(u(1), u(2), q)
    h = norm_of(g, u(3), p)
    if (g > 0) x(1:2) = sign(c%half(1:2)*(u(1:2)/g)**(q - 1)*(g/h)**(p - 1), d(1:2))
    x(3) = sign(c%half(3)*(u(3)/h)**(p - 1), d(3))
  end function farthest_of_superquadric

  pure real(c_double) function norm_of(a, b, p)
    real(c_double), intent(in) :: a, b, p
    norm_of = max(a, b)
    if (norm_of > 0) norm_of = norm_of*((a/norm_of)**p + (b/norm_of)**p)**(1/p)
  end function norm_of

  !> Directions in which faces or sides of c may look: what contacts often have as normal.
  pure subroutine guesses(c, count, d)
    type(convex), intent(in) :: c
    integer, intent(out) :: count
    real(c_double), intent(out) :: d(3, most_guesses)
    integer :: k
    count = 0
    if (c%kind == is_cylinder) then
      count = 2
      d(:, 1) = c%frame(:, 3)
    else if (c%kind == is_superquadric) then
      count = 6
      d(:, 1:3) = c%frame
    end if
    do k = 1, count/2
      d(:, count/2 + k) = -d(:, k)
    end do
  end subroutine guesses

end module convex_shape
