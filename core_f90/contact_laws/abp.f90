!> Cohesive zone that softens in two straight lines, as wood and concrete do (Foster & Morel's bilinear curve): strengths, works and
!> openings of breaking of both modes, and the share of the work under the first line; breaking in a fixed mode takes
!> G_I/G_1 + G_II/G_2 = 1.
module abp
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use cohesive_zone, only: cohesive_prepare, cohesive_solve, cohesive_residual, cohesive_commit, cohesive_energy, &
    damage_along, first_own
  use mixed_mode, only: mixed_length, mixed_work
  implicit none
  private
  public :: cairn_law_abp_prepare, cairn_law_abp_solve, cairn_law_abp_commit
  public :: cairn_law_abp_residual, cairn_law_abp_energy
  integer, parameter :: own = 13 !< parameters
  logical, parameter :: square = .false. !< whether springs go with beta^2
contains

  pure subroutine damage(p, h, normal, tangent, old, beta, spent)
    real(c_double), intent(in)            :: p(*)            !< parameters
    real(c_double), intent(in)            :: h               !< step [s]
    real(c_double), intent(in)            :: normal, tangent !< opening at the end of the step [m]
    real(c_double), intent(in)            :: old             !< intensity at its begin
    real(c_double), intent(out)           :: beta            !< and at its end
    real(c_double), intent(out), optional :: spent           !< [J/m2]
    call damage_along(curve, p, normal, tangent, old, beta, spent)
  end subroutine damage

  pure subroutine curve(p, share, opening, beta, work)
    real(c_double), intent(in)  :: p(*)    !< parameters
    real(c_double), intent(in)  :: share   !< tangential part of the opening's square
    real(c_double), intent(in)  :: opening !< [m]
    real(c_double), intent(out) :: beta    !< [-]
    real(c_double), intent(out) :: work    !< of opening as far as here [J/m2]
    real(c_double) :: k, first, g, last, knee, stress, at, d
    k = (1 - share)*p(1) + share*p(2)
    first = mixed_length(share, p(first_own)/p(1), p(first_own + 1)/p(2))
    g = mixed_work(share, p(1), p(2), p(first_own + 2), p(first_own + 3))
    last = mixed_length(share, p(first_own + 4), p(first_own + 5))
    stress = k*first
    knee = 2*g*(1 - p(first_own + 6))/last
    at = (2*g*p(first_own + 6) + knee*first)/stress
    beta = 1
    work = k*opening**2/2
    if (opening <= first) return
    d = min(opening, at)
    beta = (stress + (knee - stress)*(d - first)/(at - first))/(k*d)
    work = stress*first/2 + (d - first)*(stress + k*beta*d)/2
    if (opening <= at) return
    d = min(opening, last)
    beta = 0
    if (opening < last) beta = knee*(last - d)/(last - at)/(k*d)
    work = work + (d - at)*(knee + k*beta*d)/2
  end subroutine curve

  subroutine cairn_law_abp_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
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
  end subroutine cairn_law_abp_prepare

  subroutine cairn_law_abp_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
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
  end subroutine cairn_law_abp_solve

  subroutine cairn_law_abp_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
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
  end subroutine cairn_law_abp_residual

  subroutine cairn_law_abp_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see laws.def
    real(c_double), intent(inout)       :: state(n, c + 4) !< see cohesive_zone
    call cohesive_commit(n, c, own, context, damage, gap, u, params, state)
  end subroutine cairn_law_abp_commit

  subroutine cairn_law_abp_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
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
  end subroutine cairn_law_abp_energy
end module abp
