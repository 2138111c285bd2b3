!> One conductance for every contact that pushes.
module constant_conductance
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_constant_conductance
contains

  pure subroutine cairn_conductance_constant_conductance(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< conductance [S | W/K]
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    conductance = merge(params(1), 0.0_c_double, contact(:, force) > 0)
  end subroutine cairn_conductance_constant_conductance
end module constant_conductance
