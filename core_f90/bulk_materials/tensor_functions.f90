!> Tensors of solids. Symmetric ones are six numbers in the order 11 22 33 12 23 13; strains have twice their shear there.
module tensor_functions
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: first_index, second_index, place_of, identity6, to_strain, from_strain, to_stress, from_stress
  public :: determinant, cofactors, inverse, beyond_one, symmetric_eigen, isotropic_moduli, elastic_from_measure
  public :: half_log_difference, log1p, expm1
  integer, parameter :: first_index(6) = [1, 2, 3, 1, 2, 1], second_index(6) = [1, 2, 3, 2, 3, 3]
  integer, parameter :: place_of(3, 3) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [3, 3])
  real(c_double), parameter :: identity6(6) = [1, 1, 1, 0, 0, 0]
  interface
    pure real(c_double) function log1p(x) bind(c) ! of C: ln (1 + x)
      import :: c_double
      real(c_double), value :: x
    end function
    pure real(c_double) function expm1(x) bind(c) ! of C: exp(x) - 1
      import :: c_double
      real(c_double), value :: x
    end function
  end interface
contains

  pure function to_strain(a) result(v)
    real(c_double), intent(in) :: a(3, 3)
    real(c_double) :: v(6)
    v = [a(1, 1), a(2, 2), a(3, 3), a(1, 2) + a(2, 1), a(2, 3) + a(3, 2), a(1, 3) + a(3, 1)]
  end function to_strain

  pure function from_strain(v) result(a)
    real(c_double), intent(in) :: v(6)
    real(c_double) :: a(3, 3)
    a = from_stress([v(1:3), 0.5_c_double*v(4:6)])
  end function from_strain

  pure function to_stress(a) result(v)
    real(c_double), intent(in) :: a(3, 3)
    real(c_double) :: v(6)
    v = to_strain(a)
    v(4:6) = 0.5_c_double*v(4:6)
  end function to_stress

  pure function from_stress(v) result(a)
    real(c_double), intent(in) :: v(6)
    real(c_double) :: a(3, 3)
    a(:, 1) = [v(1), v(4), v(6)]
    a(:, 2) = [v(4), v(2), v(5)]
    a(:, 3) = [v(6), v(5), v(3)]
  end function from_stress

  pure function determinant(a) result(d)
    real(c_double), intent(in) :: a(3, 3)
    real(c_double) :: d
    d = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) - a(1, 2)*(a(2, 1)*a(3, 3) - a(2, 3)*a(3, 1)) &
        + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
  end function determinant

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

  !> C - 1 of F - 1, C = F'F: exact to rounding of the strain where points are not turned, to that of 1 where they are.
  pure function beyond_one(h) result(c)
    real(c_double), intent(in) :: h(3, 3)
    real(c_double) :: c(3, 3)
    c = h + transpose(h) + matmul(transpose(h), h)
  end function beyond_one

  pure function inverse(a) result(b)
    real(c_double), intent(in) :: a(3, 3)
    real(c_double) :: b(3, 3)
    b = transpose(cofactors(a))
    b = b/dot_product(a(1, :), b(:, 1))
  end function inverse

  !> a = q diag(value) q', by Jacobi's rotations, which keep small eigenvalues beside large ones.
  pure subroutine symmetric_eigen(given, value, q)
    real(c_double), intent(in)  :: given(3, 3)
    real(c_double), intent(out) :: value(3), q(3, 3)
    real(c_double) :: a(3, 3), t, c, s, tau, column(3)
    integer :: pass, i, j, k
    integer, parameter :: most = 30
    a = given
    q = 0
    do i = 1, 3
      q(i, i) = 1
    end do
    do pass = 1, most
      if (.not. (abs(a(1, 2)) > 0 .or. abs(a(1, 3)) > 0 .or. abs(a(2, 3)) > 0)) exit
      do i = 1, 2
        do j = i + 1, 3
          if (.not. abs(a(i, j)) > 0) cycle
          if (abs(a(i, j)) <= epsilon(t)*1e-3_c_double*sqrt(abs(a(i, i)))*sqrt(abs(a(j, j)))) then
            a(i, j) = 0
            a(j, i) = 0
            cycle
          end if
          tau = (a(j, j) - a(i, i))/(2*a(i, j))
          t = sign(1.0_c_double, tau)/(abs(tau) + hypot(1.0_c_double, tau))
          c = 1/sqrt(1 + t*t)
          s = t*c
          do k = 1, 3
            if (k == i .or. k == j) cycle
            tau = a(k, i)
            a(k, i) = c*tau - s*a(k, j)
            a(k, j) = s*tau + c*a(k, j)
            a(i, k) = a(k, i)
            a(j, k) = a(k, j)
          end do
          a(i, i) = a(i, i) - t*a(i, j)
          a(j, j) = a(j, j) + t*a(i, j)
          a(i, j) = 0
          a(j, i) = 0
          column = q(:, i)
          q(:, i) = c*column - s*q(:, j)
          q(:, j) = s*column + c*q(:, j)
        end do
      end do
    end do
    value = [a(1, 1), a(2, 2), a(3, 3)]
  end subroutine symmetric_eigen

  pure function isotropic_moduli(young, poisson) result(c)
    real(c_double), intent(in) :: young, poisson
    real(c_double) :: c(6, 6), shear
    integer :: i
    shear = young/(2*(1 + poisson))
    c = 0
    c(:3, :3) = young*poisson/((1 + poisson)*(1 - 2*poisson))
    do i = 1, 3
      c(i, i) = c(i, i) + 2*shear
      c(i + 3, i + 3) = shear
    end do
  end function isotropic_moduli

  !> First Piola-Kirchhoff stress and its derivative by F from the second one and its derivative by Green's strain.
  pure subroutine elastic_from_measure(f, s, c, stress, tangent)
    real(c_double), intent(in)  :: f(3, 3), s(6), c(6, 6)
    real(c_double), intent(out) :: stress(3, 3), tangent(3, 3, 3, 3) !< of stress(i, j) by f(k, l)
    real(c_double) :: full(3, 3), half(3, 3, 6)
    integer :: i, j, k, l
    full = from_stress(s)
    stress = matmul(f, full)
    do l = 1, 6
      half(:, :, l) = matmul(f, from_stress(c(:, l)))
    end do
    do l = 1, 3
      do k = 1, 3
        do j = 1, 3
          do i = 1, 3
            tangent(i, j, k, l) = f(k, 1)*half(i, j, place_of(1, l)) + f(k, 2)*half(i, j, place_of(2, l)) &
                                  + f(k, 3)*half(i, j, place_of(3, l))
          end do
          tangent(k, j, k, l) = tangent(k, j, k, l) + full(j, l)
        end do
      end do
    end do
  end subroutine elastic_from_measure

  !> (ln a - ln b) / (2 (a - b)), of full accuracy where a is near b.
  pure function half_log_difference(a, b) result(d)
    real(c_double), intent(in) :: a, b
    real(c_double) :: d, z
    z = (a - b)/(a + b)
    if (abs(z) > 0.03125_c_double) then
      d = atanh(z)/(z*(a + b))
    else
      z = z*z
      d = (1 + z*(1/3.0_c_double + z*(0.2_c_double + z*(1/7.0_c_double + z*(1/9.0_c_double + z/11)))))/(a + b)
    end if
  end function half_log_difference
end module tensor_functions
