!> Cohesive zone that softens in two straight lines, as wood and concrete do (Foster & Morel's bilinear curve): strengths, works and
!> openings of breaking of both modes, and the share of the work under the first line; breaking in a fixed mode takes
!> G_I/G_1 + G_II/G_2 = 1.
module abp
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use cohesive_curves, only: damage_along
  use cohesive_element, only: cohesive_zone_element
  use cohesive_error, only: cohesive_residual
  use cohesive_history, only: cohesive_commit, cohesive_energy, opening_velocity
  use cohesive_zone, only: cohesive_prepare, cohesive_solve, first_own
  use mixed_mode, only: onset => onset_of_strengths, mixed_length, mixed_work
  implicit none
  private
  public :: law_prepare, law_solve, law_residual, law_zone, law_commit, law_energy
  character(*), parameter :: row = "abp"
  integer, parameter :: own = 16 !< parameters
  logical, parameter :: square = .false. !< whether springs go with beta^2
contains

  pure subroutine curve(p, share, opening, beta, work)
    real(c_double), intent(in)  :: p(*)    !< parameters
    real(c_double), intent(in)  :: share   !< tangential share of the squared opening [-]
    real(c_double), intent(in)  :: opening !< [m]
    real(c_double), intent(out) :: beta    !< [-]
    real(c_double), intent(out) :: work    !< per area to separate faces by `opening` [J/m2]
    real(c_double) :: k, first, g, last, knee, stress, at, d
    k = (1 - share)*p(1) + share*p(2)
    first = mixed_length(share, p(first_own)/p(1), p(first_own + 1)/p(2))
    g = mixed_work(share, p(1), p(2), p(first_own + 2), p(first_own + 3))
    last = mixed_length(share, p(first_own + 4), p(first_own + 5))
    beta = 1
    work = k*opening**2/2
    if (opening <= first) return
    beta = 0
    work = k*first**2/2
    if (.not. (first > 0 .and. last > first)) return
    stress = k*first
    knee = 2*g*(1 - p(first_own + 6))/last
    at = (2*g*p(first_own + 6) + knee*first)/stress
    d = min(opening, at)
    beta = (stress + (knee - stress)*(d - first)/(at - first))/(k*d)
    work = stress*first/2 + (d - first)*(stress + k*beta*d)/2
    if (opening <= at) return
    d = min(opening, last)
    beta = 0
    if (opening < last) beta = knee*(last - d)/(last - at)/(k*d)
    work = work + (d - at)*(knee + k*beta*d)/2
  end subroutine curve

  include "cohesive_curve_slots.inc"
end module abp
