!> Flat faces of superquadrics like boxes, pillows and drums. With an exponent below 1 the middle of a face is flat: its lowest
!> point runs from rim to rim at the least rotation, so a single contact there would bear a body as a needle does. Corners on the
!> surface, a little behind the middle, represent the face as those of a polyhedron do.
module flat_faces
  use, intrinsic :: iso_c_binding, only: c_double
  use convex_shape, only: convex, sag_of, support
  implicit none
  private
  public :: face_of_superquadric

  real(c_double), parameter :: upright = 0.7_c_double !< cosine: a face looks along the normal

contains

  !> Corners of the face of c that looks along d, unit, counterclockwise seen from outside: four where it is flat both ways, two
  !> where it is flat one way, none where it is round. From the centre of c; m: the normal of four.
  pure subroutine face_of_superquadric(c, d, count, corner, m)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: d(3)
    integer, intent(out) :: count
    real(c_double), intent(out) :: corner(3, 4), m(3)
    real(c_double) :: e(3), x(3, 4), p(2)
    logical :: flat(2)
    integer :: k, axis
    count = 0
    corner = 0
    m = 0
    flat = c%dual < 2
    if (.not. any(flat)) return
    p = c%dual/(c%dual - 1) ! of the norms whose unit ball it is, 2/e
    e = own_axes(c, d)
    axis = maxloc(abs(e), 1)
    if (abs(e(axis)) > upright .and. axis == 3) then
      if (.not. flat(1)) return
      call at_pole(c, p, x)
      count = 4
    else if (abs(e(3)) > upright) then
      return
    else if (abs(e(axis)) > upright .and. flat(2)) then
      call at_side(c, p, axis, flat(1), e, count, x)
    else if (flat(1)) then
      call along_meridian(c, p, e, x)
      count = 2
    else
      return
    end if
    if (e(axis) < 0 .and. count == 4) then
      x(axis, :) = -x(axis, :)
      x = x(:, 4:1:-1)
    else if (count == 2 .and. e(axis) < 0 .and. flat(2) .and. abs(e(axis)) > upright) then
      x(axis, :) = -x(axis, :)
    end if
    do k = 1, count
      corner(:, k) = matmul(c%frame, x(:, k))
    end do
    m = sign(1.0_c_double, e(axis))*c%frame(:, axis)
  end subroutine face_of_superquadric

  pure function own_axes(c, x) result(y)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: x(3)
    real(c_double) :: y(3)
    integer :: k
    do k = 1, 3
      y(k) = dot_product(x, c%frame(:, k))
    end do
  end function own_axes

  !> The rest of a sum of powers that is 1: (1 - g**p)**(1/p), for 0 < g <= 1.
  pure real(c_double) function rest(g, p)
    real(c_double), intent(in) :: g, p
    real(c_double) :: left
    left = -expm1_of(p*log(g))
    rest = 0
    if (left > 0) rest = exp(log(left)/p)
  end function rest

  !> exp(x) - 1 with all digits (Kahan).
  pure real(c_double) function expm1_of(x)
    real(c_double), intent(in) :: x
    real(c_double) :: u
    u = exp(x)
    expm1_of = u - 1
    if (abs(expm1_of) < 0.5_c_double .and. abs(log(u)) > 0) expm1_of = expm1_of*x/log(u)
    if (.not. abs(log(u)) > 0) expm1_of = x
  end function expm1_of

  !> Corners of the face across the third axis, on the side to which that points: on the diagonals of an outline that is round or
  !> square, at the tips of a rhomb.
  pure subroutine at_pole(c, p, x)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: p(2)
    real(c_double), intent(out) :: x(3, 4)
    real(c_double) :: high, far
    high = 1 - sag_of(c)/c%half(3)
    far = rest(high, p(1))
    x(3, :) = high*c%half(3)
    if (p(2) < 2) then
      x(1, :) = far*c%half(1)*[1, 0, -1, 0]
      x(2, :) = far*c%half(2)*[0, 1, 0, -1]
    else
      far = far*exp(-log(2.0_c_double)/p(2))
      x(1, :) = far*c%half(1)*[1, -1, -1, 1]
      x(2, :) = far*c%half(2)*[1, 1, -1, -1]
    end if
  end subroutine at_pole

  !> Corners of the face across the first or the second axis, on the side to which that points; where the face is round along the
  !> third axis, at the height of the point that is farthest along e.
  pure subroutine at_side(c, p, axis, both, e, count, x)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: p(2)
    integer, intent(in) :: axis
    logical, intent(in) :: both
    real(c_double), intent(in) :: e(3)
    integer, intent(out) :: count
    real(c_double), intent(out) :: x(3, 4)
    real(c_double) :: far, wide, round, low(3), out(3)
    integer :: other
    other = 3 - axis
    far = 1 - sag_of(c)/c%half(axis)
    x = 0
    if (both) then
      count = 4
      round = (1 + far)/2 ! of the norm across the third axis, which makes half of their offset
      x(axis, :) = far*c%half(axis)
      wide = round*rest(far/round, p(2))*c%half(other)
      x(other, :) = merge(wide, -wide, axis == 1)*[1, 1, -1, -1]
      x(3, :) = rest(round, p(1))*c%half(3)*[-1, 1, 1, -1]
    else
      count = 2
      out = matmul(c%frame, e)
      low = own_axes(c, support(c, out))
      round = norm(low(1)/c%half(1), low(2)/c%half(2), p(2))
      x(axis, 1:2) = round*far*c%half(axis)
      wide = round*rest(far, p(2))*c%half(other)
      x(other, 1:2) = [-wide, wide]
      x(3, 1:2) = low(3)
    end if
  end subroutine at_side

  !> Both ends of the flat part of the meridian that is farthest along e.
  pure subroutine along_meridian(c, p, e, x)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: p(2), e(3)
    real(c_double), intent(out) :: x(3, 4)
    real(c_double) :: low(3), out(3), round
    out = e(1)*c%frame(:, 1) + e(2)*c%frame(:, 2)
    low = own_axes(c, support(c, out))
    round = 1 - sag_of(c)/max(abs(low(1)), abs(low(2)))
    x = 0
    x(1, 1:2) = round*low(1)
    x(2, 1:2) = round*low(2)
    x(3, 1:2) = rest(round, p(1))*c%half(3)*[-1, 1]
  end subroutine along_meridian

  pure real(c_double) function norm(a, b, p)
    real(c_double), intent(in) :: a, b, p
    real(c_double) :: large, part
    large = max(abs(a), abs(b))
    norm = large
    if (.not. large > 0) return
    part = min(abs(a), abs(b))/large
    if (part > 0) norm = large*exp(log(1 + exp(p*log(part)))/p)
  end function norm

end module flat_faces
