!> A point of a body that deforms, in 2D: it moves with its nodes and turns with its edge. Record v: velocity (2) of the point and
!> spin of the edge, which condensed_bodies makes from those of the nodes; how an impulse acts is told there as well.
module mapped2
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: cairn_side_mapped2_gather
contains

  !> u = u + sign H'v
  subroutine cairn_side_mapped2_gather(n, c, width, sign, v, frame, lever, u) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 2, or 3 with rotation
    integer(c_int32_t), value     :: width        !< numbers of a record
    real(c_double), value         :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)    :: v(n, width)  !< of the points, one a contact [m/s, rad/s]
    real(c_double), intent(in)    :: frame(n, 2)  !< normal [-]
    real(c_double), intent(in)    :: lever(n, 4)  !< weights of the nodes, in the velocity already [-]
    real(c_double), intent(inout) :: u(n, c)      !< relative velocity (n, t) [m/s], then spin [rad/s]
    integer :: i
    !$omp simd
    do i = 1, n
      u(i, 1) = u(i, 1) + sign*(frame(i, 1)*v(i, 1) + frame(i, 2)*v(i, 2))
      u(i, 2) = u(i, 2) + sign*(frame(i, 1)*v(i, 2) - frame(i, 2)*v(i, 1))
    end do
    if (c > 2) u(:, 3) = u(:, 3) + sign*v(:, 3)
  end subroutine cairn_side_mapped2_gather
end module mapped2
