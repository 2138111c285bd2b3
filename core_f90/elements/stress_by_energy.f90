!> Energy-conserving stress (discrete gradient, Gonzalez 2000): its work over a step is the change of the stored energy to rounding.
!> With C0, C1 at both ends,
!>   S = S(C) + 2 (W1 - W0 - S(C):(C1 - C0)/2)/|C1 - C0|**2 (C1 - C0),   C = (C0 + C1)/2,   P = (F0 + F1)/2 S.
!> Linear and angular momentum are conserved as well. The law is evaluated at the upper triangle R with R'R = C.
module stress_by_energy
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: inverse, beyond_one
  implicit none
  private
  public :: cairn_middle_stretch, cairn_stress_by_energy
contains

  !> R - 1 of n points.
  pure subroutine cairn_middle_stretch(n, begin, end, middle) bind(c)
    integer(c_int64_t), value   :: n               !< points
    real(c_double), intent(in)  :: begin(3, 3, n)  !< F - 1 at the begin of the step [-]
    real(c_double), intent(in)  :: end(3, 3, n)    !< at its end [-]
    real(c_double), intent(out) :: middle(3, 3, n) !< R - 1 [-]
    real(c_double) :: c(3, 3), r(3, 3), rest
    integer(c_int64_t) :: i
    integer :: j, k
    do i = 1, n
      c = 0.5_c_double*(beyond_one(begin(:, :, i)) + beyond_one(end(:, :, i)))
      r = 0
      do j = 1, 3
        rest = c(j, j) - dot_product(r(:j - 1, j), r(:j - 1, j))
        middle(j, j, i) = rest/(1 + sqrt(1 + rest))
        r(j, j) = 1 + middle(j, j, i)
        do k = j + 1, 3
          r(j, k) = (c(j, k) - dot_product(r(:j - 1, j), r(:j - 1, k)))/r(j, j)
          middle(j, k, i) = r(j, k)
          middle(k, j, i) = 0
        end do
      end do
    end do
  end subroutine cairn_middle_stretch

  !> Stress P of the step from the law's at R, and twice its derivative by F1, without terms that are unsymmetric and of higher
  !> order in the step.
  pure subroutine cairn_stress_by_energy(n, begin, end, middle, energy_begin, energy_end, want, piola, tangent) bind(c)
    integer(c_int64_t), value     :: n                      !< points
    real(c_double), intent(in)    :: begin(3, 3, n)         !< F - 1 at the begin of the step [-]
    real(c_double), intent(in)    :: end(3, 3, n)           !< at its end [-]
    real(c_double), intent(in)    :: middle(3, 3, n)        !< R - 1 [-]
    real(c_double), intent(in)    :: energy_begin(n)        !< [J/m3]
    real(c_double), intent(in)    :: energy_end(n)          !< [J/m3]
    integer(c_int32_t), value     :: want                   !< 1: the derivative too
    real(c_double), intent(inout) :: piola(3, 3, n)         !< in: of R; out: of the step [Pa]
    real(c_double), intent(inout) :: tangent(3, 3, 3, 3, n) !< in: its derivative by R [Pa]
    real(c_double) :: f(3, 3), back(3, 3), turn(3, 3), s(3, 3), material(3, 3), change(3, 3), left
    integer(c_int64_t) :: i
    do i = 1, n
      f = with_identity(0.5_c_double*(begin(:, :, i) + end(:, :, i)))
      back = inverse(with_identity(middle(:, :, i)))
      material = matmul(back, piola(:, :, i))
      material = 0.5_c_double*(material + transpose(material))
      change = matmul(transpose(f), end(:, :, i) - begin(:, :, i))
      change = change + transpose(change)
      left = energy_end(i) - energy_begin(i) - 0.5_c_double*sum(material*change)
      s = material
      ! a smaller remainder is rounding of the energies
      if (abs(left) > 4*epsilon(left)*(abs(energy_begin(i)) + abs(energy_end(i)))) s = s + (2*left/sum(change**2))*change
      piola(:, :, i) = matmul(f, s)
      if (want == 0) cycle
      turn = matmul(f, back)
      call turned(turn, material, s, tangent(:, :, :, :, i))
    end do
  end subroutine cairn_stress_by_energy

  !> A(a, J, b, L) = turn(a, i) turn(b, k) (A(i, J, k, L) - 1(i, k) material(J, L)) + 1(a, b) s(J, L).
  pure subroutine turned(turn, material, s, a)
    real(c_double), intent(in)    :: turn(3, 3), material(3, 3), s(3, 3)
    real(c_double), intent(inout) :: a(3, 3, 3, 3)
    integer :: j, l, m
    do m = 1, 3
      do l = 1, 3
        do j = 1, 3
          a(j, l, j, m) = a(j, l, j, m) - material(l, m)
        end do
        a(:, l, :, m) = matmul(turn, matmul(a(:, l, :, m), transpose(turn)))
        do j = 1, 3
          a(j, l, j, m) = a(j, l, j, m) + s(l, m)
        end do
      end do
    end do
  end subroutine turned

  pure function with_identity(h) result(f)
    real(c_double), intent(in) :: h(3, 3)
    real(c_double) :: f(3, 3)
    integer :: k
    f = h
    do k = 1, 3
      f(k, k) = f(k, k) + 1
    end do
  end function with_identity
end module stress_by_energy
