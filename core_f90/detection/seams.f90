!> Seams between flush bodies: contacts with covered sides are found here. A body that slides over two flush pieces meets the
!> inner side of the second one just after the seam, although the first piece covers this side.
!> Other engines know the neighbours of an edge of one mesh and clamp normals that lean over a flat or convex edge (Box2D: ghost
!> vertices; Jolt: active edges; Bullet: internal edges). Here pieces are separate bodies; the neighbours of a piece are the
!> other bodies that the same body touches.
!>
!> A contact of X with Y takes another normal under three conditions. Its points lie on the rim of Y and its normal leans
!> outward there. X touches a third body along a plane, or the points lie on a side of that body. All of Y lies below this plane,
!> flush with it, and X above: the plane separates the two at this distance, and its normal is that of the contact. Where Y rises
!> above the plane, as a ramp does, the contact takes the normal of the rising face.
module seams
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t, c_int8_t
  use hull_view, only: solid, view_solid
  use convex_shape, only: convex, see_cylinder
  use seam_scene, only: bar, cairn_seams, cylinder, facet, half_space, hull, meet, meeting, &
    most_points, open_scene, reach_of, scene, size_of
  implicit none
  private
  public :: cairn_seam_contacts, cairn_seam_closing

  ! Tolerance of flush heights, relative to the radius of the bounding ball of the smallest body.
  real(c_double), parameter :: flush = 1e-4_c_double
  real(c_double), parameter :: lean = 1e-4_c_double !< sine from which on a normal leans
  real(c_double), parameter :: wide = 0.05_c_double !< least width of a wide patch, relative to its length
  integer, parameter :: most_planes = 64            !< planes of contact kept for one body
  integer, parameter :: most_sides = 4              !< sides of a body found at one point
  !> Bits of the motion of a run: these are the values of enum cairn_seam_motion of rows.h.
  integer(c_int8_t), parameter :: touches = 1, meets = 2, closes = 4, asked = 8

  !> Sides of Y at the points of a run: see sides_at.
  type :: rim
    real(c_double) :: tolerance = 0 !< [m]
    integer :: sides(most_points)
    real(c_double) :: side(3, most_sides, most_points), above(most_sides, most_points) !< [-], [m]
  end type rim

contains

  !> Motion of the runs first to last - 1, by the velocities at the start of the step and by those at its end without contacts.
  !> A run of one line at most touches if its gap is flush, and meets if it closes within the step. A run closes if its bodies come
  !> nearer now, and presses on other contacts of theirs.
  subroutine cairn_seam_closing(given, alike, step, first, last, motion) bind(c)
    type(cairn_seams), intent(in) :: given
    integer(c_int8_t), intent(in) :: alike(*) !< of each body: 1 if it moves as all others that have a 1
    real(c_double), value :: step !< [s]
    integer(c_int64_t), value :: first, last
    integer(c_int8_t), intent(inout) :: motion(0:*)
    type(scene) :: s
    integer(c_int64_t) :: r, k
    integer(c_int32_t) :: a, b
    real(c_double) :: by_speed, by_forces, slack
    logical :: moves
    call open_scene(given, s)
    do r = first, last - 1
      motion(r) = 0
      k = s%run(r + 1) + 1
      a = s%body(s%a(k) + 1) + 1
      b = s%body(s%b(k) + 1) + 1
      slack = flush*min(size_of(s, s%a(k)), size_of(s, s%b(k)))
      moves = a < 1 .or. b < 1
      if (.not. moves) moves = alike(a) == 0 .or. alike(b) == 0
      do k = k, s%run(r + 2)
        if (abs(s%gap(k)) <= slack) motion(r) = ior(motion(r), touches)
        if (.not. moves) cycle
        call approach(s, k, a, b, by_speed, by_forces)
        if (by_speed > 0) motion(r) = ior(motion(r), closes)
        if (max(by_speed, by_forces) > 0 .and. s%gap(k) <= step*max(by_speed, by_forces)) motion(r) = ior(motion(r), meets)
      end do
      if (iand(motion(r), touches + meets) == 0) cycle
      if (is_wide(s, s%run(r + 1) + 1, s%run(r + 2), slack)) motion(r) = iand(motion(r), closes)
    end do
  end subroutine cairn_seam_closing

  !> Speeds at which the bodies a and b of contact k come nearer along its normal [m/s], images of a cell included: now, and at the
  !> end of the step without contacts.
  pure subroutine approach(s, k, a, b, now, later)
    type(scene), intent(in) :: s
    integer(c_int64_t), intent(in) :: k
    integer(c_int32_t), intent(in) :: a, b
    real(c_double), intent(out) :: now, later
    now = 0
    later = 0
    if (b > 0) call add_speed(s, k, b, merge(s%b(k) + 1, 0, s%periodic), 1.0_c_double, now, later)
    if (a > 0) call add_speed(s, k, a, 0, -1.0_c_double, now, later)
  end subroutine approach

  !> Adds the speed along the normal of contact k of the point of body i at the contact, or at the centre of a contactor [m/s].
  pure subroutine add_speed(s, k, i, contactor, sense, now, later)
    type(scene), intent(in) :: s
    integer(c_int64_t), intent(in) :: k
    integer(c_int32_t), intent(in) :: i, contactor
    real(c_double), intent(in) :: sense
    real(c_double), intent(inout) :: now, later
    real(c_double) :: n1, n2, n3, x1, x2, x3
    n1 = sense*s%normal(1, k)
    n2 = sense*s%normal(2, k)
    if (contactor > 0) then
      x1 = s%centre(1, contactor) - s%position(1, i)
      x2 = s%centre(2, contactor) - s%position(2, i)
    else
      x1 = s%point(1, k) - s%position(1, i)
      x2 = s%point(2, k) - s%position(2, i)
    end if
    now = now + n1*s%velocity(1, i) + n2*s%velocity(2, i)
    later = later + n1*s%free(1, i) + n2*s%free(2, i)
    if (s%dim == 2) then
      now = now + (x1*n2 - x2*n1)*s%velocity(3, i)
      later = later + (x1*n2 - x2*n1)*s%free(3, i)
      return
    end if
    n3 = sense*s%normal(3, k)
    if (contactor > 0) then
      x3 = s%centre(3, contactor) - s%position(3, i)
    else
      x3 = s%point(3, k) - s%position(3, i)
    end if
    now = now + n3*s%velocity(3, i) + (x2*n3 - x3*n2)*s%velocity(4, i) + (x3*n1 - x1*n3)*s%velocity(5, i) &
      + (x1*n2 - x2*n1)*s%velocity(6, i)
    later = later + n3*s%free(3, i) + (x2*n3 - x3*n2)*s%free(4, i) + (x3*n1 - x1*n3)*s%free(5, i) &
      + (x1*n2 - x2*n1)*s%free(6, i)
  end subroutine add_speed

  !> Verdicts on the runs of contactors first to last - 1: 1 replaces the normal of a run by `turned`.
  subroutine cairn_seam_contacts(given, first, last, start, entry, motion, verdict, turned) bind(c)
    type(cairn_seams), intent(in) :: given
    integer(c_int32_t), value :: first, last
    integer(c_int32_t), intent(in) :: start(0:*)     !< (contactors + 1) of the runs of each in `entry`
    integer(c_int32_t), intent(in) :: entry(0:*)     !< a run, from 0, times 2, and 1 where the contactor is B
    integer(c_int8_t), intent(in) :: motion(0:*)     !< of each run, with the bit `asked` where a verdict is sought
    integer(c_int8_t), intent(inout) :: verdict(0:*) !< of each entry, 0 before
    real(c_double), intent(inout) :: turned(given%dim, 0:*) !< normals from the other body, where the verdict is 1
    type(scene) :: s
    type(meeting) :: plane(most_planes), of_run
    integer(c_int32_t) :: c, e
    integer :: planes, k
    real(c_double) :: n(3)
    call open_scene(given, s)
    do c = first, last - 1
      k = start(c + 1) - start(c)
      if (k < 2) cycle
      if (s%seen(s%shape(c + 1) + 1) == half_space) cycle
      planes = 0
      do e = start(c), start(c + 1) - 1
        if (k > most_planes) then
          call meet(s, entry(e), motion(entry(e)/2), of_run)
          call note_plane(s, of_run, planes, plane)
        else
          planes = planes + 1
          call meet(s, entry(e), motion(entry(e)/2), plane(planes))
        end if
      end do
      do e = start(c), start(c + 1) - 1
        if (iand(motion(entry(e)/2), asked) == 0) cycle
        if (k > most_planes) then
          call meet(s, entry(e), motion(entry(e)/2), of_run)
          call judge(s, of_run, planes, plane, verdict(e), n)
        else
          call judge(s, plane(e - start(c) + 1), planes, plane, verdict(e), n)
        end if
        if (verdict(e) == 1) turned(:, e) = n(1:s%dim)
      end do
    end do
  end subroutine cairn_seam_contacts

  !> Adds a plane to the list, or merges it with one that coincides. Large bodies touch many others in one plane.
  pure subroutine note_plane(s, m, planes, plane)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    integer, intent(inout) :: planes
    type(meeting), intent(inout) :: plane(most_planes)
    real(c_double) :: d(3)
    integer :: k
    do k = 1, planes
      d = m%n - plane(k)%n
      if (dot_product(d, d) > lean**2 .or. abs(m%height - plane(k)%height) > m%far + plane(k)%far) cycle
      plane(k)%many = plane(k)%many .or. plane(k)%y /= m%y
      plane(k)%mixed = plane(k)%mixed .or. s%body(plane(k)%y + 1) /= s%body(m%y + 1)
      plane(k)%height = max(plane(k)%height, m%height)
      plane(k)%sunk = max(plane(k)%sunk, m%sunk)
      plane(k)%far = max(plane(k)%far, m%far)
      plane(k)%motion = ior(plane(k)%motion, m%motion)
      return
    end do
    if (planes == most_planes) return
    planes = planes + 1
    plane(planes) = m
  end subroutine note_plane

  !> The verdict on one run: 0 keeps it, 1 gives it the normal n.
  subroutine judge(s, m, planes, plane, verdict, n)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    integer, intent(in) :: planes
    type(meeting), intent(in) :: plane(planes)
    integer(c_int8_t), intent(inout) :: verdict
    real(c_double), intent(out) :: n(3)
    type(rim) :: r
    real(c_double) :: slack, height
    integer :: j, k, found, likely, which(most_planes)
    logical :: looked, of_surface
    n = 0
    verdict = 0
    if (.not. has_rim(s, m%y)) return
    if (.not. (iand(m%motion, meets) > 0 .or. is_pressed(m, planes, plane))) return
    looked = .false.
    of_surface = s%seen(s%shape(m%y + 1) + 1) == facet
    slack = m%far + flush*min(size_of(s, m%x), size_of(s, m%y))
    likely = 0
    do j = 1, planes
      if (plane(j)%y == m%y .and. .not. plane(j)%many) cycle
      ! triangles of one surface leave contacts at their edges to each other where they are found
      if (of_surface .and. s%body(plane(j)%y + 1) == s%body(m%y + 1) .and. .not. plane(j)%mixed) cycle
      height = huge(height)
      do k = 1, m%points
        height = min(height, abs(dot_product(plane(j)%n, m%q(:, k)) - plane(j)%height))
      end do
      if (height > slack + plane(j)%far) cycle
      if (dot_product(plane(j)%n, m%n) > 1 - lean**2/2) cycle
      if (.not. looked) then
        if (.not. is_on_rim(s, m, planes, plane, r)) return
        looked = .true.
      end if
      likely = likely + 1
      which(likely) = j
      found = under_plane(s, m, r, plane(j), n)
      if (found > 0) verdict = 1
      if (found == 1) return
    end do
    do j = 1, likely
      if (plane(which(j))%many) cycle
      found = under_sides(s, m, r, plane(which(j)), n)
      if (found > 0) verdict = 1
      if (found == 1) return
    end do
  end subroutine judge

  !> True if another contact closes and presses X against Y.
  pure logical function is_pressed(m, planes, plane)
    type(meeting), intent(in) :: m
    integer, intent(in) :: planes
    type(meeting), intent(in) :: plane(planes)
    integer :: j
    is_pressed = .false.
    if (iand(m%motion, touches) == 0) return
    do j = 1, planes
      is_pressed = is_pressed .or. (iand(plane(j)%motion, closes) > 0 .and. dot_product(plane(j)%n, m%n) < -lean)
    end do
  end function is_pressed

  !> True if contacts first to last span an area above the square of slack [m]. A contact with a covered side spans a line at most.
  pure logical function is_wide(s, first, last, slack)
    type(scene), intent(in) :: s
    integer(c_int64_t), intent(in) :: first, last
    real(c_double), intent(in) :: slack
    real(c_double) :: d(3), e(3), w(3)
    integer(c_int64_t) :: k
    is_wide = .false.
    if (last < first + 2) return
    d = 0
    e = 0
    d(1:s%dim) = s%point(:, first + 1) - s%point(:, first)
    do k = first + 2, last
      e(1:s%dim) = s%point(:, k) - s%point(:, first)
      w = [d(2)*e(3) - d(3)*e(2), d(3)*e(1) - d(1)*e(3), d(1)*e(2) - d(2)*e(1)]
      is_wide = is_wide .or. dot_product(w, w) > &
        max(wide*max(dot_product(d, d), dot_product(e, e)), slack**2)**2
    end do
  end function is_wide

  !> True if a point of a run may lie on the rim of Y, that is on two sides. The tolerance is the widest of those below.
  logical function is_on_rim(s, m, planes, plane, r)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    integer, intent(in) :: planes
    type(meeting), intent(in) :: plane(planes)
    type(rim), intent(inout) :: r
    integer :: k
    r%tolerance = 2*(flush*min(size_of(s, m%x), size_of(s, m%y)) + m%sunk + maxval(plane%sunk))
    do k = 1, m%points
      call sides_at(s, m%y, m%q(:, k) - m%at, -m%at, r%tolerance, r%sides(k), r%side(:, :, k), r%above(:, k))
    end do
    is_on_rim = any(r%sides(1:m%points) > 1)
  end function is_on_rim

  pure logical function has_rim(s, y)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: y
    integer :: kind
    kind = s%seen(s%shape(y + 1) + 1)
    has_rim = kind == hull .or. kind == bar .or. kind == cylinder .or. (kind == facet .and. s%body(y + 1) >= 0)
  end function has_rim

  !> The verdict by a plane p of contact of X: it separates X from Y, whose points lie on it or below.
  integer function under_plane(s, m, r, p, n) result(found)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m, p
    type(rim), intent(in) :: r
    real(c_double), intent(inout) :: n(3)
    real(c_double) :: tolerance, top
    integer :: k
    found = 0
    tolerance = flush*min(size_of(s, m%x), size_of(s, m%y))
    if (.not. p%many) tolerance = min(tolerance, flush*size_of(s, p%y))
    do k = 1, m%points
      if (dot_product(p%n, m%q(:, k)) - p%height > tolerance + p%sunk) return
    end do
    do k = 1, m%points
      if (.not. leans_out(s, m, r, k, p%n, tolerance + p%sunk)) return
    end do
    if (-reach_of(s, m%x, -p%n) < p%height - tolerance - p%sunk) return
    top = dot_product(p%n, m%at) + reach_of(s, m%y, p%n) - p%height
    if (top > tolerance) then
      call turn(s, m, p%n, m%q(:, 1), tolerance, found, n)
    else if (abs(top) <= tolerance) then
      found = 1
      n = p%n
    end if
  end function under_plane

  !> The verdict by the sides of the third body: one of them covers the points of the run, and X lies above it.
  integer function under_sides(s, m, r, p, n) result(found)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m, p
    type(rim), intent(in) :: r
    real(c_double), intent(inout) :: n(3)
    real(c_double) :: tolerance, q(3), side(3, most_sides), above(most_sides), t(3), top, size
    real(c_double) :: other(3, most_sides), above_other(most_sides)
    integer :: i, sides, j, k, others, highest
    logical :: covers
    found = 0
    if (s%seen(s%shape(p%y + 1) + 1) == facet) return ! its edges cover nothing
    tolerance = flush*min(size_of(s, m%x), size_of(s, m%y), size_of(s, p%y))
    highest = 1
    do k = 2, m%points
      if (dot_product(p%n, m%q(:, k)) > dot_product(p%n, m%q(:, highest))) highest = k
    end do
    q = m%q(:, highest)
    call sides_at(s, p%y, q - p%at, -p%at, tolerance, sides, side, above)
    do i = 1, sides
      t = m%n - dot_product(m%n, side(:, i))*side(:, i)
      size = sqrt(dot_product(t, t))
      covers = size > lean
      do j = 1, sides
        if (j /= i .and. dot_product(t, side(:, j)) > lean*size) covers = .false. ! leads out of the side again
      end do
      do k = 1, m%points
        if (.not. covers) exit
        call sides_at(s, p%y, m%q(:, k) - p%at, -p%at, tolerance, others, other, above_other)
        covers = others >= 0
        if (covers) covers = leans_out(s, m, r, k, side(:, i), tolerance)
      end do
      if (.not. covers) cycle
      if (reach_of(s, m%x, -side(:, i)) + dot_product(side(:, i), q) - above(i) > tolerance + m%sunk + p%sunk) cycle
      top = dot_product(side(:, i), m%at - q) + reach_of(s, m%y, side(:, i)) + above(i)
      if (top <= tolerance) then
        found = 1
        n = side(:, i)
        return
      end if
      call turn(s, m, side(:, i), q, tolerance, found, n)
    end do
  end function under_sides

  !> Normals of the sides of a contactor that pass through its point x, and the height of x above each [m]. x is relative to the
  !> centre. sides = -1 if x lies outside. The long side of a bar counts at any depth below it; it faces the point `of`.
  subroutine sides_at(s, y, x, of, tolerance, sides, side, above)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: y
    real(c_double), intent(in) :: x(3), of(3), tolerance
    integer, intent(out) :: sides
    real(c_double), intent(out) :: side(3, most_sides), above(most_sides) !< [-], [m]
    type(solid) :: p
    type(convex) :: c
    real(c_double) :: along, high, w(3), axis(3), beyond
    integer :: i, d
    sides = 0
    side = 0
    above = 0
    d = s%dim
    select case (s%seen(s%shape(y + 1) + 1))
    case (hull)
      call view_solid(s%view, y, s%radius(y + 1), p)
      do i = 1, p%faces
        w = 0
        w(1:d) = p%normal(i, :)
        call put(w, dot_product(w, x) - p%offset(i))
        if (sides < 0) return
      end do
    case (facet)
      call view_solid(s%view, y, s%radius(y + 1), p)
      axis = across(p%v(2, :) - p%v(1, :), p%v(3, :) - p%v(1, :))
      axis = axis/sqrt(dot_product(axis, axis))
      call put(axis, dot_product(axis, x - p%v(1, :)))
      do i = 1, 3
        w = across(p%v(modulo(i, 3) + 1, :) - p%v(i, :), axis)
        call put(w/sqrt(dot_product(w, w)), dot_product(w, x - p%v(i, :))/sqrt(dot_product(w, w)))
      end do
    case (half_space)
      axis = 0
      axis(1:d) = s%direction(1:d, y + 1)
      call put(axis, dot_product(axis, x))
    case (bar)
      axis = 0
      axis(1:2) = s%direction(1:2, y + 1)
      along = dot_product(axis, x)
      w = [-axis(2), axis(1), 0.0_c_double]
      if (dot_product(w, of) < 0) w = -w
      high = dot_product(w, x)
      beyond = abs(along) - s%direction(3, y + 1)
      if (sqrt(high**2 + max(beyond, 0.0_c_double)**2) > s%radius(y + 1) + tolerance) then
        sides = -1
        return
      end if
      sides = 1
      side(:, 1) = w
      above(1) = high - s%radius(y + 1)
      call put(sign(1.0_c_double, along)*axis, min(beyond, 0.0_c_double))
    case (cylinder)
      call see_cylinder(s%view, y, s%radius(y + 1), c)
      along = dot_product(c%frame(:, 3), x)
      w = x - along*c%frame(:, 3)
      high = sqrt(dot_product(w, w))
      call put(sign(1.0_c_double, along)*c%frame(:, 3), abs(along) - c%half(3))
      if (high > 0) call put(w/high, high - c%half(1))
    case default
      sides = -1
    end select
  contains
    pure function across(u, v)
      real(c_double), intent(in) :: u(3), v(3)
      real(c_double) :: across(3)
      across = [u(2)*v(3) - u(3)*v(2), u(3)*v(1) - u(1)*v(3), u(1)*v(2) - u(2)*v(1)]
    end function across

    subroutine put(m, height)
      real(c_double), intent(in) :: m(3), height
      if (height > tolerance) sides = -1
      if (height < -tolerance .or. sides < 0 .or. sides == most_sides) return
      sides = sides + 1
      side(:, sides) = m
      above(sides) = height
    end subroutine put
  end subroutine sides_at

  !> True if point k of the run lies on the rim of Y below the plane with normal p, and the normal of the run leans outward there.
  !> A point over the inside of a face fails this test.
  logical function leans_out(s, m, r, k, p, tolerance)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    type(rim), intent(in) :: r
    integer, intent(in) :: k
    real(c_double), intent(in) :: p(3), tolerance
    real(c_double) :: t(3), within
    integer :: i
    logical :: bounded
    leans_out = .false.
    t = m%n - dot_product(m%n, p)*p
    if (dot_product(t, t) <= lean**2 .or. r%sides(k) < 1) return
    within = 2*(tolerance + m%sunk)
    bounded = s%seen(s%shape(m%y + 1) + 1) /= bar ! see sides_at
    if (bounded .and. any(r%above(1:r%sides(k), k) > within)) return
    do i = 1, r%sides(k)
      if ((bounded .or. i > 1) .and. r%above(i, k) < -within) cycle
      if (dot_product(r%side(:, i, k), p) > 1 - lean) cycle
      leans_out = leans_out .or. dot_product(r%side(:, i, k), t) > lean*sqrt(dot_product(t, t))
    end do
  end function leans_out

  !> Sets found = 2 and the normal n of a face of Y that rises from its point q above the plane with normal p. A run that has the
  !> normal of such a face stays.
  subroutine turn(s, m, p, q, tolerance, found, n)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    real(c_double), intent(in) :: p(3), q(3), tolerance
    integer, intent(inout) :: found
    real(c_double), intent(inout) :: n(3)
    real(c_double) :: side(3, most_sides), above(most_sides), best, look, likest
    integer :: sides, i, kind
    kind = s%seen(s%shape(m%y + 1) + 1)
    if (kind == cylinder .or. kind == facet) return
    call sides_at(s, m%y, q - m%at, -m%at, 2*(tolerance + m%sunk), sides, side, above)
    best = lean
    likest = -1
    do i = 1, sides
      if (kind == hull) then
        if (.not. rises(s, m, side(:, i), p, q - m%at, tolerance)) cycle
      else if (i > 1) then
        exit ! the end of a bar
      end if
      look = dot_product(side(:, i), m%n)
      likest = max(likest, look)
      if (look < 0 .or. dot_product(side(:, i), p) <= best) cycle
      best = dot_product(side(:, i), p)
      n = side(:, i)
    end do
    if (best > lean .and. likest < 1 - lean**2/2) found = 2
  end subroutine turn

  !> True if the face of Y with this normal has a corner above the plane with normal p through x, relative to the centre of Y.
  logical function rises(s, m, normal, p, x, tolerance)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    real(c_double), intent(in) :: normal(3), p(3), x(3), tolerance
    type(solid) :: h
    real(c_double) :: d
    integer :: i, k
    k = s%dim
    call view_solid(s%view, m%y, s%radius(m%y + 1), h)
    rises = .false.
    do i = 1, h%vertices
      d = dot_product(normal(1:k), h%v(i, :) - x(1:k))
      if (abs(d) > 4*(tolerance + m%sunk)) cycle
      rises = rises .or. dot_product(p(1:k), h%v(i, :) - x(1:k)) > tolerance + m%sunk
    end do
  end function rises

end module seams
