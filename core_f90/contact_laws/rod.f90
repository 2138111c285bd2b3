!> Rods that push and pull: see rods.
module rod
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use rods, only: rods_prepare, rods_solve, rods_residual, rods_commit, rods_energy, own => rod_parameters
  implicit none
  private
  public :: cairn_law_rod_prepare, cairn_law_rod_solve, cairn_law_rod_commit
  public :: cairn_law_rod_residual, cairn_law_rod_energy
  logical, parameter :: pushes = .true.
contains

  subroutine cairn_law_rod_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< not asked for [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see rods
    real(c_double), intent(inout)       :: state(n, 3)      !< see rods
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    call rods_prepare(n, c, context%h, gap, params, state, bias, compliance, mu)
  end subroutine cairn_law_rod_prepare

  subroutine cairn_law_rod_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)         !< in u_free [m/s]
    real(c_double), intent(in)    :: params(n, own + 4) !< see rods; step, geometry
    real(c_double), intent(in)    :: state(n, 3)        !< see rods
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    call rods_solve(n, c, pushes, w, u_free, params, params(:, own + 1), state, r, status)
  end subroutine cairn_law_rod_solve

  subroutine cairn_law_rod_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n                  !< contacts
    integer(c_int32_t), value           :: c                  !< components
    type(cairn_law_context), intent(in) :: context            !< step
    real(c_double), intent(in)          :: rho(n)             !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)            !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)         !< in u [m/s]
    real(c_double), intent(in)          :: r(n, c)            !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own + 4) !< see rods; step, geometry
    real(c_double), intent(in)          :: state(n, 3)        !< see rods
    real(c_double), intent(out)         :: f(n, c)            !< [N s]
    real(c_double), intent(out)         :: weight(n, c)       !< [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)          !< see cairn_contact_status
    call rods_residual(n, c, pushes, w, u, r, params, context%h, state, f, weight, status)
  end subroutine cairn_law_rod_residual

  subroutine cairn_law_rod_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see rods
    real(c_double), intent(inout)       :: state(n, 3)    !< see rods
    call rods_commit(n, c, context%h, r, params, state)
  end subroutine cairn_law_rod_commit

  subroutine cairn_law_rod_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see rods
    real(c_double), intent(in)          :: state_begin(n, 3), state(n, 3) !< see rods
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    call rods_energy(n, c, pushes, context%h, u, params, state_begin, state, energy)
  end subroutine cairn_law_rod_energy
end module rod
