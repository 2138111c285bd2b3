!> Rough planes that yield (Yovanovich 1981): h = 1.25 k (m/sigma) (p/H)^0.95.
module yovanovich
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_yovanovich
contains

  pure subroutine cairn_conductance_yovanovich(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< slope [-], roughness [m], hardness [Pa], area [m2]
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    real(c_double) :: s(n), h(n)
    s = contact(:, area)
    if (params(4) > 0) s = params(4)
    h = contact(:, hardness)
    if (params(3) > 0) h = params(3)
    conductance = 0
    where (contact(:, force) > 0 .and. s > 0)
      conductance = 1.25_c_double*series(contact(:, conductivity_a), contact(:, conductivity_b)) &
        *params(1)/params(2)*(contact(:, force)/(s*h))**0.95_c_double*s
    end where
  end subroutine cairn_conductance_yovanovich
end module yovanovich
