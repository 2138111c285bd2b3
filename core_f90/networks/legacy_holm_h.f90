!> LMGC90's HolmH.
module legacy_holm_h
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_legacy_holm_h
contains

  pure subroutine cairn_conductance_legacy_holm_h(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< none
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    conductance = 2*series(contact(:, conductivity_a), contact(:, conductivity_b)) &
                  *spot_radius(contact(:, force), contact(:, radius), contact(:, modulus))
  end subroutine cairn_conductance_legacy_holm_h
end module legacy_holm_h
