!> Ogden's rubber of up to three terms on stretches without change of volume (Ogden 1972): W = sum mu/a (sum of (J^(-1/3) l)^a - 3)
!> + bulk/2 (J - 1)^2. Mooney and Rivlin's: shear 2 C10 of power 2, -2 C01 of power -2.
module ogden
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: symmetric_eigen, to_stress, elastic_from_measure, determinant, from_strain, &
                              to_strain, place_of, beyond_one, log1p, expm1
  implicit none
  private
  public :: cairn_bulk_ogden
  integer, parameter :: parameters = 7, states = 0
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_ogden(n, h, theta, params, length, gradient, state_begin, state, stress, tangent, &
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
    real(c_double) :: f(3, 3), stretched(3, 3), x(3), q(3, 3), log_stretch(3), s(3), by(3, 3), full(6), c(6, 6)
    real(c_double), parameter :: apart = 0.25_c_double !< square of C - 1 above which 1 rounds it no more
    integer(c_int64_t) :: i
    integer :: k
    if (.not. params(2)*params(3) + params(4)*params(5) + params(6)*params(7) > 0) status = 2 ! shear would grow by itself
    do i = 1, n
      f = gradient(:, :, i)
      stretched = beyond_one(f)
      do k = 1, 3
        f(k, k) = f(k, k) + 1
      end do
      if (.not. determinant(f) > 0) then
        status(i) = 1
        f = 0
        do k = 1, 3
          f(k, k) = 1
        end do
        stretched = 0
      end if
      if (sum(stretched**2) <= apart) then
        call symmetric_eigen(stretched, x, q)
        log_stretch = [(0.5_c_double*log1p(x(k)), k=1, 3)]
        x = 1 + x
      else ! stretches may be small, and no differences of numbers of size 1
        call symmetric_eigen(matmul(transpose(f), f), x, q)
        log_stretch = 0.5_c_double*log(x)
      end if
      call principal(params, x, log_stretch, energy(i), s, by)
      full = to_stress(matmul(q*spread(s, 1, 3), transpose(q)))
      call turned(x, q, s, by, c)
      call elastic_from_measure(f, full, c, stress(:, :, i), tangent(:, :, :, :, i))
    end do
    dissipated = 0
    state = state_begin
  end subroutine cairn_bulk_ogden

  !> Energy, principal second Piola-Kirchhoff stresses and their derivatives by half the eigenvalues of C. Small strains keep their
  !> relative precision: powers less 1, and the sum of powers less that of exponents, which is 0.
  pure subroutine principal(params, x, log_stretch, energy, s, by)
    real(c_double), intent(in)  :: params(parameters), x(3), log_stretch(3)
    real(c_double), intent(out) :: energy, s(3), by(3, 3)
    real(c_double) :: growth, j, log_x(3), power(3), mean, shear, a
    integer :: term, i, k
    log_x = log_stretch - sum(log_stretch)/3 ! of stretches without change of volume
    growth = expm1(sum(log_stretch))
    j = 1 + growth
    energy = 0.5_c_double*params(1)*growth**2
    ! beta = dW / d ln stretch; s = beta / x; by = (d beta / d ln stretch - 2 beta delta) / (x x)
    s = params(1)*growth*j
    by = params(1)*(2*j - 1)*j
    do term = 1, 3
      shear = params(2*term)
      a = params(2*term + 1)
      if (.not. (abs(shear) > 0 .and. abs(a) > 0)) cycle
      power = [(expm1(a*log_x(i)), i=1, 3)]
      mean = (beyond_exponent(a*log_x(1)) + beyond_exponent(a*log_x(2)) + beyond_exponent(a*log_x(3)))/3
      energy = energy + 3*shear/a*mean
      s = s + shear*(power - mean)
      do k = 1, 3
        do i = 1, 3
          by(i, k) = by(i, k) + shear*a*(mean - power(i) - power(k) - 1)/3
        end do
        by(k, k) = by(k, k) + shear*a*(1 + power(k))
      end do
    end do
    do k = 1, 3
      by(k, k) = by(k, k) - 2*s(k)
    end do
    s = s/x
    do k = 1, 3
      by(:, k) = by(:, k)/(x*x(k))
    end do
  end subroutine principal

  !> exp(x) - 1 - x, of small x to their own precision.
  pure function beyond_exponent(x) result(rest)
    real(c_double), intent(in) :: x
    real(c_double) :: rest
    integer, parameter :: terms = 9
    integer :: k
    if (abs(x) > 0.03125_c_double) then
      rest = expm1(x) - x
      return
    end if
    rest = 1
    do k = terms, 3, -1
      rest = 1 + x/k*rest
    end do
    rest = 0.5_c_double*x**2*rest
  end function beyond_exponent

  !> Derivative of the stress by Green's strain in the axes of space.
  pure subroutine turned(x, q, s, by, c)
    real(c_double), intent(in)  :: x(3), q(3, 3), s(3), by(3, 3)
    real(c_double), intent(out) :: c(6, 6)
    real(c_double) :: m(6, 6), shear, own(6, 6)
    integer :: i, k, v, w
    own = 0
    own(:3, :3) = by
    do k = 2, 3
      do i = 1, k - 1
        if (abs(x(i) - x(k)) > 1e-6_c_double*(x(i) + x(k))) then
          shear = (s(i) - s(k))/(x(i) - x(k))
        else
          shear = 0.25_c_double*(by(i, i) + by(k, k) - 2*by(i, k))
        end if
        own(place_of(i, k), place_of(i, k)) = shear
      end do
    end do
    do w = 1, 6 ! strains of space to those of the principal axes
      m(:, w) = 0
      m(w, w) = 1
      call to_axes(q, m(:, w))
    end do
    c = 0
    do w = 1, 6
      do v = 1, 6
        c(v, w) = dot_product(m(:, v), matmul(own, m(:, w)))
      end do
    end do
  end subroutine turned

  pure subroutine to_axes(q, v)
    real(c_double), intent(in)    :: q(3, 3)
    real(c_double), intent(inout) :: v(6)
    real(c_double) :: a(3, 3)
    a = from_strain(v)
    a = matmul(transpose(q), matmul(a, q))
    v = to_strain(a)
  end subroutine to_axes
end module ogden
