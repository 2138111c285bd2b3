!> Constriction of what flows through the spot of two elastic spheres into half spaces (Holm 1967): 1/C = 1/(4 k1 a) + 1/(4 k2 a).
module holm
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_holm
contains

  pure subroutine cairn_conductance_holm(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< none
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    conductance = 2*series(contact(:, conductivity_a), contact(:, conductivity_b)) &
                  *spot_radius(contact(:, force), contact(:, radius), contact(:, modulus))
  end subroutine cairn_conductance_holm
end module holm
