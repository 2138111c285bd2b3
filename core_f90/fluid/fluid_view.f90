!> Data of a meshless fluid as kernels see them, and the kernel function.
!> Wendland's C2 function (Wendland 1995) of support 2 h: gradients need no root but that of the distance, and particles do not pair
!> (Dehnen & Aly 2012).
module fluid_view
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_int64_t, c_int8_t, c_ptr
  implicit none
  private
  public :: add_square, cross, invert, mass_of, symmetric_product
  public :: from_behind, held_pressure, viscous_reynolds_number
  public :: cairn_fluid, fluid, open_fluid, gradient_scale, wall_points, wall_points_of
  integer, parameter :: record_size = 8, surface_size = 14, plane_size = 16
  !> Reynolds number of a spacing, by a difference of velocities, below which viscosity damps this difference by itself.
  real(c_double), parameter :: viscous_reynolds_number = 8
  integer, parameter :: most_wall_points = 1024 !< of half-spaces and surfaces about one particle; more are left out

  type, bind(c) :: cairn_fluid
    integer(c_int32_t) :: dim, planes
    real(c_double) :: smoothing, spacing, mass, density, sound_speed, viscosity, diffusion, limiter, artificial
    real(c_double) :: gravity(3), resting(3), period(3)
    type(c_ptr) :: record, first, neighbour, surface, first_point, point, plane, open, masses, gradient_correction
  end type cairn_fluid

  type :: fluid
    integer :: dim, planes
    real(c_double) :: h, dx, mass, density, c, viscosity, diffusion, limiter, artificial
    real(c_double) :: gravity(3), resting(3), period(3), per(3), scale !< per: 1/period, 0 without one
    logical :: periodic, grains, corrects_pressure !< pressure takes corrected gradients
    real(c_double), pointer, contiguous :: record(:, :), surface(:, :), plane(:, :)
    integer(c_int64_t), pointer, contiguous :: first(:), first_point(:)
    integer(c_int32_t), pointer, contiguous :: neighbour(:), point(:)
    integer(c_int8_t), pointer, contiguous :: open(:)
    real(c_double), pointer, contiguous :: gradient_correction(:, :) !< less 1; correction of gradients: xx xy xz yy yz zz
    real(c_double), pointer, contiguous :: masses(:) !< of particles beside grains; none where all have that of a spacing
  end type fluid

  !> Points of walls about a particle. r: from the point to the particle [m].
  type :: wall_points
    integer :: count = 0
    integer :: plane(most_wall_points) !< number of the half-space, 0: a point of a surface
    integer :: point(most_wall_points) !< its number there, 0: of a half-space
    real(c_double) :: r(3, most_wall_points), velocity(3, most_wall_points), normal(3, most_wall_points)
    real(c_double) :: depth(most_wall_points), volume(most_wall_points)
    real(c_double) :: centre(most_wall_points) !< of curvature, below the point along its normal [m]; 0: of a flat side
    logical :: holds(most_wall_points)
  end type wall_points
contains

  pure function gradient_scale(dim, h) result(scale)
    integer, intent(in) :: dim
    real(c_double), intent(in) :: h
    real(c_double) :: scale !< W'/r = -scale (1 - q/2)**3
    real(c_double), parameter :: pi = acos(-1.0_c_double)
    if (dim == 2) then
      scale = 5*7/(4*pi*h**4)
    else
      scale = 5*21/(16*pi*h**5)
    end if
  end function gradient_scale

  !> View of the data of a call.
  subroutine open_fluid(given, last, f)
    type(cairn_fluid), intent(in) :: given
    integer(c_int64_t), intent(in) :: last !< particles that are read by number at least
    type(fluid), intent(out) :: f
    integer(c_int64_t), parameter :: any_size = huge(1_c_int32_t)
    f%dim = given%dim
    f%planes = given%planes
    f%h = given%smoothing
    f%dx = given%spacing
    f%mass = given%mass
    f%density = given%density
    f%c = given%sound_speed
    f%viscosity = given%viscosity
    f%diffusion = given%diffusion
    f%limiter = given%limiter
    f%artificial = given%artificial
    f%gravity = given%gravity
    f%resting = given%resting
    f%period = given%period
    f%per = 0
    where (f%period > 0) f%per = 1/f%period
    f%periodic = any(f%period > 0)
    f%scale = gradient_scale(f%dim, f%h)
    call c_f_pointer(given%record, f%record, [int(record_size, c_int64_t), any_size])
    call c_f_pointer(given%surface, f%surface, [int(surface_size, c_int64_t), any_size])
    call c_f_pointer(given%plane, f%plane, [int(plane_size, c_int64_t), max(1_c_int64_t, int(f%planes, c_int64_t))])
    call c_f_pointer(given%first, f%first, [last + 1])
    call c_f_pointer(given%first_point, f%first_point, [last + 1])
    call c_f_pointer(given%neighbour, f%neighbour, [any_size])
    call c_f_pointer(given%point, f%point, [any_size])
    call c_f_pointer(given%open, f%open, [any_size])
    nullify (f%masses)
    f%grains = c_associated(given%masses)
    if (f%grains) call c_f_pointer(given%masses, f%masses, [any_size])
    nullify (f%gradient_correction)
    f%corrects_pressure = c_associated(given%gradient_correction)
    if (f%corrects_pressure) call c_f_pointer(given%gradient_correction, f%gradient_correction, [6_c_int64_t, any_size])
  end subroutine open_fluid

  !> Mass of particle i [kg | kg/m].
  pure function mass_of(f, i) result(mass)
    type(fluid), intent(in) :: f
    integer(c_int64_t), intent(in) :: i
    real(c_double) :: mass
    mass = f%mass
    if (f%grains) mass = f%masses(i)
  end function mass_of

  !> Points of surfaces and half-spaces within reach of particle i.
  subroutine wall_points_of(f, i, w)
    type(fluid), intent(in) :: f
    integer(c_int64_t), intent(in) :: i
    type(wall_points), intent(inout) :: w
    integer(c_int64_t) :: k
    integer :: b, n, p
    real(c_double) :: r(3)
    n = 0
    do k = f%first_point(i) + 1, f%first_point(i + 1)
      b = f%point(k) + 1
      r = f%record(1:3, i) - f%surface(1:3, b)
      if (f%periodic) r = r - f%period*int(r*f%per + sign(0.5_c_double, r))
      if (sum(r**2) >= 4*f%h**2 .or. n == most_wall_points) cycle
      if (from_behind(f, b, r)) cycle
      n = n + 1
      w%r(:, n) = r
      w%velocity(:, n) = f%surface(4:6, b)
      w%normal(:, n) = f%surface(7:9, b)
      w%depth(n) = f%surface(10, b)
      w%centre(n) = f%surface(14, b)
      w%volume(n) = f%surface(11, b)
      w%holds(n) = f%surface(12, b) < 1.5_c_double
      w%plane(n) = 0
      w%point(n) = b
    end do
    w%count = n
    do p = 1, f%planes
      call points_of_plane(f, i, p, w)
    end do
  end subroutine wall_points_of

  !> True if the far side of a thin body hides point b of a surface from a particle, at r from the point.
  pure function from_behind(f, b, r) result(hidden)
    type(fluid), intent(in) :: f
    integer, intent(in) :: b
    real(c_double), intent(in) :: r(3)
    logical :: hidden
    hidden = dot_product(r, f%surface(7:9, b)) - f%surface(10, b) < -f%surface(13, b)
  end function from_behind

  !> Points of half-space p about particle i: a lattice below its foot, so that the wall is smooth along itself. A point within a
  !> half-space before it is that one's.
  subroutine points_of_plane(f, i, p, w)
    type(fluid), intent(in) :: f
    integer(c_int64_t), intent(in) :: i
    integer, intent(in) :: p
    type(wall_points), intent(inout) :: w
    real(c_double) :: n(3), t(3), s(3), r(3), at(3), high, deep, reach, across
    integer :: layer, k, l, most, other, depth_layers, beside
    logical :: turns
    n = f%plane(4:6, p)
    r = f%record(1:3, i) - f%plane(1:3, p)
    high = dot_product(r, n)
    reach = 2*f%h
    if (.not. high < reach) return
    high = max(high, 0.05_c_double*f%dx)
    t = 0
    s = 0
    if (f%dim == 2) then
      t(1:2) = [-n(2), n(1)]
    else
      t(minloc(abs(n), 1)) = 1
      t = t - dot_product(t, n)*n
      t = t/sqrt(sum(t**2))
      s = [n(2)*t(3) - n(3)*t(2), n(3)*t(1) - n(1)*t(3), n(1)*t(2) - n(2)*t(1)]
    end if
    do beside = p - 1, 1, -1 ! the last half-space before it whose points may be its own
      if (dot_product(f%record(1:3, i) - f%plane(1:3, beside), f%plane(4:6, beside)) < 1.001_c_double*reach) exit
    end do
    turns = any(abs(f%plane(13:15, p)) > 0)
    depth_layers = ceiling(reach/f%dx)
    most = int(reach/f%dx)
    do layer = 1, depth_layers
      deep = (layer - 0.5_c_double)*f%dx
      if (high + deep >= reach) exit
      across = (1.001_c_double*reach**2 - (high + deep)**2)/f%dx**2 ! a bound: the distance itself decides
      do l = merge(-most, 0, f%dim == 3), merge(most, 0, f%dim == 3)
        do k = -most, most
          if (k*k + l*l > across) cycle
          r = (high + deep)*n + k*f%dx*t + l*f%dx*s
          if (sum(r**2) >= reach**2) cycle
          at = f%record(1:3, i) - r
          do other = 1, beside
            if (dot_product(at - f%plane(1:3, other), f%plane(4:6, other)) < 0) exit
          end do
          if (other <= beside .or. w%count == most_wall_points) cycle
          w%count = w%count + 1
          w%r(:, w%count) = r
          at = at - f%plane(7:9, p)
          w%velocity(:, w%count) = f%plane(10:12, p)
          if (turns) w%velocity(:, w%count) = f%plane(10:12, p) + cross(f%plane(13:15, p), at)
          w%normal(:, w%count) = n
          w%depth(w%count) = deep
          w%centre(w%count) = 0
          w%volume(w%count) = f%dx**f%dim
          w%holds(w%count) = f%plane(16, p) < 1.5_c_double
          w%plane(w%count) = p
          w%point(w%count) = 0
        end do
      end do
    end do
  end subroutine points_of_plane

  !> Adds a weighted square of r to a moment.
  pure subroutine add_square(sum_of, weight, r)
    real(c_double), intent(inout) :: sum_of(3, 3)
    real(c_double), intent(in) :: weight, r(3)
    integer :: l
    do l = 1, 3
      sum_of(:, l) = sum_of(:, l) + weight*r*r(l)
    end do
  end subroutine add_square

  !> Inverse of the second moment of the gradients about a particle within the liquid, with which they are exact for linear fields
  !> (Randles & Libersky 1996); 1 elsewhere, and where neighbours lie too unevenly.
  pure subroutine invert(dim, second, within, shape, least)
    integer, intent(in) :: dim
    real(c_double), intent(in) :: second(3, 3)
    logical, intent(in) :: within
    real(c_double), intent(out) :: shape(3, 3)
    real(c_double), intent(in), optional :: least !< determinant that is inverted, 0.3 if not given [-]
    real(c_double) :: a(3, 3), det, enough
    integer :: l
    enough = 0.3_c_double
    if (present(least)) enough = least
    shape = 0
    do l = 1, 3
      shape(l, l) = 1
    end do
    if (.not. within) return
    a = second
    if (dim == 2) a(3, :) = [0, 0, 1]
    if (dim == 2) a(:, 3) = [0, 0, 1]
    shape(:, 1) = cross(a(:, 2), a(:, 3))
    shape(:, 2) = cross(a(:, 3), a(:, 1))
    shape(:, 3) = cross(a(:, 1), a(:, 2))
    det = dot_product(a(:, 1), shape(:, 1))
    if (det > enough) then
      shape = shape/det
    else
      shape = 0
      do l = 1, 3
        shape(l, l) = 1
      end do
    end if
  end subroutine invert

  !> Product of a symmetric matrix, xx xy xz yy yz zz, and a vector.
  pure function symmetric_product(a, r) result(out)
    real(c_double), intent(in) :: a(6), r(3)
    real(c_double) :: out(3)
    out = [a(1)*r(1) + a(2)*r(2) + a(3)*r(3), a(2)*r(1) + a(4)*r(2) + a(5)*r(3), a(3)*r(1) + a(5)*r(2) + a(6)*r(3)]
  end function symmetric_product

  !> Tension at a free surface is none: particles there would clump.
  pure elemental function held_pressure(p, open) result(held)
    real(c_double), intent(in) :: p
    integer(c_int8_t), intent(in) :: open
    real(c_double) :: held
    held = merge(max(p, 0.0_c_double), p, open > 0)
  end function held_pressure

  pure function cross(a, b) result(c)
    real(c_double), intent(in) :: a(3), b(3)
    real(c_double) :: c(3)
    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross
end module fluid_view
