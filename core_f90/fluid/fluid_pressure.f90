!> Pressure of an incompressible fluid of particles, as a condition on the divergence at the end of a step (Cummins & Rudman 1999).
!> The pressure force is the adjoint of the divergence. A compact Laplacian filters the null modes of both.
!> A wall has mirrored velocities, so that the adjoint has the pressure of the particle there, and momentum is kept exactly.
module fluid_pressure
  use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_float, c_int32_t, c_int64_t, c_int8_t, c_ptr
  use fluid_view, only: add_square, cairn_fluid, cross, fluid, invert, open_fluid, wall_points, wall_points_of
  implicit none
  private
  public :: cairn_fluid_rows, cairn_fluid_fill_rows, cairn_fluid_push, cairn_fluid_divergence, cairn_fluid_viscous
  public :: rows, open_rows
  integer, parameter :: wall_size = 16
  real(c_double), parameter :: open_share = 0.75_c_double  !< divergence of places, over dim, below which a surface is free
  real(c_double), parameter :: least_height = 0.5_c_double !< of a particle above a wall that holds it, over the spacing

  type, bind(c) :: cairn_fluid_rows
    integer(c_int32_t) :: dim, bodies
    real(c_double) :: step, density, volume
    type(c_ptr) :: first, used, near, pair, first_wall, used_wall, wall_body, wall
    type(c_ptr) :: body_of_point, body_of_plane, centre, shape
  end type cairn_fluid_rows

  type :: rows
    integer :: dim
    integer(c_int64_t), pointer, contiguous :: first(:), first_wall(:)
    integer(c_int32_t), pointer, contiguous :: used(:), near(:), used_wall(:), wall_body(:), body_of_point(:), body_of_plane(:)
    real(c_float), pointer, contiguous :: pair(:, :)
    real(c_double), pointer, contiguous :: wall(:, :), centre(:, :), shape(:, :)
  end type rows
contains

  subroutine open_rows(given, last, r)
    type(cairn_fluid_rows), intent(in) :: given
    integer(c_int64_t), intent(in) :: last
    type(rows), intent(out) :: r
    integer(c_int64_t), parameter :: any_size = huge(1_c_int32_t)
    r%dim = given%dim
    call c_f_pointer(given%first, r%first, [last + 1])
    call c_f_pointer(given%used, r%used, [last])
    call c_f_pointer(given%near, r%near, [any_size])
    call c_f_pointer(given%pair, r%pair, [int(r%dim + 1, c_int64_t), any_size])
    call c_f_pointer(given%first_wall, r%first_wall, [last + 1])
    call c_f_pointer(given%used_wall, r%used_wall, [last])
    call c_f_pointer(given%wall_body, r%wall_body, [any_size])
    call c_f_pointer(given%wall, r%wall, [int(wall_size, c_int64_t), any_size])
    call c_f_pointer(given%body_of_point, r%body_of_point, [any_size])
    call c_f_pointer(given%body_of_plane, r%body_of_plane, [any_size])
    call c_f_pointer(given%shape, r%shape, [int(3*(r%dim - 1), c_int64_t), last])
    call c_f_pointer(given%centre, r%centre, [3_c_int64_t, max(1_c_int64_t, int(given%bodies, c_int64_t))])
  end subroutine open_rows

  !> Rows of particles first to last - 1 at their places: gradients of the kernel times volumes, and for each body beside the
  !> sums over its points.
  subroutine cairn_fluid_fill_rows(f, given, first, last, bare) bind(c)
    type(cairn_fluid), intent(in) :: f
    type(cairn_fluid_rows), intent(in) :: given
    integer(c_int64_t), value :: first, last
    integer(c_int8_t), intent(inout) :: bare(0:*) !< 2 at a free surface, 1 beside one, 0 within
    type(fluid) :: v
    type(rows) :: to
    type(wall_points) :: w
    integer(c_int64_t) :: i, k, n
    integer :: j, beside
    real(c_double) :: r(3), d, t, g, spread, second(3, 3), shape(3, 3)
    call open_fluid(f, last, v)
    call open_rows(given, last, to)
    do i = first + 1, last
      n = to%first(i)
      second = 0
      spread = 0
      beside = 0
      do k = v%first(i) + 1, v%first(i + 1)
        j = v%neighbour(k) + 1
        r = v%record(1:3, i) - v%record(1:3, j)
        if (v%periodic) r = r - v%period*int(r*v%per + sign(0.5_c_double, r))
        d = sqrt(r(1)**2 + r(2)**2 + r(3)**2)
        t = 1 - 0.5_c_double*d/v%h
        if (t <= 0) cycle
        n = n + 1
        g = -v%scale*t**3*given%volume
        to%near(n) = j - 1
        to%pair(1:to%dim, n) = real(g*r(1:to%dim), c_float)
        to%pair(to%dim + 1, n) = real(-g, c_float)
        spread = spread - g*d**2
        call add_square(second, -g, r)
        beside = max(beside, int(v%open(j)))
      end do
      to%used(i) = int(n - to%first(i), c_int32_t)
      call wall_points_of(v, i, w)
      do k = 1, w%count
        d = sqrt(sum(w%r(:, k)**2))
        t = max(0.0_c_double, 1 - 0.5_c_double*d/v%h)
        spread = spread + v%scale*t**3*w%volume(k)*d**2
        call add_square(second, v%scale*t**3*w%volume(k), w%r(:, k))
      end do
      bare(i - 1) = merge(2_c_int8_t, merge(1_c_int8_t, 0_c_int8_t, beside == 2), spread < open_share*v%dim)
      call invert(v%dim, second, bare(i - 1) == 0, shape)
      if (v%dim == 2) then
        to%shape(:, i) = [shape(1, 1), shape(2, 2), shape(1, 2)]
      else
        to%shape(:, i) = [shape(1, 1), shape(2, 2), shape(3, 3), shape(1, 2), shape(1, 3), shape(2, 3)]
      end if
      call fill_walls(v, given, to, w, i, shape)
    end do
  end subroutine cairn_fluid_fill_rows

  !> Sums of each body over its points about particle i: twice the gradient, its moment, the force by the pressure that gravity adds
  !> there and its moment, the viscous coefficient and where it acts, from the centre of the body. Pressure acts at centres of
  !> curvature: the gradients of points about a particle beside a round body have a sum that does not lead through its axis.
  subroutine fill_walls(v, given, to, w, i, shape)
    type(fluid), intent(in) :: v
    type(cairn_fluid_rows), intent(in) :: given
    type(rows), intent(inout) :: to
    type(wall_points), intent(in) :: w
    integer(c_int64_t), intent(in) :: i
    real(c_double), intent(in) :: shape(3, 3)
    integer(c_int64_t) :: n, at
    integer :: k, body
    real(c_double) :: grad(3), arm(3), lever(3), force(3), d, t, high, c
    n = to%first_wall(i)
    do k = 1, w%count
      d = sqrt(sum(w%r(:, k)**2))
      t = 1 - 0.5_c_double*d/v%h
      if (t <= 0) cycle
      if (w%plane(k) == 0) then
        body = to%body_of_point(w%point(k))
        arm = v%surface(1:3, w%point(k)) - to%centre(:, body + 1)
        lever = arm - v%surface(14, w%point(k))*w%normal(:, k)
      else
        body = to%body_of_plane(w%plane(k))
        arm = v%record(1:3, i) - w%r(:, k) - to%centre(:, body + 1)
        lever = arm
      end if
      do at = n, to%first_wall(i) + 1, -1
        if (to%wall_body(at) == body) exit
      end do
      if (at <= to%first_wall(i)) then
        n = n + 1
        at = n
        to%wall_body(at) = body
        to%wall(:, at) = 0
      end if
      grad = -v%scale*t**3*w%volume(k)*matmul(shape, w%r(:, k))
      force = v%density*dot_product(v%resting, w%r(:, k))*grad
      to%wall(1:3, at) = to%wall(1:3, at) + 2*grad
      to%wall(4:6, at) = to%wall(4:6, at) + 2*cross(lever, grad)
      to%wall(7:9, at) = to%wall(7:9, at) + force
      to%wall(10:12, at) = to%wall(10:12, at) + cross(lever, force)
      if (.not. w%holds(k) .or. v%viscosity <= 0) cycle
      high = max(dot_product(w%r(:, k), w%normal(:, k)) - w%depth(k), least_height*v%dx)
      c = 2*v%viscosity*v%scale*t**3*w%volume(k)*(1 + w%depth(k)/high)
      to%wall(13, at) = to%wall(13, at) + c
      to%wall(14:16, at) = to%wall(14:16, at) + c*(arm + w%depth(k)*w%normal(:, k)) ! at the surface
    end do
    do at = to%first_wall(i) + 1, n
      if (to%wall(13, at) > 0) to%wall(14:16, at) = to%wall(14:16, at)/to%wall(13, at)
    end do
    to%used_wall(i) = int(n - to%first_wall(i), c_int32_t)
  end subroutine fill_walls

  !> Changes of velocity by pressures, and the compact Laplacian of these.
  subroutine cairn_fluid_push(given, filtered, first, last, p, load, change, laplacian) bind(c)
    type(cairn_fluid_rows), intent(in) :: given
    integer(c_int8_t), intent(in) :: filtered(0:*) !< 1: the Laplacian is over this particle and others of it, 0: not
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: p(0:*)            !< [Pa]
    real(c_double), intent(in) :: load(3*(given%dim - 1), 0:*) !< these times `shape`
    real(c_double), intent(inout) :: change(3, 0:*) !< [m/s]
    real(c_double), intent(inout) :: laplacian(0:*)      !< - step/density times the Laplacian [1/s]
    type(rows) :: r
    integer(c_int64_t) :: i, k
    real(c_double) :: a(3), s, own, l(6), factor
    integer :: j
    call open_rows(given, last, r)
    factor = given%step/given%density
    do i = first + 1, last
      own = p(i - 1)
      a = 0
      s = 0
      if (r%dim == 2) then
        do k = r%first(i) + 1, r%first(i) + r%used(i)
          j = r%near(k)
          l(1:3) = load(1:3, i - 1) + load(1:3, j)
          a(1) = a(1) + l(1)*r%pair(1, k) + l(3)*r%pair(2, k)
          a(2) = a(2) + l(3)*r%pair(1, k) + l(2)*r%pair(2, k)
          s = s + (own - p(j))*(filtered(j)*r%pair(3, k))
        end do
      else
        do k = r%first(i) + 1, r%first(i) + r%used(i)
          j = r%near(k)
          l = load(1:6, i - 1) + load(1:6, j)
          a(1) = a(1) + l(1)*r%pair(1, k) + l(4)*r%pair(2, k) + l(5)*r%pair(3, k)
          a(2) = a(2) + l(4)*r%pair(1, k) + l(2)*r%pair(2, k) + l(6)*r%pair(3, k)
          a(3) = a(3) + l(5)*r%pair(1, k) + l(6)*r%pair(2, k) + l(3)*r%pair(3, k)
          s = s + (own - p(j))*(filtered(j)*r%pair(4, k))
        end do
      end if
      do k = r%first_wall(i) + 1, r%first_wall(i) + r%used_wall(i)
        a = a + own*r%wall(1:3, k)
      end do
      change(:, i - 1) = -factor*a
      laplacian(i - 1) = 2*factor*filtered(i - 1)*s
    end do
  end subroutine cairn_fluid_push

  !> Divergence of velocities.
  subroutine cairn_fluid_divergence(given, first, last, velocity, of_body, divergence) bind(c)
    type(cairn_fluid_rows), intent(in) :: given
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: velocity(3, 0:*)    !< [m/s]
    real(c_double), intent(in) :: of_body(6, 0:*)     !< velocity and spin [m/s], [1/s]
    real(c_double), intent(inout) :: divergence(0:*)  !< [1/s]
    type(rows) :: r
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: own(3), u(3), t(6), s
    call open_rows(given, last, r)
    do i = first + 1, last
      own = velocity(:, i - 1)
      t = 0
      if (r%dim == 2) then
        do k = r%first(i) + 1, r%first(i) + r%used(i)
          j = r%near(k)
          u(1:2) = velocity(1:2, j) - own(1:2)
          t(1) = t(1) + u(1)*r%pair(1, k)
          t(2) = t(2) + u(2)*r%pair(2, k)
          t(3) = t(3) + (u(1)*r%pair(2, k) + u(2)*r%pair(1, k))
        end do
        s = r%shape(1, i)*t(1) + r%shape(2, i)*t(2) + r%shape(3, i)*t(3)
      else
        do k = r%first(i) + 1, r%first(i) + r%used(i)
          j = r%near(k)
          u = velocity(:, j) - own
          t(1:3) = t(1:3) + u*r%pair(1:3, k)
          t(4) = t(4) + (u(1)*r%pair(2, k) + u(2)*r%pair(1, k))
          t(5) = t(5) + (u(1)*r%pair(3, k) + u(3)*r%pair(1, k))
          t(6) = t(6) + (u(2)*r%pair(3, k) + u(3)*r%pair(2, k))
        end do
        s = dot_product(r%shape(1:6, i), t)
      end if
      do k = r%first_wall(i) + 1, r%first_wall(i) + r%used_wall(i)
        j = r%wall_body(k)
        s = s + dot_product(of_body(1:3, j) - own, r%wall(1:3, k)) + dot_product(of_body(4:6, j), r%wall(4:6, k))
      end do
      divergence(i - 1) = s
    end do
  end subroutine cairn_fluid_divergence

  !> Accelerations by Morris' viscosity.
  subroutine cairn_fluid_viscous(given, viscosity, first, last, velocity, of_body, acceleration) bind(c)
    type(cairn_fluid_rows), intent(in) :: given
    real(c_double), value :: viscosity !< [Pa s]
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: velocity(3, 0:*)       !< [m/s]
    real(c_double), intent(in) :: of_body(6, 0:*)        !< velocity and spin [m/s], [1/s]
    real(c_double), intent(inout) :: acceleration(3, 0:*) !< [m/s2]
    type(rows) :: r
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: own(3), a(3)
    call open_rows(given, last, r)
    do i = first + 1, last
      own = velocity(:, i - 1)
      a = 0
      do k = r%first(i) + 1, r%first(i) + r%used(i)
        j = r%near(k)
        a = a + 2*viscosity*r%pair(r%dim + 1, k)*(velocity(:, j) - own)
      end do
      do k = r%first_wall(i) + 1, r%first_wall(i) + r%used_wall(i)
        j = r%wall_body(k)
        a = a + r%wall(13, k)*(of_body(1:3, j) + cross(of_body(4:6, j), r%wall(14:16, k)) - own)
      end do
      acceleration(:, i - 1) = a/given%density
    end do
  end subroutine cairn_fluid_viscous
end module fluid_pressure
