!> Mises' plasticity at large strains: F = Fe Fp, Hencky's energy, the radial return on the logarithm of the trial left stretch
!> (Simo 1992); with kinematic hardening the return about a back stress. Its state is the inverse of Fp'Fp, less the identity.
module finite_j2
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: symmetric_eigen, inverse, determinant, to_strain, to_stress, from_stress, from_strain, &
                              half_log_difference
  use radial_return, only: hardening_law, mises, hardening_energy
  use finite_back_stress, only: point_with_back_stress
  implicit none
  private
  public :: cairn_bulk_finite_j2
  integer, parameter :: parameters = 7, states = 7
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_finite_j2(n, h, theta, params, length, gradient, state_begin, state, stress, tangent, &
                                    energy, dissipated, status) bind(c)
    integer(c_int64_t), value   :: n                  !< points
    real(c_double), value       :: h                  !< step [s]
    real(c_double), value       :: theta              !< of the theta-method
    real(c_double), intent(in)  :: params(parameters) !< in the order of bulk_materials.def
    real(c_double), intent(in)  :: length(n)          !< size of the cell round each point [m]
    real(c_double), intent(in)  :: gradient(3, 3, n)  !< of displacement at the end of the step, F - 1 [-]
    real(c_double), intent(in)  :: state_begin(states, n) !< at the begin of the step
    real(c_double), intent(out) :: state(states, n)   !< at its end
    real(c_double), intent(out) :: stress(3, 3, n)    !< first Piola-Kirchhoff [Pa]
    real(c_double), intent(out) :: tangent(3, 3, 3, 3, n) !< of stress(i, j) by F(k, l) [Pa]
    real(c_double), intent(out) :: energy(n)          !< stored [J/m3]
    real(c_double), intent(out) :: dissipated(n)      !< in the step [J/m3]
    integer(c_int32_t), intent(inout) :: status(n)    !< 0; 1 volume not positive, 2 no solution at the point, 4 softened to nothing
    type(hardening_law) :: law
    real(c_double) :: shear, bulk, f(3, 3), plastic(3, 3), begin
    integer(c_int64_t) :: i
    integer :: k, fault
    shear = params(1)/(2*(1 + params(2)))
    bulk = params(1)/(3*(1 - 2*params(2)))
    law = hardening_law(params(3), params(4), params(5), params(6), params(7))
    do i = 1, n
      f = gradient(:, :, i)
      plastic = from_stress(state_begin(1:6, i))
      do k = 1, 3
        f(k, k) = f(k, k) + 1
        plastic(k, k) = plastic(k, k) + 1
      end do
      state(:, i) = state_begin(:, i)
      if (.not. determinant(f) > 0) then
        status(i) = 1
        stress(:, :, i) = 0
        tangent(:, :, :, :, i) = 0
        energy(i) = 0
        dissipated(i) = 0
        cycle
      end if
      begin = state(7, i)
      if (law%kinematic > 0) then
        plastic = from_stress(state_begin(1:6, i))
        call point_with_back_stress(bulk, shear, law, gradient(:, :, i), plastic, state(7, i), stress(:, :, i), &
                                    tangent(:, :, :, :, i), energy(i), fault)
        if (fault /= 0) status(i) = fault
        state(1:6, i) = to_stress(plastic)
        dissipated(i) = law%yield*(state(7, i) - begin)
        cycle
      end if
      call point(bulk, shear, law, f, plastic, state(7, i), stress(:, :, i), tangent(:, :, :, :, i), energy(i), status(i))
      do k = 1, 3
        plastic(k, k) = plastic(k, k) - 1
      end do
      if (state(7, i) > begin) state(1:6, i) = to_stress(plastic)
      dissipated(i) = law%yield*(state(7, i) - begin)
    end do
  end subroutine cairn_bulk_finite_j2

  pure subroutine point(bulk, shear, law, f, plastic, accumulated, stress, tangent, energy, status)
    real(c_double), intent(in)      :: bulk, shear, f(3, 3)
    type(hardening_law), intent(in) :: law
    real(c_double), intent(inout)   :: plastic(3, 3), accumulated
    real(c_double), intent(out)     :: stress(3, 3), tangent(3, 3, 3, 3), energy
    integer(c_int32_t), intent(inout) :: status
    real(c_double) :: half(3, 3), x(3), q(3, 3), trial(6), back(6), flow(6), tau(6), algorithmic(6, 6), f_back(3, 3), &
                      full(3, 3), first(3, 3), change(3, 3), push(3, 3)
    integer :: fault
    integer :: i, k, l
    half = matmul(plastic, transpose(f))
    call symmetric_eigen(matmul(f, half), x, q)
    trial = to_strain(matmul(q*spread(0.5_c_double*log(x), 1, 3), transpose(q)))
    back = 0
    call mises(bulk, shear, law, trial, back, accumulated, flow, tau, algorithmic, fault)
    if (fault /= 0) status = fault
    energy = 0.5_c_double*dot_product(tau, trial - flow) + hardening_energy(law, accumulated)
    f_back = inverse(f)
    full = from_stress(tau)
    stress = matmul(full, transpose(f_back))
    do k = 1, 3
      do i = 1, 3
        first(i, k) = half_log_difference(x(i), x(k))
      end do
    end do
    do l = 1, 3
      do k = 1, 3
        change = 0 ! of the trial left stretch, squared, by F(k, l)
        change(k, :) = half(l, :)
        change(:, k) = change(:, k) + half(l, :)
        change = matmul(q, matmul(first*matmul(transpose(q), matmul(change, q)), transpose(q)))
        push = from_stress(matmul(algorithmic, to_strain(change)))
        push = matmul(push, transpose(f_back))
        do i = 1, 3
          push(:, i) = push(:, i) - stress(:, l)*f_back(i, k) ! P dF' F^-T
        end do
        tangent(:, :, k, l) = push
      end do
    end do
    ! elastic part of the left stretch, from it the inverse of Fp'Fp
    call symmetric_eigen(from_strain(trial - flow), x, q)
    plastic = matmul(f_back, matmul(matmul(q*spread(exp(2*x), 1, 3), transpose(q)), transpose(f_back)))
  end subroutine point
end module finite_j2
