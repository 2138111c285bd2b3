!> Bars and beams whose ends move and turn as far as they like: energy, forces and their exact derivatives, in space.
!>
!> Bars: force by the change of length (corotational), or by Green's strain and the second Piola-Kirchhoff stress (total
!> Lagrangian). Beams: corotational (Crisfield 1990; Felippa & Haugen 2005), with the linear beam of Przemieniecki (1968) in the
!> frames of their ends. Each end bends by the rotation vector from the chord to its triad, in the axes of this triad; the beam
!> twists by the part about the axis of the rotation between both triads (swing and twist). All of these are products of vectors
!> that rotate with the beam, so that rigid motions of any size cause no strain.
module corotational_frames
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_bars_moved, cairn_beams_moved
  integer, parameter :: corotational = 1, total_lagrangian = 2
contains

  !> n bars of reference vectors d0 between their ends, and vectors w by which the second end moved more than the first.
  !> by_energy not 0: forces along the straight way from `begin` to w whose work is the change of the energy, along the mean of both
  !> directions so that they keep the angular momentum (Simo & Tarnow 1992); tangents are then the symmetric part.
  pure subroutine cairn_bars_moved(n, kinematics, d0, moved, begin, by_energy, axial, pull, energy, force, tangent, fault) bind(c)
    integer(c_int64_t), value       :: n
    integer(c_int32_t), value       :: kinematics, by_energy
    real(c_double), intent(in)      :: d0(3, n), moved(3, n) !< [m]
    real(c_double), intent(in)      :: begin(3, n)   !< [m], read where by_energy
    real(c_double), intent(in)      :: axial(n)      !< young*area [N]
    real(c_double), intent(in)      :: pull(n)       !< before they move, tension positive [N]
    real(c_double), intent(out)     :: energy(n)     !< [J]
    real(c_double), intent(out)     :: force(3, n)   !< on the second end; the other way on the first [N]
    real(c_double), intent(out)     :: tangent(3, 3, n) !< [N/m]
    integer(c_int32_t), intent(out) :: fault(n)      !< 1: it has no length, or one that is not finite
    real(c_double) :: d(3), d1(3), size, long, long0, strain, strain0, tension, by_length, rate
    integer(c_int64_t) :: i
    integer :: k
    do i = 1, n
      size = norm2(d0(:, i))
      d1 = d0(:, i) + moved(:, i)
      d = d1
      if (by_energy /= 0) d = d0(:, i) + (moved(:, i) + begin(:, i))/2
      long = norm2(d1)
      fault(i) = merge(0, 1, long > 0 .and. long <= huge(long))
      energy(i) = 0
      force(:, i) = 0
      tangent(:, :, i) = 0
      if (fault(i) /= 0) cycle
      strain = strain_of(kinematics, d0(:, i), moved(:, i), size, long)
      energy(i) = size*(pull(i) + axial(i)*strain)**2/(2*axial(i))
      long0 = long
      strain0 = strain
      if (by_energy /= 0) then
        long0 = norm2(d0(:, i) + begin(:, i))
        strain0 = strain_of(kinematics, d0(:, i), begin(:, i), size, long0)
      end if
      tension = pull(i) + axial(i)*(strain + strain0)/2
      if (kinematics == total_lagrangian) then
        by_length = tension/size ! force over length
        rate = axial(i)/size**3/(1 + merge(1, 0, by_energy /= 0))
      else
        by_length = 2*tension/(long + long0)
        if (by_energy /= 0) then
          rate = (axial(i)/size - by_length)/(long*(long + long0))
        else
          rate = (axial(i)/size - by_length)/long**2
        end if
      end if
      force(:, i) = by_length*d
      tangent(:, :, i) = 0.5_c_double*rate*(spread(d, 2, 3)*spread(d1, 1, 3) + spread(d1, 2, 3)*spread(d, 1, 3))
      do k = 1, 3
        tangent(k, k, i) = tangent(k, k, i) + by_length*merge(0.5_c_double, 1.0_c_double, by_energy /= 0)
      end do
    end do
  end subroutine cairn_bars_moved

  !> Without the difference of two lengths that are nearly the same.
  pure real(c_double) function strain_of(kinematics, d0, moved, size, long)
    integer(c_int32_t), intent(in) :: kinematics
    real(c_double), intent(in) :: d0(3), moved(3), size, long
    real(c_double) :: change
    change = dot_product(2*d0 + moved, moved)
    if (kinematics == total_lagrangian) then
      strain_of = change/(2*size**2)
    else
      strain_of = change/((long + size)*size)
    end if
  end function strain_of

  !> n beams. Unknowns are the displacement by which the second end moved more than the first, and small rotations of both ends on
  !> top of those that they have, in the axes of space.
  pure subroutine cairn_beams_moved(n, d0, axes, moved, turned, stiff, pull, want, energy, force, tangent, fault) bind(c)
    integer(c_int64_t), value       :: n
    real(c_double), intent(in)      :: d0(3, n)        !< from end to end before they move [m]
    real(c_double), intent(in)      :: axes(3, 3, n)   !< along, second and third of the section there, each a column
    real(c_double), intent(in)      :: moved(3, n)     !< [m]
    real(c_double), intent(in)      :: turned(3, 3, 2, n) !< rotations of their ends
    real(c_double), intent(in)      :: stiff(6, n)     !< axial [N]; of bending by the turn of an end at this one and at the other,
                                                       !< along the second axis and along the third; of twist [N m]
    real(c_double), intent(in)      :: pull(n)         !< before they move, tension positive [N]
    integer(c_int32_t), value       :: want            !< not 0: tangents
    real(c_double), intent(out)     :: energy(n)       !< [J]
    real(c_double), intent(out)     :: force(9, n)     !< [N, N m]
    real(c_double), intent(out)     :: tangent(9, 9, n) !< [N/m, N, N m]
    integer(c_int32_t), intent(out) :: fault(n)        !< 1 as of bars; 2: an end is turned nearly back on the beam
    real(c_double) :: e(3), long, size, strain, t(3, 3, 2), tension
    integer(c_int64_t) :: i
    integer :: k, wrong
    do i = 1, n
      size = norm2(d0(:, i))
      e = d0(:, i) + moved(:, i)
      long = norm2(e)
      energy(i) = 0
      force(:, i) = 0
      if (want /= 0) tangent(:, :, i) = 0
      fault(i) = merge(0, 1, long > 0 .and. long <= huge(long))
      if (fault(i) /= 0) cycle
      e = e/long
      strain = strain_of(corotational, d0(:, i), moved(:, i), size, long)
      tension = pull(i) + stiff(1, i)*strain
      energy(i) = size*tension**2/(2*stiff(1, i))
      force(1:3, i) = tension*e
      if (want /= 0) then
        tangent(1:3, 1:3, i) = (stiff(1, i)/size - tension/long)*spread(e, 2, 3)*spread(e, 1, 3)
        do k = 1, 3
          tangent(k, k, i) = tangent(k, k, i) + tension/long
        end do
      end if
      t(:, :, 1) = matmul(turned(:, :, 1, i), axes(:, :, i))
      t(:, :, 2) = matmul(turned(:, :, 2, i), axes(:, :, i))
      call bend(e, long, t, stiff(2:5, i), want, energy(i), force(:, i), tangent(:, :, i), wrong)
      if (wrong == 0) call twist(t, stiff(6, i), want, energy(i), force(:, i), tangent(:, :, i), wrong)
      fault(i) = wrong
    end do
  end subroutine cairn_beams_moved

  pure subroutine bend(e, long, t, stiff, want, energy, force, tangent, wrong)
    real(c_double), intent(in)        :: e(3), long, t(3, 3, 2), stiff(4)
    integer(c_int32_t), intent(in)    :: want
    real(c_double), intent(inout)     :: energy, force(9), tangent(9, 9)
    integer, intent(out)              :: wrong
    real(c_double) :: c, s, f(3), angle(2, 2), slope(9, 2, 2), of_c(9), of_s(9), moment(2, 2), k(2, 2)
    integer :: axis, end
    wrong = 0
    do end = 1, 2
      c = dot_product(t(:, 1, end), e)
      if (.not. c > -0.99_c_double) then
        wrong = 2
        return
      end if
      f = angle_over_sine(c)
      of_c = slope_along(t(:, 1, end), e, long, end)
      do axis = 1, 2
        s = dot_product(t(:, axis + 1, end), e)
        of_s = slope_along(t(:, axis + 1, end), e, long, end)
        angle(axis, end) = f(1)*s
        slope(:, axis, end) = f(1)*of_s + s*f(2)*of_c
      end do
    end do
    do axis = 1, 2
      k(:, 1) = stiff([2*axis - 1, 2*axis])
      k(:, 2) = stiff([2*axis, 2*axis - 1])
      moment(axis, :) = matmul(k, angle(axis, :))
      energy = energy + dot_product(moment(axis, :), angle(axis, :))/2
      force = force + moment(axis, 1)*slope(:, axis, 1) + moment(axis, 2)*slope(:, axis, 2)
      if (want == 0) cycle
      tangent = tangent + k(1, 1)*(outer(slope(:, axis, 1), slope(:, axis, 1)) + outer(slope(:, axis, 2), slope(:, axis, 2))) &
        + k(1, 2)*(outer(slope(:, axis, 1), slope(:, axis, 2)) + outer(slope(:, axis, 2), slope(:, axis, 1)))
    end do
    if (want == 0) return
    do end = 1, 2
      c = dot_product(t(:, 1, end), e)
      f = angle_over_sine(c)
      of_c = slope_along(t(:, 1, end), e, long, end)
      do axis = 1, 2
        s = dot_product(t(:, axis + 1, end), e)
        of_s = slope_along(t(:, axis + 1, end), e, long, end)
        tangent = tangent + moment(axis, end)*(f(2)*(outer(of_c, of_s) + outer(of_s, of_c)) + s*f(3)*outer(of_c, of_c))
        call add_curve_along(t(:, axis + 1, end), e, long, end, moment(axis, end)*f(1), tangent)
        call add_curve_along(t(:, 1, end), e, long, end, moment(axis, end)*s*f(2), tangent)
      end do
    end do
  end subroutine bend

  !> By the angle tau = atan2(t13.t22 - t12.t23, t12.t22 + t13.t23) of both triads about the axis.
  pure subroutine twist(t, stiff, want, energy, force, tangent, wrong)
    real(c_double), intent(in)        :: t(3, 3, 2), stiff
    integer(c_int32_t), intent(in)    :: want
    real(c_double), intent(inout)     :: energy, force(9), tangent(9, 9)
    integer, intent(out)              :: wrong
    real(c_double) :: s, c, square, angle, of_s(9), of_c(9), slope(9)
    s = dot_product(t(:, 3, 1), t(:, 2, 2)) - dot_product(t(:, 2, 1), t(:, 3, 2))
    c = dot_product(t(:, 2, 1), t(:, 2, 2)) + dot_product(t(:, 3, 1), t(:, 3, 2))
    square = s**2 + c**2
    wrong = merge(0, 2, square > 1.0e-4_c_double)
    if (wrong /= 0) return
    angle = atan2(s, c)
    of_s = slope_between(t(:, 3, 1), t(:, 2, 2)) - slope_between(t(:, 2, 1), t(:, 3, 2))
    of_c = slope_between(t(:, 2, 1), t(:, 2, 2)) + slope_between(t(:, 3, 1), t(:, 3, 2))
    slope = (c*of_s - s*of_c)/square
    energy = energy + stiff*angle**2/2
    force = force + stiff*angle*slope
    if (want == 0) return
    tangent = tangent + stiff*outer(slope, slope) + stiff*angle/square**2*(2*s*c*(outer(of_c, of_c) - outer(of_s, of_s)) &
              + (s**2 - c**2)*(outer(of_s, of_c) + outer(of_c, of_s)))
    call add_curve_between(t(:, 3, 1), t(:, 2, 2), stiff*angle*c/square, tangent)
    call add_curve_between(t(:, 2, 1), t(:, 3, 2), -stiff*angle*c/square, tangent)
    call add_curve_between(t(:, 2, 1), t(:, 2, 2), -stiff*angle*s/square, tangent)
    call add_curve_between(t(:, 3, 1), t(:, 3, 2), -stiff*angle*s/square, tangent)
  end subroutine twist

  !> arccos(c)/sqrt(1 - c**2) and its two derivatives; by its series in 1 - c near the end, where the quotient is one of zeros.
  pure function angle_over_sine(c) result(f)
    real(c_double), intent(in) :: c
    real(c_double) :: f(3), x, term
    integer :: k
    x = 1 - c
    if (x < 0.25_c_double) then
      f = 0
      term = 1
      do k = 0, 24
        f(1) = f(1) + term*x**k
        if (k > 0) f(2) = f(2) - k*term*x**(k - 1)
        if (k > 1) f(3) = f(3) + k*(k - 1)*term*x**(k - 2)
        term = term*(k + 1)/(2*k + 3)
      end do
    else
      f(1) = acos(c)/sqrt(1 - c**2)
      f(2) = (c*f(1) - 1)/(1 - c**2)
      f(3) = (f(1) + 3*c*f(2))/(1 - c**2)
    end if
  end function angle_over_sine

  !> Derivative of t.e, t carried by an end and e = d/|d|.
  pure function slope_along(t, e, long, end) result(slope)
    real(c_double), intent(in) :: t(3), e(3), long
    integer, intent(in)        :: end
    real(c_double) :: slope(9)
    slope = 0
    slope(1:3) = (t - dot_product(t, e)*e)/long
    slope(3*end + 1:3*end + 3) = cross(t, e)
  end function slope_along

  !> And its second one, times a factor. That by two rotations is the symmetric part.
  pure subroutine add_curve_along(t, e, long, end, factor, tangent)
    real(c_double), intent(in)    :: t(3), e(3), long, factor
    integer, intent(in)           :: end
    real(c_double), intent(inout) :: tangent(9, 9)
    real(c_double) :: across(3), mixed(3, 3), along
    integer :: k, at
    along = dot_product(t, e)
    across = t - along*e
    tangent(1:3, 1:3) = tangent(1:3, 1:3) - factor/long**2*(spread(across, 2, 3)*spread(e, 1, 3) &
                                                            + spread(e, 2, 3)*spread(across, 1, 3) &
                                                            - along*spread(e, 2, 3)*spread(e, 1, 3))
    at = 3*end
    do k = 1, 3
      tangent(k, k) = tangent(k, k) - factor*along/long**2
      mixed(:, k) = cross(unit(k), t)
      mixed(:, k) = (mixed(:, k) - dot_product(mixed(:, k), e)*e)*factor/long
      tangent(at + k, at + k) = tangent(at + k, at + k) - factor*along
    end do
    tangent(1:3, at + 1:at + 3) = tangent(1:3, at + 1:at + 3) + mixed
    tangent(at + 1:at + 3, 1:3) = tangent(at + 1:at + 3, 1:3) + transpose(mixed)
    tangent(at + 1:at + 3, at + 1:at + 3) = tangent(at + 1:at + 3, at + 1:at + 3) &
      + factor/2*(spread(t, 2, 3)*spread(e, 1, 3) + spread(e, 2, 3)*spread(t, 1, 3))
  end subroutine add_curve_along

  !> The same of a.b, a carried by the first end and b by the second one.
  pure function slope_between(a, b) result(slope)
    real(c_double), intent(in) :: a(3), b(3)
    real(c_double) :: slope(9)
    slope(1:3) = 0
    slope(4:6) = cross(a, b)
    slope(7:9) = cross(b, a)
  end function slope_between

  pure subroutine add_curve_between(a, b, factor, tangent)
    real(c_double), intent(in)    :: a(3), b(3), factor
    real(c_double), intent(inout) :: tangent(9, 9)
    real(c_double) :: same(3, 3), other(3, 3)
    integer :: k
    same = 0.5_c_double*(spread(a, 2, 3)*spread(b, 1, 3) + spread(b, 2, 3)*spread(a, 1, 3))
    other = -spread(b, 2, 3)*spread(a, 1, 3)
    do k = 1, 3
      same(k, k) = same(k, k) - dot_product(a, b)
      other(k, k) = other(k, k) + dot_product(a, b)
    end do
    tangent(4:6, 4:6) = tangent(4:6, 4:6) + factor*same
    tangent(7:9, 7:9) = tangent(7:9, 7:9) + factor*same
    tangent(4:6, 7:9) = tangent(4:6, 7:9) + factor*other
    tangent(7:9, 4:6) = tangent(7:9, 4:6) + factor*transpose(other)
  end subroutine add_curve_between

  pure function outer(a, b) result(product)
    real(c_double), intent(in) :: a(9), b(9)
    real(c_double) :: product(9, 9)
    product = spread(a, 2, 9)*spread(b, 1, 9)
  end function outer

  pure function cross(a, b) result(product)
    real(c_double), intent(in) :: a(3), b(3)
    real(c_double) :: product(3)
    product = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  pure function unit(k)
    integer, intent(in) :: k
    real(c_double) :: unit(3)
    unit = 0
    unit(k) = 1
  end function unit
end module corotational_frames
