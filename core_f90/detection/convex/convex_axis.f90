!> Normal, gap and nearest points of two convex shapes, from their support functions: separating axes from a list of guesses,
!> improved by Newton's method until optimality is proved. Without proof: the point of the Minkowski difference nearest to 0 (Wolfe
!> 1976; Gilbert, Johnson & Keerthi 1988). For overlapping bodies: local minima of the penetration depth, each improved by
!> separating the bodies along the axis and finding their nearest points, until the translation is the shortest around.
module convex_axis
  use, intrinsic :: iso_c_binding, only: c_double
  use convex_climb, only: climb
  use convex_shape, only: convex, guesses, is_cylinder, is_point, is_polyhedron, is_segment, is_superquadric, most_guesses, &
    reach, support
  use convex_top, only: meet_across
  use hull_distance, only: add_and_reduce, simplex
  use hull_view, only: solid
  implicit none
  private
  public :: axis_between, separation_along

  integer, parameter :: most_rounds = 40, most_draws = 20
  real(c_double), parameter :: rounding = 16*epsilon(1.0_c_double)
  !> blind: distance below which differences define no direction, relative to the sum of sizes. drawn: distance by which bodies are
  !> separated; deep: overlap that counts as deep; both relative to the smaller size.
  real(c_double), parameter :: blind = 1e-7_c_double, drawn = 0.02_c_double, deep = 0.03_c_double
  !> Largest offset across the normal of two points that meet, relative to the smaller size.
  real(c_double), parameter :: slack = 1e-10_c_double
  real(c_double), parameter :: nearly = 0.02_c_double !< sine: edges that lean by less may be where a body is touched

contains

  !> Unit normal from b to a, which stands at `at` from b; gap along it; nearest points from the centre of b, layers left out.
  !> apart: the gap is more than the limit, and the rest is not found.
  subroutine axis_between(a, b, at, limit, n, gap, point_a, point_b, apart)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), limit
    real(c_double), intent(out) :: n(3), gap, point_a(3), point_b(3)
    logical, intent(out) :: apart
    real(c_double) :: extent, layers, flat
    logical :: known
    extent = a%size + b%size
    layers = a%layer + b%layer
    point_a = at
    point_b = 0
    call smooth_top(a, b, at, extent, limit + layers, n, flat, point_a, point_b, known)
    apart = flat - layers > limit
    if (.not. (apart .or. known)) then
      call best_guess(a, b, at, limit + layers, n, flat)
      apart = flat - layers > limit
    end if
    if (.not. (apart .or. known)) then
      call at_once(a, b, at, extent, limit + layers, n, flat, point_a, point_b, known)
      if (flat < -deep*smaller(a, b)) call beyond_edges(a, b, at, extent, limit + layers, n, flat, point_a, point_b, known)
      apart = flat - layers > limit
      if (.not. (apart .or. known)) call search(a, b, at, extent, limit + layers, n, flat, point_a, point_b)
    end if
    gap = flat - layers
    apart = gap > limit
  end subroutine axis_between

  !> Where no body has edges, from the line of the centres, or across the side of one that has its axis beside the other's
  !> centre. The top is not known for the highest if the overlap is deep.
  subroutine smooth_top(a, b, at, extent, limit, n, best, point_a, point_b, known)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), extent, limit
    real(c_double), intent(out) :: n(3), best, point_a(3), point_b(3)
    logical, intent(out) :: known
    real(c_double) :: slope, along, start(3), x(3), y(3)
    logical :: across_side, sharp
    known = .false.
    best = -huge(best)
    n = 0
    point_a = at
    point_b = 0
    start = at
    across_side = .false.
    if ((a%kind == is_segment .or. a%kind == is_cylinder) .and. b%kind == is_superquadric) then
      along = -dot_product(at, a%frame(:, 3))
      across_side = abs(along) < a%half(3)
      if (a%kind == is_cylinder .and. .not. across_side) return
      start = at + max(-a%half(3), min(a%half(3), along))*a%frame(:, 3)
    else if (.not. (is_smooth(a) .and. is_smooth(b))) then
      return
    end if
    if (.not. dot_product(start, start) > 0) return
    call climb(a, b, at, extent, limit, across_side, a%frame(:, 3), start, n, best, known, slope, x, y)
    known = known .and. best > -drawn*smaller(a, b)
    if (known .and. .not. is_smooth(a)) &
      call meet_across(a, b, at, n, extent, max(room_of(a, b, extent), 2*slope), known, sharp, x, y)
    point_a = x
    point_b = y
  end subroutine smooth_top

  !> How far points may be apart across the normal and be the nearest.
  pure real(c_double) function room_of(a, b, extent)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: extent
    room_of = slack*smaller(a, b) + 4*rounding*extent
  end function room_of

  pure logical function is_smooth(c)
    type(convex), intent(in) :: c
    is_smooth = c%kind == is_point .or. c%kind == is_superquadric
  end function is_smooth

  !> The axis where a guess, or a top near it or near the line of the nearest points, can be proved to be the best around.
  subroutine at_once(a, b, at, extent, limit, n, best, point_a, point_b, known)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), extent, limit
    real(c_double), intent(inout) :: n(3), best, point_a(3), point_b(3)
    logical, intent(out) :: known
    real(c_double) :: x(3), y(3), d(3), m(3), distance, trial
    logical :: sharp
    integer :: round
    call meet_across(a, b, at, n, extent, room_of(a, b, extent), known, sharp, x, y)
    known = known .and. (sharp .or. best > 1000*room_of(a, b, extent)) ! else the offset across the normal matters
    if (known) then
      point_a = x
      point_b = y
      return
    end if
    if (a%kind /= is_polyhedron .and. b%kind /= is_polyhedron) then
      call polish(a, b, at, extent, limit, n, best, point_a, point_b, known)
      if (known .or. best > limit) return
    end if
    do round = 1, 2
      d = max(drawn*smaller(a, b) - best, 0.0_c_double)*n
      call nearest(a, b, at + d, n, extent, 1e-2_c_double, distance, x, y)
      if (.not. distance > blind*extent) return
      m = x - y
      m = m/sqrt(dot_product(m, m))
      trial = separation_along(a, b, at, m)
      if (trial > best + rounding*extent) then
        n = m
        best = trial
      end if
      if (best > limit) return
      call polish(a, b, at, extent, limit, n, best, point_a, point_b, known)
      if (known .or. best > limit) return
    end do
  end subroutine at_once

  !> Climbs from every edge of a polyhedron deep in a body with sides or faces, since the shortest translation may be across any of
  !> them. A better axis found so is no longer proved to be the best.
  subroutine beyond_edges(a, b, at, extent, limit, n, best, point_a, point_b, known)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), extent, limit
    real(c_double), intent(inout) :: n(3), best, point_a(3), point_b(3)
    logical, intent(inout) :: known
    real(c_double) :: before
    before = best
    if (a%kind == is_polyhedron) call climb_all(a%hull, -1.0_c_double)
    if (b%kind == is_polyhedron) call climb_all(b%hull, 1.0_c_double)
    if (best > before) call polish(a, b, at, extent, limit, n, best, point_a, point_b, known)
  contains
    subroutine climb_all(p, sense)
      type(solid), intent(in) :: p
      real(c_double), intent(in) :: sense
      real(c_double) :: m(3), e(3), x(3), y(3), trial, slope
      logical :: top
      integer :: k
      do k = 1, p%edges
        e = p%normal(p%edge(3, k), :)
        m = p%normal(p%edge(4, k), :)
        m = sense*(m + e)
        if (.not. dot_product(m, at) > 0) cycle
        e = p%v(p%edge(2, k), :)
        e = e - p%v(p%edge(1, k), :)
        e = e/sqrt(dot_product(e, e))
        call climb(a, b, at, extent, limit, .true., e, m - dot_product(m, e)*e, x, trial, top, slope, y, m)
        if (.not. trial > best + rounding*extent) cycle
        best = trial
        n = x
      end do
    end subroutine climb_all
  end subroutine beyond_edges

  !> The same by exhaustive search, at any cost.
  subroutine search(a, b, at, extent, limit, n, flat, point_a, point_b)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), extent, limit
    real(c_double), intent(inout) :: n(3), flat, point_a(3), point_b(3)
    real(c_double) :: distance, d(3), m(3), trial, x(3), y(3), enough
    logical :: known
    integer :: round
    enough = 0
    if (a%kind == is_superquadric .or. b%kind == is_superquadric) enough = 1e-8_c_double ! Newton's steps do the rest
    call nearest(a, b, at, n, extent, enough, distance, x, y)
    if (distance > drawn*smaller(a, b)) then
      point_a = x
      point_b = y
      if (distance > limit) flat = distance
      if (distance > limit .or. distance <= flat + rounding*extent) return
      d = x - y
      n = d/sqrt(dot_product(d, d))
      flat = separation_along(a, b, at, n)
      call polish(a, b, at, extent, limit, n, flat, point_a, point_b, known)
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
      call nearest(a, b, at + d, m, extent, enough, distance, x, y)
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
      call polish(a, b, at, extent, limit, n, flat, point_a, point_b, known)
      if (known) return
      m = n
      trial = flat
    end do
    call polish(a, b, at, extent, limit, n, flat, point_a, point_b, known)
  end subroutine search

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
    separation_along = dot_product(n, at) - reach(a, -n) - reach(b, n)
  end function separation_along

  !> Best separating axis among the line of centres, axes, faces, and cross products of axes; or the first that exceeds the limit.
  subroutine best_guess(a, b, at, limit, n, best)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), limit
    real(c_double), intent(out) :: n(3), best
    real(c_double) :: d(3, most_guesses), e(3), f(3)
    integer :: k, count
    logical :: long_a, long_b
    best = -huge(best)
    n = [0.0_c_double, 0.0_c_double, 1.0_c_double]
    call try(at)
    if (best > limit) return
    call guesses(a, count, d)
    do k = 1, count/2 ! the others are their opposites
      call try(d(:, k))
    end do
    call guesses(b, count, d)
    do k = 1, count/2 ! the others are their opposites
      call try(d(:, k))
    end do
    if (best > limit) return
    long_a = a%kind == is_cylinder .or. a%kind == is_segment
    long_b = b%kind == is_cylinder .or. b%kind == is_segment
    e = a%frame(:, 3)
    f = b%frame(:, 3)
    if (long_a) call try(at - dot_product(at, e)*e)
    if (long_b) call try(at - dot_product(at, f)*f)
    if (long_a .and. long_b) call try(cross(e, f))
    if (a%kind == is_polyhedron) call try_faces(a%hull, b, -1.0_c_double)
    if (b%kind == is_polyhedron) call try_faces(b%hull, a, 1.0_c_double)
  contains
    !> The way it looks from b to a.
    subroutine try(w)
      real(c_double), intent(in) :: w(3)
      real(c_double) :: length, m(3)
      length = sqrt(dot_product(w, w))
      if (.not. length > 0) return
      m = w/length
      if (dot_product(m, at) < 0) m = -m
      call weigh(m, separation_along(a, b, at, m))
    end subroutine try
    !> Along the outward normals of p, which look along sense*n. The other is around its own centre, so none is farther than that.
    subroutine try_faces(p, other, sense)
      type(solid), intent(in) :: p
      type(convex), intent(in) :: other
      real(c_double), intent(in) :: sense
      real(c_double) :: m(3), s
      do k = 1, p%faces
        m = sense*p%normal(k, :)
        s = dot_product(m, at) - p%offset(k)
        if (s > best) s = s - reach(other, -sense*m)
        call weigh(m, s)
      end do
    end subroutine try_faces
    subroutine weigh(m, s)
      real(c_double), intent(in) :: m(3), s
      if (.not. s > best) return
      best = s
      n = m
    end subroutine weigh
  end subroutine best_guess

  !> Improves a normal: the largest separation is at a smooth maximum, on a crest across a straight edge or side of either body, or
  !> where the crests of both cross. Keeps improvements only, with the support points if these are the nearest points; known: proved
  !> to be.
  subroutine polish(a, b, at, extent, limit, n, best, point_a, point_b, known)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), extent, limit
    real(c_double), intent(inout) :: n(3), best, point_a(3), point_b(3)
    logical, intent(out) :: known
    real(c_double) :: of_a(3), of_b(3), x(3), y(3)
    real(c_double) :: slope
    logical :: a_is_straight, b_is_straight, top
    call straight_edge(a, -n, a_is_straight, of_a)
    call straight_edge(b, n, b_is_straight, of_b)
    known = .false.
    if (a_is_straight .and. b_is_straight) then
      x = cross(of_a, of_b)
      x = sign(1.0_c_double, dot_product(x, n))*x
      top = .false.
      if (dot_product(x, x) > 1e-12_c_double) &
        call weigh(x/sqrt(dot_product(x, x)), separation_along(a, b, at, x)/sqrt(dot_product(x, x)))
      if (known .or. best > limit) return
    end if
    if (a_is_straight) call try(.true., of_a, n - dot_product(n, of_a)*of_a)
    if (known .or. best > limit) return
    if (b_is_straight) call try(.true., of_b, n - dot_product(n, of_b)*of_b)
    if (known .or. best > limit) return
    call try(.false., of_a, n)
    if (known .or. best > limit) return
    x = at + support(a, -n)
    y = support(b, n)
    if (maxval(abs(x - y - best*n)) > blind*extent) return
    point_a = x
    point_b = y
  contains
    subroutine try(on_crest, edge, start)
      logical, intent(in) :: on_crest
      real(c_double), intent(in) :: edge(3), start(3)
      real(c_double) :: m(3), trial
      call climb(a, b, at, extent, limit, on_crest, edge, start, m, trial, top, slope, x, y)
      call weigh(m, trial)
    end subroutine try
    subroutine weigh(m, trial)
      real(c_double), intent(in) :: m(3), trial
      real(c_double) :: room
      logical :: sharp
      if (trial < best - rounding*extent) return
      room = room_of(a, b, extent)
      if (top) room = max(room, 2*slope)
      if (is_smooth(a) .and. is_smooth(b)) then
        known = top
      else
        call meet_across(a, b, at, m, extent, room, known, sharp, x, y)
        known = known .and. (top .or. sharp)
      end if
      if (.not. (known .or. trial > best)) return
      n = m
      best = trial
      if (.not. known) return
      point_a = x
      point_b = y
    end subroutine weigh
  end subroutine polish

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
  subroutine nearest(a, b, at, start, extent, enough, distance, point_a, point_b)
    type(convex), intent(in) :: a, b
    real(c_double), intent(in) :: at(3), start(3), extent
    real(c_double), intent(in) :: enough !< of the distance, how far it may be from the least
    real(c_double), intent(out) :: distance, point_a(3), point_b(3)
    type(simplex) :: s, before
    real(c_double) :: of_a(3, 0:most_rounds), of_b(3, 0:most_rounds), v(3), w(3), length, beyond
    integer :: round, k

    beyond = -huge(beyond)
    call difference(0, start)
    s%count = 1
    s%w(:, 1) = w
    s%share(1) = 1
    s%a(1) = 0
    v = w
    do round = 1, most_rounds
      length = sqrt(dot_product(v, v))
      if (length <= 8*epsilon(length)*extent) exit
      call difference(round, v)
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
    subroutine difference(i, d)
      integer, intent(in) :: i
      real(c_double), intent(in) :: d(3)
      of_a(:, i) = support(a, -d)
      of_b(:, i) = support(b, d)
      w = at + (of_a(:, i) - of_b(:, i))
    end subroutine difference
    pure logical function known()
      integer :: i
      known = .false.
      do i = 1, s%count
        known = known .or. all(abs(s%w(:, i) - w) <= 0)
      end do
    end function known
  end subroutine nearest

end module convex_axis
