!> LMGC90's hertz: the cube root of the force, which is no conductance.
module legacy_hertz
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_legacy_hertz
contains

  pure subroutine cairn_conductance_legacy_hertz(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< none
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    conductance = max(contact(:, force), 0.0_c_double)**(1.0_c_double/3)
  end subroutine cairn_conductance_legacy_hertz
end module legacy_hertz
