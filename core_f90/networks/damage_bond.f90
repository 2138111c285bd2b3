!> A bond conducts by the share of it that is intact, and where it is broken by what pushes.
module damage_bond
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_damage_bond
contains

  pure subroutine cairn_conductance_damage_bond(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< of an area intact, broken [W/(m2 K) | S/m2], area [m2]
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    real(c_double) :: s(n)
    s = contact(:, area)
    if (params(3) > 0) s = params(3)
    conductance = s*(contact(:, intact)*params(1) &
                     + (1 - contact(:, intact))*merge(params(2), 0.0_c_double, contact(:, force) > 0))
  end subroutine cairn_conductance_damage_bond
end module damage_bond
