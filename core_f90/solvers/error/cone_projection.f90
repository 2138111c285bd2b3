!> Projection on Coulomb's cone K = { r: |r_T| <= mu r_N }, contact-major.
module cone_projection
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_project_cones, cairn_project_disks, project_cone, project_disk
contains

  !> Each contact's r becomes the nearest point of its cone, in the plain norm.
  subroutine cairn_project_cones(dim, n, mu, r) bind(c)
    integer(c_int32_t), value     :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), value     :: n         !< contacts
    real(c_double), intent(in)    :: mu(n)     !< friction [-]
    real(c_double), intent(inout) :: r(dim, n) !< any unit
    integer(c_int64_t) :: a
    do a = 1, n
      call project_cone(dim, mu(a), r(:, a))
    end do
  end subroutine cairn_project_cones

  !> Each contact's r becomes (max(r_N, 0), r_T on the disk mu r_N).
  subroutine cairn_project_disks(dim, n, mu, r) bind(c)
    integer(c_int32_t), value     :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), value     :: n         !< contacts
    real(c_double), intent(in)    :: mu(n)     !< friction [-]
    real(c_double), intent(inout) :: r(dim, n) !< any unit
    integer(c_int64_t) :: a
    do a = 1, n
      call project_disk(dim, mu(a), r(:, a))
    end do
  end subroutine cairn_project_disks

  !> One contact. Divided by mu where mu is large, so that no mu is too large.
  pure subroutine project_cone(dim, mu, r)
    integer(c_int32_t), intent(in) :: dim    !< 2 or 3
    real(c_double), intent(in)     :: mu     !< friction [-]
    real(c_double), intent(inout)  :: r(dim) !< any unit
    real(c_double) :: tangent, n, t, along
    tangent = length(dim, r)
    if (r(1) >= 0 .and. tangent <= mu*r(1)) return ! mu may be 0: of itself 0 <= mu r_N says nothing then
    n = 1
    t = mu
    if (mu > 1) then
      n = 1/mu
      t = 1
    end if
    along = max(0.0_c_double, n*r(1) + t*tangent)/(n*n + t*t)
    r(1) = n*along
    if (tangent > 0) r(2:) = (t*along/tangent)*r(2:)
  end subroutine project_cone

  !> The normal part on the half line, the tangential on the disk that it allows (Alart & Curnier 1991).
  pure subroutine project_disk(dim, mu, r)
    integer(c_int32_t), intent(in) :: dim    !< 2 or 3
    real(c_double), intent(in)     :: mu     !< friction [-]
    real(c_double), intent(inout)  :: r(dim) !< any unit
    real(c_double) :: tangent, limit
    r(1) = max(0.0_c_double, r(1))
    limit = mu*r(1)
    tangent = length(dim, r)
    if (tangent > limit) r(2:) = (limit/tangent)*r(2:)
  end subroutine project_disk

  pure real(c_double) function length(dim, r)
    integer(c_int32_t), intent(in) :: dim    !< 2 or 3
    real(c_double), intent(in)     :: r(dim) !< any unit
    if (dim == 2) then
      length = abs(r(2))
    else
      length = sqrt(r(2)**2 + r(3)**2)
    end if
  end function length
end module cone_projection
