!> Drucker & Prager's cone, which touches Mohr and Coulomb's at the edges of compression; flow by the dilation angle, cohesion
!> hardens with the plastic strain; return to cone or apex (de Souza Neto, Peric & Owen 2008).
module drucker_prager
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: identity6
  implicit none
  private
  public :: cairn_bulk_drucker_prager
  integer, parameter :: parameters = 6, states = 7
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_drucker_prager(n, h, theta, params, length, strain, state_begin, state, stress, tangent, &
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
    integer(c_int64_t) :: i
    real(c_double) :: flow(6)
    do i = 1, n
      state(:, i) = state_begin(:, i)
      call point(params, strain(:, i) - state(1:6, i), state(7, i), flow, stress(:, i), tangent(:, :, i))
      state(1:6, i) = state(1:6, i) + flow
      energy(i) = 0.5_c_double*dot_product(stress(:, i), strain(:, i) - state(1:6, i))
      dissipated(i) = dot_product(stress(:, i), flow)
    end do
  end subroutine cairn_bulk_drucker_prager

  pure subroutine point(params, elastic, accumulated, flow, stress, tangent)
    real(c_double), intent(in)    :: params(parameters), elastic(6)
    real(c_double), intent(inout) :: accumulated
    real(c_double), intent(out)   :: flow(6), stress(6), tangent(6, 6)
    real(c_double) :: shear, bulk, eta, eta_flow, xi, trace, deviator(6), root_j2, pressure, f, multiplier, cohesion, n(6), a, &
                      share, volume, per_volume, slope
    integer :: i, k
    shear = params(1)/(2*(1 + params(2)))
    bulk = params(1)/(3*(1 - 2*params(2)))
    eta = 6*sin(params(4))/(sqrt(3.0_c_double)*(3 - sin(params(4))))
    xi = 6*cos(params(4))/(sqrt(3.0_c_double)*(3 - sin(params(4))))
    eta_flow = 6*sin(params(5))/(sqrt(3.0_c_double)*(3 - sin(params(5))))
    cohesion = params(3) + params(6)*accumulated
    trace = sum(elastic(:3))
    deviator(:3) = 2*shear*(elastic(:3) - trace/3)
    deviator(4:) = shear*elastic(4:)
    root_j2 = sqrt(0.5_c_double*sum(deviator(:3)**2) + sum(deviator(4:)**2))
    pressure = bulk*trace
    f = root_j2 + eta*pressure - xi*cohesion
    flow = 0
    n = 0
    share = 1
    stress = deviator + pressure*identity6
    tangent = 0
    if (f > 0) then
      a = 1/(shear + bulk*eta*eta_flow + xi**2*params(6))
      multiplier = f*a
      if (root_j2 - shear*multiplier >= 0) then
        share = 1 - shear*multiplier/root_j2
        n = deviator/root_j2 ! twice the square of its size is one
        accumulated = accumulated + xi*multiplier
        flow(:3) = multiplier*(0.5_c_double*n(:3) + eta_flow/3)
        flow(4:) = multiplier*n(4:)
        stress = share*deviator + (pressure - bulk*eta_flow*multiplier)*identity6
        do k = 1, 6
          tangent(:, k) = shear*(multiplier/root_j2 - a)*shear*n*n(k) - a*shear*bulk*eta*n*identity6(k) &
                          - a*shear*bulk*eta_flow*identity6*n(k) - a*bulk**2*eta*eta_flow*identity6*identity6(k)
        end do
      else
        ! all shear is lost; the plastic change of volume brings the pressure to the tip of the cone
        per_volume = xi/max(eta_flow, 1e-6_c_double*eta) ! accumulated strain for a change of volume
        slope = bulk + params(6)*per_volume*xi/eta
        volume = (pressure - xi/eta*cohesion)/slope
        accumulated = accumulated + per_volume*volume
        stress = (pressure - bulk*volume)*identity6
        flow(:3) = elastic(:3) - (trace - volume)/3
        flow(4:) = elastic(4:)
        tangent(:3, :3) = bulk*(1 - bulk/slope)
        return
      end if
    end if
    do i = 1, 3
      do k = 1, 3
        tangent(i, k) = tangent(i, k) + bulk - 2*shear*share/3
      end do
      tangent(i, i) = tangent(i, i) + 2*shear*share
      tangent(i + 3, i + 3) = tangent(i + 3, i + 3) + shear*share
    end do
  end subroutine point
end module drucker_prager
