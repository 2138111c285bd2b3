!> Grains smaller than the particles of a fluid, by averages over volumes (Anderson & Jackson 1967; with particles of fluid:
!> Robinson, Ramaioli & Luding 2014). A grain shares out its volume to the particles about it, by weights whose sum is 1, and
!> reads the flow by the same weights, so that forces are equal and opposite. Particles stand for
!> volumes of space, less those of grains.
module fluid_grains
  use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_int32_t, c_int64_t, c_int8_t, c_ptr
  use fluid_view, only: cairn_fluid, fluid, open_fluid
  implicit none
  private
  public :: cairn_fluid_grains, grain_pairs, open_grains
  public :: cairn_fluid_grain_weights, cairn_fluid_grain_solids, cairn_fluid_grain_push, cairn_fluid_grain_bear, &
            cairn_fluid_grain_drag, cairn_fluid_grain_react
  integer, parameter :: grain_size = 12
  integer, parameter :: di_felice = 3, ergun = 4, gidaspow = 5 !< numbers of laws, as rules of a fluid have them
  real(c_double), parameter :: most_solid = 0.9_c_double !< share of a particle's volume that grains take; more of them are dry
  real(c_double), parameter :: dry = 0.25_c_double, wetted = 0.75_c_double !< sums of the kernel between which a free surface wets


  type, bind(c) :: cairn_fluid_grains
    integer(c_int32_t) :: grains
    type(c_ptr) :: grain, first_of, particle, weight, first, grain_of, pair, wet, solid, mass
  end type cairn_fluid_grains

  type :: grain_pairs
    real(c_double), pointer, contiguous :: grain(:, :), weight(:), wet(:), solid(:), mass(:)
    integer(c_int64_t), pointer, contiguous :: first_of(:), first(:), pair(:)
    integer(c_int32_t), pointer, contiguous :: particle(:), grain_of(:)
  end type grain_pairs
contains

  subroutine open_grains(given, v)
    type(cairn_fluid_grains), intent(in) :: given
    type(grain_pairs), intent(out) :: v
    integer(c_int64_t), parameter :: any_size = huge(1_c_int32_t)
    call c_f_pointer(given%grain, v%grain, [int(grain_size, c_int64_t), int(given%grains, c_int64_t)])
    call c_f_pointer(given%wet, v%wet, [int(given%grains, c_int64_t)])
    call c_f_pointer(given%first_of, v%first_of, [int(given%grains, c_int64_t) + 1])
    call c_f_pointer(given%particle, v%particle, [any_size])
    call c_f_pointer(given%weight, v%weight, [any_size])
    call c_f_pointer(given%first, v%first, [any_size])
    call c_f_pointer(given%grain_of, v%grain_of, [any_size])
    call c_f_pointer(given%pair, v%pair, [any_size])
    call c_f_pointer(given%solid, v%solid, [any_size])
    call c_f_pointer(given%mass, v%mass, [any_size])
  end subroutine open_grains

  !> Weights of the particles about grains first to last - 1, and the share of each that is under the free surface.
  subroutine cairn_fluid_grain_weights(f, given, first, last) bind(c)
    type(cairn_fluid), intent(in) :: f
    type(cairn_fluid_grains), intent(in) :: given
    integer(c_int64_t), value :: first, last
    type(fluid) :: v
    type(grain_pairs) :: to
    integer(c_int64_t) :: g, k, a, e
    integer :: i
    real(c_double) :: r(3), q, sum_of, bare, peak
    call open_fluid(f, 0_c_int64_t, v)
    call open_grains(given, to)
    peak = v%scale*v%h**2/5
    do g = first + 1, last
      a = to%first_of(g) + 1
      e = to%first_of(g + 1)
      sum_of = 0
      bare = 0
      do k = a, e
        i = to%particle(k) + 1
        r = to%grain(1:3, g) - v%record(1:3, i)
        if (v%periodic) r = r - v%period*int(r*v%per + sign(0.5_c_double, r))
        q = min(2.0_c_double, sqrt(sum(r**2))/v%h)
        to%weight(k) = v%record(7, i)*peak*(1 - 0.5_c_double*q)**4*(2*q + 1)
        sum_of = sum_of + to%weight(k)
        if (v%open(i) == 2) bare = bare + to%weight(k)
      end do
      to%wet(g) = 0
      if (.not. sum_of > 0) cycle
      to%weight(a:e) = to%weight(a:e)/sum_of
      to%wet(g) = 1 - min(1.0_c_double, 2*bare/sum_of)*min(1.0_c_double, max(0.0_c_double, (wetted - sum_of)/(wetted - dry)))
    end do
  end subroutine cairn_fluid_grain_weights

  !> Shares of volumes of particles first to last - 1 that grains take. swift: greatest square of the speed of sound of fluid and
  !> grains that move with it over that of the fluid [-].
  subroutine cairn_fluid_grain_solids(f, given, first, last, swift) bind(c)
    type(cairn_fluid), intent(in) :: f
    type(cairn_fluid_grains), intent(in) :: given
    integer(c_int64_t), value :: first, last
    real(c_double), intent(inout) :: swift
    type(fluid) :: v
    type(grain_pairs) :: to
    integer(c_int64_t) :: i, k
    integer :: g
    real(c_double) :: share, solid, light
    call open_fluid(f, 0_c_int64_t, v)
    call open_grains(given, to)
    do i = first + 1, last
      solid = 0
      light = 0
      do k = to%first(i) + 1, to%first(i + 1)
        g = to%grain_of(k) + 1
        share = to%weight(to%pair(k) + 1)*to%wet(g)*to%grain(7, g)/v%record(7, i)
        solid = solid + share
        light = light + share*v%density*to%grain(7, g)*maxval(to%grain(10:12, g))
      end do
      if (solid > most_solid) then
        do k = to%first(i) + 1, to%first(i + 1)
          to%weight(to%pair(k) + 1) = to%weight(to%pair(k) + 1)*(most_solid/solid)
        end do
        light = light*(most_solid/solid)
        solid = most_solid
      end if
      to%solid(i) = solid
      swift = max(swift, (1 + light)/(1 - solid))
    end do
  end subroutine cairn_fluid_grain_solids

  !> Forces of the pressure on grains first to last - 1, minus its gradient by volume, and the part of each particle in them.
  !> They are the derivative of the pressures times the volumes that grains take, so that a particle that is pressed moves away from
  !> grains (else it goes among them), and what gravity adds at rest is exact, beside walls too.
  subroutine cairn_fluid_grain_push(f, given, first, last, force, of_pair) bind(c)
    type(cairn_fluid), intent(in) :: f
    type(cairn_fluid_grains), intent(in) :: given
    integer(c_int64_t), value :: first, last
    real(c_double), intent(inout) :: force(3, 0:*)   !< on grains [N | N/m]
    real(c_double), intent(inout) :: of_pair(3, 0:*) !< the part of each pair [N | N/m]
    type(fluid) :: v
    type(grain_pairs) :: to
    integer(c_int64_t) :: g, k, a, e
    integer :: i
    real(c_double) :: r(3), q, p, mean, sum_of
    call open_fluid(f, 0_c_int64_t, v)
    call open_grains(given, to)
    do g = first + 1, last
      a = to%first_of(g)
      e = to%first_of(g + 1) - 1
      of_pair(:, a:e) = 0
      force(:, g - 1) = 0
      sum_of = sum(to%weight(a + 1:e + 1))
      if (.not. (sum_of > 0 .and. to%wet(g) > 0)) cycle
      mean = 0
      do k = a, e
        i = to%particle(k + 1) + 1
        mean = mean + to%weight(k + 1)/sum_of*beyond_rest(v, i, from_grain(v, to, g, i))
      end do
      do k = a, e
        i = to%particle(k + 1) + 1
        r = from_grain(v, to, g, i)
        q = sqrt(sum(r**2))/v%h
        if (q >= 2) cycle
        p = 5/(v%h**2*(1 - 0.5_c_double*q)*(2*q + 1))*(beyond_rest(v, i, r) - mean)
        of_pair(:, k) = -(to%wet(g)*to%grain(7, g)*to%weight(k + 1))*(p*r + v%density*v%resting)
        force(:, g - 1) = force(:, g - 1) + of_pair(:, k)
      end do
    end do
  end subroutine cairn_fluid_grain_push

  !> Way from grain g to particle i.
  pure function from_grain(v, to, g, i) result(r)
    type(fluid), intent(in) :: v
    type(grain_pairs), intent(in) :: to
    integer(c_int64_t), intent(in) :: g
    integer, intent(in) :: i
    real(c_double) :: r(3)
    r = v%record(1:3, i) - to%grain(1:3, g)
    if (v%periodic) r = r - v%period*int(r*v%per + sign(0.5_c_double, r))
  end function from_grain

  !> Pressure of particle i at r from a grain, less what gravity adds over that way: a free surface bears no tension.
  pure function beyond_rest(v, i, r) result(p)
    type(fluid), intent(in) :: v
    integer, intent(in) :: i
    real(c_double), intent(in) :: r(3)
    real(c_double) :: p
    p = v%record(8, i)
    if (v%open(i) > 0) p = max(p, 0.0_c_double)
    p = p - v%density*dot_product(v%resting, r)
  end function beyond_rest

  !> Takes the parts of pairs from the accelerations of particles first to last - 1.
  subroutine cairn_fluid_grain_bear(given, first, last, of_pair, acceleration) bind(c)
    type(cairn_fluid_grains), intent(in) :: given
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: of_pair(3, 0:*)         !< [N | N/m]
    real(c_double), intent(inout) :: acceleration(3, 0:*) !< [m/s2]
    type(grain_pairs) :: to
    integer(c_int64_t) :: i, k
    real(c_double) :: sum_of(3)
    call open_grains(given, to)
    do i = first + 1, last
      sum_of = 0
      do k = to%first(i) + 1, to%first(i + 1)
        sum_of = sum_of + of_pair(:, to%pair(k))
      end do
      acceleration(:, i - 1) = acceleration(:, i - 1) - sum_of/to%mass(i)
    end do
  end subroutine cairn_fluid_grain_bear

  !> Impulses of drag on grains first to last - 1 over a time, implicit in the velocities of a grain and of its share of the fluid.
  !> The law has the porosity of the bed about the grain and the liquid that passes there. Particles bear the impulse, and are read,
  !> by their liquid: the drop of pressure over a bed then is that of the law, though at its faces particles see fewer grains.
  subroutine cairn_fluid_grain_drag(f, given, time, first, last, velocity, impulse) bind(c)
    type(cairn_fluid), intent(in) :: f
    type(cairn_fluid_grains), intent(in) :: given
    real(c_double), value :: time
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: velocity(3, 0:*)   !< of particles [m/s]
    real(c_double), intent(inout) :: impulse(4, 0:*) !< [N s | N s/m], 1 over the sum of weights times porosities
    type(fluid) :: v
    type(grain_pairs) :: to
    integer(c_int64_t) :: g, k
    integer :: i
    real(c_double) :: flow(3), mass, sum_of, liquid, volume, share, dense, w
    call open_fluid(f, 0_c_int64_t, v)
    call open_grains(given, to)
    do g = first + 1, last
      flow = 0
      mass = 0
      sum_of = 0
      liquid = 0
      do k = to%first_of(g) + 1, to%first_of(g + 1)
        i = to%particle(k) + 1
        w = to%weight(k)
        if (.not. to%solid(i) > 0) cycle ! a weight of 0
        sum_of = sum_of + w
        liquid = liquid + w*(1 - to%solid(i))
        flow = flow + w*(1 - to%solid(i))*velocity(:, i - 1)
        mass = mass + w*to%mass(i)/(to%solid(i)*v%record(7, i))
      end do
      impulse(:, g - 1) = 0
      volume = to%wet(g)*to%grain(7, g)
      if (.not. (sum_of > 0 .and. volume > 0)) cycle
      flow = flow/liquid - to%grain(4:6, g)
      share = share_of_bed(v, to, g)
      dense = liquid/sum_of/(1 - share) ! velocity between the grains of the bed over that of the liquid about this one
      w = time*volume*sum_of*dense**2*coefficient(v, nint(to%grain(9, g)), to%grain(8, g), share, dense*sqrt(sum(flow**2)))
      mass = mass*volume/sum_of ! of the fluid that goes with this grain
      impulse(1:3, g - 1) = w/(1 + w*(to%grain(10:12, g) + 1/mass))*flow
      impulse(4, g - 1) = 1/liquid
    end do
  end subroutine cairn_fluid_grain_drag

  !> Share of the volume that grains take in the bed about grain g. The kernel smooths the faces of a bed: the share about a grain
  !> there is less than that of the bed, the more so the farther the centre of that share lies from the grain. This is fitted to
  !> beds with one plane face. Particles about the grain bound it: none there has a share so great.
  pure function share_of_bed(v, to, g) result(share)
    type(fluid), intent(in) :: v
    type(grain_pairs), intent(in) :: to
    integer(c_int64_t), intent(in) :: g
    real(c_double) :: share, most, sum_of, w, r(3), centre(3), of_grains(3), aside
    real(c_double), parameter :: fit(2) = [1.05_c_double, 7.5_c_double], furthest = 0.35_c_double !< beyond a face of a bed
    integer(c_int64_t) :: k
    integer :: i
    share = 0
    most = 0
    sum_of = 0
    centre = 0
    of_grains = 0
    do k = to%first_of(g) + 1, to%first_of(g + 1)
      i = to%particle(k) + 1
      w = to%weight(k)
      if (.not. to%solid(i) > 0) cycle ! a weight of 0
      r = from_grain(v, to, g, i)
      sum_of = sum_of + w
      share = share + w*to%solid(i)
      centre = centre + w*r
      of_grains = of_grains + w*to%solid(i)*r
      if (w > 0) most = max(most, to%solid(i))
    end do
    aside = min(furthest, sqrt(sum((of_grains/share - centre/sum_of)**2))/v%h)
    share = min(most, share/sum_of*(1 + aside*(fit(1) + aside*fit(2))))
  end function share_of_bed

  !> Takes impulses on grains from particles first to last - 1. lost: their work with the velocities after, added [J | J/m].
  subroutine cairn_fluid_grain_react(given, first, last, impulse, velocity, lost) bind(c)
    type(cairn_fluid_grains), intent(in) :: given
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: impulse(4, 0:*)     !< [N s | N s/m], 1 over the sum of weights times porosities
    real(c_double), intent(inout) :: velocity(3, 0:*) !< [m/s]
    real(c_double), intent(inout) :: lost
    type(grain_pairs) :: to
    integer(c_int64_t) :: i, k
    real(c_double) :: change(3)
    call open_grains(given, to)
    do i = first + 1, last
      change = 0
      if (.not. to%solid(i) > 0) cycle
      do k = to%first(i) + 1, to%first(i + 1)
        change = change - to%weight(to%pair(k) + 1)*(1 - to%solid(i))*impulse(4, to%grain_of(k))*impulse(1:3, to%grain_of(k))
      end do
      lost = lost - sum(change*(velocity(:, i - 1) + change/to%mass(i)))
      velocity(:, i - 1) = velocity(:, i - 1) + change/to%mass(i)
    end do
  end subroutine cairn_fluid_grain_react

  !> Force of drag over volume of a grain and relative velocity [kg/(m3 s)], which beside it has the gradient of pressure.
  !> Ergun (1952); Gidaspow (1994): his form below a porosity of .8, that of Wen & Yu (1966) above; Di Felice (1994).
  pure function coefficient(v, law, d, solid, speed) result(k)
    type(fluid), intent(in) :: v
    integer, intent(in) :: law
    real(c_double), intent(in) :: d, solid, speed !< diameter of a sphere of its volume [m], share of volume, [m/s]
    real(c_double) :: k, e, s, re, power
    real(c_double), parameter :: pi = acos(-1.0_c_double), rough = 0.44_c_double
    k = 0
    s = solid
    if (v%dim == 2) s = min(most_solid, 2/sqrt(pi*sqrt(3.0_c_double))*solid*sqrt(solid)) ! of spheres that lie as disks do
    e = 1 - s
    re = v%density*e*speed*d
    select case (law)
    case (ergun, gidaspow)
      if (law == ergun .or. e < 0.8_c_double) then
        k = 150*s*v%viscosity/(e*d**2) + 1.75_c_double*v%density*speed/d
      else if (re < 1000*v%viscosity) then
        k = 18*v%viscosity/d**2*(1 + 0.15_c_double*(re/v%viscosity)**0.687_c_double)*e**(-2.65_c_double)
      else
        k = 0.75_c_double*rough*v%density*e*speed/d*e**(-2.65_c_double)
      end if
    case (di_felice)
      power = 3.7_c_double
      if (re > 0 .and. v%viscosity > 0) &
        power = power - 0.65_c_double*exp(-0.5_c_double*(1.5_c_double - log10(re/v%viscosity))**2)
      k = 0.75_c_double/d*(0.63_c_double*sqrt(v%density*e*speed) + 4.8_c_double*sqrt(v%viscosity/d))**2*e**(1 - power)
    end select
  end function coefficient
end module fluid_grains
