!> Two cylinders along the depth of a 2D scene: a strip of half width b = sqrt(4 R F'/(pi E*)), from which what flows spreads
!> into half spaces up to the effective radius, 1/C = ln(4R/b)/(pi L) (1/k1 + 1/k2).
module hertz_strip
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_hertz_strip
contains

  pure subroutine cairn_conductance_hertz_strip(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< none
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    real(c_double) :: b(n)
    b = sqrt(4*contact(:, radius)*max(contact(:, force), 0.0_c_double)/(pi*contact(:, modulus)*contact(:, depth)))
    conductance = 0
    where (b > 0) conductance = pi*contact(:, depth)*series(contact(:, conductivity_a), contact(:, conductivity_b)) &
                                /(2*log(4*max(contact(:, radius)/b, 0.5_c_double)))
  end subroutine cairn_conductance_hertz_strip
end module hertz_strip
