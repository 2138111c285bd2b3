!> LMGC90's HolmP: the modulus where a hardness belongs.
module legacy_holm_p
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_legacy_holm_p
contains

  pure subroutine cairn_conductance_legacy_holm_p(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< none
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    conductance = 2*series(contact(:, conductivity_a), contact(:, conductivity_b))&
                  *sqrt(max(contact(:, force), 0.0_c_double)/(pi*contact(:, modulus)))
  end subroutine cairn_conductance_legacy_holm_p
end module legacy_holm_p
