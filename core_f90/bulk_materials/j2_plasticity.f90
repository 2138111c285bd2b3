!> Mises' plasticity with isotropic and kinematic hardening on a measure of strain; on Hencky's for large strains (Miehe, Apel &
!> Lambrecht 2002).
module j2_plasticity
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use radial_return, only: hardening_law, mises, hardening_energy
  implicit none
  private
  public :: cairn_bulk_j2_plasticity
  integer, parameter :: parameters = 7, states = 13
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_j2_plasticity(n, h, theta, params, length, strain, state_begin, state, stress, tangent, &
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
    integer(c_int32_t), intent(inout) :: status(n)    !< 0; 1 volume not positive, 2 no solution at the point, 4 softened to nothing
    type(hardening_law) :: law
    real(c_double) :: shear, bulk, flow(6), elastic(6), begin
    integer :: fault
    integer(c_int64_t) :: i
    shear = params(1)/(2*(1 + params(2)))
    bulk = params(1)/(3*(1 - 2*params(2)))
    law = hardening_law(params(3), params(4), params(5), params(6), params(7))
    do i = 1, n
      state(:, i) = state_begin(:, i)
      begin = state(13, i)
      call mises(bulk, shear, law, strain(:, i) - state(1:6, i), state(7:12, i), state(13, i), flow, stress(:, i), &
                 tangent(:, :, i), fault)
      if (fault /= 0) status(i) = fault
      state(1:6, i) = state(1:6, i) + flow
      elastic = strain(:, i) - state(1:6, i)
      energy(i) = 0.5_c_double*dot_product(stress(:, i), elastic) + hardening_energy(law, state(13, i))
      if (law%kinematic > 0) & ! squares may leave the range of numbers
        energy(i) = energy(i) + 0.75_c_double*(sum(state(7:9, i)*(state(7:9, i)/law%kinematic)) &
                                               + 2*sum(state(10:12, i)*(state(10:12, i)/law%kinematic)))
      dissipated(i) = law%yield*(state(13, i) - begin)
    end do
  end subroutine cairn_bulk_j2_plasticity
end module j2_plasticity
