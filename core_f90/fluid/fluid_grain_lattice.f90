!> Lattice of the particles among grains smaller than these. A liquid that flows into a bed draws its particles out along the way,
!> and the symmetric sums of the pressure then are wrong by a share of the pressure itself. Here they become the adjoint of the
!> divergence, which is exact for linear fields (Randles & Libersky 1996), and particles drift (as in Lind et al. 2012) to where an
!> equal pressure pushes none of them.
module fluid_grain_lattice
  use, intrinsic :: iso_c_binding, only: c_double, c_int64_t, c_int8_t
  use fluid_grains, only: cairn_fluid_grains, grain_pairs, open_grains
  use fluid_view, only: add_square, cairn_fluid, fluid, invert, mass_of, open_fluid, wall_points, wall_points_of
  implicit none
  private
  public :: cairn_fluid_grain_shapes, cairn_fluid_grain_align, cairn_fluid_grain_stir
  real(c_double), parameter :: few = 0.1_c_double !< share of grains below which particles drift less, in proportion
contains

  !> Inverse second moments of the gradients about particles first to last - 1, less 1; 0 at free surfaces and walls.
  subroutine cairn_fluid_grain_shapes(f, first, last, shape_of, within) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    real(c_double), intent(inout) :: shape_of(6, 0:*)  !< xx xy xz yy yz zz [-]
    integer(c_int8_t), intent(inout) :: within(0:*)    !< 1: of a particle away from free surfaces and walls
    type(fluid) :: v
    type(wall_points) :: w
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: r(3), g, second(3, 3), inverse(3, 3)
    call open_fluid(f, last, v)
    do i = first + 1, last
      call wall_points_of(v, i, w)
      within(i - 1) = merge(1_c_int8_t, 0_c_int8_t, v%open(i) == 0 .and. w%count == 0)
      second = 0
      if (within(i - 1) == 1) then
        do k = v%first(i) + 1, v%first(i + 1)
          j = v%neighbour(k) + 1
          call pair_of(v, i, j, r, g)
          call add_square(second, -g, r)
        end do
      end if
      call invert(v%dim, second, within(i - 1) == 1, inverse)
      shape_of(:, i - 1) = [inverse(1, 1) - 1, inverse(1, 2), inverse(1, 3), inverse(2, 2) - 1, inverse(2, 3), inverse(3, 3) - 1]
    end do
  end subroutine cairn_fluid_grain_shapes

  !> Adds to the accelerations of particles first to last - 1 what the pressure lacks to be the adjoint of the divergence, and finds
  !> by how much an equal pressure would push them.
  subroutine cairn_fluid_grain_align(f, first, last, shape_of, within, acceleration, uneven) bind(c)
    type(cairn_fluid), intent(in) :: f
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: shape_of(6, 0:*)
    integer(c_int8_t), intent(in) :: within(0:*)
    real(c_double), intent(inout) :: acceleration(3, 0:*) !< [m/s2]
    real(c_double), intent(inout) :: uneven(3, 0:*)       !< minus half the sum of both gradients, 0 at surfaces and walls [1/m]
    type(fluid) :: v
    integer(c_int64_t) :: i, k
    integer :: j
    real(c_double) :: r(3), g, a(3), s(3), own, p
    call open_fluid(f, last, v)
    do i = first + 1, last
      own = held(v, int(i))
      a = 0
      s = 0
      do k = v%first(i) + 1, v%first(i + 1)
        j = v%neighbour(k) + 1
        call pair_of(v, i, j, r, g)
        if (g >= 0) cycle
        p = held(v, j)
        a = a - g*times(own*shape_of(:, i - 1) + p*shape_of(:, j - 1), r)
        s = s - g*(r + 0.5_c_double*times(shape_of(:, i - 1) + shape_of(:, j - 1), r))
      end do
      acceleration(:, i - 1) = acceleration(:, i - 1) + a*(v%record(7, i)/mass_of(v, i))
      uneven(:, i - 1) = s*within(i - 1)
    end do
  end subroutine cairn_fluid_grain_align

  !> Speeds by which the liquid flows past the grains about particles first to last - 1, less where these are few.
  subroutine cairn_fluid_grain_stir(given, first, last, velocity, speed) bind(c)
    type(cairn_fluid_grains), intent(in) :: given
    integer(c_int64_t), value :: first, last
    real(c_double), intent(in) :: velocity(3, 0:*) !< of particles [m/s]
    real(c_double), intent(inout) :: speed(0:*)    !< [m/s]
    type(grain_pairs) :: to
    integer(c_int64_t) :: i, k
    integer :: g
    real(c_double) :: w, sum_of, weights
    call open_grains(given, to)
    do i = first + 1, last
      sum_of = 0
      weights = 0
      do k = to%first(i) + 1, to%first(i + 1)
        g = to%grain_of(k) + 1
        w = to%weight(to%pair(k) + 1)*to%wet(g)*to%grain(7, g)
        if (.not. w > 0) cycle
        weights = weights + w
        sum_of = sum_of + w*sqrt(sum((velocity(:, i - 1) - to%grain(4:6, g))**2))
      end do
      speed(i - 1) = 0
      if (weights > 0) speed(i - 1) = sum_of/weights*min(1.0_c_double, to%solid(i)/few)
    end do
  end subroutine cairn_fluid_grain_stir

  !> Way from particle j to i, and the derivative of the kernel over it times the volume of j.
  pure subroutine pair_of(v, i, j, r, g)
    type(fluid), intent(in) :: v
    integer(c_int64_t), intent(in) :: i
    integer, intent(in) :: j
    real(c_double), intent(out) :: r(3), g
    r = v%record(1:3, i) - v%record(1:3, j)
    if (v%periodic) r = r - v%period*int(r*v%per + sign(0.5_c_double, r))
    g = -v%scale*v%record(7, j)*max(0.0_c_double, 1 - 0.5_c_double*sqrt(sum(r**2))/v%h)**3
  end subroutine pair_of

  !> Pressure of a particle; a free surface bears no tension.
  pure function held(v, i) result(p)
    type(fluid), intent(in) :: v
    integer, intent(in) :: i
    real(c_double) :: p
    p = v%record(8, i)
    if (v%open(i) > 0) p = max(p, 0.0_c_double)
  end function held

  !> A symmetric matrix (xx xy xz yy yz zz) times a vector.
  pure function times(a, r) result(t)
    real(c_double), intent(in) :: a(6), r(3)
    real(c_double) :: t(3)
    t = [a(1)*r(1) + a(2)*r(2) + a(3)*r(3), a(2)*r(1) + a(4)*r(2) + a(5)*r(3), a(3)*r(1) + a(5)*r(2) + a(6)*r(3)]
  end function times
end module fluid_grain_lattice
