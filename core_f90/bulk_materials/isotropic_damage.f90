!> Stiffness lost with the largest stretch that was reached (Mazars 1984), softening exponentially so that a cell takes the fracture
!> energy per area of crack, whatever its size (crack band, Bazant & Oh 1983). Cells of second order have one damage each: else
!> some of their points alone would soften, and the crack be narrower than the cell.
module isotropic_damage
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: isotropic_moduli, symmetric_eigen, from_strain, to_stress
  implicit none
  private
  public :: cairn_bulk_isotropic_damage, cairn_damage_of_cells
  integer, parameter :: parameters = 5, states = 2
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_isotropic_damage(n, h, theta, params, length, strain, state_begin, state, stress, tangent, &
                                    energy, dissipated, status) bind(c)
    integer(c_int64_t), value   :: n                  !< points
    real(c_double), value       :: h                  !< step [s]
    real(c_double), value       :: theta              !< of the theta-method
    real(c_double), intent(in)  :: params(parameters) !< in the order of bulk_materials.def
    real(c_double), intent(in)  :: length(n)          !< size of the cell round each point [m]
    real(c_double), intent(in)  :: strain(6, n)       !< at the end of the step, of the body's measure [-]
    real(c_double), intent(in)  :: state_begin(states, n) !< at the begin of the step
    real(c_double), intent(out) :: state(states, n)   !< at its end
    real(c_double), intent(out) :: stress(6, n)       !< conjugate to it [Pa]
    real(c_double), intent(out) :: tangent(6, 6, n)   !< of stress by strain [Pa]
    real(c_double), intent(out) :: energy(n)          !< stored [J/m3]
    real(c_double), intent(out) :: dissipated(n)      !< in the step [J/m3]
    integer(c_int32_t), intent(inout) :: status(n)    !< 0; 1 volume not positive, 2 no solution at the point, 3 cell too large
    real(c_double) :: c(6, 6), whole(6), reached, largest, first, decay, damage, direction(6)
    integer(c_int64_t) :: i
    c = isotropic_moduli(params(1), params(2))
    first = params(3)/params(1)
    do i = 1, n
      call find_decay(params, length(i), decay, status(i))
      call stretched(strain(:, i), reached, direction)
      largest = max(state_begin(1, i), reached, first)
      damage = 1 - first/largest*exp(-(largest - first)/decay)
      whole = matmul(c, strain(:, i))
      stress(:, i) = (1 - damage)*whole
      tangent(:, :, i) = (1 - damage)*c
      if (reached >= largest .and. largest > first) &
        tangent(:, :, i) = tangent(:, :, i) &
                           - (1 - damage)*(1/largest + 1/decay)*spread(whole, 2, 6)*spread(direction/reached, 1, 6)
      state(1, i) = largest
      state(2, i) = damage
      energy(i) = 0.5_c_double*dot_product(stress(:, i), strain(:, i))
      dissipated(i) = dot_product(whole, strain(:, i))*share_spent(state_begin(1, i), largest, first, decay)
    end do
  end subroutine cairn_bulk_isotropic_damage

  !> Stress of n cells with a single damage variable each, driven by the root mean square of the tensile strain of their points, and
  !> so by the energy release, such that a crack takes the same energy as under uniform strain. The derivative of the stress is that
  !> at constant damage; damage adds -growth forces (sum over points of volume drive by strain) to the derivative of the nodal
  !> forces of a cell by its displacements.
  pure subroutine cairn_damage_of_cells(points, n, params, length, volume, strain, state_begin, state, stress, tangent, drive, &
                                        growth, energy, dissipated, status) bind(c)
    integer(c_int32_t), value   :: points             !< of a cell
    integer(c_int64_t), value   :: n                  !< cells
    real(c_double), intent(in)  :: params(parameters) !< these and the others as above
    real(c_double), intent(in)  :: length(points, n)  !< the same of all points of a cell
    real(c_double), intent(in)  :: volume(points, n)  !< of each point [m3]
    real(c_double), intent(in)  :: strain(6, points, n)
    real(c_double), intent(in)  :: state_begin(states, points, n)
    real(c_double), intent(out) :: state(states, points, n)
    real(c_double), intent(out) :: stress(6, points, n)
    real(c_double), intent(out) :: tangent(6, 6, points, n)
    real(c_double), intent(out) :: drive(6, points, n) !< of the largest stretch by strain, for each volume [1/m3]
    real(c_double), intent(out) :: growth(n)          !< of - ln (1 - damage) by the largest stretch [-]
    real(c_double), intent(out) :: energy(points, n)
    real(c_double), intent(out) :: dissipated(points, n)
    integer(c_int32_t), intent(inout) :: status(points, n)
    real(c_double) :: c(6, 6), whole(6), reached, largest, first, decay, damage, square
    integer(c_int64_t) :: i
    integer :: p
    c = isotropic_moduli(params(1), params(2))
    first = params(3)/params(1)
    do i = 1, n
      square = 0
      call find_decay(params, length(1, i), decay, status(1, i))
      do p = 1, points
        call stretched(strain(:, p, i), reached, drive(:, p, i))
        square = square + volume(p, i)*reached**2
      end do
      reached = sqrt(square/sum(volume(:, i)))
      if (reached > 0) drive(:, :, i) = drive(:, :, i)/(reached*sum(volume(:, i)))
      largest = max(maxval(state_begin(1, :, i)), reached, first)
      damage = 1 - first/largest*exp(-(largest - first)/decay)
      growth(i) = 0
      if (reached >= largest .and. largest > first) growth(i) = 1/largest + 1/decay
      do p = 1, points
        whole = matmul(c, strain(:, p, i))
        stress(:, p, i) = (1 - damage)*whole
        tangent(:, :, p, i) = (1 - damage)*c
        state(:, p, i) = [largest, damage]
        energy(p, i) = 0.5_c_double*dot_product(stress(:, p, i), strain(:, p, i))
        dissipated(p, i) = dot_product(whole, strain(:, p, i))*share_spent(state_begin(1, p, i), largest, first, decay)
      end do
    end do
  end subroutine cairn_damage_of_cells

  !> Decay strain beyond the onset of damage in a cell of the given length.
  pure subroutine find_decay(params, length, decay, status)
    real(c_double), intent(in) :: params(parameters), length
    real(c_double), intent(out) :: decay
    integer(c_int32_t), intent(inout) :: status
    real(c_double) :: size, first
    first = params(3)/params(1)
    size = length
    if (params(5) > 0) size = params(5)
    decay = params(4)/(size*params(3)) - 0.5_c_double*first
    if (.not. decay > 0) status = 3
    decay = max(decay, 1e-6_c_double*first)
  end subroutine find_decay

  !> Norm of the tensile part of strain, and its derivative by strain times the norm.
  pure subroutine stretched(strain, reached, direction)
    real(c_double), intent(in) :: strain(6)
    real(c_double), intent(out) :: reached, direction(6)
    real(c_double) :: x(3), q(3, 3)
    call symmetric_eigen(from_strain(strain), x, q)
    x = max(x, 0.0_c_double)
    reached = sqrt(sum(x**2))
    direction = to_stress(matmul(q*spread(x, 1, 3), transpose(q)))
  end subroutine stretched

  !> Dissipation of a step over undamaged stress times strain at its end. Exact in steps of any length along a strain of constant
  !> direction, since the energy release grows with the square of the largest stretch.
  pure real(c_double) function share_spent(before, now, first, decay)
    real(c_double), intent(in) :: before, now, first, decay !< largest stretches at both ends of the step
    share_spent = max(0.5_c_double*first*(left(max(before, first)) - left(now))/now**2, 0.0_c_double)
  contains
    !> Energy still to be released from a largest stretch on.
    pure real(c_double) function left(largest)
      real(c_double), intent(in) :: largest
      left = exp(-(largest - first)/decay)*(largest + 2*decay)
    end function left
  end function share_spent
end module isotropic_damage
