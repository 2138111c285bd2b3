!> Signorini-Coulomb with friction against rolling and twisting, each an exact cone of the normal impulse. About the normal
!> |M_t| <= twisting R r_N. Across it M = D m with |m| <= rolling r_N: D holds the radii by which the surfaces roll on each other.
!> The power of m is that of a force rolling r_N against the velocity D omega of the point of contact over the surfaces. Where
!> both radii are one, R, |M_r| <= rolling R r_N.
module rolling_friction
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, map_blocks, status_of_blocks
  implicit none
  private
  public :: cairn_law_rolling_friction_prepare, cairn_law_rolling_friction_solve, cairn_law_rolling_friction_residual
  integer, parameter :: own = 3    !< parameters
  integer, parameter :: columns = own + 7 !< then step, area, effective radius and mass, radii about t t, t s, s s
contains

  !> Free of bias where it is open.
  subroutine cairn_law_rolling_friction_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, *)      !< none
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    compliance = 0
    do i = 1, n
      bias(i, 1) = max(gap(i), 0.0_c_double)/context%h
      mu(i) = params(i, 1)
    end do
  end subroutine cairn_law_rolling_friction_prepare

  !> See block_cones, with the moments that m = D^-1 M has for impulses.
  subroutine cairn_law_rolling_friction_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)         !< in u_free [m/s]
    real(c_double), intent(in)    :: params(n, columns) !< see laws.def; step, geometry
    real(c_double), intent(in)    :: state(n, *)        !< none
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: mu(3), k(3), x(c), block(c, c), free(c), d(3)
    logical :: even
    integer :: i
    k = 0
    do i = 1, n
      call limits(c, params(i, :), mu, d, even)
      block = w(i, :, :)
      free = u_free(i, :)
      if (.not. even) call scale_block(c, d, block, free)
      call solve_blocks(c, .true., block, free, mu, k, x)
      if (present(status)) status(i) = status_of_blocks(c, .true., mu, k, x)
      if (.not. even) x(5:6) = times(d, x(5:6))
      r(i, :) = x
    end do
  end subroutine cairn_law_rolling_friction_solve

  !> The natural map, of m for rolling.
  subroutine cairn_law_rolling_friction_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n                  !< contacts
    integer(c_int32_t), value           :: c                  !< components
    type(cairn_law_context), intent(in) :: context            !< step
    real(c_double), intent(in)          :: rho(n)             !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)            !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)         !< in u [m/s]
    real(c_double), intent(in)          :: r(n, c)            !< impulse [N s]
    real(c_double), intent(in)          :: params(n, columns) !< see laws.def; step, geometry
    real(c_double), intent(in)          :: state(n, *)        !< none
    real(c_double), intent(out)         :: f(n, c)            !< [N s]
    real(c_double), intent(out)         :: weight(n, c)       !< [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)          !< see cairn_contact_status
    real(c_double) :: mu(3), k(3), x(c), block(c, c), speed(c), d(3), left(2)
    logical :: even
    integer :: i, l
    k = 0
    left = 0
    do i = 1, n
      call limits(c, params(i, :), mu, d, even)
      x = r(i, :)
      block = w(i, :, :)
      speed = u(i, :)
      if (.not. even) then
        call scale_block(c, d, block, speed)
        x(5:6) = divided(d, x(5:6))
        left = r(i, 5:6) - times(d, x(5:6)) ! about an axis about which nothing is borne
      end if
      call map_blocks(c, .true., block, speed, mu, k, x, f(i, :))
      status(i) = status_of_blocks(c, .true., mu, k, x)
      if (.not. even) f(i, 5:6) = times(d, f(i, 5:6)) + left
      weight(i, :) = [(w(i, l, l), l=1, c)]
    end do
  end subroutine cairn_law_rolling_friction_residual

  !> Limits of the blocks over the normal impulse; those of rolling may differ by direction.
  pure subroutine limits(c, p, mu, d, even)
    integer(c_int32_t), intent(in) :: c          !< components
    real(c_double), intent(in)     :: p(columns) !< parameters, step, geometry
    real(c_double), intent(out)    :: mu(3)      !< see block_cones
    real(c_double), intent(out)    :: d(3)       !< radii about t t, t s, s s [m]
    logical, intent(out)           :: even       !< mu says all
    d = 0
    even = c < 6
    mu = [p(1), p(3)*p(own + 3), p(2)*p(own + 3)]
    if (even) return
    d = p(own + 5:own + 7)
    even = .not. (abs(d(2)) > 0 .or. abs(d(1) - d(3)) > 0)
    mu(3) = p(2)
    if (even) mu(3) = p(2)*d(1)
  end subroutine limits

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
end module rolling_friction
