!> A film on both sides of a contact, in series with its spot: removed by sliding, broken down by the power it dissipates.
module oxide_film
  use, intrinsic :: iso_c_binding, only: c_int8_t, c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_film_conductance, cairn_film_break
contains

  !> C_s = C C_film/(C + C_film) where there is a film.
  pure subroutine cairn_film_conductance(n, film, clean, broken, conductance) bind(c)
    integer(c_int64_t), value       :: n              !< contacts
    real(c_double), value           :: film           !< conductance of the film [S]
    real(c_double), intent(in)      :: clean(n)       !< conductance of the spot [S]
    integer(c_int8_t), intent(in)   :: broken(n)      !< 1: the film is gone
    real(c_double), intent(out)     :: conductance(n) !< [S]
    integer(c_int64_t) :: i
    do i = 1, n
      conductance(i) = clean(i)
      if (broken(i) /= 0 .or. .not. clean(i) > 0) cycle
      conductance(i) = 0
      if (film > 0) conductance(i) = 1/(1/clean(i) + 1/film)
    end do
  end subroutine cairn_film_conductance

  !> Films whose power is beyond their threshold, power + ratio R F, go; none comes back here.
  pure subroutine cairn_film_break(n, power, ratio, radius, force, conductance, current, broken, switched) bind(c)
    integer(c_int64_t), value        :: n              !< contacts
    real(c_double), value            :: power          !< threshold [W]
    real(c_double), value            :: ratio          !< of it to effective radius times force [1/s]
    real(c_double), intent(in)       :: radius(n)      !< effective [m]
    real(c_double), intent(in)       :: force(n)       !< [N]
    real(c_double), intent(in)       :: conductance(n) !< [S]
    real(c_double), intent(in)       :: current(n)     !< [A]
    integer(c_int8_t), intent(inout) :: broken(n)      !< 1: the film is gone
    integer(c_int64_t), intent(out)  :: switched       !< how many went
    integer(c_int64_t) :: i
    switched = 0
    do i = 1, n
      if (broken(i) /= 0 .or. .not. conductance(i) > 0) cycle
      if (current(i)**2 < conductance(i)*(power + ratio*radius(i)*max(force(i), 0.0_c_double))) cycle
      broken(i) = 1
      switched = switched + 1
    end do
  end subroutine cairn_film_break
end module oxide_film
