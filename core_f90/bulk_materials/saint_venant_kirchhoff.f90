!> Hooke's law between Green's strain and the second Piola-Kirchhoff stress; it fails in compression below a stretch of 0.577.
module saint_venant_kirchhoff
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: isotropic_moduli, to_strain, elastic_from_measure, determinant
  implicit none
  private
  public :: cairn_bulk_saint_venant_kirchhoff
  integer, parameter :: parameters = 2, states = 0
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_saint_venant_kirchhoff(n, h, theta, params, length, gradient, state_begin, state, stress, tangent, &
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
    integer(c_int32_t), intent(inout) :: status(n)    !< 0; 1 volume not positive, 2 no solution at the point, 3 cell too large
    real(c_double) :: c(6, 6), e(6), f(3, 3)
    integer(c_int64_t) :: i
    integer :: k
    c = isotropic_moduli(params(1), params(2))
    do i = 1, n
      e = 0.5_c_double*to_strain(gradient(:, :, i) + transpose(gradient(:, :, i)) &
                                 + matmul(transpose(gradient(:, :, i)), gradient(:, :, i)))
      f = gradient(:, :, i)
      do k = 1, 3
        f(k, k) = f(k, k) + 1
      end do
      if (.not. determinant(f) > 0) status(i) = 1
      call elastic_from_measure(f, matmul(c, e), c, stress(:, :, i), tangent(:, :, :, :, i))
      energy(i) = 0.5_c_double*dot_product(e, matmul(c, e))
    end do
    dissipated = 0
    state = state_begin
  end subroutine cairn_bulk_saint_venant_kirchhoff
end module saint_venant_kirchhoff
