!> Cohesive zone with a plateau (Tvergaard & Hutchinson 1992): sound to the strength, constant stress to the openings of the
!> plateau, and from there in a straight line to nothing, so that breaking in a fixed mode takes G_I/G_1 + G_II/G_2 = 1. A plateau
!> of no length makes a triangle.
module th
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
  character(*), parameter :: row = "th"
  integer, parameter :: own = 15 !< parameters
  logical, parameter :: square = .false. !< whether springs go with beta^2
contains

  pure subroutine curve(p, share, opening, beta, work)
    real(c_double), intent(in)  :: p(*)    !< parameters
    real(c_double), intent(in)  :: share   !< tangential share of the squared opening [-]
    real(c_double), intent(in)  :: opening !< [m]
    real(c_double), intent(out) :: beta    !< [-]
    real(c_double), intent(out) :: work    !< per area to separate faces by `opening` [J/m2]
    real(c_double) :: k, first, flat, last, g, d
    k = (1 - share)*p(1) + share*p(2)
    first = mixed_length(share, p(first_own)/p(1), p(first_own + 1)/p(2))
    g = mixed_work(share, p(1), p(2), p(first_own + 2), p(first_own + 3))
    beta = 1
    work = k*opening**2/2
    if (opening <= first) return
    beta = 0
    work = k*first**2/2
    if (.not. first > 0) return
    flat = max(first, mixed_length(share, p(first_own + 4), p(first_own + 5)))
    last = max(flat, 2*g/(k*first) - flat + first)
    d = min(opening, flat)
    beta = first/d
    work = k*first*(first/2 + (d - first))
    if (opening <= flat) return
    d = min(opening, last)
    beta = 0
    if (opening < last) beta = (first/d)*(last - d)/(last - flat)
    if (last > flat) work = work + k*first*(d - flat)*(1 - (d - flat)/(2*(last - flat)))
  end subroutine curve

  include "cohesive_curve_slots.inc"
end module th
