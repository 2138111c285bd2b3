!> Linear response of contacts of any law to a change of velocity, from the law's local solution. With the block w of a contact, its
!> velocity u and impulse r, the law wants r* = solve(w, q) at q = u - w r. Where that is linear, r* = target - G (q' - q), and an
!> impulse is its own answer where
!>   dr = known - answer du,   answer = (1 - G w)^-1 G,   known = (1 - G w)^-1 (r* - r):
!> for a spring K between the bodies, answer is K; for a rigid constraint it is unbounded, so the proximal term increases 1
!> slightly. Certain constraints have G w = 1 exactly, where differences give 1 - G w to 1e-10 at best.
module contact_responses
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_contact_nudges, cairn_contact_responses
  integer, parameter :: most = 6
  real(c_double), parameter :: nudge = 2.0_c_double**(-16)  !< share of the velocities at hand by which q is changed
  real(c_double), parameter :: least = 2.0_c_double**(-10)  !< of the largest velocity of the step, of what rests
  real(c_double), parameter :: known_share = 2.0_c_double**(-30) !< to which differences know how fast something is held
  real(c_double), parameter :: skew = 0.25_c_double !< share of an answer that is not symmetric, beyond which it is a cone's
contains

  !> By how much each component of q is changed to see what the law makes of it.
  subroutine cairn_contact_nudges(n, c, axes, w, q, r, speed, nudges) bind(c)
    integer(c_int32_t), value   :: n            !< contacts
    integer(c_int32_t), value   :: c            !< components
    integer(c_int32_t), value   :: axes         !< of them that are no spin
    real(c_double), intent(in)  :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)  :: q(n, c)      !< velocity without the contact's own impulse [m/s]
    real(c_double), intent(in)  :: r(n, c)      !< impulse [N s]
    real(c_double), value       :: speed        !< largest of the step [m/s]
    real(c_double), intent(out) :: nudges(n, c) !< [m/s]
    real(c_double) :: shift(c), spin
    integer :: i, k
    do i = 1, n
      do k = 1, c
        shift(k) = max(abs(q(i, k)), maxval(abs(w(i, k, :)*r(i, :))))
      end do
      nudges(i, :axes) = nudge*max(maxval(shift(:axes)), least*speed)
      if (c == axes) cycle
      ! a spin is as large as that speed would make it by its inertia
      do k = axes + 1, c
        spin = 0
        if (w(i, 1, 1) > 0) spin = nudges(i, 1)*sqrt(w(i, k, k)/w(i, 1, 1))
        nudges(i, k) = max(nudge*maxval(shift(axes + 1:)), spin)
      end do
    end do
  end subroutine cairn_contact_nudges

  !> Answers of contacts, symmetric and not negative, so that the matrix of bodies is positive definite. What slides answers along
  !> its normal alone; what softens, as if it did not.
  subroutine cairn_contact_responses(n, c, contacts, proximal, held, w, r, target, nudged, nudges, answer, known) &
    bind(c)
    integer(c_int32_t), value   :: n               !< contacts, dummies included
    integer(c_int32_t), value   :: c               !< components
    integer(c_int32_t), value   :: contacts        !< that are not dummies
    real(c_double), value       :: proximal        !< increase of 1; 2^-30 at least, if any, where not certainly held
    integer(c_int32_t), intent(in) :: held(n)      !< 1: held for certain, and r* = -G q
    real(c_double), intent(in)  :: w(n, c, c)      !< Delassus blocks [1/kg]
    real(c_double), intent(in)  :: r(n, c)         !< impulse [N s]
    real(c_double), intent(in)  :: target(n, c)    !< that the law wants [N s]
    real(c_double), intent(in)  :: nudged(n, c, c) !< the same with component l of q changed, in (:, :, l); if held, at
    !< that change alone [N s]
    real(c_double), intent(in)  :: nudges(n, c)    !< by so much [m/s]
    real(c_double), intent(out) :: answer(c, c, n) !< [kg]
    real(c_double), intent(out) :: known(c, n)     !< [N s]
    real(c_double) :: g(most, most), block(most, most), m(most, most), right(most, most + 1), begun(c), share
    integer :: i, k, l
    answer = 0
    known = 0
    do i = 1, contacts
      g = 0
      begun = merge(0.0_c_double, target(i, :), held(i) > 0)
      do l = 1, c
        if (nudges(i, l) > 0) g(:c, l) = (begun - nudged(i, :, l))/nudges(i, l)
        block(:c, l) = w(i, :, l)
      end do
      m(:c, :c) = -matmul(g(:c, :c), block(:c, :c))
      share = merge(proximal, max(proximal, merge(known_share, 0.0_c_double, proximal > 0)), held(i) > 0)
      if (held(i) > 0) m(:c, :c) = 0
      do k = 1, c
        m(k, k) = m(k, k) + merge(0, 1, held(i) > 0) + share
      end do
      right(:c, :c) = g(:c, :c)
      right(:c, c + 1) = target(i, :) - r(i, :)
      call eliminate(c, m, right)
      if (symmetric(c, right)) then
        do l = 1, c
          do k = 1, c
            answer(k, l, i) = (right(k, l) + right(l, k))/2
          end do
        end do
        known(:, i) = right(:c, c + 1)
      else if (g(1, 1) > 0) then
        m(1, 1) = max(0.0_c_double, 1 - g(1, 1)*block(1, 1)) + share
        answer(1, 1, i) = g(1, 1)/m(1, 1)
        known(1, i) = (target(i, 1) - r(i, 1))/m(1, 1)
      end if
    end do
  end subroutine cairn_contact_responses

  pure logical function symmetric(c, a)
    integer(c_int32_t), intent(in) :: c
    real(c_double), intent(in)     :: a(most, most)
    integer :: k, l
    symmetric = .true.
    do l = 1, c
      do k = 1, l - 1
        symmetric = symmetric .and. abs(a(k, l) - a(l, k)) <= skew*(sqrt(abs(a(k, k)))*sqrt(abs(a(l, l))))
      end do
    end do
  end function symmetric

  !> right <- m^-1 right, with the largest pivot of each column.
  pure subroutine eliminate(c, m, right)
    integer(c_int32_t), intent(in) :: c
    real(c_double), intent(inout)  :: m(most, most), right(most, most + 1)
    real(c_double) :: line(most), line_right(most + 1), factor
    integer :: k, p, i
    do k = 1, c
      p = k
      do i = k + 1, c
        if (abs(m(i, k)) > abs(m(p, k))) p = i
      end do
      line(:c) = m(p, :c)
      line_right(:c + 1) = right(p, :c + 1)
      m(p, :c) = m(k, :c)
      right(p, :c + 1) = right(k, :c + 1)
      m(k, :c) = line(:c)/line(k)
      right(k, :c + 1) = line_right(:c + 1)/line(k)
      do i = 1, c
        if (i == k) cycle
        factor = m(i, k)
        m(i, :c) = m(i, :c) - factor*m(k, :c)
        right(i, :c + 1) = right(i, :c + 1) - factor*right(k, :c + 1)
      end do
    end do
  end subroutine eliminate
end module contact_responses
