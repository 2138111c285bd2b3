!> Bonds (see bonded) beside friction against sliding, rolling and twisting (see rolling_friction) where there is no bond.
module rolling_bonded
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use rolling_friction, only: solve_free => law_solve, map_free => law_residual
  use bonded, only: cairn_law_bonded_prepare, cairn_law_bonded_residual
  use lane_blocks, only: held_impulses
  implicit none
  private
  public :: cairn_law_rolling_bonded_prepare, cairn_law_rolling_bonded_solve, cairn_law_rolling_bonded_residual
  integer, parameter :: own = 3, states = 2 !< parameters, which rolling_friction has too; states
contains

  !> See bonded, which has the first parameter.
  subroutine cairn_law_rolling_bonded_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components: 3 in 2D, 6 in 3D
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states) !< of a bond, see bonded; gap at which it bonded [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    call cairn_law_bonded_prepare(n, c, context, gap, u_begin, params(:, :1), state, bias, compliance, mu)
  end subroutine cairn_law_rolling_bonded_prepare

  !> Impulses that hold bonds fast, those of the cones elsewhere, each contact by itself.
  subroutine cairn_law_rolling_bonded_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components: 3 in 2D, 6 in 3D
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg], with rotations [1/(kg m), 1/(kg m2)]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s, rad/s]
    real(c_double), intent(in)    :: bias(n, c)         !< of the law, already in u_free [m/s]
    real(c_double), intent(in)    :: params(n, own + 7) !< see laws.def; step, geometry
    real(c_double), intent(in)    :: state(n, states)   !< above 0: a bond; gap at which it bonded [m]
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s], then moment [N m s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: held(n, c)
    integer :: k
    if (all(state(:, 1) > 0)) then
      call held_impulses(n, c, w, u_free, r)
      if (present(status)) status = 3
      return
    end if
    call solve_free(n, c, w, u_free, bias, params, state, r, status)
    if (.not. any(state(:, 1) > 0)) return
    call held_impulses(n, c, w, u_free, held)
    do k = 1, c
      r(:, k) = merge(held(:, k), r(:, k), state(:, 1) > 0)
    end do
    if (present(status)) where (state(:, 1) > 0) status = 3
  end subroutine cairn_law_rolling_bonded_solve

  !> F of a bond, see bonded; F of the cones where there is none.
  subroutine cairn_law_rolling_bonded_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n                  !< contacts
    integer(c_int32_t), value           :: c                  !< components: 3 in 2D, 6 in 3D
    type(cairn_law_context), intent(in) :: context            !< step
    real(c_double), intent(in)          :: rho(n)             !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)            !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)         !< of the law, in u [m/s]
    real(c_double), intent(in)          :: r(n, c)            !< impulse [N s], then moment [N m s]
    real(c_double), intent(in)          :: params(n, own + 7) !< see laws.def; step, geometry
    real(c_double), intent(in)          :: state(n, states)   !< above 0: a bond
    real(c_double), intent(out)         :: f(n, c)            !< residual [N s]
    real(c_double), intent(out)         :: weight(n, c)       !< by which squares of f are energies [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)          !< see cairn_contact_status
    real(c_double) :: f_held(n, c), weight_held(n, c)
    integer(c_int32_t) :: told(n)
    integer :: k
    call map_free(n, c, context, rho, w, u, bias, r, params, state, f, weight, status)
    if (.not. any(state(:, 1) > 0)) return
    call cairn_law_bonded_residual(n, c, context, rho, w, u, bias, r, params(:, :1), state, f_held, weight_held, told)
    do k = 1, c
      f(:, k) = merge(f_held(:, k), f(:, k), state(:, 1) > 0)
      weight(:, k) = merge(weight_held(:, k), weight(:, k), state(:, 1) > 0)
    end do
    where (state(:, 1) > 0) status = told
  end subroutine cairn_law_rolling_bonded_residual
end module rolling_bonded
