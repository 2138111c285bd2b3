!> Rates of a weakly compressible fluid of particles: density by continuity with diffusion (delta-SPH: Molteni & Colagrossi 2009,
!> less what rests under gravity: Fourtakas et al. 2019), momentum by the symmetric pressure, in viscous liquids by the adjoint
!> of the rate of density, and Morris' viscosity (Morris et al. 1997), with an approach that is damped, where viscosity does
!> not, as by a Riemann solver of low dissipation (Zhang, Hu & Adams 2017). Walls are points below their surface with the pressure
!> of the particle and what gravity adds, and with the velocity that makes the surface hold or slide.
module fluid_rates
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t, c_int8_t
  use fluid_view, only: add_square, cairn_fluid, fluid, from_behind, held_pressure, invert, mass_of, open_fluid, &
    symmetric_product, viscous_reynolds_number, wall_points, wall_points_of
  implicit none
  private
  public :: cairn_fluid_density_rate, cairn_fluid_acceleration, cairn_fluid_on_points
  real(c_double), parameter :: least_height = 0.5_c_double !< of a particle above a wall that holds it, over the spacing
  real(c_double), parameter :: open_share = 0.75_c_double  !< divergence of places, over dim, below which a surface is free
  real(c_double), parameter :: nearest = 0.25_c_double !< to a surface without a barrier, over the spacing
  real(c_double), parameter :: facing = 0.7_c_double   !< cosine to its normal of a point that bars the way
  real(c_double), parameter :: bowl = 0.65_c_double    !< rise of it over the square of the way aside, both over the spacing
  real(c_double), parameter :: barrier = 0.05_c_double !< of rho c^2, over a spacing
  integer, parameter :: most_near = 128 !< of particles whose sums are taken at once

  !> Neighbours of a particle i within its reach: x_i - x_j, u_i - u_j, squares of distances, volumes and pressures.
  type :: near_particles
    integer :: count = 0
    real(c_double), dimension(most_near + 1) :: r1, r2, r3, d2, u1, u2, u3, volume, pressure
    integer :: place(most_near + 1) !< numbers of the neighbours
  end type near_particles
contains

  !> Puts particles within reach from place k + 1 of the list on into a block, until it is full; k: the place of the last one.
  subroutine gather(v, own, last, k, near, held, beside)
    type(fluid), intent(in) :: v
    real(c_double), intent(in) :: own(8)
    integer(c_int64_t), intent(in) :: last
    integer(c_int64_t), intent(inout) :: k
    type(near_particles), intent(inout) :: near
    logical, intent(in) :: held          !< pressures as a free surface holds them
    integer, intent(inout) :: beside     !< greatest `open` of these particles
    real(c_double) :: r(3), d2, reach
    integer :: j, n
    reach = 4*v%h**2
    n = 1
    do while (k < last .and. n <= most_near)
      k = k + 1
      near%place(n) = v%neighbour(k) + 1
      r = own(1:3) - v%record(1:3, near%place(n))
      if (v%periodic) r = r - v%period*int(r*v%per + sign(0.5_c_double, r))
      d2 = r(1)**2 + r(2)**2 + r(3)**2
      near%r1(n) = r(1)
      near%r2(n) = r(2)
      near%r3(n) = r(3)
      near%d2(n) = d2
      n = n + merge(1, 0, d2 < reach) ! without a branch: the next one overwrites a neighbour beyond reach
    end do
    near%count = n - 1
    do n = 1, near%count
      j = near%place(n)
      near%u1(n) = own(4) - v%record(4, j)
      near%u2(n) = own(5) - v%record(5, j)
      near%u3(n) = own(6) - v%record(6, j)
      near%volume(n) = v%record(7, j)
      near%pressure(n) = v%record(8, j)
    end do
    if (.not. held) return
    do n = 1, near%count
      near%pressure(n) = held_pressure(near%pressure(n), v%open(near%place(n)))
      beside = max(beside, int(v%open(near%place(n))))
    end do
  end subroutine gather

  !> Rate of density of particles first to last - 1, and the correction of their gradients where pressure takes it too.
  subroutine cairn_fluid_density_rate(f, first, last, rate, gradient_correction) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    real(c_double), intent(inout) :: rate(0:*) !< [kg/(m3 s)]
    real(c_double), intent(inout) :: gradient_correction(6, 0:*) !< `shape` less 1: xx xy xz yy yz zz, where pressure takes it [-]
    type(fluid) :: v
    type(wall_points) :: w
    type(near_particles) :: near
    integer(c_int64_t) :: i, k
    integer :: j, beside
    real(c_double) :: own(8), r(3), t, g, divergence, spread, per_c2, moment(6), second(3, 3)
    real(c_double) :: rates(3, 3), shape(3, 3), mirrored
    logical :: within
    call open_fluid(f, last, v)
    per_c2 = 1/v%c**2
    beside = 0
    do i = first + 1, last
      own = v%record(:, i)
      rates = 0
      moment = 0
      spread = 0
      k = v%first(i)
      do while (k < v%first(i + 1))
        call gather(v, own, v%first(i + 1), k, near, .false., beside)
        if (v%dim == 2) then
          call add_rates_2d(v, near, own(8), rates, moment, spread)
        else
          call add_rates_3d(v, near, own(8), rates, moment, spread)
        end if
      end do
      ! Walls press with twice the pressure of a particle. The rate beside them is the adjoint of that, with velocities that walls
      ! mirror, so that pressure gives the liquid what it takes from bodies: still water is stirred otherwise, a free wall on it
      ! begins to swing, and a particle whose share of grains rises as it leaves a wall is driven off by it. At a free
      ! surface and next to it, where pressure is small, walls do not mirror: the liquid is struck there, twice as hard if they did.
      mirrored = merge(2, 1, v%grains .or. v%open(i) == 0)
      call wall_points_of(v, i, w)
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
      ! Exact for linear fields away from walls, also where the flow has stretched the lattice of the particles; at walls where
      ! pressure takes the same gradients.
      within = v%open(i) == 0 .and. (w%count == 0 .or. v%corrects_pressure)
      call invert(v%dim, second, within, shape)
      divergence = sum(shape*rates)
      if (v%corrects_pressure) then ! of a particle that is not within, `shape` is 1
        gradient_correction(:, i - 1) = [shape(1:3, 1) - [1, 0, 0], shape(2:3, 2) - [1, 0], shape(3, 3) - 1]
      end if
      if (v%grains) spread = spread*(mass_of(v, i)/(own(7)*(v%density + per_c2*own(8)))) ! by the porosity: it is one of pressure
      rate(i - 1) = mass_of(v, i)/own(7)*divergence + 2*v%diffusion*v%h*v%c*per_c2*spread
    end do
  end subroutine cairn_fluid_density_rate

  !> Adds the sums over particles in the plane: g u r', whose symmetric part alone acts, - g r r' as xx xy xz yy yz zz, and the
  !> diffusion of pressures.
  pure subroutine add_rates_2d(v, near, p, rates, moment, spread)
    type(fluid), intent(in) :: v
    type(near_particles), intent(in) :: near
    real(c_double), intent(in) :: p
    real(c_double), intent(inout) :: rates(3, 3), moment(6), spread
    real(c_double) :: g, e1, e2, a11, a12, a22, m11, m12, m22, sum_of
    integer :: k
    a11 = 0
    a12 = 0
    a22 = 0
    m11 = 0
    m12 = 0
    m22 = 0
    sum_of = 0
    !$omp simd reduction(+: a11, a12, a22, m11, m12, m22, sum_of) private(g, e1, e2)
    do k = 1, near%count
      g = -v%scale*near%volume(k)*(1 - 0.5_c_double*sqrt(near%d2(k))/v%h)**3
      e1 = g*near%r1(k)
      e2 = g*near%r2(k)
      a11 = a11 + e1*near%u1(k)
      a22 = a22 + e2*near%u2(k)
      a12 = a12 + (e2*near%u1(k) + e1*near%u2(k))
      m11 = m11 - e1*near%r1(k)
      m22 = m22 - e2*near%r2(k)
      m12 = m12 - e1*near%r2(k)
      sum_of = sum_of - g*((near%pressure(k) - p) + v%density*(v%resting(1)*near%r1(k) + v%resting(2)*near%r2(k)))
    end do
    rates(1, 1) = rates(1, 1) + a11
    rates(2, 2) = rates(2, 2) + a22
    rates(1, 2) = rates(1, 2) + 0.5_c_double*a12
    rates(2, 1) = rates(1, 2)
    moment(1) = moment(1) + m11
    moment(2) = moment(2) + m12
    moment(4) = moment(4) + m22
    spread = spread + sum_of
  end subroutine add_rates_2d

  !> Adds the sums over particles in space: g u r', - g r r' as xx xy xz yy yz zz, and the diffusion of pressures.
  pure subroutine add_rates_3d(v, near, p, rates, moment, spread)
    type(fluid), intent(in) :: v
    type(near_particles), intent(in) :: near
    real(c_double), intent(in) :: p
    real(c_double), intent(inout) :: rates(3, 3), moment(6), spread
    real(c_double) :: g, e1, e2, e3, a11, a12, a13, a21, a22, a23, a31, a32, a33, m11, m12, m13, m22, m23, m33, sum_of
    integer :: k
    a11 = 0
    a12 = 0
    a13 = 0
    a21 = 0
    a22 = 0
    a23 = 0
    a31 = 0
    a32 = 0
    a33 = 0
    m11 = 0
    m12 = 0
    m13 = 0
    m22 = 0
    m23 = 0
    m33 = 0
    sum_of = 0
    !$omp simd reduction(+: a11, a12, a13, a21, a22, a23, a31, a32, a33, m11, m12, m13, m22, m23, m33, sum_of) &
    !$omp private(g, e1, e2, e3)
    do k = 1, near%count
      g = -v%scale*near%volume(k)*(1 - 0.5_c_double*sqrt(near%d2(k))/v%h)**3
      e1 = g*near%r1(k)
      e2 = g*near%r2(k)
      e3 = g*near%r3(k)
      a11 = a11 + e1*near%u1(k)
      a21 = a21 + e1*near%u2(k)
      a31 = a31 + e1*near%u3(k)
      a12 = a12 + e2*near%u1(k)
      a22 = a22 + e2*near%u2(k)
      a32 = a32 + e2*near%u3(k)
      a13 = a13 + e3*near%u1(k)
      a23 = a23 + e3*near%u2(k)
      a33 = a33 + e3*near%u3(k)
      m11 = m11 - e1*near%r1(k)
      m12 = m12 - e1*near%r2(k)
      m13 = m13 - e1*near%r3(k)
      m22 = m22 - e2*near%r2(k)
      m23 = m23 - e2*near%r3(k)
      m33 = m33 - e3*near%r3(k)
      sum_of = sum_of - g*((near%pressure(k) - p) &
                           + v%density*(v%resting(1)*near%r1(k) + v%resting(2)*near%r2(k) + v%resting(3)*near%r3(k)))
    end do
    rates = rates + reshape([a11, a21, a31, a12, a22, a32, a13, a23, a33], [3, 3])
    moment = moment + [m11, m12, m13, m22, m23, m33]
    spread = spread + sum_of
  end subroutine add_rates_3d

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
    type(near_particles) :: near
    integer(c_int64_t) :: i, k
    integer :: j, beside
    real(c_double) :: own(8), a(3), s(3), push(3), shear(3), g, peak, spread, at(3)
    call open_fluid(f, last, v)
    peak = max(0.0_c_double, 1 - 0.5_c_double*v%dx/v%h)
    peak = peak**4*(2*v%dx/v%h + 1)
    do i = first + 1, last
      own = v%record(:, i)
      own(8) = held_pressure(own(8), v%open(i))
      a = 0
      s = 0
      spread = 0
      beside = 0
      k = v%first(i)
      do while (k < v%first(i + 1))
        call gather(v, own, v%first(i + 1), k, near, .true., beside)
        call add_forces(v, near, own(8), peak, a, s, spread)
        if (v%corrects_pressure) call add_corrected_pressure(v, near, own(8)*v%gradient_correction(:, i), a)
      end do
      call wall_points_of(v, i, w)
      do k = 1, w%count
        call from_wall(v, own, i, w%r(:, k), w%velocity(:, k), w%normal(:, k), w%depth(k), w%holds(k), push, shear, g)
        push = (push + shear + barred(v, w%r(:, k), w%normal(:, k), w%depth(k), w%centre(k), w%plane(k) > 0))*w%volume(k)
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

  !> Adds the sums over particles: accelerations by pressure and viscosity over density, the slope of the concentration, and
  !> the divergence of places.
  pure subroutine add_forces(v, near, p, peak, a, s, spread)
    type(fluid), intent(in) :: v
    type(near_particles), intent(in) :: near
    real(c_double), intent(in) :: p, peak !< the kernel at a spacing
    real(c_double), intent(inout) :: a(3), s(3), spread
    real(c_double) :: a1, a2, a3, s1, s2, s3, sum_of, d, t, g, f, c, both
    integer :: k
    a1 = 0
    a2 = 0
    a3 = 0
    s1 = 0
    s2 = 0
    s3 = 0
    sum_of = 0
    both = 2*v%viscosity
    !$omp simd reduction(+: a1, a2, a3, s1, s2, s3, sum_of) private(d, t, g, f, c)
    do k = 1, near%count
      d = sqrt(near%d2(k))
      t = 1 - 0.5_c_double*d/v%h
      g = -v%scale*near%volume(k)*t**3
      f = p + near%pressure(k) + approach(v, near%u1(k)*near%r1(k) + near%u2(k)*near%r2(k) + near%u3(k)*near%r3(k), d)
      c = 1 + 0.2_c_double*(t**4*(2*d/v%h + 1)/peak)**4
      a1 = a1 + g*(both*near%u1(k) - f*near%r1(k))
      a2 = a2 + g*(both*near%u2(k) - f*near%r2(k))
      a3 = a3 + g*(both*near%u3(k) - f*near%r3(k))
      s1 = s1 - g*c*near%r1(k)
      s2 = s2 - g*c*near%r2(k)
      s3 = s3 - g*c*near%r3(k)
      sum_of = sum_of - g*near%d2(k)
    end do
    a = a + [a1, a2, a3]
    s = s + [s1, s2, s3]
    spread = spread + sum_of
  end subroutine add_forces

  !> Adds what the correction of gradients changes in the pressure forces, which are the adjoint of the rate of density then.
  !> Without it particles have to be evenly spread for their pressure to be in balance: they resist a change of places as a
  !> solid does, with a strength that grows with the pressure, and a slow body that moves them stands still.
  pure subroutine add_corrected_pressure(v, near, own, a)
    type(fluid), intent(in) :: v
    type(near_particles), intent(in) :: near
    real(c_double), intent(in) :: own(6) !< pressure times the correction [Pa]
    real(c_double), intent(inout) :: a(3)
    real(c_double) :: g, b(6)
    integer :: k
    do k = 1, near%count
      g = v%scale*near%volume(k)*(1 - 0.5_c_double*sqrt(near%d2(k))/v%h)**3
      b = own + near%pressure(k)*v%gradient_correction(:, near%place(k))
      a = a + g*symmetric_product(b, [near%r1(k), near%r2(k), near%r3(k)])
    end do
  end subroutine add_corrected_pressure

  !> Forces of the fluid on points first to last - 1 of surfaces, the part of them by viscosity, and the normals of sides that
  !> hold the fluid, as particles see them.
  subroutine cairn_fluid_on_points(f, first, last, first_of, particle, force, shear, side) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    integer(c_int64_t), intent(in) :: first_of(0:*) !< in particle
    integer(c_int32_t), intent(in) :: particle(0:*) !< numbers of particles, from 0
    real(c_double), intent(inout) :: force(3, 0:*), shear(3, 0:*) !< [N | N/m]
    real(c_double), intent(inout) :: side(3, 0:*) !< normal into the body times the wetted area, 0 without viscosity [m2 | m]
    type(fluid) :: v
    logical :: periodic
    real(c_double) :: period(3), per(3)
    integer(c_int64_t) :: b, k
    integer :: i
    real(c_double) :: own(8), r(3), push(3), drag(3), sum_of(3), of_shear(3), of_side(3), g
    logical :: holds
    call open_fluid(f, last, v)
    periodic = v%periodic
    period = v%period
    per = v%per
    do b = first, last - 1
      sum_of = 0
      of_shear = 0
      of_side = 0
      holds = v%surface(12, b + 1) < 1.5_c_double
      do k = first_of(b), first_of(b + 1) - 1
        i = particle(k) + 1
        own = v%record(:, i)
        own(8) = held_pressure(own(8), v%open(i))
        r = own(1:3) - v%surface(1:3, b + 1)
        if (periodic) r = r - period*int(r*per + sign(0.5_c_double, r))
        if (sum(r**2) >= 4*v%h**2) cycle
        if (from_behind(v, int(b) + 1, r)) cycle
        call from_wall(v, own, int(i, c_int64_t), r, v%surface(4:6, b + 1), v%surface(7:9, b + 1), &
                       v%surface(10, b + 1), holds, push, drag, g)
        push = push + barred(v, r, v%surface(7:9, b + 1), v%surface(10, b + 1), v%surface(14, b + 1), .false.)
        sum_of = sum_of - own(7)*((push + drag)*v%surface(11, b + 1))
        of_shear = of_shear - own(7)*(drag*v%surface(11, b + 1))
        if (holds .and. v%viscosity > 0) of_side = of_side + 2*g*own(7)*v%surface(11, b + 1)*r
      end do
      force(:, b) = sum_of
      shear(:, b) = of_shear
      side(:, b) = of_side
    end do
  end subroutine cairn_fluid_on_points

  !> Forces of a point of a wall on particle i by pressure and by viscosity, over the volumes of both, with own(8) the pressure that
  !> acts.
  pure subroutine from_wall(v, own, i, r, velocity, normal, depth, holds, push, shear, g)
    type(fluid), intent(in) :: v
    real(c_double), intent(in) :: own(8), r(3), velocity(3), normal(3), depth
    integer(c_int64_t), intent(in) :: i
    logical, intent(in) :: holds
    real(c_double), intent(out) :: push(3), shear(3) !< [N/m6 | N/m4]
    real(c_double), intent(out) :: g !< W'/r
    real(c_double) :: u(3), d, p, high
    d = sqrt(sum(r**2))
    g = -v%scale*max(0.0_c_double, 1 - 0.5_c_double*d/v%h)**3
    u = own(4:6) - velocity
    p = 2*own(8) - v%density*dot_product(v%resting, r)
    if (own(8) >= 0) p = max(p, 0.0_c_double)
    push = 0
    if (v%corrects_pressure) push = -g*p*symmetric_product(v%gradient_correction(:, i), r)
    p = p + approach(v, dot_product(u, normal)*dot_product(r, normal), d) ! a shear along it is none
    push = push - g*p*r
    shear = 0
    if (holds .and. v%viscosity > 0) then
      high = max(dot_product(r, normal) - depth, least_height*v%dx)
      shear = g*2*v%viscosity*(1 + depth/high)*u
    end if
  end subroutine from_wall

  !> Force over both volumes of a point of a wall on a particle that is about to go through its surface, whatever the pressure.
  !> Heights are those above the surface itself: at round sides by their centre, at flat ones of bodies, which end somewhere,
  !> above a bowl about the point, so that a particle beyond an edge, which is near to another side alone, feels none.
  pure function barred(v, r, normal, depth, centre, endless) result(push)
    type(fluid), intent(in) :: v
    real(c_double), intent(in) :: r(3), normal(3), depth, centre
    logical, intent(in) :: endless !< of a half-space
    real(c_double) :: push(3), along, d, high
    push = 0
    along = dot_product(r, normal)
    d = sqrt(sum(r**2))
    high = along - depth
    if (abs(centre) > 0) then
      high = sign(sqrt(sum((r + centre*normal)**2)), centre) - centre - depth
    else if (.not. endless) then
      high = high + bowl*(d**2 - along**2)/v%dx
    end if
    if (high < nearest*v%dx .and. along > facing*d) &
      push = v%scale*max(0.0_c_double, 1 - 0.5_c_double*d/v%h)**3*barrier*v%density*v%c**2*(nearest - high/v%dx)*d*normal
  end function barred

  !> Pressure that two particles feel together where they approach, speed times distance `closing` < 0.
  pure function approach(v, closing, d) result(p)
    type(fluid), intent(in) :: v
    real(c_double), intent(in) :: closing, d
    real(c_double) :: p, speed
    speed = max(0.0_c_double, -closing)/max(d, 1e-3_c_double*v%dx)
    p = v%density*speed*(v%artificial*v%c + max(0.0_c_double, &
        min(v%limiter*speed, v%c) - viscous_reynolds_number*v%viscosity/(v%density*v%dx)))
  end function approach
end module fluid_rates
