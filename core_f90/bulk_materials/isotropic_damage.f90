!> Stiffness lost with the largest stretch that was reached (Mazars 1984), softening exponentially so that a cell takes the fracture
!> energy per area of crack, whatever its size (crack band, Bazant & Oh 1983).
module isotropic_damage
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: isotropic_moduli, symmetric_eigen, from_strain, to_stress
  implicit none
  private
  public :: cairn_bulk_isotropic_damage
  integer, parameter :: parameters = 5, states = 2
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_isotropic_damage(n, h, theta, params, length, strain, state_begin, state, stress, tangent, &
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
    real(c_double) :: c(6, 6), x(3), q(3, 3), whole(6), reached, largest, first, decay, damage, slope, direction(6), size
    integer(c_int64_t) :: i
    c = isotropic_moduli(params(1), params(2))
    first = params(3)/params(1)
    do i = 1, n
      size = length(i)
      if (params(5) > 0) size = params(5)
      decay = params(4)/(size*params(3)) - 0.5_c_double*first ! of strain, beyond the first damage
      if (.not. decay > 0) status(i) = 3
      decay = max(decay, 1e-6_c_double*first)
      call symmetric_eigen(from_strain(strain(:, i)), x, q)
      x = max(x, 0.0_c_double)
      reached = sqrt(sum(x**2))
      largest = max(state_begin(1, i), reached, first)
      damage = 1 - first/largest*exp(-(largest - first)/decay)
      whole = matmul(c, strain(:, i))
      stress(:, i) = (1 - damage)*whole
      tangent(:, :, i) = (1 - damage)*c
      if (reached >= largest .and. largest > first) then
        slope = (1 - damage)*(1/largest + 1/decay)
        direction = to_stress(matmul(q*spread(x, 1, 3), transpose(q)))/reached
        tangent(:, :, i) = tangent(:, :, i) - slope*spread(whole, 2, 6)*spread(direction, 1, 6)
      end if
      state(1, i) = largest
      state(2, i) = damage
      energy(i) = 0.5_c_double*dot_product(stress(:, i), strain(:, i))
      dissipated(i) = 0.5_c_double*dot_product(whole, strain(:, i))*(damage - state_begin(2, i))
    end do
  end subroutine cairn_bulk_isotropic_damage
end module isotropic_damage
