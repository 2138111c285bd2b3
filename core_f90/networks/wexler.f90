!> Between ballistic and diffusive spots (Wexler 1966): R = R_Sharvin + gamma(l/a) rho/(2a). gamma is a ratio of first
!> degree with Wexler's ends, 1 where l/a is none and 9 pi^2/128 where it has no end.
module wexler
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_wexler
contains

  pure subroutine cairn_conductance_wexler(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< free path [m]
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    real(c_double), parameter :: slope = 4.0_c_double/3 !< of gamma where l/a is small
    real(c_double) :: a(n), k(n), ratio(n)
    a = spot_radius(contact(:, force), contact(:, radius), contact(:, modulus))
    k = series(contact(:, conductivity_a), contact(:, conductivity_b))
    conductance = 0
    where (a > 0 .and. k > 0)
      ratio = slope*params(1)/a
      ratio = (1 + 9*pi**2/128*ratio)/(1 + ratio)
      conductance = k/(4*params(1)/(3*pi*a**2) + ratio/(2*a))
    end where
  end subroutine cairn_conductance_wexler
end module wexler
