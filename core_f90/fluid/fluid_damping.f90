!> Damping of the motion that particles of an incompressible fluid have between each other: of the velocity along their distance,
!> less the part that the slope of the velocity about them explains. A flow that is linear over a kernel has none of it. The
!> impulses are along the distance and opposite, so that momentum and its moment are kept; a limiter keeps them from giving energy.
!> The reconstruction is that of Riemann solvers in SPH (Vila 1999; Zhang, Hu & Adams 2017). The speed by which a difference of
!> velocities becomes a pressure is sqrt(p / rho) with the pressure by gravity, as of a fall from the free surface.
module fluid_damping
  use, intrinsic :: iso_c_binding, only: c_double, c_int64_t
  use fluid_pressure, only: cairn_fluid_rows, open_rows, rows
  use fluid_view, only: add_square, invert, viscous_reynolds_number
  implicit none
  private
  public :: cairn_fluid_velocity_slopes, cairn_fluid_damp
  real(c_double), parameter :: least_moment = 0.05_c_double !< determinant of the second moment; at a flat free surface 1/4
  real(c_double), parameter :: longest = 0.3_c_double !< way of that speed in a step, over the spacing
contains

  !> Slopes of the velocity about particles first to last - 1, by sums over particles alone: exact for a linear flow beside walls
  !> and free surfaces too.
  subroutine cairn_fluid_velocity_slopes(given, first, last, velocity, slope) bind(c)
    type(cairn_fluid_rows), intent(in) :: given
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: velocity(3, 0:*)    !< [m/s]
    real(c_double), intent(inout) :: slope(3, 3, 0:*) !< component, direction [1/s]
    type(rows) :: r
    integer(c_int64_t) :: i, k
    integer :: c, d
    real(c_double) :: t(3, 3), u(3), second(3, 3), shape(3, 3), g(3)
    call open_rows(given, last, r)
    d = r%dim
    do i = first + 1, last
      t = 0
      second = 0
      g = 0
      do k = r%first(i) + 1, r%first(i) + r%used(i)
        if (.not. r%pair(d + 1, k) > 0) cycle
        u = velocity(:, r%near(k)) - velocity(:, i - 1)
        g(1:d) = r%pair(1:d, k)
        do c = 1, d
          t(1:d, c) = t(1:d, c) + u(1:d)*g(c)
        end do
        call add_square(second, 1/real(r%pair(d + 1, k), c_double), g)
      end do
      call invert(d, second, .true., shape, least_moment)
      slope(:, :, i - 1) = matmul(t, shape)
    end do
  end subroutine cairn_fluid_velocity_slopes

  !> Changes of the velocity of particles first to last - 1 by the damping.
  subroutine cairn_fluid_damp(given, viscosity, spacing, first, last, velocity, slope, pressure, change) bind(c)
    type(cairn_fluid_rows), intent(in) :: given
    real(c_double), value :: viscosity, spacing       !< [Pa s], [m]
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: velocity(3, 0:*)    !< [m/s]
    real(c_double), intent(in) :: slope(3, 3, 0:*)    !< [1/s]
    real(c_double), intent(in) :: pressure(0:*)       !< by gravity [Pa]
    real(c_double), intent(inout) :: change(3, 0:*)   !< [m/s]
    type(rows) :: r
    integer(c_int64_t) :: i, k
    integer :: j, d
    real(c_double) :: own(3), away(3), a(3), closing, speed, most, less
    call open_rows(given, last, r)
    d = r%dim
    most = longest*spacing/given%step
    less = viscous_reynolds_number*viscosity/(given%density*spacing)
    do i = first + 1, last
      own = velocity(:, i - 1)
      a = 0
      do k = r%first(i) + 1, r%first(i) + r%used(i)
        if (.not. r%pair(d + 1, k) > 0) cycle
        j = r%near(k)
        speed = min(most, sqrt(0.5_c_double*max(0.0_c_double, pressure(i - 1) + pressure(j))/given%density) - less)
        if (.not. speed > 0) cycle
        away = 0
        away(1:d) = -real(r%pair(1:d, k), c_double)/r%pair(d + 1, k)
        closing = unexplained(away, own - velocity(:, j), slope(:, :, i - 1) + slope(:, :, j))
        a(1:d) = a(1:d) + closing*speed*r%pair(1:d, k)
      end do
      change(:, i - 1) = given%step*a
    end do
  end subroutine cairn_fluid_damp

  !> Velocity of a particle relative to another along their distance, less that by the mean slope: between 0 and the whole.
  pure function unexplained(away, relative, slopes) result(u)
    real(c_double), intent(in) :: away(3)     !< from the other one [m]
    real(c_double), intent(in) :: relative(3) !< [m/s]
    real(c_double), intent(in) :: slopes(3, 3) !< sum of both [1/s]
    real(c_double) :: u, whole, left, distance
    u = 0
    distance = norm2(away)
    if (.not. distance > 0) return ! the particle itself
    whole = dot_product(away, relative)
    left = whole - 0.5_c_double*dot_product(away, matmul(slopes, away))
    u = merge(min(max(left, 0.0_c_double), whole), max(min(left, 0.0_c_double), whole), whole > 0)/distance
  end function unexplained
end module fluid_damping
