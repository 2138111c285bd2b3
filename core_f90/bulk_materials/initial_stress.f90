!> Initial stress of a body: in the initial configuration the law sees a symmetric stretch U0 that gives this stress. At large
!> strains it sees Fe = F U0, at small ones eps + eps0, so that yield, tangent and energy are those of the total stress (Hoger
!> 1997). Energies are per volume of the initial configuration, 1/det U0 of the law's.
module initial_stress
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: determinant, inverse
  implicit none
  private
  public :: cairn_stretch_of_stress, cairn_with_prestretch, cairn_without_prestretch
  integer, parameter :: first(6) = [1, 2, 3, 1, 1, 2], second(6) = [1, 2, 3, 2, 3, 3] ! as stresses are given
contains

  !> A step of Newton's method towards the stretch at which the true stress is the one asked for.
  pure subroutine cairn_stretch_of_stress(large, n, stress, piola, by_gradient, stretch, left) bind(c)
    integer(c_int32_t), value     :: large                !< 1: large strains
    integer(c_int64_t), value     :: n                    !< points
    real(c_double), intent(in)    :: stress(6, n)         !< asked for, 11 22 33 12 13 23 [Pa]
    real(c_double), intent(in)    :: piola(3, 3, n)       !< of the law at this stretch [Pa]
    real(c_double), intent(in)    :: by_gradient(3, 3, 3, 3, n) !< of piola(i, j) by F(k, l) [Pa]
    real(c_double), intent(inout) :: stretch(3, 3, n)     !< U0 - 1, small strains: eps0 [-]
    real(c_double), intent(out)   :: left(n)              !< largest part of the stress that was not met [Pa]; < 0: no step is known
    real(c_double) :: u(3, 3), back(3, 3), true(3, 3), change(3, 3), by(3, 3), a(6, 6), b(6), size
    integer(c_int64_t) :: i
    integer :: k, m
    logical :: singular
    do i = 1, n
      u = 0
      do k = 1, 3
        u(k, k) = 1
      end do
      back = u
      size = 1
      if (large /= 0) then
        u = u + stretch(:, :, i)
        size = determinant(u)
        back = inverse(u)
      end if
      true = matmul(piola(:, :, i), transpose(u))/size
      do k = 1, 6
        b(k) = stress(k, i) - 0.5_c_double*(true(first(k), second(k)) + true(second(k), first(k)))
        change = 0
        change(first(k), second(k)) = 1
        change(second(k), first(k)) = 1
        do m = 1, 3
          by(:, m) = [sum(by_gradient(1, m, :, :, i)*change), sum(by_gradient(2, m, :, :, i)*change), &
                      sum(by_gradient(3, m, :, :, i)*change)]
        end do
        by = matmul(by, transpose(u))/size
        if (large /= 0) by = by + matmul(piola(:, :, i), change)/size - sum(back*change)*true
        do m = 1, 6
          a(m, k) = 0.5_c_double*(by(first(m), second(m)) + by(second(m), first(m)))
        end do
      end do
      left(i) = maxval(abs(b))
      call solve(a, b, singular)
      if (singular) then
        left(i) = -1
        cycle
      end if
      if (large /= 0) b = b*min(1.0_c_double, 0.25_c_double/max(maxval(abs(b)), tiny(size))) ! so that volumes stay
      do k = 1, 6
        stretch(first(k), second(k), i) = stretch(first(k), second(k), i) + b(k)
        if (k > 3) stretch(second(k), first(k), i) = stretch(first(k), second(k), i)
      end do
    end do
  end subroutine cairn_stretch_of_stress

  !> b becomes the solution of a b, with rows exchanged by the largest entry.
  pure subroutine solve(a, b, singular)
    real(c_double), intent(inout) :: a(6, 6), b(6)
    logical, intent(out)          :: singular
    real(c_double) :: size, row(6), kept
    integer :: k, m, at
    size = maxval(abs(a))
    singular = .true.
    do k = 1, 6
      at = k - 1 + maxloc(abs(a(k:, k)), 1)
      if (.not. abs(a(at, k)) > 1e-14_c_double*size) return
      row = a(k, :)
      a(k, :) = a(at, :)
      a(at, :) = row
      kept = b(k)
      b(k) = b(at)
      b(at) = kept
      do m = k + 1, 6
        b(m) = b(m) - a(m, k)/a(k, k)*b(k)
        a(m, :) = a(m, :) - a(m, k)/a(k, k)*a(k, :)
      end do
    end do
    do k = 6, 1, -1
      b(k) = (b(k) - sum(a(k, k + 1:)*b(k + 1:)))/a(k, k)
    end do
    singular = .false.
  end subroutine solve

  !> Gradients of displacement become those that the law sees.
  pure subroutine cairn_with_prestretch(large, n, stretch, gradient) bind(c)
    integer(c_int32_t), value     :: large             !< 1: large strains
    integer(c_int64_t), value     :: n                 !< points
    real(c_double), intent(in)    :: stretch(3, 3, n)  !< U0 - 1 [-]
    real(c_double), intent(inout) :: gradient(3, 3, n) !< F - 1, then Fe - 1 [-]
    integer(c_int64_t) :: i
    do i = 1, n
      if (large /= 0) then
        gradient(:, :, i) = gradient(:, :, i) + stretch(:, :, i) + matmul(gradient(:, :, i), stretch(:, :, i))
      else
        gradient(:, :, i) = gradient(:, :, i) + stretch(:, :, i)
      end if
    end do
  end subroutine cairn_with_prestretch

  !> The inverse: stress conjugate to F, its derivative, and energies per reference volume.
  pure subroutine cairn_without_prestretch(large, n, stretch, piola, want, by_gradient, energy, dissipated) bind(c)
    integer(c_int32_t), value     :: large                !< 1: large strains
    integer(c_int64_t), value     :: n                    !< points
    real(c_double), intent(in)    :: stretch(3, 3, n)     !< U0 - 1 [-]
    real(c_double), intent(inout) :: piola(3, 3, n)       !< by Fe, then by F [Pa]
    integer(c_int32_t), value     :: want                 !< 1: the derivative too
    real(c_double), intent(inout) :: by_gradient(3, 3, 3, 3, n) !< of piola by Fe, then by F [Pa]
    real(c_double), intent(inout) :: energy(n)            !< [J/m3]
    real(c_double), intent(inout) :: dissipated(n)        !< [J/m3]
    real(c_double) :: u(3, 3), size
    integer(c_int64_t) :: i
    integer :: k, l, m
    if (large == 0) return
    do i = 1, n
      u = stretch(:, :, i)
      do k = 1, 3
        u(k, k) = u(k, k) + 1
      end do
      size = determinant(u)
      piola(:, :, i) = matmul(piola(:, :, i), u)/size
      energy(i) = energy(i)/size
      dissipated(i) = dissipated(i)/size
      if (want == 0) cycle
      do m = 1, 3
        do l = 1, 3
          by_gradient(:, :, l, m, i) = matmul(by_gradient(:, :, l, m, i), u)/size
        end do
      end do
      do l = 1, 3
        do k = 1, 3
          by_gradient(:, k, l, :, i) = matmul(by_gradient(:, k, l, :, i), u)
        end do
      end do
    end do
  end subroutine cairn_without_prestretch
end module initial_stress
