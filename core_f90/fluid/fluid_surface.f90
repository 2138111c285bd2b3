!> The free surface of a fluid of particles: how much of space the fluid fills, and surface tension.
!> Tension is a force by volume, the curvature times the gradient of the color (Brackbill, Kothe & Zemach 1992; with particles:
!> Morris 2000), with the curvature from normals along the surface alone, which needs no particles outside.
module fluid_surface
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use fluid_view, only: cairn_fluid, fluid, mass_of, open_fluid, wall_points, wall_points_of
  implicit none
  private
  public :: cairn_fluid_fill, cairn_fluid_color, cairn_fluid_normals, cairn_fluid_curvature, cairn_fluid_tension
  real(c_double), parameter :: clear = 0.1_c_double !< gradient of the color by the spacing from which it has a direction
  real(c_double), parameter :: sharp = 0.5_c_double !< greatest curvature times the spacing: one beyond is no curve of particles
  !> Viscosity along a surface over the root of density, twice the coefficient of tension and spacing: waves of the length of the
  !> spacing would grow.
  real(c_double), parameter :: damped = 0.5_c_double
contains

  !> Share of the space about particles first to last - 1 that the fluid and walls fill: the sum of the kernel, and what a flat
  !> surface takes from it by its gradient. It is 1 in and at the surface of a lattice of the spacing, within 3 to 8 %.
  subroutine cairn_fluid_fill(f, first, last, fill) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    real(c_double), intent(inout) :: fill(0:*) !< [-]
    type(fluid) :: v
    type(wall_points) :: w
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: r(3), d, t, slope(3), volume, inside, peak, step
    call open_fluid(f, last, v)
    peak = v%scale*v%h**2/5
    step = 0.66_c_double*v%h - 0.4_c_double*v%dx ! brings the first layer of a lattice to 1, h 1.3 to 3 spacings, 2D and 3D
    do i = first + 1, last
      volume = own_volume(v, int(i))
      inside = volume*peak
      slope = 0
      do k = v%first(i) + 1, v%first(i + 1)
        j = v%neighbour(k) + 1
        r = way(v, int(i), j)
        d = sqrt(sum(r**2))
        t = max(0.0_c_double, 1 - 0.5_c_double*d/v%h)
        volume = own_volume(v, j)
        inside = inside + volume*peak*t**4*(1 + 2*d/v%h)
        slope = slope + volume*v%scale*t**3*r
      end do
      call wall_points_of(v, i, w)
      do k = 1, w%count
        d = sqrt(sum(w%r(:, k)**2))
        t = max(0.0_c_double, 1 - 0.5_c_double*d/v%h)
        inside = inside + w%volume(k)*peak*t**4*(1 + 2*d/v%h)
        slope = slope + w%volume(k)*v%scale*t**3*w%r(:, k)
      end do
      fill(i - 1) = inside + step*sqrt(sum(slope**2))
    end do
  end subroutine cairn_fluid_fill

  !> Volume of particle i at rest; beside grains that of the space that it stands for.
  pure function own_volume(v, i) result(volume)
    type(fluid), intent(in) :: v
    integer, intent(in) :: i
    real(c_double) :: volume
    volume = v%mass/v%density
    if (v%grains) volume = v%record(7, i)
  end function own_volume

  !> Gradients of the color of particles first to last - 1: the color is 1 in the fluid and in walls.
  subroutine cairn_fluid_color(f, first, last, color) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    real(c_double), intent(inout) :: color(4, 0:*) !< gradient, into the fluid, and its size [1/m]
    type(fluid) :: v
    type(wall_points) :: w
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: r(3), t, s(3)
    call open_fluid(f, last, v)
    do i = first + 1, last
      s = 0
      do k = v%first(i) + 1, v%first(i + 1)
        j = v%neighbour(k) + 1
        r = way(v, int(i), j)
        t = max(0.0_c_double, 1 - 0.5_c_double*sqrt(sum(r**2))/v%h)
        s = s - (v%scale*t**3*v%record(7, j))*r
      end do
      call wall_points_of(v, i, w)
      do k = 1, w%count
        t = max(0.0_c_double, 1 - 0.5_c_double*sqrt(sum(w%r(:, k)**2))/v%h)
        s = s - (v%scale*t**3*w%volume(k))*w%r(:, k)
      end do
      color(1:3, i - 1) = s
      color(4, i - 1) = sqrt(sum(s**2))
    end do
  end subroutine cairn_fluid_color

  !> Normals of particles first to last - 1 into the fluid: the mean of the gradients about each, and its size, as these alone
  !> feel waves of the length of the spacing.
  subroutine cairn_fluid_normals(f, first, last, color, normal) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: color(4, 0:*)
    real(c_double), intent(inout) :: normal(4, 0:*) !< unit vector, and the gradient that it has [1/m]
    type(fluid) :: v
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: q, s(3), weights, weight
    call open_fluid(f, last, v)
    do i = first + 1, last
      s = color(1:3, i - 1)
      weights = 1
      do k = v%first(i) + 1, v%first(i + 1)
        j = v%neighbour(k) + 1
        q = min(2.0_c_double, sqrt(sum(way(v, int(i), j)**2))/v%h)
        weight = (1 - 0.5_c_double*q)**4*(2*q + 1)
        s = s + weight*color(1:3, j - 1)
        weights = weights + weight
      end do
      normal(4, i - 1) = sqrt(sum(s**2))/weights
      normal(1:3, i - 1) = 0
      if (normal(4, i - 1)*v%dx > clear) normal(1:3, i - 1) = s/(normal(4, i - 1)*weights)
    end do
  end subroutine cairn_fluid_normals

  !> Curvatures of the surface at particles first to last - 1 where it has a normal, > 0 about a drop: the slope of normals along
  !> the surface, by least squares.
  subroutine cairn_fluid_curvature(f, first, last, normal, curvature) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: normal(4, 0:*)
    real(c_double), intent(inout) :: curvature(0:*) !< [1/m]
    type(fluid) :: v
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: r(3), t, own(3), rise, square, weight
    call open_fluid(f, last, v)
    do i = first + 1, last
      curvature(i - 1) = 0
      if (.not. normal(4, i - 1)*v%dx > clear) cycle
      own = normal(1:3, i - 1)
      rise = 0
      square = 0
      do k = v%first(i) + 1, v%first(i + 1)
        j = v%neighbour(k) + 1
        if (.not. normal(4, j - 1)*v%dx > clear) cycle
        r = way(v, int(i), j)
        t = max(0.0_c_double, 1 - 0.5_c_double*sqrt(sum(r**2))/v%h)
        weight = t**3*normal(4, j - 1)
        r = r - dot_product(r, own)*own
        rise = rise + weight*dot_product(own - normal(1:3, j - 1), r)
        square = square + weight*sum(r**2)
      end do
      if (square > 0) curvature(i - 1) = max(-sharp/v%dx, min(sharp/v%dx, -(v%dim - 1)*rise/square))
    end do
  end subroutine cairn_fluid_curvature

  !> Adds what surface tension gives particles first to last - 1 to their accelerations: the mean curvature about them, along the
  !> gradient of the color.
  subroutine cairn_fluid_tension(f, tension, first, last, color, normal, curvature, acceleration) bind(c)
    type(cairn_fluid), intent(in) :: f
    real(c_double), value :: tension !< coefficient over the sum of the gradient across a flat surface [N/m]
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: color(4, 0:*), normal(4, 0:*), curvature(0:*)
    real(c_double), intent(inout) :: acceleration(3, 0:*) !< [m/s2]
    type(fluid) :: v
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: q, curvatures, weights, weight, r(3), a(3), stiff
    call open_fluid(f, last, v)
    stiff = 2*(v%dim + 2)*max(0.0_c_double, damped*sqrt(v%density*tension*v%dx) - v%viscosity)
    do i = first + 1, last
      a = 0
      curvatures = 0
      weights = 0
      if (normal(4, i - 1)*v%dx > clear) then
        curvatures = normal(4, i - 1)*curvature(i - 1)
        weights = normal(4, i - 1)
      end if
      do k = v%first(i) + 1, v%first(i + 1)
        j = v%neighbour(k) + 1
        if (.not. normal(4, j - 1)*v%dx > clear) cycle
        r = way(v, int(i), j)
        q = min(2.0_c_double, sqrt(sum(r**2))/v%h)
        weight = (1 - 0.5_c_double*q)**4*(2*q + 1)*normal(4, j - 1)
        curvatures = curvatures + weight*curvature(j - 1)
        weights = weights + weight
        if (.not. (normal(4, i - 1)*v%dx > clear .and. q > 0)) cycle
        weight = stiff*v%scale*(1 - 0.5_c_double*q)**3*v%record(7, j)/sum(r**2)
        a = a - (weight*dot_product(v%record(4:6, i) - v%record(4:6, j), r))*r
      end do
      if (weights > 0) a = a + (tension*curvatures/weights)*color(1:3, i - 1)
      acceleration(:, i - 1) = acceleration(:, i - 1) + (v%record(7, i)/mass_of(v, i))*a
    end do
  end subroutine cairn_fluid_tension

  !> Way from particle j to i.
  pure function way(v, i, j) result(r)
    type(fluid), intent(in) :: v
    integer, intent(in) :: i, j
    real(c_double) :: r(3)
    r = v%record(1:3, i) - v%record(1:3, j)
    if (v%periodic) r = r - v%period*int(r*v%per + sign(0.5_c_double, r))
  end function way
end module fluid_surface
