!> Adhesive elastic spheres (Johnson, Kendall & Roberts 1971): contact begins where surfaces touch and ends where the neck
!> tears, at a pull of 1.5 pi w R. Tangentially as Hertz-Mindlin, with the limit mu (f_n + 3 pi w R) (Thornton & Yin 1991).
module jkr
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use spring_slider, only: slide, damping_of, damp
  implicit none
  private
  public :: cairn_law_jkr_force, cairn_law_jkr_stiffness, neck_of, fold_of, tear_gap, &
            stored_in_neck, contact_radius, touching
  real(c_double), parameter :: pi = acos(-1.0_c_double)
contains

  !> With b = sqrt(2 pi w/E*): delta = a^2/R - b sqrt(a), f_n = 4 E* a^3/3R - 2 E* b a^(3/2), less damping.
  subroutine cairn_law_jkr_force(n, c, context, gap, u, params, state, f, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components: 2 or 3
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the middle of the step [m/s]
    real(c_double), intent(in)          :: params(5) !< Young [Pa], work of adhesion [J/m2], Poisson, restitution, friction
    real(c_double), intent(inout)       :: state(n, c)    !< 1 once it touched and until it tears; tangential spring [m]
    real(c_double), intent(out)         :: f(n, c)        !< on A [N]
    real(c_double), intent(inout), optional :: energy(n, 4) !< stored, dissipated by damping and tearing, by friction;
    !< released by tangential springs as their stiffness changed [J]
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: normal, shear, ratio, b, elastic(n), a(n), limit(n), tangential(n), damping(n), stiffer(n), touch(n), slope
    logical :: touched(n), before(n)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    normal = params(1)/(2*(1 - params(3)**2))
    shear = params(1)/(4*(2 - params(3))*(1 + params(3)))
    ratio = 2*sqrt(5.0_c_double/6)*damping_of(params(4))
    b = neck_of(normal, params(2))
    before = state(:, 1) > 0
    call touching(n, b, geometry(:, 2), gap, before, touched)
    call contact_radius(n, b, geometry(:, 2), gap, touched, a)
    !$omp simd
    do i = 1, n
      elastic(i) = 4*normal*a(i)**3/(3*geometry(i, 2)) - 2*normal*b*a(i)*sqrt(a(i))
      damping(i) = ratio*sqrt(2*normal*a(i)*geometry(i, 3))
    end do
    f(:, 1) = elastic
    call damp(n, context%h, geometry(:, 3), damping, u(:, 1), f(:, 1))
    touch = merge(1.0_c_double, 0.0_c_double, touched)
    !$omp simd
    do i = 1, n
      limit(i) = merge(params(5)*max(f(i, 1) + 3*pi*params(2)*geometry(i, 2), 0.0_c_double), 0.0_c_double, touch(i) > 0)
      tangential(i) = 8*shear*a(i)
      damping(i) = ratio*sqrt(tangential(i)*geometry(i, 3))
      f(i, 1) = merge(f(i, 1), 0.0_c_double, touch(i) > 0)
    end do
    if (.not. all(touched)) then
      do i = 1, n
        if (.not. touched(i)) state(i, :) = 0
      end do
    end if
    if (present(energy)) then
      energy(:, 1) = stored_in_neck(normal, b, geometry(:, 2), a)
      energy(:, 2) = merge((elastic - f(:, 1))*u(:, 1)*context%h, 0*gap, touched)
      where (touched .and. .not. before) energy(:, 2) = -stored_in_neck(normal, b, geometry(:, 2), a)
      where (before .and. .not. touched) energy(:, 2) = stored_in_neck(normal, b, geometry(:, 2), fold_of(b, geometry(:, 2)))
      energy(:, 3) = 0
    end if
    state(:, 1) = merge(1.0_c_double, 0.0_c_double, touched)
    if (present(energy)) then
      !$omp simd private(slope)
      do i = 1, n ! the contact radius changes with the overlap by da/ddelta, up to its own size near the fold
        slope = 2*a(i)/geometry(i, 2) - 0.5_c_double*b/sqrt(max(a(i), tiny(b)))
        slope = merge(slope*a(i), 0.0_c_double, a(i) > 0)
        stiffer(i) = merge(max(-1.0_c_double, min(1.0_c_double, context%h*u(i, 1)/max(slope, tiny(b)))), 0.0_c_double, slope > 0)
      end do
    end if
    call slide(n, c, context%h, tangential, damping, limit, u, state(:, 2:), f, energy, stiffer)
  end subroutine cairn_law_jkr_force

  !> Stiffness at an overlap, damping ratio, and a gap beyond that at which the neck tears.
  subroutine cairn_law_jkr_stiffness(n, c, overlap, radius, params, k, reach) bind(c)
    integer(c_int32_t), value   :: n          !< contacts
    integer(c_int32_t), value   :: c          !< components of the force
    real(c_double), intent(in)  :: overlap(n) !< [m]
    real(c_double), intent(in)  :: radius(n)  !< effective radius [m]
    real(c_double), intent(in)  :: params(5)  !< as for the force
    real(c_double), intent(out) :: k(n, 4)    !< normal, tangential [N/m], damping ratio [-], of spins [N m/rad]
    real(c_double), intent(out) :: reach(n)   !< [m]
    real(c_double) :: normal, b, a(n)
    logical :: touched(n)
    normal = params(1)/(2*(1 - params(3)**2))
    b = neck_of(normal, params(2))
    touched = .true.
    call contact_radius(n, b, radius, -max(overlap, 0.0_c_double), touched, a)
    k(:, 1) = 2*normal*a
    k(:, 2) = 2*params(1)/((2 - params(3))*(1 + params(3)))*a
    k(:, 3) = sqrt(5.0_c_double/6)*damping_of(params(4))
    k(:, 4) = 0
    reach = 1.5_c_double*tear_gap(b, radius)
  end subroutine cairn_law_jkr_stiffness

  elemental function neck_of(normal, work) result(b)
    real(c_double), intent(in) :: normal, work !< E* [Pa], w [J/m2]
    real(c_double) :: b
    b = 0
    if (normal > 0) b = sqrt(2*pi*work/normal)
  end function neck_of

  !> Contact radius at which the neck tears when the bodies are held apart: the fold of delta(a).
  elemental function fold_of(b, radius) result(a)
    real(c_double), intent(in) :: b, radius
    real(c_double) :: a
    a = (b*radius/4)**(2.0_c_double/3)
  end function fold_of

  !> Gap at which it does.
  elemental function tear_gap(b, radius) result(gap)
    real(c_double), intent(in) :: b, radius
    real(c_double) :: gap
    gap = 0.75_c_double*b*sqrt(fold_of(b, radius))
  end function tear_gap

  !> Bodies touch, and those that did hold together up to the gap at which the neck tears.
  pure subroutine touching(n, b, radius, gap, before, touched)
    integer(c_int32_t), intent(in) :: n
    real(c_double), intent(in)     :: b, radius(n), gap(n)
    logical, intent(in)            :: before(n)
    logical, intent(out)           :: touched(n)
    integer :: i
    do i = 1, n
      touched(i) = gap(i) < 0
      if (gap(i) < 0 .or. .not. before(i)) cycle ! for a power costs as much as the rest of the law
      touched(i) = gap(i) <= tear_gap(b, radius(i))
    end do
  end subroutine touching

  !> Elastic less surface energy, the integral of f_n over delta from a = 0.
  elemental function stored_in_neck(normal, b, radius, a) result(energy)
    real(c_double), intent(in) :: normal, b, radius, a
    real(c_double) :: energy
    energy = normal*a**2*(8*a**3/(15*radius**2) - 4*b*a*sqrt(a)/(3*radius) + 0.5_c_double*b**2)
  end function stored_in_neck

  !> Root s of s^4/R - b s - delta, a = s^2, by Newton's method from above, where the function is convex. A lane that has come
  !> to rest stays, so that no contact depends on those beside it.
  pure subroutine contact_radius(n, b, radius, gap, touched, a)
    integer(c_int32_t), intent(in) :: n
    real(c_double), intent(in)     :: b, radius(n), gap(n)
    logical, intent(in)            :: touched(n)
    real(c_double), intent(out)    :: a(n)
    real(c_double) :: s(n), most(n), inverse(n), slope, fall, cube, moving
    integer :: i, k
    call upper_cube_roots(n, b, radius, most)
    !$omp simd
    do i = 1, n
      s(i) = sqrt(sqrt(radius(i)*max(-gap(i), 0.0_c_double))) + most(i)
      inverse(i) = 1/radius(i)
    end do
    where (.not. touched) s = 0
    do k = 1, 100
      moving = 0
      !$omp simd private(slope, fall, cube) reduction(max:moving)
      do i = 1, n
        cube = s(i)*s(i)*s(i)*inverse(i)
        slope = 4*cube - b
        fall = (s(i)*cube - b*s(i) + gap(i))/max(slope, tiny(b))
        fall = merge(fall, 0.0_c_double, slope > 0 .and. fall > 4*epsilon(b)*s(i))
        moving = max(moving, fall)
        s(i) = s(i) - fall
      end do
      if (.not. moving > 0) exit
    end do
    a = s**2
  end subroutine contact_radius

  !> Numbers a little above (b R)^(1/3), b > 0: a power of the bits of R/b^2, which has no unit, and a step of Newton's method,
  !> which ends above the root (arithmetic and geometric mean).
  pure subroutine upper_cube_roots(n, b, radius, root)
    integer(c_int32_t), intent(in) :: n
    real(c_double), intent(in)     :: b, radius(n)
    real(c_double), intent(out)    :: root(n)
    real(c_double), parameter :: bits_of_one = 1023*2.0_c_double**52
    real(c_double) :: x, y, square
    integer :: i
    square = b*b
    if (.not. square > tiny(b)) then
      root = (b*radius)**(1.0_c_double/3)
      return
    end if
    !$omp simd private(x, y)
    do i = 1, n
      x = min(radius(i)/square, 1e300_c_double)
      y = transfer(int((real(transfer(x, 0_c_int64_t), c_double) + 2*bits_of_one)/3, c_int64_t), 0.0_c_double)
      root(i) = b*(2*y + x/(y*y))/3
    end do
  end subroutine upper_cube_roots
end module jkr
