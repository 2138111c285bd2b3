!> Signorini-Coulomb with friction against rolling and twisting, each an exact cone of the normal impulse: |M_r| <= rolling R r_N
!> across
!> the normal, |M_t| <= twisting R r_N about it, R the effective radius.
module rolling_friction
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, map_blocks, status_of_blocks
  implicit none
  private
  public :: cairn_law_rolling_friction_prepare, cairn_law_rolling_friction_solve, cairn_law_rolling_friction_residual
  integer, parameter :: own = 3 !< parameters
contains

  !> Free of bias where it is open.
  subroutine cairn_law_rolling_friction_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, *)!< none
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

  !> With the attraction taken to the free velocity.
  subroutine cairn_law_rolling_friction_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)         !< in u_free [m/s]
    real(c_double), intent(in)    :: params(n, own + 4) !< see laws.def; step, geometry
    real(c_double), intent(in)    :: state(n, *)  !< none
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: pull, mu(3), k(3), shifted(c)
    integer :: i
    do i = 1, n
      call limits(c, params(i, :), state(i, 1:0), pull, mu, k)
      call solve_blocks(c, .true., w(i, :, :), u_free(i, :) - w(i, :, 1)*pull, mu, k, shifted)
      if (present(status)) status(i) = status_of_blocks(c, .true., mu, k, shifted)
      shifted(1) = shifted(1) - pull
      r(i, :) = shifted
    end do
  end subroutine cairn_law_rolling_friction_solve

  !> The natural map of the impulse without the attraction.
  subroutine cairn_law_rolling_friction_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n                  !< contacts
    integer(c_int32_t), value           :: c                  !< components
    type(cairn_law_context), intent(in) :: context            !< step
    real(c_double), intent(in)          :: rho(n)             !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)            !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)         !< in u [m/s]
    real(c_double), intent(in)          :: r(n, c)            !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own + 4) !< see laws.def; step, geometry
    real(c_double), intent(in)          :: state(n, *)  !< none
    real(c_double), intent(out)         :: f(n, c)            !< [N s]
    real(c_double), intent(out)         :: weight(n, c)       !< [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)          !< see cairn_contact_status
    real(c_double) :: pull, mu(3), k(3), shifted(c)
    integer :: i, l
    do i = 1, n
      call limits(c, params(i, :), state(i, 1:0), pull, mu, k)
      shifted = r(i, :)
      shifted(1) = shifted(1) + pull
      call map_blocks(c, .true., w(i, :, :), u(i, :), mu, k, shifted, f(i, :))
      status(i) = status_of_blocks(c, .true., mu, k, shifted)
      weight(i, :) = [(w(i, l, l), l=1, c)]
    end do
  end subroutine cairn_law_rolling_friction_residual

  !> Attraction along the normal and limits of the blocks, as impulses.
  pure subroutine limits(c, p, s, pull, mu, k)
    integer(c_int32_t), intent(in) :: c        !< components
    real(c_double), intent(in)     :: p(own + 4) !< parameters, step, area, effective radius, mass
    real(c_double), intent(in)     :: s(*)      !< state
    real(c_double), intent(out)    :: pull     !< [N s]
    real(c_double), intent(out)    :: mu(3), k(3) !< see block_cones
    pull = 0
    mu = [p(1), p(3)*p(own + 3), p(2)*p(own + 3)]
    k = 0
  end subroutine limits
end module rolling_friction
