!> Parallel bonds of smooth scenes (Potyondy & Cundall 2004): bodies that came in touching are glued by a disk (in 2D a strip) of
!> radius b = radius x 2 R, R the effective radius, whose springs take tension, shear, bending and twist until the stress at its rim
!> reaches a strength. Broken, and between other bodies, a contact has the same springs in compression and shear, with friction.
module smooth_bond
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use spring_slider, only: damp, slide
  implicit none
  private
  public :: cairn_law_smooth_bond_force, cairn_law_smooth_bond_stiffness
  integer, parameter :: own = 8, columns = 4
  integer, parameter :: p_normal = 1, p_shear = 2, p_tension = 3, p_cohesion = 4, p_mu = 5, p_radius = 6, p_within = 7, &
                        p_damping = 8
  integer, parameter :: s_held = 1, s_first = 2, s_twist = 3, s_stored = 4
  real(c_double), parameter :: pi = acos(-1.0_c_double)
contains

  !> held: 1 at a contact of bodies that came in together, 2 once it is a bond, 0 broken or none.
  subroutine cairn_law_smooth_bond_force(n, c, context, gap, u, params, state, f, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components: 3 in 2D, 6 in 3D
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the middle of the step [m/s, rad/s]
    real(c_double), intent(in)          :: params(own)    !< see laws.def
    real(c_double), intent(inout)       :: state(n, columns + 2*(merge(2, 3, c == 3) - 1)) !< held, first gap [m], twist [rad],
    !< energy [J], slip [m], bend [rad]
    real(c_double), intent(out)         :: f(n, c)        !< on A [N, N m]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by damping, by friction and breakage;
    !< released by tangential springs as their stiffness changed [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: section(n), bending(n), twisting(n), b(n), loss(n), spent(n), was(n), work(n, 4), limit(n), k(n), dashpot(n)
    real(c_double) :: springs(n), broken(n), old(n, merge(1, 2, c == 3))
    integer :: axes, i, slip, bend
    call c_f_pointer(context%geometry, geometry, [n, 3])
    axes = merge(2, 3, c == 3)
    slip = columns + 1
    bend = slip + axes - 1
    b = 2*params(p_radius)*geometry(:, 2)
    call sections(axes, b, section, bending, twisting)
    was = state(:, s_stored)
    f = 0
    do i = 1, n
      if (state(i, s_held) > 0 .and. state(i, s_held) < 2) then
        state(i, s_held) = merge(2.0_c_double, 0.0_c_double, gap(i) <= params(p_within))
        state(i, s_first) = gap(i)
      end if
    end do
    k = params(p_normal)*section
    dashpot = 2*params(p_damping)*sqrt(k*geometry(:, 3))
    f(:, 1) = k*max(-gap, 0.0_c_double)
    where (state(:, s_held) > 0) f(:, 1) = -k*(gap - state(:, s_first))
    spent = f(:, 1)
    call damp(n, context%h, geometry(:, 3), dashpot, u(:, 1), f(:, 1))
    where (.not. state(:, s_held) > 0 .and. .not. gap < 0) f(:, 1) = 0
    where (.not. state(:, s_held) > 0 .and. gap < 0) f(:, 1) = max(f(:, 1), 0.0_c_double)
    loss = (spent - f(:, 1))*u(:, 1)*context%h
    limit = params(p_mu)*max(f(:, 1), 0.0_c_double)
    where (state(:, s_held) > 0) limit = huge(1.0_c_double)**0.25_c_double
    old = state(:, slip:slip + axes - 2)
    work = 0
    call slide(n, axes, context%h, params(p_shear)*section, sqrt(params(p_shear)/max(params(p_normal), tiny(b)))*dashpot, limit, &
               u(:, 1:axes), state(:, slip:slip + axes - 2), f(:, 1:axes), work)
    springs = work(:, 1)
    do i = 1, n
      spent(i) = -context%h*sum(f(i, 2:axes)*u(i, 2:axes)) &
                 - 0.5_c_double*params(p_shear)*section(i)*context%h*sum(u(i, 2:axes)*(state(i, slip:slip + axes - 2) - old(i, :)))
      broken(i) = 0
      if (.not. state(i, s_held) > 0) cycle
      call turn(axes, context%h, params, bending(i), twisting(i), geometry(i, 2:3), u(i, axes + 1:c), state(i, s_twist), &
                state(i, bend:bend + axes - 2), f(i, axes + 1:c), springs(i), spent(i))
      if (.not. breaks(axes, params, b(i), gap(i) - state(i, s_first), state(i, slip:slip + axes - 2), state(i, s_twist), &
                       state(i, bend:bend + axes - 2))) cycle
      broken(i) = 0.5_c_double*k(i)*(gap(i) - state(i, s_first))**2 - 0.5_c_double*k(i)*max(-gap(i), 0.0_c_double)**2
      springs(i) = 0
      state(i, [s_held, s_first, s_twist]) = 0
      state(i, slip:bend + axes - 2) = 0
      f(i, 2:c) = 0
      f(i, 1) = max(-k(i)*gap(i), 0.0_c_double)
    end do
    if (present(energy)) then
      energy(:, 1) = springs + 0.5_c_double*k*max(-gap, 0.0_c_double)**2
      where (state(:, s_held) > 0) energy(:, 1) = springs + 0.5_c_double*k*(gap - state(:, s_first))**2
      energy(:, 2) = loss
      energy(:, 3) = spent - (springs - was) + broken
      energy(:, 4) = 0
    end if
    state(:, s_stored) = springs
  end subroutine cairn_law_smooth_bond_force

  !> Moments of a bond, with dashpots that are the same share of the critical damping as along the normal, of two like spheres.
  pure subroutine turn(axes, h, params, bending, twisting, grain, w, twist, bend, moment, stored, spent)
    integer, intent(in)           :: axes
    real(c_double), intent(in)    :: h, params(own), bending, twisting, grain(2), w(:)
    real(c_double), intent(inout) :: twist, bend(:), moment(:), stored, spent
    real(c_double) :: k, c
    integer :: first
    first = merge(1, 2, axes == 2)
    k = params(p_normal)*bending
    c = 2*params(p_damping)*sqrt(1.6_c_double*k*grain(2))*grain(1)
    spent = spent - 0.5_c_double*k*sum((h*w(first:))**2)
    bend = bend + h*w(first:)
    moment(first:) = -k*bend - c*w(first:)
    stored = stored + 0.5_c_double*k*sum(bend**2)
    spent = spent - h*sum(moment(first:)*w(first:))
    if (axes == 2) return
    k = params(p_shear)*twisting
    c = 2*params(p_damping)*sqrt(1.6_c_double*k*grain(2))*grain(1)
    spent = spent - 0.5_c_double*k*(h*w(1))**2
    twist = twist + h*w(1)
    moment(1) = -k*twist - c*w(1)
    stored = stored + 0.5_c_double*k*twist**2
    spent = spent - h*moment(1)*w(1)
  end subroutine turn

  !> Beam theory: greatest tension and shear at the rim of the disk.
  pure logical function breaks(axes, params, b, stretch, slip, twist, bend)
    integer, intent(in)        :: axes
    real(c_double), intent(in) :: params(own), b, stretch, slip(:), twist, bend(:)
    breaks = params(p_normal)*(stretch + b*sqrt(sum(bend**2))) >= params(p_tension) .or. &
             params(p_shear)*(sqrt(sum(slip**2)) + merge(b*abs(twist), 0.0_c_double, axes == 3)) >= params(p_cohesion)
  end function breaks

  !> Area and moments of the disk; of the strip per metre of depth.
  elemental subroutine sections(axes, b, area, bending, twisting)
    integer, intent(in)         :: axes
    real(c_double), intent(in)  :: b
    real(c_double), intent(out) :: area, bending, twisting
    if (axes == 3) then
      area = pi*b**2
      bending = pi*b**4/4
    else
      area = 2*b
      bending = 2*b**3/3
    end if
    twisting = 2*bending
  end subroutine sections

  !> Stiffness of forces and moments, damping ratio, and the opening up to which a bond may go: that at which tension breaks it, at
  !> most the effective radius.
  subroutine cairn_law_smooth_bond_stiffness(n, c, overlap, radius, params, k, reach) bind(c)
    integer(c_int32_t), value   :: n           !< contacts
    integer(c_int32_t), value   :: c           !< components of the force: 3 in 2D, 6 in 3D
    real(c_double), intent(in)  :: overlap(n)  !< not read [m]
    real(c_double), intent(in)  :: radius(n)   !< effective radius [m]
    real(c_double), intent(in)  :: params(own) !< as for the force
    real(c_double), intent(out) :: k(n, 4)     !< normal, tangential [N/m], damping ratio [-], of spins [N m/rad]
    real(c_double), intent(out) :: reach(n)    !< [m]
    real(c_double) :: area(n), bending(n), twisting(n)
    call sections(merge(2, 3, c == 3), 2*params(p_radius)*radius, area, bending, twisting)
    k(:, 1) = params(p_normal)*area
    k(:, 2) = params(p_shear)*area
    k(:, 3) = params(p_damping)
    k(:, 4) = params(p_normal)*bending
    if (c /= 3) k(:, 4) = max(k(:, 4), params(p_shear)*twisting)
    reach = params(p_within) + radius
    if (params(p_normal) > 0) reach = params(p_within) + min(radius, 1.0001_c_double*params(p_tension)/params(p_normal))
  end subroutine cairn_law_smooth_bond_stiffness
end module smooth_bond
