!> A spot smaller than the free path of electrons, which cross it as they come (Sharvin 1965): R = 4 rho l/(3 pi a^2).
module sharvin
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_sharvin
contains

  pure subroutine cairn_conductance_sharvin(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< free path [m]
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    conductance = 0.75_c_double*pi*series(contact(:, conductivity_a), contact(:, conductivity_b)) &
                  *spot_radius(contact(:, force), contact(:, radius), contact(:, modulus))**2/params(1)
  end subroutine cairn_conductance_sharvin
end module sharvin
