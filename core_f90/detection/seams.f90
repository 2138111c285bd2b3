!> Seams between flush bodies: contacts with covered sides are found here. A body that slides over two flush pieces meets the
!> inner side of the second one just after the seam, although the first piece covers this side.
!> Other engines know the neighbours of an edge of one mesh and clamp normals that lean over a flat or convex edge (Box2D: ghost
!> vertices; Jolt: active edges; Bullet: internal edges). Here pieces are separate bodies; the neighbours of a piece are the
!> other bodies that the same body touches.
!>
!> A contact of X with Y is dropped under three conditions. Its points lie on the rim of Y and its normal leans outward there. X
!> touches a third body along a plane, or the points lie on a side of that body. All of Y lies below this plane, flush with it.
!> Where Y rises above the plane, as a ramp does, the contact takes the normal of the rising face instead.
module seams
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t, c_int8_t
  use hull_view, only: solid, view_solid
  use convex_shape, only: convex, see_cylinder
  use seam_scene, only: bar, cairn_seams, cylinder, facet, half_space, hull, meet, meeting, open_scene, reach_of, scene, size_of
  implicit none
  private
  public :: cairn_seam_contacts, cairn_seam_closing

  ! Tolerance of flush heights, relative to the radius of the bounding ball of the smallest body.
  real(c_double), parameter :: flush = 1e-4_c_double
  real(c_double), parameter :: lean = 1e-4_c_double !< sine from which on a normal leans
  real(c_double), parameter :: wide = 0.05_c_double !< least width of a wide patch, relative to its length
  ! Bodies at rest keep speeds of this share of what forces add in a step: the tolerance of a solver leaves them.
  real(c_double), parameter :: rest = 1e-2_c_double
  real(c_double), parameter :: still = 1e-6_c_double !< the same for bodies that slide along a plane: rounding errors leave them
  real(c_double), parameter :: along = 1e-2_c_double !< greatest speed across a plane that a body slides along, of its speed
  real(c_double), parameter :: ahead = 10            !< steps over which flush bodies stay flush at their velocities
  integer, parameter :: most_planes = 64            !< planes of contact kept for one body
  integer, parameter :: most_sides = 4              !< sides of a body found at one point

contains

  !> Marks the runs first to last - 1 that have a closing contact. Marks: 2, it closes by the velocities at the start of the step;
  !> 1, by those at its end without contacts; -1, no faster than the tolerance of a solver leaves. Other runs carry no impulse
  !> unless another contact presses on them.
  subroutine cairn_seam_closing(given, first, last, closing, speed) bind(c)
    type(cairn_seams), intent(in) :: given
    integer(c_int64_t), value :: first, last
    integer(c_int8_t), intent(inout) :: closing(0:*)
    real(c_double), intent(inout) :: speed(0:*) !< greatest along the normal of each run [m/s]
    type(scene) :: s
    integer(c_int64_t) :: r, k
    integer(c_int32_t) :: a, b
    real(c_double) :: least, by_forces, by_speed
    call open_scene(given, s)
    do r = first, last - 1
      closing(r) = 0
      speed(r) = 0
      k = s%run(r + 1) + 1
      a = s%body(s%a(k) + 1) + 1
      b = s%body(s%b(k) + 1) + 1
      if (move_as_one(s, a, b)) cycle
      least = rest*max(change(s, a), change(s, b))
      do k = k, s%run(r + 2)
        call approach(s, k, a, b, by_speed, by_forces)
        if (by_forces > least) closing(r) = max(closing(r), 1_c_int8_t)
        if (by_speed > least) closing(r) = 2
        if (by_speed > still/rest*least .and. closing(r) == 0) closing(r) = -1
        speed(r) = max(speed(r), abs(by_speed))
      end do
    end do
  end subroutine cairn_seam_closing

  !> True if two bodies have the same velocity now and at the end of the step, and do not turn.
  pure logical function move_as_one(s, a, b)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: a, b
    integer :: i
    move_as_one = .false.
    if (a < 1 .or. b < 1) return
    do i = 1, s%dim
      if (abs(s%velocity(i, a) - s%velocity(i, b)) + abs(s%free(i, a) - s%free(i, b)) > 0) return
    end do
    do i = s%dim + 1, 3*s%dim - 3
      if (abs(s%velocity(i, a)) + abs(s%velocity(i, b)) + abs(s%free(i, a)) + abs(s%free(i, b)) > 0) return
    end do
    move_as_one = .true.
  end function move_as_one

  !> Change of the velocity of body i by the forces of one step [m/s].
  pure real(c_double) function change(s, i)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: i
    integer :: k
    change = 0
    if (i < 1) return
    do k = 1, s%dim
      change = max(change, abs(s%free(k, i) - s%velocity(k, i)))
    end do
  end function change

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
    real(c_double) :: n(3), x(3), turn(3)
    integer :: d
    d = s%dim
    n(1:d) = sense*s%normal(:, k)
    if (contactor > 0) then
      x(1:d) = s%centre(:, contactor) - s%position(:, i)
    else
      x(1:d) = s%point(:, k) - s%position(:, i)
    end if
    if (d == 2) then
      turn(1) = x(1)*n(2) - x(2)*n(1)
      now = now + n(1)*s%velocity(1, i) + n(2)*s%velocity(2, i) + turn(1)*s%velocity(3, i)
      later = later + n(1)*s%free(1, i) + n(2)*s%free(2, i) + turn(1)*s%free(3, i)
      return
    end if
    turn = [x(2)*n(3) - x(3)*n(2), x(3)*n(1) - x(1)*n(3), x(1)*n(2) - x(2)*n(1)]
    now = now + n(1)*s%velocity(1, i) + n(2)*s%velocity(2, i) + n(3)*s%velocity(3, i) &
      + turn(1)*s%velocity(4, i) + turn(2)*s%velocity(5, i) + turn(3)*s%velocity(6, i)
    later = later + n(1)*s%free(1, i) + n(2)*s%free(2, i) + n(3)*s%free(3, i) &
      + turn(1)*s%free(4, i) + turn(2)*s%free(5, i) + turn(3)*s%free(6, i)
  end subroutine add_speed

  !> Verdicts on the runs of contactors first to last - 1: 1 drops a run, 2 replaces its normal by `turned`.
  subroutine cairn_seam_contacts(given, first, last, start, entry, closing, speed, verdict, turned) bind(c)
    type(cairn_seams), intent(in) :: given
    integer(c_int32_t), value :: first, last
    integer(c_int32_t), intent(in) :: start(0:*)     !< (contactors + 1) of the runs of each in `entry`
    integer(c_int32_t), intent(in) :: entry(0:*)     !< a run, from 0, times 2, and 1 where the contactor is B
    integer(c_int8_t), intent(in) :: closing(0:*)    !< of each run
    real(c_double), intent(in) :: speed(0:*)         !< of each run [m/s]
    integer(c_int8_t), intent(inout) :: verdict(0:*) !< of each entry, 0 before
    real(c_double), intent(inout) :: turned(given%dim, 0:*) !< normals from the other body, where the verdict is 2
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
          call meet(s, entry(e), of_run)
          of_run%closing = closing(entry(e)/2)
          of_run%speed = speed(entry(e)/2)
          call note_plane(s, of_run, planes, plane)
        else
          planes = planes + 1
          call meet(s, entry(e), plane(planes))
          plane(planes)%closing = closing(entry(e)/2)
          plane(planes)%speed = speed(entry(e)/2)
        end if
      end do
      do e = start(c), start(c + 1) - 1
        if (k > most_planes) then
          call meet(s, entry(e), of_run)
          of_run%closing = closing(entry(e)/2)
          of_run%speed = speed(entry(e)/2)
          call judge(s, of_run, planes, plane, verdict(e), n)
        else
          call judge(s, plane(e - start(c) + 1), planes, plane, verdict(e), n)
        end if
        if (verdict(e) == 2) turned(:, e) = n(1:s%dim)
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
      plane(k)%closing = max(plane(k)%closing, m%closing)
      plane(k)%speed = max(plane(k)%speed, m%speed)
      return
    end do
    if (planes == most_planes) return
    planes = planes + 1
    plane(planes) = m
  end subroutine note_plane

  !> The verdict on one run: 0 keeps it, 1 drops it, 2 gives it the normal n of a face of Y that rises there.
  subroutine judge(s, m, planes, plane, verdict, n)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    integer, intent(in) :: planes
    type(meeting), intent(in) :: plane(planes)
    integer(c_int8_t), intent(inout) :: verdict
    real(c_double), intent(out) :: n(3)
    real(c_double) :: q(3), slack, height
    integer :: j, found
    logical :: looked, of_surface
    n = 0
    verdict = 0
    if (.not. has_rim(s, m%y)) return
    if (.not. (m%closing /= 0 .or. is_pressed(s, m, planes, plane))) return
    if (is_wide(s, m)) return
    looked = .false.
    of_surface = s%seen(s%shape(m%y + 1) + 1) == facet
    q = m%q(:, 1)
    slack = m%far + flush*min(size_of(s, m%x), size_of(s, m%y))
    do j = 1, planes
      if (plane(j)%y == m%y .and. .not. plane(j)%many) cycle
      ! triangles of one surface leave contacts at their edges to each other where they are found
      if (of_surface .and. s%body(plane(j)%y + 1) == s%body(m%y + 1) .and. .not. plane(j)%mixed) cycle
      height = plane(j)%n(1)*q(1) + plane(j)%n(2)*q(2) + plane(j)%n(3)*q(3) - plane(j)%height
      if (abs(height) > slack + plane(j)%far) cycle
      if (dot_product(plane(j)%n, m%n) > 1 - lean**2/2) cycle
      if (rises_above(s, m, plane(j), slack + plane(j)%far)) cycle
      if (m%closing < 0 .and. plane(j)%speed > along*m%speed) cycle
      if (.not. stays_flush(s, m, plane(j))) cycle
      if (.not. looked) then
        if (.not. is_on_rim(s, m, planes, plane)) return
        looked = .true.
      end if
      found = under_plane(s, m, plane(j), n)
      if (found == 0 .and. .not. plane(j)%many) found = under_sides(s, m, plane(j), n)
      if (found == 1) verdict = 1
      if (found == 1) return
      if (found == 2) verdict = 2
    end do
  end subroutine judge

  !> True if a point of a run is higher above plane p than a height [m]: the body below p does not cover it.
  pure logical function rises_above(s, m, p, height)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m, p
    real(c_double), intent(in) :: height
    integer :: k
    rises_above = .false.
    do k = 2, m%points
      rises_above = dot_product(p%n, m%q(:, k)) - p%height > height
      if (rises_above) return
    end do
  end function rises_above

  !> True if Y and the body below X keep their heights along the normal of plane p for some steps, and X comes no nearer to a body
  !> that can give way, but for the tolerance of flush heights. Else X may sink beside Y.
  logical function stays_flush(s, m, p)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m, p
    real(c_double) :: tolerance, of_p, q(3)
    stays_flush = .true.
    if (s%body(m%y + 1) < 0 .or. s%body(p%y + 1) < 0 .or. s%body(m%y + 1) == s%body(p%y + 1)) return
    tolerance = flush*min(size_of(s, m%x), size_of(s, m%y), size_of(s, p%y))
    q = m%q(:, 1)
    of_p = speed_at(s, p%y, q - p%at, p%n)
    stays_flush = .not. abs(speed_at(s, m%y, q - m%at, p%n) - of_p)*ahead*s%step > tolerance
    if (.not. stays_flush .or. s%body(m%x + 1) < 0) return
    if (is_at_rest(s, p%y) .and. is_at_rest(s, m%y)) return
    stays_flush = .not. (of_p - speed_at(s, m%x, q, p%n))*ahead*s%step > tolerance
  end function stays_flush

  !> True if the body of a contactor has no velocity and no force changes it.
  pure logical function is_at_rest(s, c)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: c
    integer :: i
    is_at_rest = .true.
    do i = 1, 3*s%dim - 3
      is_at_rest = is_at_rest .and. .not. abs(s%velocity(i, s%body(c + 1) + 1)) + abs(s%free(i, s%body(c + 1) + 1)) > 0
    end do
  end function is_at_rest

  !> Speed along n of the point x of a contactor, from its centre [m/s].
  pure real(c_double) function speed_at(s, c, x, n)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: c
    real(c_double), intent(in) :: x(3), n(3)
    real(c_double) :: arm(3)
    integer :: i, d
    d = s%dim
    i = s%body(c + 1) + 1
    arm = 0
    arm(1:d) = x(1:d) + s%centre(:, c + 1) - s%position(:, i)
    speed_at = dot_product(n(1:d), s%velocity(1:d, i))
    if (d == 2) then
      speed_at = speed_at + (arm(1)*n(2) - arm(2)*n(1))*s%velocity(3, i)
    else
      speed_at = speed_at + (arm(2)*n(3) - arm(3)*n(2))*s%velocity(4, i) + (arm(3)*n(1) - arm(1)*n(3))*s%velocity(5, i) &
        + (arm(1)*n(2) - arm(2)*n(1))*s%velocity(6, i)
    end if
  end function speed_at

  !> True if another contact closes and presses X against Y.
  pure logical function is_pressed(s, m, planes, plane)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    integer, intent(in) :: planes
    type(meeting), intent(in) :: plane(planes)
    integer :: j
    is_pressed = .false.
    if (m%far > flush*size_of(s, m%x)) return
    do j = 1, planes
      is_pressed = is_pressed .or. (plane(j)%closing == 2 .and. dot_product(plane(j)%n, m%n) < -lean)
    end do
  end function is_pressed

  !> True if the points of a run span an area. A contact with a covered side spans a line at most.
  pure logical function is_wide(s, m)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    real(c_double) :: d(3), e(3), w(3)
    integer(c_int64_t) :: k
    is_wide = .false.
    if (m%last < m%first + 2) return
    d = 0
    e = 0
    d(1:s%dim) = s%point(:, m%first + 1) - s%point(:, m%first)
    do k = m%first + 2, m%last
      e(1:s%dim) = s%point(:, k) - s%point(:, m%first)
      w = [d(2)*e(3) - d(3)*e(2), d(3)*e(1) - d(1)*e(3), d(1)*e(2) - d(2)*e(1)]
      is_wide = is_wide .or. dot_product(w, w) > wide**2*max(dot_product(d, d), dot_product(e, e))**2
    end do
  end function is_wide

  !> True if a point of a run may lie on the rim of Y, that is on two sides. The tolerance is the widest of those below.
  logical function is_on_rim(s, m, planes, plane)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    integer, intent(in) :: planes
    type(meeting), intent(in) :: plane(planes)
    real(c_double) :: side(3, most_sides), above(most_sides), tolerance
    integer :: k
    integer :: sides
    tolerance = flush*min(size_of(s, m%x), size_of(s, m%y)) + m%sunk + maxval(plane%sunk)
    is_on_rim = .false.
    do k = 1, m%points
      call sides_at(s, m%y, m%q(:, k) - m%at, -m%at, 2*tolerance, sides, side, above)
      is_on_rim = sides > 1
      if (is_on_rim) return
    end do
  end function is_on_rim

  pure logical function has_rim(s, y)
    type(scene), intent(in) :: s
    integer(c_int32_t), intent(in) :: y
    integer :: kind
    kind = s%seen(s%shape(y + 1) + 1)
    has_rim = kind == hull .or. kind == bar .or. kind == cylinder .or. (kind == facet .and. s%body(y + 1) >= 0)
  end function has_rim

  !> The verdict by a plane p of contact of X: it separates X from Y, and the points of the run lie on it.
  integer function under_plane(s, m, p, n) result(found)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m, p
    real(c_double), intent(inout) :: n(3)
    real(c_double) :: tolerance, q(3), top
    integer :: k
    found = 0
    tolerance = flush*min(size_of(s, m%x), size_of(s, m%y))
    if (.not. p%many) tolerance = min(tolerance, flush*size_of(s, p%y))
    do k = 1, m%points
      q = m%q(:, k)
      if (abs(dot_product(p%n, q) - p%height) > tolerance + p%sunk) return
    end do
    do k = 1, m%points
      if (.not. leans_out(s, m, m%q(:, k) - m%at, p%n, tolerance + p%sunk)) return
    end do
    if (-reach_of(s, m%x, -p%n) < p%height - tolerance - p%sunk) return
    top = dot_product(p%n, m%at) + reach_of(s, m%y, p%n) - p%height
    if (abs(top) <= tolerance) found = 1
    if (top > tolerance) call turn(s, m, p%n, m%q(:, 1), tolerance, found, n)
  end function under_plane

  !> The verdict by the sides of the third body: one of them covers the points of the run. X need not lie along this side.
  integer function under_sides(s, m, p, n) result(found)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m, p
    real(c_double), intent(inout) :: n(3)
    real(c_double) :: tolerance, q(3), side(3, most_sides), above(most_sides), t(3), top, size
    real(c_double) :: other(3, most_sides), above_other(most_sides)
    integer :: k, highest, i, sides, j, others
    logical :: covers
    found = 0
    if (s%seen(s%shape(p%y + 1) + 1) == facet) return ! its edges cover nothing
    tolerance = flush*min(size_of(s, m%x), size_of(s, m%y), size_of(s, p%y))
    highest = 1
    do k = 1, m%points
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
        if (covers) covers = leans_out(s, m, m%q(:, k) - m%at, side(:, i), tolerance)
      end do
      if (.not. covers) cycle
      top = dot_product(side(:, i), m%at - q) + reach_of(s, m%y, side(:, i)) + above(i)
      if (top <= tolerance) found = 1
      if (found == 1) return
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

  !> True if the point x of Y, relative to its centre, lies on the rim of Y below the plane with normal p, and the normal of the run
  !> leans outward there. A point over the inside of a face fails this test.
  logical function leans_out(s, m, x, p, tolerance)
    type(scene), intent(in) :: s
    type(meeting), intent(in) :: m
    real(c_double), intent(in) :: x(3), p(3), tolerance
    real(c_double) :: side(3, most_sides), above(most_sides), t(3)
    integer :: sides, i
    leans_out = .false.
    t = m%n - dot_product(m%n, p)*p
    if (dot_product(t, t) <= lean**2) return
    call sides_at(s, m%y, x, -m%at, 2*(tolerance + m%sunk), sides, side, above)
    do i = 1, sides
      if (dot_product(side(:, i), p) > 1 - lean) cycle
      leans_out = leans_out .or. dot_product(side(:, i), t) > lean*sqrt(dot_product(t, t))
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
