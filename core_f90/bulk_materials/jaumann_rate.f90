!> Laws that give Cauchy's stress by increments: strain and rotation of a step from its middle (Hughes & Winget 1980), and the first
!> Piola-Kirchhoff stress with its derivative from moduli of Jaumann's rate of Kirchhoff's stress.
module jaumann_rate
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: determinant, from_stress, inverse, place_of, to_strain
  implicit none
  private
  public :: cairn_step_strain, cairn_stress_of_rate
contains

  !> Strain increments and rotations of n points: L = 2 (F1 - F0) (F1 + F0)^-1, its symmetric part, and the rotation (1 - W/2)^-1 (1
  !> + W/2) of its other part W, which is F1 F0^-1 itself where that is a rotation. Half a turn in a step gives no finite numbers.
  pure subroutine cairn_step_strain(n, begin, end, change, rotation, status) bind(c)
    integer(c_int64_t), value   :: n                !< points
    real(c_double), intent(in)  :: begin(3, 3, n), end(3, 3, n) !< gradients of displacement, F - 1 [-]
    real(c_double), intent(out) :: change(6, n)     !< of strain, 11 22 33 12 23 13, shear twice [-]
    real(c_double), intent(out) :: rotation(3, 3, n)
    integer(c_int32_t), intent(inout) :: status(n)  !< set to 1 where the volume is not positive
    real(c_double) :: rate(3, 3), half(3, 3)
    integer(c_int64_t) :: i
    do i = 1, n
      if (.not. determinant(with_identity(end(:, :, i))) > 0) then
        status(i) = 1
        change(:, i) = 0
        half = 0
        rotation(:, :, i) = with_identity(half)
        cycle
      end if
      half = with_identity(0.5_c_double*(begin(:, :, i) + end(:, :, i)))
      rate = matmul(end(:, :, i) - begin(:, :, i), inverse(half))
      change(:, i) = 0.5_c_double*to_strain(rate + transpose(rate))
      half = 0.25_c_double*(rate - transpose(rate))
      rotation(:, :, i) = matmul(inverse(with_identity(-half)), with_identity(half))
    end do
  end subroutine cairn_step_strain

  !> P = tau F^-T, and dP = (J C : D + W tau - tau D) F^-T where dF F^-1 = D + W.
  pure subroutine cairn_stress_of_rate(n, gradient, stress, moduli, want, piola, by_gradient) bind(c)
    integer(c_int64_t), value   :: n                 !< points
    real(c_double), intent(in)  :: gradient(3, 3, n) !< of displacement, F - 1 [-]
    real(c_double), intent(in)  :: stress(6, n)      !< Cauchy's, 11 22 33 12 23 13 [Pa]
    real(c_double), intent(in)  :: moduli(6, 6, n)   !< of Jaumann's rate of tau = J sigma by D, over J [Pa]
    integer(c_int32_t), value   :: want              !< 1: the derivative too
    real(c_double), intent(out) :: piola(3, 3, n)    !< [Pa]
    real(c_double), intent(inout) :: by_gradient(3, 3, 3, 3, n) !< of piola(i, j) by F(k, l) [Pa]
    real(c_double) :: f(3, 3), back(3, 3), volume, tau(3, 3), rate(3, 3, 3, 3), pulled(3, 3)
    integer(c_int64_t) :: i
    integer :: j, k, l, m
    do i = 1, n
      f = with_identity(gradient(:, :, i))
      volume = determinant(f)
      back = inverse(f)
      tau = volume*from_stress(stress(:, i))
      piola(:, :, i) = matmul(tau, transpose(back))
      if (want == 0) cycle
      do m = 1, 3 ! by L(l, m)
        do l = 1, 3
          do k = 1, 3
            do j = 1, 3
              rate(j, k, l, m) = volume*moduli(place_of(j, k), place_of(l, m), i)
            end do
          end do
          rate(l, :, l, m) = rate(l, :, l, m) + 0.5_c_double*tau(m, :)
          rate(m, :, l, m) = rate(m, :, l, m) - 0.5_c_double*tau(l, :)
          rate(:, m, l, m) = rate(:, m, l, m) - 0.5_c_double*tau(:, l)
          rate(:, l, l, m) = rate(:, l, l, m) - 0.5_c_double*tau(:, m)
        end do
      end do
      do l = 1, 3
        do k = 1, 3
          pulled = back(l, 1)*rate(:, :, k, 1) + back(l, 2)*rate(:, :, k, 2) + back(l, 3)*rate(:, :, k, 3)
          by_gradient(:, :, k, l, i) = matmul(pulled, transpose(back))
        end do
      end do
    end do
  end subroutine cairn_stress_of_rate

  pure function with_identity(a) result(f)
    real(c_double), intent(in) :: a(3, 3)
    real(c_double) :: f(3, 3)
    integer :: k
    f = a
    do k = 1, 3
      f(k, k) = f(k, k) + 1
    end do
  end function with_identity
end module jaumann_rate
