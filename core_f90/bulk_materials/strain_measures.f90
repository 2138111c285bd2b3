!> Strains E = f(C), C = F'F, of a family: Biot's (sqrt C - 1), Green's ((C - 1)/2), Hencky's (ln C / 2), and the linear one; and
!> the first Piola-Kirchhoff stress that is conjugate to a law on them (Hill 1968; derivatives of tensor functions by divided
!> differences, Miehe & Lambrecht 2001).
module strain_measures
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: from_strain, from_stress, to_strain, symmetric_eigen, elastic_from_measure, determinant, place_of, &
                              half_log_difference, beyond_one
  implicit none
  private
  public :: cairn_strain_measure, cairn_stress_of_measure
  integer, parameter :: linear = 0, biot = 1, green = 2, hencky = 3
contains

  !> Strains of n points.
  pure subroutine cairn_strain_measure(measure, n, gradient, strain, status) bind(c)
    integer(c_int32_t), value      :: measure           !< 0 linear, 1 Biot, 2 Green, 3 Hencky
    integer(c_int64_t), value      :: n                 !< points
    real(c_double), intent(in)     :: gradient(3, 3, n) !< of displacement, F - 1 [-]
    real(c_double), intent(out)    :: strain(6, n)      !< 11 22 33 12 23 13, shear twice [-]
    integer(c_int32_t), intent(inout) :: status(n)      !< set to 1 where the volume is not positive
    real(c_double) :: x(3), q(3, 3), e(3, 3)
    integer(c_int64_t) :: i
    do i = 1, n
      if (measure == linear) then
        strain(:, i) = 0.5_c_double*to_strain(gradient(:, :, i) + transpose(gradient(:, :, i)))
        cycle
      end if
      if (.not. volume_ratio(gradient(:, :, i)) > 0) then
        status(i) = 1
        strain(:, i) = 0
        cycle
      end if
      e = beyond_one(gradient(:, :, i))
      if (measure /= green) then
        call symmetric_eigen(e, x, q)
        e = matmul(q*spread(strain_of(measure, x), 1, 3), transpose(q))
      else
        e = 0.5_c_double*e
      end if
      strain(:, i) = 0.5_c_double*to_strain(e + transpose(e))
    end do
  end subroutine cairn_strain_measure

  !> First Piola-Kirchhoff stress of n points and its derivative by F, from the stress and the tangent of the law.
  pure subroutine cairn_stress_of_measure(measure, n, gradient, stress, tangent, want, piola, by_gradient) bind(c)
    integer(c_int32_t), value   :: measure           !< 0 linear, 1 Biot, 2 Green, 3 Hencky
    integer(c_int64_t), value   :: n                 !< points
    real(c_double), intent(in)  :: gradient(3, 3, n) !< of displacement, F - 1 [-]
    real(c_double), intent(in)  :: stress(6, n)      !< of the law, conjugate to its strain [Pa]
    real(c_double), intent(in)  :: tangent(6, 6, n)  !< of stress by strain [Pa]
    integer(c_int32_t), value   :: want              !< 1: the derivative too
    real(c_double), intent(out) :: piola(3, 3, n)    !< [Pa]
    real(c_double), intent(inout) :: by_gradient(3, 3, 3, 3, n) !< of piola(i, j) by F(k, l) [Pa]
    real(c_double) :: f(3, 3), s(6), c(6, 6)
    integer(c_int64_t) :: i
    integer :: j, k, l, m
    do i = 1, n
      if (measure == linear) then
        piola(:, :, i) = from_stress(stress(:, i))
        if (want == 0) cycle
        do m = 1, 3
          do l = 1, 3
            do k = 1, 3
              do j = 1, 3
                by_gradient(j, k, l, m, i) = tangent(place_of(j, k), place_of(l, m), i)
              end do
            end do
          end do
        end do
        cycle
      end if
      f = gradient(:, :, i)
      do j = 1, 3
        f(j, j) = f(j, j) + 1
      end do
      if (measure == green) then
        call elastic_from_measure(f, stress(:, i), tangent(:, :, i), piola(:, :, i), by_gradient(:, :, :, :, i))
      else
        call pulled_back(measure, gradient(:, :, i), stress(:, i), tangent(:, :, i), s, c)
        call elastic_from_measure(f, s, c, piola(:, :, i), by_gradient(:, :, :, :, i))
      end if
    end do
  end subroutine cairn_stress_of_measure

  !> Second Piola-Kirchhoff stress and its derivative by Green's strain.
  pure subroutine pulled_back(measure, gradient, stress, tangent, s, c)
    integer, intent(in)         :: measure
    real(c_double), intent(in)  :: gradient(3, 3), stress(6), tangent(6, 6)
    real(c_double), intent(out) :: s(6), c(6, 6)
    real(c_double) :: x(3), q(3, 3), t(3, 3), first(3, 3), second(3, 3, 3), change(6, 6), unit(6), g(3, 3, 6)
    integer :: i, j, k
    call symmetric_eigen(beyond_one(gradient), x, q)
    x = 1 + x
    do j = 1, 3
      do i = 1, 3
        first(i, j) = 2*first_difference(measure, x(i), x(j))
        do k = 1, 3
          second(i, k, j) = 4*second_difference(measure, x(i), x(k), x(j))
        end do
      end do
    end do
    do k = 1, 6
      unit = 0
      unit(k) = 1
      g(:, :, k) = matmul(transpose(q), matmul(from_strain(unit), q))
      t = first*g(:, :, k)
      change(:, k) = to_strain(matmul(q, matmul(t, transpose(q))))
    end do
    s = matmul(transpose(change), stress)
    c = matmul(transpose(change), matmul(tangent, change))
    t = matmul(transpose(q), matmul(from_stress(stress), q))
    do j = 1, 6
      do i = 1, j
        c(i, j) = c(i, j) + turned(g(:, :, i), g(:, :, j))
        if (i /= j) c(j, i) = c(j, i) + turned(g(:, :, i), g(:, :, j))
      end do
    end do
  contains
    !> T : D2 E [a, b]
    pure function turned(a, b) result(total)
      real(c_double), intent(in) :: a(3, 3), b(3, 3)
      real(c_double) :: total
      integer :: p, r, o
      total = 0
      do o = 1, 3
        do r = 1, 3
          do p = 1, 3
            total = total + t(p, o)*second(p, r, o)*(a(p, r)*b(r, o) + b(p, r)*a(r, o))
          end do
        end do
      end do
    end function turned
  end subroutine pulled_back

  pure function volume_ratio(gradient) result(j)
    real(c_double), intent(in) :: gradient(3, 3)
    real(c_double) :: f(3, 3), j
    integer :: i
    f = gradient
    do i = 1, 3
      f(i, i) = f(i, i) + 1
    end do
    j = determinant(f)
  end function volume_ratio

  !> Principal strain of a measure for an eigenvalue 1 + x of C.
  pure elemental function strain_of(measure, x) result(e)
    integer, intent(in)        :: measure
    real(c_double), intent(in) :: x
    real(c_double) :: e
    e = x/2
    if (measure == biot) e = x/(1 + sqrt(1 + x))
    if (measure == hencky) e = atanh(x/(2 + x))
  end function strain_of

  pure function first_difference(measure, a, b) result(d)
    integer, intent(in)        :: measure
    real(c_double), intent(in) :: a, b
    real(c_double) :: d
    if (measure == biot) then
      d = 1/(sqrt(a) + sqrt(b))
    else
      d = half_log_difference(a, b)
    end if
  end function first_difference

  !> Second divided difference of a strain measure. Where the three stretches are close it is Taylor's series about their mean, in
  !> which the linear term vanishes.
  pure function second_difference(measure, a, b, c) result(d)
    integer, intent(in)        :: measure
    real(c_double), intent(in) :: a, b, c
    real(c_double) :: d, low, high, middle, mean, x(3), h2, h3, h4
    if (measure == biot) then
      d = -1/((sqrt(a) + sqrt(b))*(sqrt(b) + sqrt(c))*(sqrt(a) + sqrt(c)))
      return
    end if
    low = min(a, b, c)
    high = max(a, b, c)
    middle = max(min(a, b), min(max(a, b), c))
    mean = (a + b + c)/3
    if (high - low > 0.02_c_double*mean) then
      d = (half_log_difference(high, middle) - half_log_difference(middle, low))/(high - low)
      return
    end if
    x = [a, b, c]/mean - 1
    ! complete homogeneous polynomials of numbers whose sum is nought
    h2 = sum(x**2)/2
    h3 = sum(x**3)/3
    h4 = h2*h2
    d = (-0.25_c_double - h2/8 + h3/10 - h4/12)/mean**2
  end function second_difference
end module strain_measures
