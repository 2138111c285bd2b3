!> A point of a body that deforms, in 3D: it moves with its nodes and turns with its face. Record v: velocity (3) of the point and
!> spin of the face about the axes of the contact (3), which condensed_bodies makes from those of the nodes; how an impulse acts is
!> told there as well.
module mapped3
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_side_mapped3_gather
contains

  !> u = u + sign H'v
  subroutine cairn_side_mapped3_gather(n, c, width, sign, v, frame, lever, u) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 3, or 6 with rotations
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: v(n, width)  !< of the points, one a contact [m/s]; of their faces in local axes [rad/s]
    real(c_double), intent(in)    :: frame(n, 6)  !< normal, first tangent [-]
    real(c_double), intent(in)    :: lever(n, 4)  !< weights of the nodes, in the velocity already [-]
    real(c_double), intent(inout) :: u(n, c)      !< relative velocity (n, t, s) [m/s], then spins [rad/s]
    real(c_double) :: s(3)
    integer :: i
    !$omp simd private(s)
    do i = 1, n
      s(1) = frame(i, 2)*frame(i, 6) - frame(i, 3)*frame(i, 5)
      s(2) = frame(i, 3)*frame(i, 4) - frame(i, 1)*frame(i, 6)
      s(3) = frame(i, 1)*frame(i, 5) - frame(i, 2)*frame(i, 4)
      u(i, 1) = u(i, 1) + sign*(frame(i, 1)*v(i, 1) + frame(i, 2)*v(i, 2) + frame(i, 3)*v(i, 3))
      u(i, 2) = u(i, 2) + sign*(frame(i, 4)*v(i, 1) + frame(i, 5)*v(i, 2) + frame(i, 6)*v(i, 3))
      u(i, 3) = u(i, 3) + sign*(s(1)*v(i, 1) + s(2)*v(i, 2) + s(3)*v(i, 3))
    end do
    if (c > 3) u(:, 4:6) = u(:, 4:6) + sign*v(:, 4:6)
  end subroutine cairn_side_mapped3_gather
end module mapped3
