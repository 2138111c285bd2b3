!> Cohesive zone whose stress falls exponentially from the strength to the share `rest` of it, where it breaks. Breaking in a fixed
!> mode takes G_I/G_1 + G_II/G_2 = 1 less the work of the omitted tail. Stiffness in a mixed mode: (1 - share) c_N + share c_T,
!> consistent with stresses and openings.
module expo
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use cohesive_curves, only: damage_along
  use cohesive_element, only: cohesive_zone_element
  use cohesive_error, only: cohesive_residual
  use cohesive_history, only: cohesive_commit, cohesive_energy, opening_velocity
  use cohesive_zone, only: cohesive_prepare, cohesive_solve, first_own
  use mixed_mode, only: onset => onset_of_strengths, mixed_length, mixed_work, mean_decay
  implicit none
  private
  public :: law_prepare, law_solve, law_residual, law_zone, law_commit, law_energy
  character(*), parameter :: row = "expo"
  integer, parameter :: own = 14 !< parameters
  logical, parameter :: square = .false. !< whether springs go with beta^2
contains

  pure subroutine curve(p, share, opening, beta, work)
    real(c_double), intent(in)  :: p(*)    !< parameters
    real(c_double), intent(in)  :: share   !< tangential share of the squared opening [-]
    real(c_double), intent(in)  :: opening !< [m]
    real(c_double), intent(out) :: beta    !< [-]
    real(c_double), intent(out) :: work    !< per area to separate faces by `opening` [J/m2]
    real(c_double) :: k, first, g, rate, last, d
    k = (1 - share)*p(1) + share*p(2)
    first = mixed_length(share, p(first_own)/p(1), p(first_own + 1)/p(2))
    g = mixed_work(share, p(1), p(2), p(first_own + 2), p(first_own + 3))
    beta = 1
    work = k*opening**2/2
    if (opening <= first) return
    beta = 0
    work = k*first**2/2
    if (.not. g > work) return
    rate = k*first/(g - work)
    last = first - log(p(first_own + 4))/rate
    d = min(opening, last)
    if (opening < last) beta = (first/d)*exp(rate*(first - d))
    work = work + k*first*(d - first)*mean_decay(rate*(d - first))
  end subroutine curve

  include "cohesive_curve_slots.inc"
end module expo
