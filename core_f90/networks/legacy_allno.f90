!> LMGC90's allno in 2D: the series conductivity, whatever the force.
module legacy_allno
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_legacy_allno
contains

  pure subroutine cairn_conductance_legacy_allno(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< none
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    conductance = merge(series(contact(:, conductivity_a), contact(:, conductivity_b)), 0.0_c_double, contact(:, force) > 0)
  end subroutine cairn_conductance_legacy_allno
end module legacy_allno
