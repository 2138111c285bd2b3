!> The normal, gap and nearest points of two convex shapes, from what they reach. Apart: the point of the set of differences
!> nearest to 0 (Wolfe 1976; Gilbert, Johnson & Keerthi 1988). Overlapping: directions in which a move takes them apart, each
!> bettered by drawing them apart along it and looking for their nearest points, until the move is the shortest around.
module convex_axis
  use, intrinsic :: iso_c_binding, only: c_double
  use convex_shape, only: convex, guesses, is_cylinder, is_polyhedron, is_segment, is_superquadric, most_guesses, support
  use hull_distance, only: add_and_reduce, simplex
  use hull_patch, only: across
  implicit none
  private
  public :: axis_between, separation_along

  integer, parameter :: most_rounds = 40, most_draws = 20
  real(c_double), parameter :: rounding = 16*epsilon(1.0_c_double)
  !> Of the sizes together: the distance below which differences tell no direction; of the smaller size: how far bodies are drawn.
  real(c_double), parameter :: blind = 1e-7_c_double, drawn = 0.02_c_double
  real(c_double), parameter :: nearly = 0.02_c_double !< sine: edges that lean by less may be where a body is touched

contains

  !> Unit normal from b to a, which stands at `at` from b; gap along it; nearest points from the centre of b, layers left out.
  !> apart: the gap is more than the limit, and the rest is not found.
  subroutine axis_between(a, b, at, limit, n, gap, point_a, point_b, apart)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), limit
    real(c_double), intent(out) :: n(3), gap, point_a(3), point_b(3)
    logical, intent(out) :: apart
    real(c_double) :: extent, layers, flat, distance, d(3), m(3), trial, x(3), y(3)
    integer :: round
    extent = a%size + b%size
    layers = a%layer + b%layer
    point_a = at
    point_b = 0
    call best_guess(a, b, at, n, flat)
    gap = flat - layers
    apart = gap > limit
    if (apart) return
    call nearest(a, b, at, n, extent, distance, x, y)
    if (distance > drawn*smaller(a, b)) then
      apart = distance - layers > limit
      point_a = x
      point_b = y
      gap = distance - layers
      if (apart .or. distance <= flat + rounding*extent) return
      d = x - y
      n = d/sqrt(dot_product(d, d))
      distance = separation_along(a, b, at, n)
      call polish(a, b, at, extent, n, distance, point_a, point_b)
      gap = distance - layers
      return
    end if
    ! a gap too small for differences to tell the direction well, or an overlap
    if (distance > blind*extent) then
      d = x - y
      d = d/sqrt(dot_product(d, d))
      trial = separation_along(a, b, at, d)
      if (trial > flat + rounding*extent) then
        n = d
        flat = trial
      end if
    end if
    m = n
    trial = flat
    do round = 1, most_draws
      d = (max(drawn*smaller(a, b), 4*blind*extent) - trial)*m
      call nearest(a, b, at + d, m, extent, distance, x, y)
      if (round == 1) then
        point_a = x - d
        point_b = y
      end if
      if (.not. distance > 0) exit
      m = x - y
      m = m/sqrt(dot_product(m, m))
      trial = separation_along(a, b, at, m)
      if (.not. trial > flat + rounding*extent) exit
      n = m
      flat = trial
      point_a = x - d
      point_b = y
      call polish(a, b, at, extent, n, flat, point_a, point_b)
      m = n
      trial = flat
    end do
    call polish(a, b, at, extent, n, flat, point_a, point_b)
    gap = flat - layers
    apart = gap > limit
  end subroutine axis_between

  pure real(c_double) function smaller(a, b)
    type(convex), intent(in) :: a, b
    smaller = min(a%size, b%size)
    if (.not. smaller > 0) smaller = max(a%size, b%size)
    if (.not. smaller > 0) smaller = a%layer + b%layer
  end function smaller

  !> How far a, at `at` from b, is beyond b along n, layers left out.
  pure real(c_double) function separation_along(a, b, at, n)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), n(3)
    separation_along = dot_product(n, at + support(a, -n)) - dot_product(n, support(b, n))
  end function separation_along

  !> The best of the line of the centres, axes, faces, and what is across axes.
  subroutine best_guess(a, b, at, n, best)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3)
    real(c_double), intent(out) :: n(3), best
    real(c_double) :: d(3, most_guesses), e(3), f(3)
    integer :: k, count
    logical :: long_a, long_b
    best = -huge(best)
    n = [0.0_c_double, 0.0_c_double, 1.0_c_double]
    call try(at)
    call guesses(a, count, d)
    do k = 1, count
      call try(d(:, k))
    end do
    call guesses(b, count, d)
    do k = 1, count
      call try(d(:, k))
    end do
    long_a = a%kind == is_cylinder .or. a%kind == is_segment
    long_b = b%kind == is_cylinder .or. b%kind == is_segment
    e = a%frame(:, 3)
    f = b%frame(:, 3)
    if (long_a) call try(at - dot_product(at, e)*e)
    if (long_b) call try(at - dot_product(at, f)*f)
    if (long_a .and. long_b) then
      e = cross(e, f)
      call try(e)
      call try(-e)
    end if
    if (a%kind == is_polyhedron) then
      do k = 1, a%hull%faces
        call try(-a%hull%normal(k, :))
      end do
    end if
    if (b%kind == is_polyhedron) then
      do k = 1, b%hull%faces
        call try(b%hull%normal(k, :))
      end do
    end if
  contains
    subroutine try(w)
      real(c_double), intent(in) :: w(3)
      real(c_double) :: length, s, m(3)
      length = sqrt(dot_product(w, w))
      if (.not. length > 0) return
      m = w/length
      s = separation_along(a, b, at, m)
      if (s > best) then
        best = s
        n = m
      end if
    end subroutine try
  end subroutine best_guess

  !> Betters a normal: the largest separation is at a smooth top, or on a crest across a straight edge or side of one body, or
  !> where the crests of both cross. Keeps what is better only, and the points reached, where these are the nearest.
  subroutine polish(a, b, at, extent, n, best, point_a, point_b)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), extent
    real(c_double), intent(inout) :: n(3), best, point_a(3), point_b(3)
    real(c_double) :: of_a(3), of_b(3), x(3), y(3)
    logical :: a_is_straight, b_is_straight
    call straight_edge(a, -n, a_is_straight, of_a)
    call straight_edge(b, n, b_is_straight, of_b)
    call climb(a, b, at, extent, .false., of_a, (n), n, best)
    if (a_is_straight) call climb(a, b, at, extent, .true., of_a, n - dot_product(n, of_a)*of_a, n, best)
    if (b_is_straight) call climb(a, b, at, extent, .true., of_b, n - dot_product(n, of_b)*of_b, n, best)
    if (a_is_straight .and. b_is_straight) then
      x = cross(of_a, of_b)
      x = sign(1.0_c_double, dot_product(x, n))*x
      if (dot_product(x, x) > 1e-12_c_double) call climb(a, b, at, extent, .true., of_a, x, n, best)
    end if
    x = at + support(a, -n)
    y = support(b, n)
    if (maxval(abs(x - y - best*n)) > blind*extent) return
    point_a = x
    point_b = y
  end subroutine polish

  !> Newton's steps from m towards the largest separation, whose slope is the difference of what both reach across it; on a
  !> crest, among normals across `edge` alone.
  subroutine climb(a, b, at, extent, on_crest, edge, start, n, best)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), extent, edge(3), start(3)
    logical, intent(in) :: on_crest
    real(c_double), intent(inout) :: n(3), best
    real(c_double), parameter :: step = 1e-6_c_double
    real(c_double) :: t(3, 2), w(3), f(2), j(2, 2), m(3), here, trial, det, x(2)
    integer :: round, k
    m = start/sqrt(dot_product(start, start))
    here = separation_along(a, b, at, m)
    do round = 1, 10
      if (here > best) then
        best = here
        n = m
      end if
      call across(m, t(:, 1), t(:, 2))
      if (on_crest) t(:, 1) = cross(edge, m)
      w = at + support(a, -m) - support(b, m)
      f = matmul(w, t)
      do k = 1, 2
        j(:, k) = matmul(at + support(a, -m - step*t(:, k)) - support(b, m + step*t(:, k)) - w, t)/step
        j(k, k) = j(k, k) - here
      end do
      if (.not. j(1, 1) < 0) return ! no top
      if (on_crest) then
        x = [-f(1)/j(1, 1), 0.0_c_double]
      else
        det = j(1, 1)*j(2, 2) - j(1, 2)*j(2, 1)
        if (.not. det > 0) return
        x = -[f(1)*j(2, 2) - f(2)*j(1, 2), f(2)*j(1, 1) - f(1)*j(2, 1)]/det
      end if
      if (.not. dot_product(x, x) < 0.01_c_double) return
      m = m + x(1)*t(:, 1) + x(2)*t(:, 2)
      m = m/sqrt(dot_product(m, m))
      trial = separation_along(a, b, at, m)
      if (.not. trial > here - epsilon(here)*extent) return
      here = trial
      if (dot_product(x, x) < 1e-28_c_double) exit
    end do
    if (here > best) then
      best = here
      n = m
    end if
  end subroutine climb

  !> A straight edge or side of c that lies nearly across d where c reaches farthest along it: its unit direction.
  pure subroutine straight_edge(c, d, found, e)
    type(convex), intent(in) :: c
    real(c_double), intent(in) :: d(3)
    logical, intent(out) :: found
    real(c_double), intent(out) :: e(3)
    real(c_double) :: high, w(3), lean, least
    integer :: k
    e = c%frame(:, 3)
    found = (c%kind == is_cylinder .or. c%kind == is_segment) .and. abs(dot_product(e, d)) < nearly
    if (c%kind /= is_polyhedron) return
    high = dot_product(d, support(c, d))
    least = nearly
    do k = 1, c%hull%edges
      if (high - dot_product(d, c%hull%v(c%hull%edge(1, k), :)) > nearly*c%size) cycle
      if (high - dot_product(d, c%hull%v(c%hull%edge(2, k), :)) > nearly*c%size) cycle
      w = c%hull%v(c%hull%edge(2, k), :) - c%hull%v(c%hull%edge(1, k), :)
      w = w/sqrt(dot_product(w, w))
      lean = abs(dot_product(w, d))
      if (lean >= least) cycle
      least = lean
      e = w
      found = .true.
    end do
  end subroutine straight_edge

  pure function cross(a, b) result(c)
    real(c_double), intent(in) :: a(3), b(3)
    real(c_double) :: c(3)
    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Nearest points of a, at `at` from b, and b, from the centre of b; distance 0 where they overlap. Where a direction along
  !> which they are apart is known, rounding within a flat set of points does not make them overlap.
  subroutine nearest(a, b, at, start, extent, distance, point_a, point_b)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), start(3), extent
    real(c_double), intent(out) :: distance, point_a(3), point_b(3)
    type(simplex) :: s, before
    real(c_double) :: of_a(3, 0:most_rounds), of_b(3, 0:most_rounds), v(3), w(3), length, beyond, enough
    integer :: round, k

    enough = 0
    if (a%kind == is_superquadric .or. b%kind == is_superquadric) enough = 1e-8_c_double ! Newton's steps do the rest
    beyond = -huge(beyond)
    call reach(0, start)
    s%count = 1
    s%w(:, 1) = w
    s%share(1) = 1
    s%a(1) = 0
    v = w
    do round = 1, most_rounds
      length = sqrt(dot_product(v, v))
      if (length <= 8*epsilon(length)*extent) exit
      call reach(round, v)
      if (dot_product(v, v - w) <= max(4*epsilon(length)*extent, enough*length)*length) exit
      if (known()) exit
      beyond = max(beyond, dot_product(v, w)/length)
      before = s
      call add_and_reduce(s, round, round, w, v)
      if (s%count == 4 .and. beyond <= rounding*extent) exit
      if (s%count < 4 .and. dot_product(v, v) < length*length) cycle
      s = before ! rounding alone moves it now
      exit
    end do
    s%share(1:s%count) = s%share(1:s%count)/sum(s%share(1:s%count)) ! of flat sets they may not be shares of 1
    if (s%count < 4) v = matmul(s%w(:, 1:s%count), s%share(1:s%count))
    distance = sqrt(dot_product(v, v))
    if (s%count == 4 .or. distance <= 8*epsilon(distance)*extent) distance = 0
    point_a = 0
    point_b = 0
    do k = 1, s%count
      point_a = point_a + s%share(k)*of_a(:, s%a(k))
      point_b = point_b + s%share(k)*of_b(:, s%a(k))
    end do
    point_a = at + point_a
  contains
    subroutine reach(i, d)
      integer, intent(in) :: i
      real(c_double), intent(in) :: d(3)
      of_a(:, i) = support(a, -d)
      of_b(:, i) = support(b, d)
      w = at + (of_a(:, i) - of_b(:, i))
    end subroutine reach
    pure logical function known()
      integer :: i
      known = .false.
      do i = 1, s%count
        known = known .or. all(abs(s%w(:, i) - w) <= 0)
      end do
    end function known
  end subroutine nearest

end module convex_axis
