!> Cohesive zone without damage up to a stress s, which then falls as 1 - ((d - d_i)/d_k)^2: d_i = s/k, d_k = 3/2 (w/s - d_i/2), so
!> that breaking takes w [J/m2] in every mode, k the stiffness along the opening (Monerie & Acary 2001, Perales et al. 2010). It
!> breaks at s if w is less than the energy stored there.
module mp3
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use cohesive_curves, only: damage_along
  use cohesive_element, only: cohesive_zone_element
  use cohesive_error, only: cohesive_residual
  use cohesive_history, only: cohesive_commit, cohesive_energy, opening_velocity
  use cohesive_zone, only: cohesive_prepare, cohesive_solve, first_own
  use mixed_mode, only: parabola
  implicit none
  private
  public :: law_prepare, law_solve, law_residual, law_zone, law_commit, law_energy
  character(*), parameter :: row = "mp3"
  integer, parameter :: own = 11 !< parameters
  logical, parameter :: square = .false. !< whether springs go with beta^2
contains

  pure subroutine curve(p, share, opening, beta, work)
    real(c_double), intent(in)  :: p(*)    !< parameters
    real(c_double), intent(in)  :: share   !< tangential share of the squared opening [-]
    real(c_double), intent(in)  :: opening !< [m]
    real(c_double), intent(out) :: beta    !< [-]
    real(c_double), intent(out) :: work    !< per area to separate faces by `opening` [J/m2]
    real(c_double) :: k, stress
    k = (1 - share)*p(1) + share*p(2)
    stress = p(first_own)
    call parabola(k, stress/k, p(first_own + 1), opening, beta, work)
  end subroutine curve

  !> Sound while k d is at most the strength; k is at most the larger stiffness.
  pure subroutine onset(n, p, limit)
    integer(c_int32_t), intent(in) :: n           !< contacts
    real(c_double), intent(in)     :: p(n, *)     !< parameters
    real(c_double), intent(out)    :: limit(n, 2) !< [1/m2]
    limit(:, 1) = (max(p(:n, 1), p(:n, 2))/p(:n, first_own))**2
    limit(:, 2) = limit(:, 1)
  end subroutine onset

  include "cohesive_curve_slots.inc"
end module mp3
