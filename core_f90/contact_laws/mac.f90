!> Cohesive zone of Raous, Cangemi & Cocou (1999), known as MAC: springs go with beta^2, and beta falls as
!>   b dbeta/dt = w - beta (c_N d_N^2 + c_T d_T^2)   where that is negative,
!> with the work w of adhesion [J/m2] and a viscosity b [N s/m]; b = 0: beta = w/(c_N d_N^2 + c_T d_T^2) once that is below 1.
!> Half of w is stored at the peak, the other half follows; the tail has no end.
module mac
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use cohesive_element, only: cohesive_zone_element
  use cohesive_error, only: cohesive_residual
  use cohesive_history, only: cohesive_commit, cohesive_energy, opening_velocity
  use cohesive_zone, only: cohesive_prepare, cohesive_solve, first_own
  implicit none
  private
  public :: law_prepare, law_solve, law_residual, law_zone, law_commit, law_energy, damage, onset
  character(*), parameter :: row = "mac"
  integer, parameter :: own = 11 !< parameters
  logical, parameter :: square = .true. !< whether springs go with beta^2
contains

  !> Implicit Euler for beta; the dissipation is the integral of beta (c_N d_N^2 + c_T d_T^2) over beta.
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

  !> Sound while c_N d_N^2 + c_T d_T^2 <= w.
  pure subroutine onset(n, p, limit)
    integer(c_int32_t), intent(in) :: n           !< contacts
    real(c_double), intent(in)     :: p(n, *)     !< parameters
    real(c_double), intent(out)    :: limit(n, 2) !< [1/m2]
    limit(:, 1) = p(:n, 1)/p(:n, first_own)
    limit(:, 2) = p(:n, 2)/p(:n, first_own)
  end subroutine onset

  include "cohesive_slots.inc"
end module mac
