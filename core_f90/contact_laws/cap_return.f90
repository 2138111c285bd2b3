!> Return to a tension cut-off, Coulomb's friction with cohesion and an elliptic cap, of one contact: impulses r and plastic
!> velocities y = q + C r with
!>   -T <= r_N,   |r_T| <= mu r_N + k,   r_N^2 + s |r_T|^2 <= R^2,
!> y along the normal for tension (y_N > 0) and cap (y = -l (r_N, s r_T)), at an angle for friction (y_T = -l r_T/|r_T|,
!> y_N = tan(psi) l). A crack that is open closes at r_N = 0 first.
!> At a given r_N the impulse r_T is that of a disk in the metric of C_TT, so that r_N is the root of one function: the plastic
!> velocity along the normal less the one that the surface allows.
module cap_return
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cap_limits, cap_flow, solve_limits

  type cap_limits
    real(c_double) :: tension   !< T [N s]
    real(c_double) :: cohesion  !< k [N s]
    real(c_double) :: friction  !< mu [-]
    real(c_double) :: cap       !< R [N s], the largest number: none
    real(c_double) :: shear     !< s [-]
    real(c_double) :: dilatancy !< tan(psi) [-], at most mu
    real(c_double) :: crack     !< width of a crack that closes freely, over the step [m/s]
  end type cap_limits

  type cap_flow
    real(c_double) :: opens = 0        !< crack [m/s]
    real(c_double) :: shuts = 0        !< crack [m/s]
    real(c_double) :: slip = 0         !< of friction [m/s]
    real(c_double) :: crush = 0        !< length of the flow under the cap [m/s]
    real(c_double) :: other = 0        !< along the normal, of dilatancy and cap [m/s]
    real(c_double) :: slips(2) = 0     !< along the tangents [m/s]
    real(c_double) :: normal_power = 0 !< of tension and cap along the normal [J]
    real(c_double) :: shear_power = 0  !< of cohesion and cap along the tangents [J]
  end type cap_flow

  integer, parameter :: by_friction = 1, by_cap = 2
contains

  pure subroutine solve_limits(c, w, q, limit, r, flow)
    integer(c_int32_t), intent(in)  :: c       !< components, 2 or 3
    real(c_double), intent(in)      :: w(c, c) !< C [1/kg]
    real(c_double), intent(in)      :: q(c)    !< velocity with r = 0 [m/s]
    type(cap_limits), intent(in)    :: limit
    real(c_double), intent(out)     :: r(c)    !< [N s]
    type(cap_flow), intent(out)     :: flow
    real(c_double) :: v(c), f, f_top, corner, most
    logical :: inside
    flow = cap_flow()
    v = q
    call within(c, w, v, limit, .not. limit%crack > 0, r, inside)
    if (inside) return
    if (limit%crack > 0) then
      f = excess(c, w, v, limit, by_friction, 0.0_c_double)
      if (f < 0 .and. f + limit%crack >= 0) then
        flow%shuts = -f
        call found(c, w, v, limit, by_friction, 0.0_c_double, r, flow)
        return
      end if
      if (f < 0) then
        flow%shuts = limit%crack
        v(1) = v(1) + limit%crack
      end if
      call within(c, w, v, limit, f < 0, r, inside)
      if (inside) return
    end if
    f = excess(c, w, v, limit, by_friction, -limit%tension)
    if (f >= 0) then
      flow%opens = f
      call found(c, w, v, limit, by_friction, -limit%tension, r, flow)
      return
    end if
    corner = corner_of(limit)
    if (corner > -limit%tension) then
      if (limit%cap < huge(corner)) then
        most = corner
      else
        most = far_enough(c, w, v, limit)
      end if
      f_top = excess(c, w, v, limit, by_friction, most)
      if (f_top >= 0) then
        call found(c, w, v, limit, by_friction, root(c, w, v, limit, by_friction, -limit%tension, most, f, f_top), r, flow)
        return
      end if
      if (.not. limit%cap < huge(corner)) then
        call found(c, w, v, limit, by_friction, most, r, flow)
        return
      end if
      f = f_top
      f_top = excess(c, w, v, limit, by_cap, corner)
      if (f_top >= 0 .or. .not. corner < limit%cap) then
        call between(c, w, v, limit, corner, r, flow)
        return
      end if
      f = f_top
    else
      corner = -limit%tension
      f = excess(c, w, v, limit, by_cap, corner)
    end if
    f_top = excess(c, w, v, limit, by_cap, limit%cap)
    most = limit%cap
    if (f < 0 .and. f_top > 0) most = root(c, w, v, limit, by_cap, corner, limit%cap, f, f_top)
    if (.not. f < 0) most = corner
    call found(c, w, v, limit, by_cap, most, r, flow)
  end subroutine solve_limits

  !> The elastic impulse, if it is within all limits.
  pure subroutine within(c, w, q, limit, may_press, r, inside)
    integer(c_int32_t), intent(in)  :: c          !< components
    real(c_double), intent(in)      :: w(c, c), q(c) !< [1/kg], [m/s]
    type(cap_limits), intent(in)    :: limit
    logical, intent(in)             :: may_press  !< no crack is open
    real(c_double), intent(out)     :: r(c)       !< [N s]
    logical, intent(out)            :: inside
    real(c_double), parameter :: rounding = 16*epsilon(1.0_c_double)
    real(c_double) :: a(c, c), f
    integer :: i, k
    a = w
    r = -q
    inside = .false.
    do k = 1, c ! w is symmetric and at least semidefinite
      if (.not. a(k, k) > rounding*w(k, k)) return
      do i = k + 1, c
        f = a(i, k)/a(k, k)
        a(i, k:) = a(i, k:) - f*a(k, k:)
        r(i) = r(i) - f*r(k)
      end do
    end do
    do k = c, 1, -1
      r(k) = (r(k) - dot_product(a(k, k + 1:), r(k + 1:)))/a(k, k)
    end do
    inside = r(1) >= -limit%tension .and. r(1) <= limit%cap .and. (may_press .or. r(1) <= 0)
    if (inside) inside = length(c - 1, r(2:)) <= min(radius(limit, by_friction, r(1)), radius(limit, by_cap, r(1)))
  end subroutine within

  !> Largest tangential impulse beside a normal one.
  pure real(c_double) function radius(limit, by, p)
    type(cap_limits), intent(in) :: limit
    integer, intent(in)          :: by !< which surface
    real(c_double), intent(in)   :: p  !< [N s]
    if (by == by_friction) then
      radius = max(0.0_c_double, limit%friction*p + limit%cohesion)
    else
      radius = huge(p)
      if (.not. (limit%cap < huge(p) .and. limit%shear > 0)) return
      radius = limit%cap/sqrt(limit%shear)
      if (p > 0) radius = sqrt(max(0.0_c_double, limit%cap - p))*(sqrt(limit%cap + p)/sqrt(limit%shear))
    end if
  end function radius

  !> Normal impulse where friction and cap meet.
  pure real(c_double) function corner_of(limit) result(p)
    type(cap_limits), intent(in) :: limit
    real(c_double) :: side, k, a
    p = limit%cap
    if (.not. limit%cap < huge(p)) return
    if (.not. limit%shear > 0) return
    side = limit%cap/sqrt(limit%shear)
    if (limit%cohesion >= side) then
      p = -huge(p)
      if (limit%friction > 0) p = (side - limit%cohesion)/limit%friction
      return
    end if
    k = limit%cohesion/limit%cap
    a = 1 + limit%shear*limit%friction**2
    p = limit%cap*((1 - limit%shear*k**2)/(limit%shear*limit%friction*k + &
                                           sqrt((limit%shear*limit%friction*k)**2 + a*(1 - limit%shear*k**2))))
  end function corner_of

  !> Tangential impulse and plastic velocities beside a normal impulse.
  pure subroutine beside(c, w, q, limit, by, p, t, y)
    integer(c_int32_t), intent(in) :: c          !< components
    real(c_double), intent(in)     :: w(c, c), q(c) !< [1/kg], [m/s]
    type(cap_limits), intent(in)   :: limit
    integer, intent(in)            :: by         !< which surface
    real(c_double), intent(in)     :: p          !< [N s]
    real(c_double), intent(out)    :: t(c - 1)   !< [N s]
    real(c_double), intent(out)    :: y(c)       !< [m/s]
    real(c_double) :: a(c - 1, c - 1), b(c - 1), rim
    integer :: k
    rim = radius(limit, by, p)
    a = w(2:, 2:) ! contiguous: the compiler would allocate a copy at each call
    b = q(2:) + w(2:, 1)*p
    call on_disk(c - 1, a, b, rim, t)
    y(2:) = b
    do k = 1, c - 1
      y(2:) = y(2:) + a(:, k)*t(k)
    end do
    if (length(c - 1, t) < rim*(1 - 8*epsilon(rim))) y(2:) = 0
    y(1) = q(1) + w(1, 1)*p + dot_product(w(1, 2:), t)
  end subroutine beside

  !> b + A t = -l t, |t| <= rim, l = 0 inside: Newton's method for l on 1/|t| from below (More & Sorensen 1983).
  pure subroutine on_disk(m, a, b, rim, t)
    integer, intent(in)         :: m       !< 1 or 2
    real(c_double), intent(in)  :: a(m, m) !< [1/kg]
    real(c_double), intent(in)  :: b(m)    !< [m/s]
    real(c_double), intent(in)  :: rim     !< [N s]
    real(c_double), intent(out) :: t(m)    !< [N s]
    real(c_double) :: mean, half, turn, e(2), g(2), x(2), cosine, sine, l, size, next, slope
    integer :: i
    t = 0
    if (.not. (rim > 0 .and. length(m, b) > 0)) return
    if (m == 1) then
      t(1) = -sign(min(rim, abs(b(1))/max(a(1, 1), abs(b(1))/huge(rim)*2, tiny(rim))), b(1))
      return
    end if
    mean = (a(1, 1) + a(2, 2))/2
    half = (a(1, 1) - a(2, 2))/2
    turn = 0.5_c_double*atan2(a(1, 2), half)
    cosine = cos(turn)
    sine = sin(turn)
    half = sqrt(half**2 + a(1, 2)**2)
    e = [mean + half, max(0.0_c_double, mean - half)]
    g = [cosine*b(1) + sine*b(2), cosine*b(2) - sine*b(1)]
    l = max(0.0_c_double, length(2, g)/rim - e(1))
    x = 0
    do i = 1, 60
      if (.not. minval(e + l) > 0) l = max(l, epsilon(l)*e(1), tiny(l))
      x = -g/(e + l)
      size = length(2, x)
      if (.not. size > rim) exit
      slope = (x(1)/size)**2/(e(1) + l) + (x(2)/size)**2/(e(2) + l)
      next = l + (size/rim - 1)/slope
      if (.not. next > l*(1 + 2*epsilon(l))) exit
      l = next
    end do
    if (size > rim) x = x*(rim/size)
    t = [cosine*x(1) - sine*x(2), sine*x(1) + cosine*x(2)]
  end subroutine on_disk

  !> Plastic velocity along the normal, less the one that the surface allows; of the cap times r_T, which leaves the sign.
  pure real(c_double) function excess(c, w, q, limit, by, p)
    integer(c_int32_t), intent(in) :: c          !< components
    real(c_double), intent(in)     :: w(c, c), q(c) !< [1/kg], [m/s]
    type(cap_limits), intent(in)   :: limit
    integer, intent(in)            :: by         !< which surface
    real(c_double), intent(in)     :: p          !< [N s]
    real(c_double) :: t(c - 1), y(c), slip
    call beside(c, w, q, limit, by, p, t, y)
    slip = length(c - 1, y(2:))
    if (by == by_friction) then
      excess = y(1) - limit%dilatancy*slip
    else
      excess = y(1)
      if (limit%shear > 0 .and. p > 0) excess = y(1)*(radius(limit, by, p)/limit%cap) + slip*((p/limit%cap)/limit%shear)
    end if
  end function excess

  !> A normal impulse beyond the root, where there is no cap: the disk grows with it.
  pure real(c_double) function far_enough(c, w, q, limit) result(p)
    integer(c_int32_t), intent(in) :: c          !< components
    real(c_double), intent(in)     :: w(c, c), q(c) !< [1/kg], [m/s]
    type(cap_limits), intent(in)   :: limit
    integer :: i
    p = (abs(q(1)) + length(c - 1, q(2:)))/w(1, 1) + limit%cohesion + limit%tension
    do i = 1, 200
      if (excess(c, w, q, limit, by_friction, p) >= 0) return
      p = 2*p
    end do
  end function far_enough

  !> Regula falsi, the end that stays halved (Illinois).
  pure real(c_double) function root(c, w, q, limit, by, from, to, f_from, f_to) result(p)
    integer(c_int32_t), intent(in) :: c          !< components
    real(c_double), intent(in)     :: w(c, c), q(c) !< [1/kg], [m/s]
    type(cap_limits), intent(in)   :: limit
    integer, intent(in)            :: by         !< which surface
    real(c_double), intent(in)     :: from, to   !< [N s]
    real(c_double), intent(in)     :: f_from, f_to !< below and above 0
    real(c_double) :: low, high, f_low, f_high, f, small
    integer :: i, side
    low = from
    high = to
    f_low = f_from
    f_high = f_to
    small = 4*epsilon(small)*(abs(q(1)) + length(c - 1, q(2:)))
    side = 0
    p = high
    do i = 1, 200
      if (.not. f_high > 0) exit
      p = (low*f_high - high*f_low)/(f_high - f_low)
      if (.not. (p > low .and. p < high)) p = low + (high - low)/2
      if (i > 60 .and. mod(i, 2) == 0) p = low + (high - low)/2
      if (.not. (p > low .and. p < high)) exit
      f = excess(c, w, q, limit, by, p)
      if (f < 0) then
        low = p
        f_low = f
        if (side < 0) f_high = f_high/2
        side = -1
      else
        high = p
        f_high = f
        if (side > 0) f_low = f_low/2
        side = 1
      end if
      if (abs(f) <= small + 4*epsilon(f)*(w(1, 1)*abs(p))) return
      if (high - low <= 4*epsilon(f)*max(abs(low), abs(high))) exit
    end do
    p = high
  end function root

  !> Impulse and flow at a normal impulse on one surface; opens and shuts are known.
  pure subroutine found(c, w, q, limit, by, p, r, flow)
    integer(c_int32_t), intent(in) :: c          !< components
    real(c_double), intent(in)     :: w(c, c), q(c) !< [1/kg], [m/s]
    type(cap_limits), intent(in)   :: limit
    integer, intent(in)            :: by         !< which surface
    real(c_double), intent(in)     :: p          !< [N s]
    real(c_double), intent(out)    :: r(c)       !< [N s]
    type(cap_flow), intent(inout)  :: flow
    real(c_double) :: y(c), slip
    r(1) = p
    call beside(c, w, q, limit, by, p, r(2:), y)
    slip = length(c - 1, y(2:))
    flow%slips(:c - 1) = y(2:)
    if (by == by_friction) then
      flow%slip = slip
      flow%other = limit%dilatancy*slip
    else
      if (p > 0) flow%other = min(0.0_c_double, y(1))
      flow%crush = length(2, [flow%other, slip])
    end if
    flow%normal_power = limit%tension*flow%opens - p*merge(flow%other, 0.0_c_double, by == by_cap)
    flow%shear_power = slip*merge(limit%cohesion, length(c - 1, r(2:)), by == by_friction)
  end subroutine found

  !> The same where friction and cap meet: the plastic velocity is a sum of both.
  pure subroutine between(c, w, q, limit, p, r, flow)
    integer(c_int32_t), intent(in) :: c          !< components
    real(c_double), intent(in)     :: w(c, c), q(c) !< [1/kg], [m/s]
    type(cap_limits), intent(in)   :: limit
    real(c_double), intent(in)     :: p          !< [N s]
    real(c_double), intent(out)    :: r(c)       !< [N s]
    type(cap_flow), intent(inout)  :: flow
    real(c_double) :: y(c), slip, size, along, cap(2)
    r(1) = p
    call beside(c, w, q, limit, by_friction, p, r(2:), y)
    slip = length(c - 1, y(2:))
    size = length(c - 1, r(2:))
    flow%slips(:c - 1) = y(2:)
    along = limit%shear*size ! the flow of the cap is l (-p, along)
    cap = 0
    if (p > 0) cap = (max(0.0_c_double, limit%dilatancy*slip - y(1))/(p + limit%dilatancy*along))*[p, along]
    if (cap(2) > slip .and. cap(2) > 0) cap = cap*[1.0_c_double, slip/cap(2)]
    flow%slip = slip - cap(2)
    flow%other = limit%dilatancy*flow%slip - cap(1)
    flow%crush = length(2, cap)
    flow%normal_power = p*cap(1)
    flow%shear_power = limit%cohesion*flow%slip + size*cap(2)
  end subroutine between

  pure real(c_double) function length(m, x)
    integer, intent(in)        :: m
    real(c_double), intent(in) :: x(m) !< any unit
    length = maxval(abs(x))
    if (m > 1 .and. length > 0) length = length*sqrt(sum((x/length)**2))
  end function length
end module cap_return
