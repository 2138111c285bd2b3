!> Gas between two surfaces, whose molecules jump a distance at each wall: k A/(gap + jump).
module gas_gap
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_gas_gap
contains

  pure subroutine cairn_conductance_gas_gap(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< conductivity [W/(m K)], jump distance [m], area [m2]
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    real(c_double) :: s(n)
    s = contact(:, area)
    if (params(3) > 0) s = params(3)
    conductance = params(1)*s/(max(contact(:, gap), 0.0_c_double) + params(2))
  end subroutine cairn_conductance_gas_gap
end module gas_gap
