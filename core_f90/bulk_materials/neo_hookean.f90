!> Compressible neo-Hookean: W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2 (Bonet & Wood 2008).
module neo_hookean
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: inverse, determinant
  implicit none
  private
  public :: cairn_bulk_neo_hookean
  integer, parameter :: parameters = 2, states = 0
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_neo_hookean(n, h, theta, params, length, gradient, state_begin, state, stress, tangent, &
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
    real(c_double) :: f(3, 3), back(3, 3), shear, lame, log_j, square
    integer(c_int64_t) :: i
    integer :: k, l, p, q
    shear = params(1)/(2*(1 + params(2)))
    lame = params(1)*params(2)/((1 + params(2))*(1 - 2*params(2)))
    do i = 1, n
      f = gradient(:, :, i)
      do k = 1, 3
        f(k, k) = f(k, k) + 1
      end do
      if (.not. determinant(f) > 0) then
        status(i) = 1
        f = 0
        do k = 1, 3
          f(k, k) = 1
        end do
      end if
      log_j = log(determinant(f))
      back = transpose(inverse(f)) ! F^-T
      stress(:, :, i) = shear*(f - back) + lame*log_j*back
      square = 0 ! trace of C - 1
      do k = 1, 3
        square = square + 2*gradient(k, k, i)
      end do
      square = square + sum(gradient(:, :, i)**2)
      energy(i) = 0.5_c_double*shear*(square - 2*log_j) + 0.5_c_double*lame*log_j**2
      do q = 1, 3
        do p = 1, 3
          do l = 1, 3
            do k = 1, 3
              tangent(k, l, p, q, i) = (shear - lame*log_j)*back(k, q)*back(p, l) + lame*back(k, l)*back(p, q)
            end do
          end do
          tangent(p, q, p, q, i) = tangent(p, q, p, q, i) + shear
        end do
      end do
    end do
    dissipated = 0
    state = state_begin
  end subroutine cairn_bulk_neo_hookean
end module neo_hookean
