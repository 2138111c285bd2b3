!> The direction along which two convex shapes are farthest apart, by Newton's steps from one nearby: to a smooth top of their
!> separation, or along the crest across a straight edge or side of one of them.
module convex_climb
  use, intrinsic :: iso_c_binding, only: c_double
  use convex_shape, only: bend, bow, convex
  use hull_patch, only: across
  implicit none
  private
  public :: climb

  integer, parameter :: most_steps = 12, most_returns = 3
  real(c_double), parameter :: widest = 0.3_c_double !< step
  real(c_double), parameter :: blunt = 1e-2_c_double !< of the sizes together: points farther apart are no top, whatever the gain
  real(c_double), parameter :: still = 1e-13_c_double !< of the sizes together: points so near across the normal are as good as one

contains

  !> Maximises the separation over unit normals n from b to a, which stands at `at` from b, from `start` (of any length). `best`:
  !> the separation; ends where it exceeds `limit`. On a crest, varies only normals across the unit vector `edge`. top: the maximum
  !> is reached to rounding and the separation falls on all sides; the support points are then within `slope` across n: rounding,
  !> unless the bodies are so sharp that the normal is uncertain as well. Support points along n are measured from the centre of b.
  pure subroutine climb(a, b, at, extent, limit, on_crest, edge, start, n, best, top, slope, point_a, point_b)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), extent, limit, edge(3), start(3)
    logical, intent(in) :: on_crest
    real(c_double), intent(out) :: n(3), best, slope, point_a(3), point_b(3)
    logical, intent(out) :: top
    real(c_double) :: m(3), t(3, 2), x(3), y(3), of_a(3), of_b(3), here, f(2), step(2), gain, least
    integer :: round, returns
    logical :: falls
    top = .false.
    m = start/sqrt(dot_product(start, start))
    n = m
    best = -huge(best)
    least = huge(least)
    slope = least
    point_a = at
    point_b = 0
    returns = 0
    step = 0
    t = 0
    do round = 1, most_steps
      if (round > 1) then
        m = step(1)*t(:, 1) + step(2)*t(:, 2)
        m = n + (m + bow(a, n, m) + bow(b, n, m))
        if (on_crest) m = m - dot_product(m, edge)*edge
      end if
      m = m/sqrt(dot_product(m, m))
      call frame_at(m, on_crest, edge, t, f) ! f is set below
      call bend(a, -m, t, x, of_a)
      call bend(b, m, t, y, of_b)
      x = at + x
      here = dot_product(m, x - y)
      if (here < best - 2*epsilon(here)*extent) then
        if (returns == most_returns .or. top) return
        returns = returns + 1
        step = step/4
        call frame_at(n, on_crest, edge, t, f)
        cycle
      end if
      n = m
      best = here
      if (here > limit) return
      point_a = x
      point_b = y
      x = x - y
      f = [dot_product(t(:, 1), x), dot_product(t(:, 2), x)]
      if (on_crest) f(2) = 0
      slope = maxval(abs(f))
      call newton(on_crest, f, of_a + of_b, here, step, gain, falls)
      top = falls .and. gain <= epsilon(gain)*extent .and. slope <= blunt*extent
      if (top .and. (slope <= still*extent .or. slope > least/2)) return
      least = min(least, slope)
    end do
  end subroutine climb

  pure subroutine frame_at(m, on_crest, edge, t, f)
    real(c_double), intent(in) :: m(3), edge(3)
    logical, intent(in) :: on_crest
    real(c_double), intent(out) :: t(3, 2), f(2)
    f = 0
    if (on_crest) then
      t(:, 1) = [edge(2)*m(3) - edge(3)*m(2), edge(3)*m(1) - edge(1)*m(3), edge(1)*m(2) - edge(2)*m(1)]
      t(:, 2) = edge
    else
      call across(m, t(:, 1), t(:, 2))
    end if
  end subroutine frame_at

  !> The step to the top of the parabola with slope f and curvature -(bent + here*1); shortened where it is long, and along the
  !> slope where there is no top.
  pure subroutine newton(on_crest, f, bent, here, step, gain, falls)
    logical, intent(in) :: on_crest
    real(c_double), intent(in) :: f(2), bent(3), here
    real(c_double), intent(out) :: step(2), gain
    logical, intent(out) :: falls
    real(c_double) :: p, q, r, det, middle, low, length
    p = bent(1) + here
    q = bent(2)
    r = bent(3) + here
    if (on_crest) then
      falls = p > 0
      step = 0
      step(1) = f(1)/p
      if (.not. falls) step(1) = sign(widest, f(1))
    else
      middle = (p + r)/2
      low = middle - sqrt(((p - r)/2)**2 + q*q) ! the least curvature
      falls = p > 0 .and. p*r - q*q > 0
      if (.not. low > 1e-3_c_double*middle) then
        low = max(abs(low), 0.1_c_double*abs(middle)) - low
        if (.not. falls) p = p + low
        if (.not. falls) r = r + low
      end if
      det = p*r - q*q
      step = [f(1)*r - f(2)*q, f(2)*p - f(1)*q]
      if (det > 0) step = step/det
    end if
    gain = (f(1)*step(1) + f(2)*step(2))/2
    length = sqrt(step(1)*step(1) + step(2)*step(2))
    if (length > widest) step = (widest/length)*step
  end subroutine newton

end module convex_climb
