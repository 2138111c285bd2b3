!> Compressible neo-Hookean: W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2 (Bonet & Wood 2008).
module neo_hookean
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: determinant
  implicit none
  private
  public :: cairn_bulk_neo_hookean
  integer, parameter :: parameters = 2, states = 0
  interface
    pure real(c_double) function log1p(x) bind(c) ! of C: ln (1 + x)
      import :: c_double
      real(c_double), value :: x
    end function
  end interface
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
    real(c_double), parameter :: apart = 0.25_c_double !< square of the strain above which 1 rounds it no more
    real(c_double) :: grown(3, 3), back(3, 3), shear, lame, log_j, distortion
    integer(c_int64_t) :: i
    integer :: k, l, p, q
    logical :: sound
    shear = params(1)/(2*(1 + params(2)))
    lame = params(1)*params(2)/((1 + params(2))*(1 - 2*params(2)))
    do i = 1, n
      grown = gradient(:, :, i)
      if (sum(grown**2) <= apart) then
        call by_strain(grown, back, stress(:, :, i), log_j, distortion, sound)
      else
        call by_deformation(grown, back, stress(:, :, i), log_j, distortion, sound)
      end if
      if (.not. sound) then
        status(i) = 1
        grown = 0
        call by_strain(grown, back, stress(:, :, i), log_j, distortion, sound)
      end if
      stress(:, :, i) = shear*stress(:, :, i) + lame*log_j*back
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

  !> F - F^-T without differences of numbers of size 1, whose rounding would be all that small strains leave.
  pure subroutine by_strain(grown, back, pull, log_j, distortion, sound)
    real(c_double), intent(in)  :: grown(3, 3) !< F - 1
    real(c_double), intent(out) :: back(3, 3)  !< F^-T
    real(c_double), intent(out) :: pull(3, 3)  !< F - F^-T
    real(c_double), intent(out) :: log_j, distortion !< ln J; I1 - 3 - 2 ln J
    logical, intent(out)        :: sound !< J is positive
    real(c_double) :: cofactor(3, 3), higher, growth
    integer :: k
    cofactor = cofactors(grown)
    higher = cofactor(1, 1) + cofactor(2, 2) + cofactor(3, 3) + determinant(grown)
    growth = grown(1, 1) + grown(2, 2) + grown(3, 3) + higher ! J - 1
    sound = 1 + growth > 0
    if (.not. sound) growth = 0
    log_j = log1p(growth)
    back = cofactor - transpose(grown)
    pull = grown + transpose(grown) + growth*grown - cofactor
    do k = 1, 3
      back(k, k) = back(k, k) + 1 + growth - higher
      pull(k, k) = pull(k, k) + higher
    end do
    back = back/(1 + growth)
    pull = pull/(1 + growth)
    distortion = sum(grown**2) + 2*(beyond_log(growth) - higher)
  end subroutine by_strain

  !> The same of large strains, whose volume may be small: a difference of numbers of size 1 by 1 + trace + ...
  pure subroutine by_deformation(grown, back, pull, log_j, distortion, sound)
    real(c_double), intent(in)  :: grown(3, 3)
    real(c_double), intent(out) :: back(3, 3), pull(3, 3), log_j, distortion
    logical, intent(out)        :: sound
    real(c_double) :: f(3, 3), volume
    integer :: k
    f = grown
    do k = 1, 3
      f(k, k) = f(k, k) + 1
    end do
    volume = determinant(f)
    sound = volume > 0
    if (.not. sound) volume = 1
    log_j = log(volume)
    back = cofactors(f)/volume
    pull = f - back
    distortion = sum(f**2) - 3 - 2*log_j
  end subroutine by_deformation

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

  pure function cofactors(a) result(b)
    real(c_double), intent(in) :: a(3, 3)
    real(c_double) :: b(3, 3)
    integer :: i, k, p, q, r, s
    do k = 1, 3
      r = mod(k, 3) + 1
      s = mod(k + 1, 3) + 1
      do i = 1, 3
        p = mod(i, 3) + 1
        q = mod(i + 1, 3) + 1
        b(i, k) = a(p, r)*a(q, s) - a(p, s)*a(q, r)
      end do
    end do
  end function cofactors
end module neo_hookean
