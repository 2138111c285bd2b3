!> Rates of a weakly compressible fluid of particles: density by continuity with diffusion (delta-SPH: Molteni & Colagrossi 2009,
!> less what rests under gravity: Fourtakas et al. 2019), momentum by the symmetric pressure and Morris' viscosity (Morris et al.
!> 1997), with an approach that is damped, where viscosity does not, as by a Riemann solver of low dissipation (Zhang, Hu & Adams
!> 2017). Walls are points below their surface with the pressure of the particle and what gravity adds, and with the velocity that
!> makes the surface hold or slide.
module fluid_rates
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t, c_int8_t
  use fluid_view, only: add_square, cairn_fluid, fluid, from_behind, invert, mass_of, open_fluid, wall_points, wall_points_of
  implicit none
  private
  public :: cairn_fluid_density_rate, cairn_fluid_acceleration, cairn_fluid_on_points
  real(c_double), parameter :: least_height = 0.5_c_double !< of a particle above a wall that holds it, over the spacing
  real(c_double), parameter :: open_share = 0.75_c_double  !< divergence of places, over dim, below which a surface is free
  real(c_double), parameter :: nearest = 0.25_c_double !< to a surface without a barrier, over the spacing
  real(c_double), parameter :: facing = 0.7_c_double   !< cosine to its normal of a point that bars the way
  real(c_double), parameter :: barrier = 0.05_c_double !< of rho c^2, over a spacing
  ! Reynolds number of the spacing, times the limiter, below which viscosity does what the limiter would.
  real(c_double), parameter :: enough = 8
contains

  !> Rate of density of particles first to last - 1.
  subroutine cairn_fluid_density_rate(f, first, last, rate) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    real(c_double), intent(inout) :: rate(0:*) !< [kg/(m3 s)]
    type(fluid) :: v
    type(wall_points) :: w
    logical :: periodic
    real(c_double) :: period(3), per(3)
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: own(8), r(3), u(3), d, t, g, reach, divergence, spread, per_c2, moment(6), second(3, 3)
    real(c_double) :: rates(3, 3), shape(3, 3), e1, e2, a11, a12, a22, m11, m12, m22, mirrored
    call open_fluid(f, last, v)
    ! Walls press with twice the pressure of a particle. Among grains the rate is the adjoint of that, with velocities that walls
    ! mirror: a particle whose share of grains rises as it leaves a wall is driven off by it otherwise.
    mirrored = merge(2, 1, v%grains)
    periodic = v%periodic
    period = v%period
    per = v%per
    per_c2 = 1/v%c**2
    reach = 4*v%h**2
    do i = first + 1, last
      own = v%record(:, i)
      rates = 0
      moment = 0
      spread = 0
      a11 = 0
      a12 = 0
      a22 = 0
      m11 = 0
      m12 = 0
      m22 = 0
      do k = v%first(i) + 1, v%first(i + 1)
        j = v%neighbour(k) + 1
        r = own(1:3) - v%record(1:3, j)
        if (periodic) r = r - period*int(r*per + sign(0.5_c_double, r))
        d = r(1)**2 + r(2)**2 + r(3)**2
        if (d >= reach) cycle
        t = max(0.0_c_double, 1 - 0.5_c_double*sqrt(d)/v%h)
        g = -v%scale*t**3*v%record(7, j)
        u = own(4:6) - v%record(4:6, j)
        if (v%dim == 2) then
          e1 = g*r(1)
          e2 = g*r(2)
          a11 = a11 + e1*u(1)
          a22 = a22 + e2*u(2)
          a12 = a12 + (e2*u(1) + e1*u(2))
          m11 = m11 - e1*r(1)
          m22 = m22 - e2*r(2)
          m12 = m12 - e1*r(2)
        else
          call add_rates(g, u, r, rates, moment)
        end if
        spread = spread - g*((v%record(8, j) - own(8)) + v%density*(v%resting(1)*r(1) + v%resting(2)*r(2) + v%resting(3)*r(3)))
      end do
      call wall_points_of(v, i, w)
      if (v%dim == 2) then
        rates(1:2, 1) = [a11, 0.5_c_double*a12]
        rates(1:2, 2) = [0.5_c_double*a12, a22]
        moment(1:4) = [m11, m12, 0.0_c_double, m22]
      end if
      second = reshape([moment(1:3), moment(2), moment(4:5), moment(3), moment(5:6)], [3, 3])
      do k = 1, w%count
        r = w%r(:, k)
        t = max(0.0_c_double, 1 - 0.5_c_double*sqrt(sum(r**2))/v%h)
        g = -v%scale*t**3*w%volume(k)
        call add_square(second, -g, r)
        do j = 1, v%dim
          rates(:, j) = rates(:, j) + mirrored*g*(own(4:6) - w%velocity(:, k))*r(j)
        end do
      end do
      ! Exact for linear fields, also where the flow has stretched the lattice of the particles.
      call invert(v%dim, second, v%open(i) == 0, shape)
      divergence = sum(shape*rates)
      if (v%grains) spread = spread*(mass_of(v, i)/(own(7)*(v%density + per_c2*own(8)))) ! by the porosity: it is one of pressure
      rate(i - 1) = mass_of(v, i)/own(7)*divergence + 2*v%diffusion*v%h*v%c*per_c2*spread
    end do
  end subroutine cairn_fluid_density_rate

  !> Adds g u r' to rates, and - g r r', as xx xy xz yy yz zz, to a moment.
  pure subroutine add_rates(g, u, r, rates, moment)
    real(c_double), intent(in) :: g, u(3), r(3)
    real(c_double), intent(inout) :: rates(3, 3), moment(6)
    integer :: l
    do l = 1, 3
      rates(:, l) = rates(:, l) + (g*r(l))*u
    end do
    moment(1:3) = moment(1:3) - (g*r(1))*r
    moment(4:5) = moment(4:5) - (g*r(2))*r(2:3)
    moment(6) = moment(6) - (g*r(3))*r(3)
  end subroutine add_rates

  !> Accelerations of particles first to last - 1, the drift that keeps them evenly spread, and what presses on half-spaces.
  subroutine cairn_fluid_acceleration(f, first, last, acceleration, drift, bare, on_planes) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    real(c_double), intent(inout) :: acceleration(3, 0:*) !< [m/s2]
    real(c_double), intent(inout) :: drift(3, 0:*)        !< - gradient of the concentration, 0 at free surfaces and walls [1/m]
    integer(c_int8_t), intent(inout) :: bare(0:*)         !< 2 at a free surface, 1 beside one, 0 within
    real(c_double), intent(inout) :: on_planes(6, *)      !< force, torque about the body's centre, added [N, N m]
    type(fluid) :: v
    type(wall_points) :: w
    logical :: periodic
    real(c_double) :: period(3), per(3)
    integer(c_int64_t) :: i, k
    integer :: j, beside
    real(c_double) :: own(8), other(8), r(3), u(3), a(3), s(3), push(3), d, t, g, p, reach, spread, near, at(3)
    call open_fluid(f, last, v)
    periodic = v%periodic
    period = v%period
    per = v%per
    near = max(0.0_c_double, 1 - 0.5_c_double*v%dx/v%h)
    near = near**4*(2*v%dx/v%h + 1)
    reach = 4*v%h**2
    do i = first + 1, last
      own = v%record(:, i)
      own(8) = held_pressure(own(8), v%open(i))
      a = 0
      s = 0
      spread = 0
      beside = 0
      do k = v%first(i) + 1, v%first(i + 1)
        j = v%neighbour(k) + 1
        other = v%record(:, j)
        r = own(1:3) - other(1:3)
        if (periodic) r = r - period*int(r*per + sign(0.5_c_double, r))
        d = r(1)**2 + r(2)**2 + r(3)**2
        if (d >= reach) cycle
        d = sqrt(d)
        t = max(0.0_c_double, 1 - 0.5_c_double*d/v%h)
        g = -v%scale*t**3*other(7)
        u = own(4:6) - other(4:6)
        p = own(8) + held_pressure(other(8), v%open(j)) + approach(v, u(1)*r(1) + u(2)*r(2) + u(3)*r(3), d)
        a = a + g*(2*v%viscosity*u - p*r)
        s = s - g*(1 + 0.2_c_double*(t**4*(2*d/v%h + 1)/near)**4)*r
        spread = spread - g*d**2
        if (t > 0) beside = max(beside, int(v%open(j)))
      end do
      call wall_points_of(v, i, w)
      do k = 1, w%count
        call from_wall(v, own, w%r(:, k), w%velocity(:, k), w%normal(:, k), w%depth(k), w%holds(k), push, g)
        push = push*w%volume(k)
        a = a + push
        s = s - g*w%volume(k)*w%r(:, k)
        spread = spread - g*w%volume(k)*sum(w%r(:, k)**2)
        if (w%plane(k) == 0) cycle
        j = w%plane(k)
        at = own(1:3) - w%r(:, k) - v%plane(7:9, j)
        on_planes(1:3, j) = on_planes(1:3, j) - own(7)*push
        on_planes(4:6, j) = on_planes(4:6, j) - own(7)*[at(2)*push(3) - at(3)*push(2), at(3)*push(1) - at(1)*push(3), &
                                                        at(1)*push(2) - at(2)*push(1)]
      end do
      acceleration(:, i - 1) = a*own(7)/mass_of(v, i) + v%gravity
      bare(i - 1) = merge(2_c_int8_t, merge(1_c_int8_t, 0_c_int8_t, beside == 2), spread < open_share*v%dim)
      drift(:, i - 1) = merge(s, 0*s, bare(i - 1) == 0 .and. w%count == 0) ! shear along walls would go with it
    end do
  end subroutine cairn_fluid_acceleration

  !> Forces of the fluid on points first to last - 1 of surfaces.
  subroutine cairn_fluid_on_points(f, first, last, first_of, particle, force) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    integer(c_int64_t), intent(in) :: first_of(0:*) !< in particle
    integer(c_int32_t), intent(in) :: particle(0:*) !< numbers of particles, from 0
    real(c_double), intent(inout) :: force(3, 0:*)  !< [N]
    type(fluid) :: v
    logical :: periodic
    real(c_double) :: period(3), per(3)
    integer(c_int64_t) :: b, k
    integer :: i
    real(c_double) :: own(8), r(3), push(3), sum_of(3), g
    call open_fluid(f, last, v)
    periodic = v%periodic
    period = v%period
    per = v%per
    do b = first, last - 1
      sum_of = 0
      do k = first_of(b), first_of(b + 1) - 1
        i = particle(k) + 1
        own = v%record(:, i)
        own(8) = held_pressure(own(8), v%open(i))
        r = own(1:3) - v%surface(1:3, b + 1)
        if (periodic) r = r - period*int(r*per + sign(0.5_c_double, r))
        if (sum(r**2) >= 4*v%h**2) cycle
        if (from_behind(v, int(b) + 1, r)) cycle
        call from_wall(v, own, r, v%surface(4:6, b + 1), v%surface(7:9, b + 1), v%surface(10, b + 1), &
                       v%surface(12, b + 1) < 1.5_c_double, push, g)
        sum_of = sum_of - own(7)*(push*v%surface(11, b + 1))
      end do
      force(:, b) = sum_of
    end do
  end subroutine cairn_fluid_on_points

  !> Force of a point of a wall on a particle, over the volumes of both, with own(8) the pressure that acts.
  pure subroutine from_wall(v, own, r, velocity, normal, depth, holds, push, g)
    type(fluid), intent(in) :: v
    real(c_double), intent(in) :: own(8), r(3), velocity(3), normal(3), depth
    logical, intent(in) :: holds
    real(c_double), intent(out) :: push(3) !< [N/m6 | N/m4]
    real(c_double), intent(out) :: g !< W'/r
    real(c_double) :: u(3), d, p, high
    d = sqrt(sum(r**2))
    g = -v%scale*max(0.0_c_double, 1 - 0.5_c_double*d/v%h)**3
    u = own(4:6) - velocity
    p = 2*own(8) - v%density*dot_product(v%resting, r)
    if (own(8) >= 0) p = max(p, 0.0_c_double)
    p = p + approach(v, dot_product(u, normal)*dot_product(r, normal), d) ! a shear along it is none
    push = -g*p*r
    high = dot_product(r, normal) - depth
    if (high < nearest*v%dx .and. dot_product(r, normal) > facing*d) & ! whatever the pressure, nothing goes through
      push = push - g*barrier*v%density*v%c**2*(nearest - high/v%dx)*d*normal
    if (holds .and. v%viscosity > 0) then
      high = max(high, least_height*v%dx)
      push = push + g*2*v%viscosity*(1 + depth/high)*u
    end if
  end subroutine from_wall

  !> Tension at a free surface is none: particles there would clump.
  pure elemental function held_pressure(p, open) result(held)
    real(c_double), intent(in) :: p
    integer(c_int8_t), intent(in) :: open
    real(c_double) :: held
    held = merge(max(p, 0.0_c_double), p, open > 0)
  end function held_pressure

  !> Pressure that two particles feel together where they approach, speed times distance `closing` < 0.
  pure function approach(v, closing, d) result(p)
    type(fluid), intent(in) :: v
    real(c_double), intent(in) :: closing, d
    real(c_double) :: p, speed
    speed = max(0.0_c_double, -closing)/max(d, 1e-3_c_double*v%dx)
    p = v%density*speed*(v%artificial*v%c + max(0.0_c_double, &
        min(v%limiter*speed, v%c) - enough*v%viscosity/(v%density*v%dx)))
  end function approach
end module fluid_rates
