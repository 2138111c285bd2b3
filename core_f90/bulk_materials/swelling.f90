!> Strain without a stress, all ways alike: F = (1 + s) Fe at large strains, eps = eps_e + s 1 at small ones. What a material
!> says of Fe, of a volume that swelled by (1 + s)^3, is handed on to F, so that the true stress is the material's own
!> (Lu & Pister 1975).
module swelling
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_without_swelling, cairn_with_swelling
contains

  !> Gradients of displacement become those that the material sees.
  pure subroutine cairn_without_swelling(large, n, free, gradient) bind(c)
    integer(c_int32_t), value     :: large             !< 1: large strains
    integer(c_int64_t), value     :: n                 !< points
    real(c_double), intent(in)    :: free(n)           !< strain without a stress [-]
    real(c_double), intent(inout) :: gradient(3, 3, n) !< F - 1, then Fe - 1 [-]
    integer(c_int64_t) :: i
    integer :: k
    do i = 1, n
      do k = 1, 3
        gradient(k, k, i) = gradient(k, k, i) - free(i)
      end do
      if (large /= 0) gradient(:, :, i) = gradient(:, :, i)/(1 + free(i))
    end do
  end subroutine cairn_without_swelling

  !> And back, with the stress that is conjugate to F, and its derivative; energies are of a volume before it swelled.
  pure subroutine cairn_with_swelling(large, n, free, gradient, piola, want, by_gradient, energy, dissipated) bind(c)
    integer(c_int32_t), value     :: large                !< 1: large strains
    integer(c_int64_t), value     :: n                    !< points
    real(c_double), intent(in)    :: free(n)              !< strain without a stress [-]
    real(c_double), intent(inout) :: gradient(3, 3, n)    !< Fe - 1, then F - 1 [-]
    real(c_double), intent(inout) :: piola(3, 3, n)       !< by Fe, then by F [Pa]
    integer(c_int32_t), value     :: want                 !< 1: the derivative too
    real(c_double), intent(inout) :: by_gradient(81, n)   !< of piola by Fe, then by F [Pa]
    real(c_double), intent(inout) :: energy(n)            !< [J/m3]
    real(c_double), intent(inout) :: dissipated(n)        !< [J/m3]
    real(c_double) :: stretch
    integer(c_int64_t) :: i
    integer :: k
    do i = 1, n
      stretch = 1 + free(i)
      if (large /= 0) then
        gradient(:, :, i) = gradient(:, :, i)*stretch
        piola(:, :, i) = piola(:, :, i)*stretch**2
        if (want /= 0) by_gradient(:, i) = by_gradient(:, i)*stretch
        energy(i) = energy(i)*stretch**3
        dissipated(i) = dissipated(i)*stretch**3
      end if
      do k = 1, 3
        gradient(k, k, i) = gradient(k, k, i) + free(i)
      end do
    end do
  end subroutine cairn_with_swelling
end module swelling
