!> Cundall's local damping (1987): each component of the force on a body is less by a share where it acts along the motion, and more
!> by as much where it acts against it. It brings bodies to rest, whatever their frequencies, and leaves forces at rest as they are.
module local_damping
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_int8_t
  implicit none
  private
  public :: cairn_local_damping
contains

  pure subroutine cairn_local_damping(dim, nd, first, last, h, share, gravity, mass, velocity, contact_force, spent, &
                                      force, driven) bind(c)
    integer(c_int32_t), value     :: dim                     !< 2 or 3
    integer(c_int32_t), value     :: nd                      !< dofs of a body
    integer(c_int64_t), value     :: first, last             !< bodies first to last - 1
    real(c_double), value         :: h                       !< step [s]
    real(c_double), value         :: share                   !< in [0, 1)
    real(c_double), intent(in)    :: gravity(dim)            !< [m/s2]
    real(c_double), intent(in)    :: mass(0:*)               !< inf: nothing moves it [kg]
    real(c_double), intent(in)    :: velocity(nd, 0:*)       !< in the middle of the step [m/s, rad/s]
    real(c_double), intent(inout) :: contact_force(nd, 0:*)  !< out, with that of damping [N, N m]
    real(c_double), intent(inout) :: spent                   !< its loss in the step is added [J]
    real(c_double), intent(in), optional :: force(nd, 0:*)   !< mean over the step [N, N m]
    integer(c_int8_t), intent(in), optional :: driven(0:*)   !< bit j: dof j is driven
    real(c_double) :: push, drag
    integer(c_int64_t) :: i
    integer :: j
    do i = first, last - 1
      if (.not. mass(i) <= huge(push)) cycle
      do j = 1, nd
        if (present(driven)) then
          if (btest(driven(i), j - 1)) cycle
        end if
        push = contact_force(j, i)
        if (present(force)) push = push + force(j, i)
        if (j <= dim) push = push + mass(i)*gravity(j)
        drag = 0
        if (velocity(j, i) > 0) drag = share*abs(push)
        if (velocity(j, i) < 0) drag = -share*abs(push)
        contact_force(j, i) = contact_force(j, i) - drag
        spent = spent + h*drag*velocity(j, i)
      end do
    end do
  end subroutine cairn_local_damping
end module local_damping
