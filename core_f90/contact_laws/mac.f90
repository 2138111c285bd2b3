!> Cohesive zone of Raous, Cangemi & Cocou (1999), known as MAC: springs go with beta^2, and beta falls as
!>   b dbeta/dt = w - beta (c_N d_N^2 + c_T d_T^2)   where that is negative,
!> with the work w of adhesion [J/m2] and a viscosity b [N s/m]; b = 0: beta = w/(c_N d_N^2 + c_T d_T^2) once that is below 1.
!> Half of w is stored at the peak, the other half follows; the tail has no end.
module mac
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use cohesive_zone, only: cohesive_prepare, cohesive_solve, cohesive_residual, cohesive_commit, cohesive_energy, first_own
  implicit none
  private
  public :: cairn_law_mac_prepare, cairn_law_mac_solve, cairn_law_mac_commit
  public :: cairn_law_mac_residual, cairn_law_mac_energy
  integer, parameter :: own = 8 !< parameters
  logical, parameter :: square = .true. !< whether springs go with beta^2
contains

  !> By implicit Euler; what it spends is the integral of beta (c_N d_N^2 + c_T d_T^2) over beta.
  pure subroutine damage(p, h, normal, tangent, old, beta, spent)
    real(c_double), intent(in)            :: p(*)            !< parameters
    real(c_double), intent(in)            :: h               !< step [s]
    real(c_double), intent(in)            :: normal, tangent !< opening at the end of the step [m]
    real(c_double), intent(in)            :: old             !< intensity at its begin
    real(c_double), intent(out)           :: beta            !< and at its end
    real(c_double), intent(out), optional :: spent           !< [J/m2]
    real(c_double) :: driving, w, viscosity
    driving = p(1)*normal**2 + p(2)*tangent**2
    w = p(first_own)
    viscosity = p(first_own + 1)
    beta = old
    if (old*driving > w) beta = min(old, (h*w + viscosity*old)/(viscosity + h*driving))
    if (present(spent)) spent = (w + viscosity*(old - beta)/h)*(old - beta)
  end subroutine damage

  subroutine cairn_law_mac_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< not asked for [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, c + 4)  !< see cohesive_zone
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction of what is broken [-]
    call cohesive_prepare(n, c, context, gap, params, state, bias, compliance, mu)
  end subroutine cairn_law_mac_prepare

  subroutine cairn_law_mac_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)         !< in u_free [m/s]
    real(c_double), intent(in)    :: params(n, own + 4) !< see laws.def; step, geometry
    real(c_double), intent(in)    :: state(n, c + 4)    !< see cohesive_zone
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    call cohesive_solve(n, c, own, damage, square, w, u_free, params, state, r, status)
  end subroutine cairn_law_mac_solve

  subroutine cairn_law_mac_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n                  !< contacts
    integer(c_int32_t), value           :: c                  !< components
    type(cairn_law_context), intent(in) :: context            !< step
    real(c_double), intent(in)          :: rho(n)             !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)            !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)         !< in u [m/s]
    real(c_double), intent(in)          :: r(n, c)            !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own + 4) !< see laws.def; step, geometry
    real(c_double), intent(in)          :: state(n, c + 4)    !< see cohesive_zone
    real(c_double), intent(out)         :: f(n, c)            !< [N s]
    real(c_double), intent(out)         :: weight(n, c)       !< [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)          !< see cairn_contact_status
    call cohesive_residual(n, c, own, damage, square, rho, u, r, params, state, f, weight, status)
  end subroutine cairn_law_mac_residual

  subroutine cairn_law_mac_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(inout)       :: state(n, c + 4) !< see cohesive_zone
    call cohesive_commit(n, c, own, context, damage, gap, u, params, state)
  end subroutine cairn_law_mac_commit

  subroutine cairn_law_mac_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(in)          :: state_begin(n, c + 4), state(n, c + 4) !< see cohesive_zone
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    call cohesive_energy(n, c, square, params, state_begin, state, energy)
  end subroutine cairn_law_mac_energy
end module mac
