!> Compressible neo-Hookean: W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2 (Bonet & Wood 2008).
module neo_hookean
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: cofactors, log1p
  implicit none
  private
  public :: cairn_bulk_neo_hookean
  integer, parameter :: parameters = 2, states = 0
  real(c_double), parameter :: identity(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
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
    real(c_double), parameter :: apart = 0.25_c_double !< square of C - 1 above which 1 rounds it no more
    real(c_double) :: f(3, 3), stretched(3, 3), back(3, 3), pull(3, 3), volume, shear, lame, log_j, distortion
    integer(c_int64_t) :: i
    integer :: k, l, p, q
    shear = params(1)/(2*(1 + params(2)))
    lame = params(1)*params(2)/((1 + params(2))*(1 - 2*params(2)))
    do i = 1, n
      f = gradient(:, :, i)
      do k = 1, 3
        f(k, k) = f(k, k) + 1
      end do
      back = cofactors(f)
      volume = dot_product(f(1, :), back(1, :))
      ! beyond_one of tensor_functions in place: compilers leave calls of another module, here a seventh of the kernel's time
      stretched = gradient(:, :, i) + transpose(gradient(:, :, i)) + matmul(transpose(gradient(:, :, i)), gradient(:, :, i))
      if (.not. volume > 0) then
        status(i) = 1
        f = identity
        back = identity
        volume = 1
        stretched = 0
      end if
      back = back/volume
      if (sum(stretched**2) <= apart) then
        pull = matmul(back, stretched) ! F - F^-T, but for the difference of two numbers of size 1
        call by_strain(stretched, log_j, distortion)
      else ! the volume may be small, and no difference of numbers of size 1
        pull = f - back
        log_j = log(volume)
        distortion = sum(f**2) - 3 - 2*log_j
      end if
      stress(:, :, i) = shear*pull + lame*log_j*back
      energy(i) = 0.5_c_double*shear*distortion + 0.5_c_double*lame*log_j**2
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

  !> ln J and I1 - 3 - 2 ln J of C - 1 without differences of numbers of size 1, whose rounding would be all that small strains
  !> leave: with the invariants i1, i2, i3 of C - 1, J**2 = 1 + i1 + i2 + i3.
  pure subroutine by_strain(stretched, log_j, distortion)
    real(c_double), intent(in)  :: stretched(3, 3)   !< C - 1
    real(c_double), intent(out) :: log_j, distortion !< ln J; I1 - 3 - 2 ln J
    real(c_double) :: a, b, c, d, e, f, higher, growth
    a = stretched(1, 1)
    b = stretched(2, 2)
    c = stretched(3, 3)
    d = stretched(1, 2)
    e = stretched(2, 3)
    f = stretched(1, 3)
    higher = a*b + b*c + c*a - d*d - e*e - f*f + a*(b*c - e*e) - d*(d*c - e*f) + f*(d*e - b*f)
    growth = a + b + c + higher ! J**2 - 1
    log_j = 0.5_c_double*log1p(growth)
    distortion = beyond_log(growth) - higher
  end subroutine by_strain

  !> x - ln (1 + x), of small x to their own precision.
  pure function beyond_log(x) result(rest)
    real(c_double), intent(in) :: x
    real(c_double) :: rest
    integer, parameter :: terms = 9
    integer :: k
    if (abs(x) > 0.01_c_double) then
      rest = x - log1p(x)
      return
    end if
    rest = 0
    do k = terms, 2, -1
      rest = 1.0_c_double/k - x*rest
    end do
    rest = x**2*rest
  end function beyond_log
end module neo_hookean
