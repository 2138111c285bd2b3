!> Steps of smooth contacts by an explicit scheme that predicts and corrects: forces are those of the predicted places. Contacts see
!> the velocities of the middle of the step, by Taylor's series from its start, as they do under velocity_verlet.
module gear_steps
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_int8_t
  use linear_scheme, only: cairn_scheme, most_history
  implicit none
  private
  public :: cairn_gear_predict, cairn_gear_correct
contains

  !> Places at the end of the step by the history, velocities in its middle; driven dofs take the mean of their old and new one.
  pure subroutine cairn_gear_predict(dim, nd, first, last, scheme, velocity, position, fastest, a2, a3, a4, a5, angle, driven, &
                                     driven_velocity) bind(c)
    integer(c_int32_t), value      :: dim                     !< 2 or 3
    integer(c_int32_t), value      :: nd                      !< dofs of a body
    integer(c_int64_t), value      :: first, last             !< bodies first to last - 1
    type(cairn_scheme), intent(in) :: scheme                  !< of the step
    real(c_double), intent(inout)  :: velocity(nd, 0:*)       !< at the start; out, at the middle of the step [m/s, rad/s]
    real(c_double), intent(inout)  :: position(dim, 0:*)      !< [m]
    real(c_double), intent(out)    :: fastest(2)              !< squares of the greatest way over h, and spin
    real(c_double), intent(in), optional, dimension(nd, 0:*) :: a2, a3, a4, a5 !< history at the start [m/s2, ...]
    real(c_double), intent(inout), optional :: angle(0:*)     !< in 2D [rad]
    integer(c_int8_t), intent(in), optional :: driven(0:*)    !< bit j: dof j is driven
    real(c_double), intent(in), optional :: driven_velocity(nd, 0:*) !< at the end of the step [m/s, rad/s]
    real(c_double) :: known(most_history), way(nd), half(most_history)
    integer(c_int64_t) :: i
    integer :: j
    half = to_the_middle(scheme%h)
    fastest = 0
    known = 0
    do i = first, last - 1
      do j = 1, nd
        if (present(a2)) known(1) = a2(j, i)
        if (present(a3)) known(2) = a3(j, i)
        if (present(a4)) known(3) = a4(j, i)
        if (present(a5)) known(4) = a5(j, i)
        way(j) = scheme%elastic_velocity*velocity(j, i) + dot_product(scheme%elastic, known)
        if (is_driven(driven, i, j)) then
          velocity(j, i) = 0.5_c_double*(velocity(j, i) + driven_velocity(j, i))
          way(j) = scheme%h*velocity(j, i)
        else
          velocity(j, i) = velocity(j, i) + dot_product(half, known)
        end if
      end do
      position(:, i) = position(:, i) + way(1:dim)
      if (present(angle)) angle(i) = angle(i) + way(3)
      fastest = max(fastest, [sum((way(1:dim)/scheme%h)**2), sum(velocity(dim + 1:nd, i)**2)])
    end do
  end subroutine cairn_gear_predict

  !> Places, velocities and history at the end of the step, by the accelerations of the predicted places.
  pure subroutine cairn_gear_correct(dim, nd, first, last, scheme, gravity, inverse_mass, contact_force, velocity, position, &
                                     wrong, farthest, a2, a3, a4, a5, angle, force, damping, driven, driven_velocity, reaction, &
                                     terms) bind(c)
    integer(c_int32_t), value      :: dim                     !< 2 or 3
    integer(c_int32_t), value      :: nd                      !< dofs of a body
    integer(c_int64_t), value      :: first, last             !< bodies first to last - 1
    type(cairn_scheme), intent(in) :: scheme                  !< of the step
    real(c_double), intent(in)     :: gravity(dim)            !< [m/s2]
    real(c_double), intent(in)     :: inverse_mass(nd, 0:*)   !< 0: nothing moves it [1/kg, 1/(kg m2)]
    real(c_double), intent(in)     :: contact_force(nd, 0:*)  !< of the predicted places [N, N m]
    real(c_double), intent(inout)  :: velocity(nd, 0:*)       !< at the middle; out, at the end of the step [m/s, rad/s]
    real(c_double), intent(inout)  :: position(dim, 0:*)      !< predicted; out, at the end [m]
    integer(c_int64_t), intent(inout) :: wrong                !< a body whose velocity is no finite number, if there is one
    real(c_double), intent(out)    :: farthest                !< square of the greatest correction of a place [m2]
    real(c_double), intent(inout), optional, dimension(nd, 0:*) :: a2, a3, a4, a5 !< history [m/s2, ...]
    real(c_double), intent(inout), optional :: angle(0:*)     !< in 2D [rad]
    real(c_double), intent(in), optional :: force(nd, 0:*)    !< at the end of the step [N, N m]
    real(c_double), intent(in), optional :: damping(0:*)      !< per unit of mass [1/s]
    integer(c_int8_t), intent(in), optional :: driven(0:*)    !< bit j: dof j is driven
    real(c_double), intent(in), optional :: driven_velocity(nd, 0:*) !< at the end of the step [m/s, rad/s]
    real(c_double), intent(inout), optional :: reaction(nd, 0:*) !< out, impulse of the drive in the step [N s, N m s]
    real(c_double), intent(inout), optional :: terms(5)       !< T, dU, W_external, W_driven, D_bulk are added [J]
    real(c_double) :: known(most_history), next(most_history), half(most_history), more(nd), part(5)
    real(c_double) :: begin, push, weight, drag, change, way, middle, mass
    integer(c_int64_t) :: i
    integer :: j
    half = to_the_middle(scheme%h)
    farthest = 0
    part = 0
    known = 0
    do i = first, last - 1
      do j = 1, nd
        if (present(a2)) known(1) = a2(j, i)
        if (present(a3)) known(2) = a3(j, i)
        if (present(a4)) known(3) = a4(j, i)
        if (present(a5)) known(4) = a5(j, i)
        middle = velocity(j, i)
        push = contact_force(j, i)
        if (present(force)) push = push + force(j, i)
        weight = 0
        if (j <= dim .and. inverse_mass(1, i) > 0) weight = gravity(j)
        begin = middle - dot_product(half, known)
        drag = 0
        if (present(damping)) drag = damping(i)*(begin + dot_product(scheme%damping_history, known))
        if (is_driven(driven, i, j)) then
          begin = 2*middle - driven_velocity(j, i)
          reaction(j, i) = -scheme%h*push
          if (inverse_mass(j, i) > 0) reaction(j, i) = (driven_velocity(j, i) - begin - scheme%h*weight)/inverse_mass(j, i) &
                                                       - scheme%h*push
          part(4) = part(4) + reaction(j, i)*middle
          velocity(j, i) = driven_velocity(j, i)
          more(j) = 0
          way = scheme%h*middle
          next = 0
        else
          change = 0
          if (inverse_mass(j, i) > 0) change = scheme%impulse*(inverse_mass(j, i)*push + weight - drag)
          more(j) = scheme%h*scheme%share*(dot_product(scheme%velocity, known) + change) &
                    + dot_product(scheme%position - scheme%elastic, known)
          velocity(j, i) = middle + dot_product(scheme%velocity - half, known) + change
          way = scheme%elastic_velocity*begin + dot_product(scheme%elastic, known) + more(j)
          next = matmul(scheme%update, known) + scheme%gain*change
        end if
        if (present(a2)) a2(j, i) = next(1)
        if (present(a3)) a3(j, i) = next(2)
        if (present(a4)) a4(j, i) = next(3)
        if (present(a5)) a5(j, i) = next(4)
        if (.not. (present(terms) .and. inverse_mass(j, i) > 0)) cycle
        mass = 1/inverse_mass(j, i)
        part(1) = part(1) + 0.5_c_double*mass*velocity(j, i)**2
        part(2) = part(2) - mass*weight*way
        if (present(force)) part(3) = part(3) + force(j, i)*way
        if (present(damping)) part(5) = part(5) + mass*damping(i)*middle*way
      end do
      position(:, i) = position(:, i) + more(1:dim)
      if (present(angle)) angle(i) = angle(i) + more(3)
      farthest = max(farthest, sum(more(1:dim)**2))
      if (.not. sum(velocity(:, i)**2) <= huge(way)) wrong = i
    end do
    if (present(terms)) terms = terms + part
  end subroutine cairn_gear_correct

  !> Contributions of derivatives of the history to the velocity at the middle of the step.
  pure function to_the_middle(h) result(factor)
    real(c_double), intent(in) :: h !< step [s]
    real(c_double) :: factor(most_history)
    integer :: k
    factor(1) = h/2
    do k = 2, most_history
      factor(k) = factor(k - 1)*(h/2)/k
    end do
  end function to_the_middle

  pure logical function is_driven(driven, i, j)
    integer(c_int8_t), intent(in), optional :: driven(0:*)
    integer(c_int64_t), intent(in) :: i
    integer, intent(in) :: j
    is_driven = .false.
    if (present(driven)) is_driven = btest(driven(i), j - 1)
  end function is_driven
end module gear_steps
