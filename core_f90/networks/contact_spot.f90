!> Contact quantities that kernels of conductance read, and the spot through which the contact conducts.
module contact_spot
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: spot_radius, series, pi
  !> Columns of `contact`, as enum cairn_contact_column in cairn/core.h has them.
  !> gap [m], force that pushes [N], effective radius [m] and modulus E* [Pa], conductivity of both sides [S/m | W/(m K)], hardness
  !> of the softer [Pa], area [m2], share of a bond that is intact, depth of a 2D scene [m].
  integer, parameter, public :: gap = 1, force = 2, radius = 3, modulus = 4, conductivity_a = 5, conductivity_b = 6, &
                                hardness = 7, area = 8, intact = 9, depth = 10, columns = 10
  real(c_double), parameter :: pi = acos(-1.0_c_double)
contains

  !> Radius of the spot of two elastic spheres (Hertz 1882) [m]; none where they do not push.
  elemental function spot_radius(f, r, e) result(a)
    real(c_double), intent(in) :: f !< normal force [N]
    real(c_double), intent(in) :: r !< effective radius [m]
    real(c_double), intent(in) :: e !< effective modulus E* [Pa]
    real(c_double) :: a
    a = 0
    if (f > 0) a = (0.75_c_double*f*r/e)**(1.0_c_double/3)
  end function spot_radius

  !> Harmonic mean of two conductivities, 2/(1/k1 + 1/k2): none where one conducts nothing, infinite where both are.
  elemental function series(one, other) result(k)
    real(c_double), intent(in) :: one, other
    real(c_double) :: k
    k = 0
    if (one > 0 .and. other > 0) k = 2/(1/one + 1/other)
  end function series
end module contact_spot
