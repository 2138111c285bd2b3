!> Tangential spring, dashpot and slider in series with Coulomb's limit (Cundall & Strack 1979), and the damping of a normal
!> spring that has a given restitution: what the smooth laws share.
module spring_slider
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: slide, damping_of, damp
  real(c_double), parameter :: pi = acos(-1.0_c_double)
contains

  !> Damping ratio whose linear oscillator leaves with restitution e: -ln e / sqrt(pi^2 + ln^2 e); 1 at e = 0.
  pure function damping_of(e) result(ratio)
    real(c_double), intent(in) :: e !< restitution, in [0, 1]
    real(c_double) :: ratio
    ratio = 1
    if (e > 0) ratio = -log(e)/sqrt(pi*pi + log(e)**2)
  end function damping_of

  !> Elastic force less damping c u+, where the velocity at the end of the step, u+ = u + h f/2m, follows from the force itself:
  !> exact to second order for a collision of two bodies, and stable whatever c.
  pure subroutine damp(n, h, mass, c, u, f)
    integer(c_int32_t), intent(in) :: n       !< contacts
    real(c_double), intent(in)     :: h       !< step [s]
    real(c_double), intent(in)     :: mass(n) !< effective mass; 0, and c too, between bodies that are held [kg]
    real(c_double), intent(in)     :: c(n)    !< [N s/m]
    real(c_double), intent(in)     :: u(n)    !< velocity at the middle of the step [m/s]
    real(c_double), intent(inout)  :: f(n)    !< elastic force; out, with damping [N]
    integer :: i
    do i = 1, n
      f(i) = (f(i) - c(i)*u(i))/(1 + 0.5_c_double*h*c(i)/max(mass(i), tiny(h)))
    end do
  end subroutine damp

  !> Tangential force of spring and dashpot, within the limit; beyond it the spring gives way.
  pure subroutine slide(n, c, h, k, damping, limit, u, spring, f, energy, stiffer)
    integer(c_int32_t), intent(in) :: n               !< contacts
    integer(c_int32_t), intent(in) :: c               !< components: 2 or 3
    real(c_double), intent(in)     :: h               !< step [s]
    real(c_double), intent(in)     :: k(n)            !< stiffness [N/m]
    real(c_double), intent(in)     :: damping(n)      !< [N s/m]
    real(c_double), intent(in)     :: limit(n)        !< largest force, not negative [N]
    real(c_double), intent(in)     :: u(n, c)         !< relative velocity (n, t [, s]) at the middle of the step [m/s]
    real(c_double), intent(inout)  :: spring(n, c - 1) !< [m]
    real(c_double), intent(inout)  :: f(n, c)         !< its tangential part is set [N]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by damping, by friction: added, friction in the
    !< mean of both ends of the step; released by a change of stiffness: set [J]
    real(c_double), intent(in), optional :: stiffer(n) !< how much more stiffness it had at the start of the step [-]
    real(c_double) :: t, s, old, yield, size2, before(n, 2)
    integer :: i
    if (c == 2) then
      do i = 1, n
        old = spring(i, 1)
        t = spring(i, 1) + h*u(i, 2)
        f(i, 2) = -k(i)*t - damping(i)*u(i, 2)
        if (abs(f(i, 2)) > limit(i)) then
          f(i, 2) = sign(limit(i), f(i, 2))
          t = 0
          if (k(i) > 0) t = -f(i, 2)/k(i)
        end if
        spring(i, 1) = t
        if (present(energy)) then
          energy(i, 4) = 0
          if (present(stiffer)) energy(i, 4) = 0.5_c_double*k(i)*stiffer(i)*old*old
          energy(i, 1) = energy(i, 1) + 0.5_c_double*k(i)*t*t
          energy(i, 3) = energy(i, 3) - h*f(i, 2)*u(i, 2) - 0.5_c_double*k(i)*(h*u(i, 2)*(t - old) + t*t - old*old)
        end if
      end do
      return
    end if
    if (present(energy)) then
      do i = 1, n
        energy(i, 4) = 0
        if (present(stiffer)) energy(i, 4) = 0.5_c_double*k(i)*stiffer(i)*(spring(i, 1)**2 + spring(i, 2)**2)
        before(i, 1) = spring(i, 1)
        before(i, 2) = spring(i, 2)
      end do
    end if
    !$omp simd private(t, s, size2, yield)
    do i = 1, n
      t = spring(i, 1) + h*u(i, 2)
      s = spring(i, 2) + h*u(i, 3)
      f(i, 2) = -k(i)*t - damping(i)*u(i, 2)
      f(i, 3) = -k(i)*s - damping(i)*u(i, 3)
      size2 = f(i, 2)*f(i, 2) + f(i, 3)*f(i, 3)
      if (size2 > limit(i)*limit(i)) then
        yield = limit(i)/sqrt(size2)
        f(i, 2) = yield*f(i, 2)
        f(i, 3) = yield*f(i, 3)
        t = -f(i, 2)/max(k(i), tiny(k))
        s = -f(i, 3)/max(k(i), tiny(k))
      end if
      spring(i, 1) = t
      spring(i, 2) = s
    end do
    if (present(energy)) then
      do i = 1, n
        energy(i, 1) = energy(i, 1) + 0.5_c_double*k(i)*(spring(i, 1)**2 + spring(i, 2)**2)
        energy(i, 3) = energy(i, 3) - h*(f(i, 2)*u(i, 2) + f(i, 3)*u(i, 3)) - 0.5_c_double*k(i)*( &
                       (spring(i, 1) - before(i, 1))*(h*u(i, 2) + spring(i, 1) + before(i, 1)) &
                       + (spring(i, 2) - before(i, 2))*(h*u(i, 3) + spring(i, 2) + before(i, 2)))
      end do
    end if
  end subroutine slide
end module spring_slider
