!> Cohesive zone of Monerie & Perales: sound to an opening d_i, beta = (3 d_i - d)/(d_i + d) from there to 3 d_i, with
!> d_i = sqrt(2 w/(k (9 - 4 ln 4))) so that breaking takes w [J/m2] in every mode, k the stiffness along the opening.
module mp
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use cohesive_curves, only: damage_along
  use cohesive_element, only: cohesive_zone_element
  use cohesive_error, only: cohesive_residual
  use cohesive_history, only: cohesive_commit, cohesive_energy, opening_velocity
  use cohesive_zone, only: cohesive_prepare, cohesive_solve, first_own
  implicit none
  private
  public :: law_prepare, law_solve, law_residual, law_zone, law_commit, law_energy
  character(*), parameter :: row = "mp"
  integer, parameter :: own = 10 !< parameters
  logical, parameter :: square = .false. !< whether springs go with beta^2
  real(c_double), parameter :: half = 4.5_c_double - 4*log(2.0_c_double) !< w/(k d_i^2)
contains

  pure subroutine curve(p, share, opening, beta, work)
    real(c_double), intent(in)  :: p(*)    !< parameters
    real(c_double), intent(in)  :: share   !< tangential share of the squared opening [-]
    real(c_double), intent(in)  :: opening !< [m]
    real(c_double), intent(out) :: beta    !< [-]
    real(c_double), intent(out) :: work    !< per area to separate faces by `opening` [J/m2]
    real(c_double) :: k, first, x
    k = (1 - share)*p(1) + share*p(2)
    first = sqrt(p(first_own)/(k*half))
    x = min(opening/first, 3.0_c_double)
    beta = 1
    work = k*opening**2/2
    if (x <= 1) return
    beta = (3 - x)/(1 + x)
    work = k*first**2*(0.5_c_double + (x - 1)*(3.5_c_double - x/2) - 4*log((1 + x)/2))
  end subroutine curve

  !> Sound while k d^2 <= w/half.
  pure subroutine onset(n, p, limit)
    integer(c_int32_t), intent(in) :: n           !< contacts
    real(c_double), intent(in)     :: p(n, *)     !< parameters
    real(c_double), intent(out)    :: limit(n, 2) !< [1/m2]
    limit(:, 1) = p(:n, 1)*half/p(:n, first_own)
    limit(:, 2) = p(:n, 2)*half/p(:n, first_own)
  end subroutine onset

  include "cohesive_curve_slots.inc"
end module mp
