!> Friction in blocks whose moments against rolling are M = D m with |m| <= rolling r_N: D holds the radii by which surfaces roll on
!> each other. The power of m is that of a force rolling r_N against the velocity D omega of the point of contact over the surfaces.
!> Where both radii are one, R, |M_r| <= rolling R r_N.
module rolling_cones
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use block_cones, only: solve_blocks, map_blocks, status_of_blocks
  implicit none
  private
  public :: solve_rolling, map_rolling, rolling_limits
contains

  !> Limits of the blocks over the normal impulse; those of rolling may differ by direction.
  pure subroutine rolling_limits(c, friction, rolling, twisting, geometry, mu, d, even)
    integer(c_int32_t), intent(in) :: c           !< components
    real(c_double), intent(in)     :: friction, rolling, twisting !< [-]
    real(c_double), intent(in)     :: geometry(6) !< area [m2], effective radius [m], mass [kg], radii about t t, t s, s s [m]
    real(c_double), intent(out)    :: mu(3)       !< see block_cones
    real(c_double), intent(out)    :: d(3)        !< radii about t t, t s, s s [m]
    logical, intent(out)           :: even        !< mu says all
    d = 0
    even = c < 6
    mu = [friction, twisting*geometry(2), rolling*geometry(2)]
    if (even) return
    d = geometry(4:6)
    even = .not. (abs(d(2)) > 0 .or. abs(d(1) - d(3)) > 0)
    mu(3) = rolling
    if (even) mu(3) = rolling*d(1)
  end subroutine rolling_limits

  !> Solves as block_cones does, with moments M scaled to impulses, m = D^-1 M.
  pure subroutine solve_rolling(c, w, u_free, mu, d, even, r, status)
    integer(c_int32_t), intent(in)  :: c         !< components
    real(c_double), intent(inout)   :: w(c, c)   !< Delassus block, overwritten [1/kg]
    real(c_double), intent(inout)   :: u_free(c) !< relative velocity with r = 0 here, overwritten [m/s]
    real(c_double), intent(in)      :: mu(3), d(3) !< see rolling_limits
    logical, intent(in)             :: even      !< see rolling_limits
    real(c_double), intent(inout)   :: r(c)      !< impulse, before and after [N s]
    integer(c_int32_t), intent(out) :: status    !< see cairn_contact_status
    real(c_double) :: k(3), start(c)
    k = 0
    start = r
    if (.not. even) then
      call scale_block(c, d, w, u_free)
      start(5:6) = divided(d, start(5:6))
    end if
    call solve_blocks(c, .true., w, u_free, mu, k, r, start)
    status = status_of_blocks(c, .true., mu, k, r)
    if (.not. even) r(5:6) = times(d, r(5:6))
  end subroutine solve_rolling

  !> The natural map, of m for rolling.
  pure subroutine map_rolling(c, w, u, mu, d, even, r, f, status)
    integer(c_int32_t), intent(in)  :: c         !< components
    real(c_double), intent(inout)   :: w(c, c)   !< Delassus block, overwritten [1/kg]
    real(c_double), intent(inout)   :: u(c)      !< relative velocity; lost [m/s]
    real(c_double), intent(in)      :: mu(3), d(3) !< see rolling_limits
    logical, intent(in)             :: even      !< see rolling_limits
    real(c_double), intent(in)      :: r(c)      !< impulse [N s]
    real(c_double), intent(out)     :: f(c)      !< [N s]
    integer(c_int32_t), intent(out) :: status    !< see cairn_contact_status
    real(c_double) :: x(c), left(2), k(3)
    k = 0
    x = r
    if (.not. even) then
      call scale_block(c, d, w, u)
      x(5:6) = divided(d, x(5:6))
      left = r(5:6) - times(d, x(5:6)) ! about an axis about which nothing is borne
    end if
    call map_blocks(c, .true., w, u, mu, k, x, f)
    status = status_of_blocks(c, .true., mu, k, x)
    if (.not. even) f(5:6) = times(d, f(5:6)) + left
  end subroutine map_rolling

  !> Moments D m in place of m, angular velocities times D.
  pure subroutine scale_block(c, d, w, u)
    integer(c_int32_t), intent(in) :: c       !< components: 6
    real(c_double), intent(in)     :: d(3)    !< [m]
    real(c_double), intent(inout)  :: w(c, c) !< [1/kg]
    real(c_double), intent(inout)  :: u(c)    !< [m/s]
    integer :: l
    u(5:6) = times(d, u(5:6))
    do l = 1, c
      w(5:6, l) = times(d, w(5:6, l))
    end do
    do l = 1, c
      w(l, 5:6) = times(d, w(l, 5:6))
    end do
  end subroutine scale_block

  pure function times(d, x) result(y)
    real(c_double), intent(in) :: d(3), x(2)
    real(c_double) :: y(2)
    y = [d(1)*x(1) + d(2)*x(2), d(2)*x(1) + d(3)*x(2)]
  end function times

  !> D^-1 x, of a D that bears moments about one axis alone, D = l e e', the shortest answer, D x/l**2.
  pure function divided(d, x) result(y)
    real(c_double), intent(in) :: d(3), x(2)
    real(c_double) :: y(2), determinant
    determinant = d(1)*d(3) - d(2)*d(2)
    y = 0
    if (determinant > 16*epsilon(determinant)*d(1)*d(3)) then
      y = [d(3)*x(1) - d(2)*x(2), d(1)*x(2) - d(2)*x(1)]/determinant
    else if (d(1) + d(3) > 0) then
      y = times(d, x)/(d(1) + d(3))**2
    end if
  end function divided
end module rolling_cones
