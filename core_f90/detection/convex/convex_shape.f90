!> Convex shapes by their support functions: points, segments, cylinders, superquadrics, polyhedra, each with a layer of uniform
!> thickness around it. A sphere is a point, a capsule a segment in such a layer.
!> A hull without edges is round: of capsules and cylinders it holds the ends of the axis, which is its only normal, with the
!> radius as offset; of superquadrics the corners of its box, and as normals the axes, twice (0, 0, 0), with the three
!> half axes and the two exponents as offsets.
module convex_shape
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
  use hull_view, only: hulls_view, solid, view_solid
  implicit none
  private
  public :: convex, see, see_point, see_capsule, see_cylinder, see_superquadric, see_polyhedron, support, reach, bend, bow, &
            guesses, sag_of

  !> Values of enum cairn_convex of core.h.
  integer, parameter, public :: is_point = 0, is_segment = 1, is_cylinder = 2, is_superquadric = 3, is_polyhedron = 4
  integer, parameter, public :: is_half_space = 5 !< of pairs; none is ever seen
  integer, parameter, public :: most_guesses = 6
  !> Rounding relative to the largest component; below it the support point of a superquadric like a box jumps across its face.
  real(c_double), parameter :: level = 1e-14_c_double
  !> Distance of the corners of a flat face behind its middle, relative to the least half axis of a superquadric.
  real(c_double), parameter :: behind = 2.0_c_double**(-13)

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

  !> Contactor i, counted from 0, as one of the kinds above.
  subroutine see(view, kind, i, radius, c)
    type(hulls_view), intent(in) :: view
    integer(c_int32_t), intent(in) :: kind, i
    real(c_double), intent(in) :: radius !< of the ball around it [m]
    type(convex), intent(inout) :: c
    select case (kind)
    case (is_point)
      call see_point(radius, c)
    case (is_segment)
      call see_capsule(view, i, radius, c)
    case (is_cylinder)
      call see_cylinder(view, i, radius, c)
    case (is_superquadric)
      call see_superquadric(view, i, radius, c)
    case (is_polyhedron)
      call see_polyhedron(view, i, radius, c)
    end select
  end subroutine see

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

  !> How far the corners of a flat face are behind the middle of that face; 0 where c has none but by an outline [m].
  pure real(c_double) function sag_of(c)
    type(convex), intent(in) :: c
    sag_of = 0
    if (c%kind == is_superquadric) sag_of = behind*minval(c%half)
  end function sag_of

  !> The point of c, without its layer, that reaches farthest along d, from its centre.
  pure function support(c, d) result(x)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: d(3)
    real(c_double) :: x(3), far, high, w(3), length
    integer :: k, best
    x = 0
    select case (c%kind)
    case (is_segment)
      x = sign(c%half(3), dot_product(c%frame(:, 3), d))*c%frame(:, 3)
    case (is_cylinder)
      high = dot_product(c%frame(:, 3), d)
      w = d - high*c%frame(:, 3)
      w = w - dot_product(w, c%frame(:, 3))*c%frame(:, 3) ! removes the component that rounding left
      length = sqrt(dot_product(w, w))
      x = sign(c%half(3), high)*c%frame(:, 3)
      if (length > 4*epsilon(length)*abs(high)) x = x + (c%half(1)/length)*w
    case (is_superquadric)
      x = matmul(c%frame, farthest_of_superquadric(c, matmul(d, c%frame)))
    case (is_polyhedron)
      best = 1
      high = -huge(high)
      do k = 1, c%hull%vertices
        far = d(1)*c%hull%v(k, 1) + d(2)*c%hull%v(k, 2) + d(3)*c%hull%v(k, 3)
        if (far > high) then
          high = far
          best = k
        end if
      end do
      x = c%hull%v(best, :)
    end select
  end function support

  !> How far c, without its layer, reaches along d, from its centre, times the length of d.
  pure real(c_double) function reach(c, d)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: d(3)
    real(c_double) :: high, w(3)
    integer :: k
    reach = 0
    select case (c%kind)
    case (is_segment)
      reach = c%half(3)*abs(dot_product(c%frame(:, 3), d))
    case (is_cylinder)
      high = dot_product(c%frame(:, 3), d)
      w = d - high*c%frame(:, 3)
      w = w - dot_product(w, c%frame(:, 3))*c%frame(:, 3)
      reach = c%half(3)*abs(high) + c%half(1)*sqrt(dot_product(w, w))
    case (is_superquadric)
      w = abs(c%half*matmul(d, c%frame))
      reach = norm_of(norm_of(w(1), w(2), c%dual(2)), w(3), c%dual(1))
    case (is_polyhedron)
      reach = -huge(reach)
      do k = 1, c%hull%vertices
        reach = max(reach, d(1)*c%hull%v(k, 1) + d(2)*c%hull%v(k, 2) + d(3)*c%hull%v(k, 3))
      end do
    end select
  end function reach

  !> The point of c that reaches farthest along d, unit, and the second derivatives (t1 t1, t1 t2, t2 t2) of the reach across it.
  pure subroutine bend(c, d, t, x, second)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: d(3), t(3, 2)
    real(c_double), intent(out) :: x(3), second(3)
    real(c_double), parameter :: upright = 1e-9_c_double
    real(c_double) :: e(3), w(3), g(3), high, length
    second = 0
    select case (c%kind)
    case (is_cylinder)
      e = c%frame(:, 3)
      high = dot_product(e, d)
      w = d - high*e
      w = w - dot_product(w, e)*e
      length = sqrt(dot_product(w, w))
      x = sign(c%half(3), high)*e
      if (length > upright) then
        w = w/length
        x = x + c%half(1)*w
        g = [e(2)*w(3) - e(3)*w(2), e(3)*w(1) - e(1)*w(3), e(1)*w(2) - e(2)*w(1)]
        g(1:2) = matmul(g, t)
        second = (c%half(1)/length)*[g(1)*g(1), g(1)*g(2), g(2)*g(2)]
      else ! any of its end: a step away from there is of a tenth
        second = 10*c%half(1)*[1, 0, 1]
      end if
    case (is_superquadric)
      call bend_superquadric(c, matmul(d, c%frame), matmul(transpose(c%frame), t), w, second)
      x = matmul(c%frame, w)
    case default
      x = support(c, d)
    end select
  end subroutine bend

  !> Support point of a superquadric (Barr 1981): the unit ball of the nested norm (|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) +
  !> |z/c|^(2/e1) <= 1. Its support function is the dual norm, of exponents 2/(2 - e); the support point is the gradient of that.
  pure function farthest_of_superquadric(c, d) result(x)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: d(3)
    real(c_double) :: x(3), u(3), g, h, of_g(2), of_h(2), second(3)
    u = abs(c%half*d)
    x = 0
    if (.not. maxval(u) > 0) return
    where (u < level*maxval(u)) u = 0
    call bend_norm(u(1), u(2), c%dual(2), g, of_g, second)
    call bend_norm(g, u(3), c%dual(1), h, of_h, second)
    x = sign(c%half*[of_g(1)*of_h(1), of_g(2)*of_h(1), of_h(2)], d)
  end function farthest_of_superquadric

  pure subroutine bend_superquadric(c, d, t, x, second)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: d(3), t(3, 2)
    real(c_double), intent(out) :: x(3), second(3)
    real(c_double), parameter :: least = 1e-12_c_double
    real(c_double) :: u(3), v(3, 2), g, h, of_g(2), of_h(2), bent_g(3), bent_h(3), along(2, 2)
    integer :: i, j, k
    u = abs(c%half*d)
    where (u < level*maxval(u)) u = 0
    call bend_norm(u(1), u(2), c%dual(2), g, of_g, bent_g)
    call bend_norm(g, u(3), c%dual(1), h, of_h, bent_h)
    x = sign(c%half*[of_g(1)*of_h(1), of_g(2)*of_h(1), of_h(2)], d)
    if (minval(u) < least*maxval(u)) then ! there the second derivatives may have no bound
      u = max(u, least*maxval(u))
      call bend_norm(u(1), u(2), c%dual(2), g, of_g, bent_g)
      call bend_norm(g, u(3), c%dual(1), h, of_h, bent_h)
    end if
    do k = 1, 2
      v(:, k) = sign(1.0_c_double, d)*c%half*t(:, k)
      along(:, k) = [of_g(1)*v(1, k) + of_g(2)*v(2, k), v(3, k)]
    end do
    do k = 1, 3
      i = merge(2, 1, k == 3)
      j = merge(1, 2, k == 1)
      second(k) = of_h(1)*product_of(bent_g, v(1:2, i), v(1:2, j)) + product_of(bent_h, along(:, i), along(:, j))
    end do
  contains
    pure real(c_double) function product_of(bent, p, q)
      real(c_double), intent(in) :: bent(3), p(2), q(2)
      product_of = bent(1)*p(1)*q(1) + bent(2)*(p(1)*q(2) + p(2)*q(1)) + bent(3)*p(2)*q(2)
    end function product_of
  end subroutine bend_superquadric

  !> Correction of a step w from the normal n where the curvature of the support function of c is unbounded: near the symmetry
  !> planes of superquadrics with flat faces, it behaves there as a power below 2 of a component. The corrected step is Newton's for
  !> the support point, the gradient of that power.
  pure function bow(c, n, w) result(more)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: n(3), w(3)
    real(c_double) :: more(3), d(3), e(3), q, part
    real(c_double), parameter :: least = 1e-12_c_double, far = 0.1_c_double
    integer :: k
    more = 0
    if (c%kind /= is_superquadric) return
    if (.not. minval(c%dual) < 2) return
    d = matmul(n, c%frame)
    e = matmul(w, c%frame)
    do k = 1, 3
      q = c%dual(merge(1, 2, k == 3)) - 1
      if (.not. q < 1) cycle
      if (abs(d(k)) < least) d(k) = sign(least, e(k))
      part = e(k)/d(k)
      if (part > -0.5_c_double .and. abs(d(k)) > far) cycle
      part = 1 + q*part
      more(k) = sign(min(exp(log(max(abs(part), least))/q)*abs(d(k)), far + abs(d(k))), part*d(k)) - d(k) - e(k)
    end do
    more = matmul(c%frame, more)
  end function bow

  pure real(c_double) function norm_of(a, b, p)
    real(c_double), intent(in) :: a, b, p
    real(c_double) :: part
    norm_of = max(a, b)
    if (.not. norm_of > 0) return
    part = min(a, b)/norm_of
    if (abs(p - 2) <= 0) then
      norm_of = norm_of*sqrt(1 + part*part)
    else if (part > 0) then
      norm_of = norm_of*exp(log(1 + exp(p*log(part)))/p)
    end if
  end function norm_of

  !> The norm of exponent p of a and b, not negative, with its slope and its second derivatives (aa, ab, bb).
  pure subroutine bend_norm(a, b, p, norm, slope, second)
    real(c_double), intent(in) :: a, b, p
    real(c_double), intent(out) :: norm, slope(2), second(3)
    real(c_double) :: large, part, power, root, bent
    large = max(a, b)
    norm = 0
    slope = 0
    second = 0
    if (.not. large > 0) return
    part = min(a, b)/large
    power = 0
    root = 1
    if (abs(p - 2) <= 0) then
      power = part*part
      root = sqrt(1 + power)
    else if (part > 0) then
      power = exp(p*log(part))
      root = exp(log(1 + power)/p)
    end if
    norm = large*root
    slope(1) = root/(1 + power)
    bent = (p - 1)*slope(1)/((1 + power)*large)
    if (part > 0) then
      power = power/part
      slope(2) = slope(1)*power
      second = bent*[power*part, -power, power/part]
    else if (abs(p - 2) <= 0) then
      second(3) = bent
    end if
    if (b > a) then
      slope = slope([2, 1])
      second = second([3, 2, 1])
    end if
  end subroutine bend_norm

  !> Directions of faces or sides of c, which are frequent contact normals.
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
