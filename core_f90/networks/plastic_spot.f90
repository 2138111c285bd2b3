!> Constriction through a spot that has yielded to its hardness (Holm 1967): a = sqrt(F/(pi H)).
module plastic_spot
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_plastic_spot
contains

  pure subroutine cairn_conductance_plastic_spot(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< hardness, 0: of the contact [Pa]
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    real(c_double) :: h(n)
    h = contact(:, hardness)
    if (params(1) > 0) h = params(1)
    conductance = 2*series(contact(:, conductivity_a), contact(:, conductivity_b))&
                  *sqrt(max(contact(:, force), 0.0_c_double)/(pi*h))
  end subroutine cairn_conductance_plastic_spot
end module plastic_spot
