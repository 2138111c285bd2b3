!> Hooke's law with three planes of symmetry, whose first two axes are turned about the third (Lekhnitskii 1963).
module orthotropic_elastic
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use tensor_functions, only: inverse, from_strain, to_strain
  implicit none
  private
  public :: cairn_bulk_orthotropic_elastic
  integer, parameter :: parameters = 10, states = 0
contains

  !> Stress of n points.
  pure subroutine cairn_bulk_orthotropic_elastic(n, h, theta, params, length, strain, state_begin, state, stress, tangent, &
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
    real(c_double) :: c(6, 6)
    integer(c_int64_t) :: i
    c = moduli(params)
    do i = 1, n
      tangent(:, :, i) = c
      stress(:, i) = matmul(c, strain(:, i))
      energy(i) = 0.5_c_double*dot_product(stress(:, i), strain(:, i))
      if (.not. c(1, 1) > 0) status(i) = 2 ! the ratios of Poisson fit no material
    end do
    dissipated = 0
    state = state_begin
  end subroutine cairn_bulk_orthotropic_elastic

  !> Stiffness matrix in the axes of space [Pa]; zero if the moduli given are not positive definite.
  pure function moduli(params) result(c)
    real(c_double), intent(in) :: params(parameters)
    real(c_double) :: c(6, 6), compliance(3, 3), turn(6, 6), q(3, 3), unit(6)
    integer :: k
    associate (young => params(1:3), poisson => params(4:6), angle => params(10))
      do k = 1, 3
        compliance(k, k) = 1/young(k)
      end do
      compliance(1, 2) = -poisson(1)/young(1)
      compliance(1, 3) = -poisson(2)/young(1)
      compliance(2, 3) = -poisson(3)/young(2)
      compliance(2, 1) = compliance(1, 2)
      compliance(3, 1) = compliance(1, 3)
      compliance(3, 2) = compliance(2, 3)
      c = 0
      c(:3, :3) = inverse(compliance)
      c(:3, :3) = 0.5_c_double*(c(:3, :3) + transpose(c(:3, :3)))
      do k = 1, 3
        c(k + 3, k + 3) = params(6 + k)
      end do
      if (.not. (c(1, 1) > 0 .and. c(1, 1)*c(2, 2) > c(1, 2)**2 .and. c(3, 3) > 0 .and. c(2, 2)*c(3, 3) > c(2, 3)**2 &
                 .and. c(1, 1)*c(3, 3) > c(1, 3)**2)) then
        c = 0
        return
      end if
      q = 0
      q(3, 3) = 1
      q(:2, 1) = [cos(angle), sin(angle)]
      q(:2, 2) = [-sin(angle), cos(angle)]
    end associate
    do k = 1, 6 ! strains of space to those of the axes
      unit = 0
      unit(k) = 1
      turn(:, k) = to_strain(matmul(transpose(q), matmul(from_strain(unit), q)))
    end do
    c = matmul(transpose(turn), matmul(c, turn))
  end function moduli
end module orthotropic_elastic
