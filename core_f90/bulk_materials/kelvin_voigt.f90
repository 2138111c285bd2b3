!> A spring and a dashpot side by side, both isotropic; the rate of strain is that of the theta-method.
module kelvin_voigt
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: isotropic_moduli
  implicit none
  private
  public :: cairn_bulk_kelvin_voigt
  integer, parameter :: parameters = 4, states = 12
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_kelvin_voigt(n, h, theta, params, length, strain, state_begin, state, stress, tangent, &
                                    energy, dissipated, status) bind(c)
    integer(c_int64_t), value   :: n                  !< points
    real(c_double), value       :: h                  !< step [s]
    real(c_double), value       :: theta              !< of the theta-method
    real(c_double), intent(in)  :: params(parameters) !< in the order of bulk_materials.def
    real(c_double), intent(in)  :: length(n)          !< size of the cell round each point [m]
    real(c_double), intent(in)  :: strain(6, n)       !< at the end of the step, of the body's measure [-]
    real(c_double), intent(in)  :: state_begin(states, n) !< at the begin of the step
    real(c_double), intent(out) :: state(states, n)   !< at its end
    real(c_double), intent(out) :: stress(6, n)       !< conjugate to it [Pa]
    real(c_double), intent(out) :: tangent(6, 6, n)   !< of stress by strain [Pa]
    real(c_double), intent(out) :: energy(n)          !< stored [J/m3]
    real(c_double), intent(out) :: dissipated(n)      !< in the step [J/m3]
    integer(c_int32_t), intent(inout) :: status(n)    !< 0; 1 volume not positive, 2 no solution at the point, 3 cell too large
    real(c_double) :: c(6, 6), viscous(6, 6), mean(6)
    integer(c_int64_t) :: i
    c = isotropic_moduli(params(1), params(2))
    viscous = 0
    if (params(3) > 0) viscous = isotropic_moduli(params(3), params(4))
    do i = 1, n
      mean = (strain(:, i) - state_begin(1:6, i))/h
      state(1:6, i) = strain(:, i)
      state(7:12, i) = (mean - (1 - theta)*state_begin(7:12, i))/theta
      stress(:, i) = matmul(c, strain(:, i)) + matmul(viscous, state(7:12, i))
      tangent(:, :, i) = c + viscous/(h*theta)
      energy(i) = 0.5_c_double*dot_product(strain(:, i), matmul(c, strain(:, i)))
      dissipated(i) = 0 ! at rest, which is a step without end
      if (h <= huge(h)) dissipated(i) = h*dot_product(mean, matmul(viscous, mean))
    end do
  end subroutine cairn_bulk_kelvin_voigt
end module kelvin_voigt
