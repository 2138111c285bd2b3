!> Projection on Coulomb's cone K = { r: |r_T| <= mu r_N }, contact-major.
module cone_projection
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_project_cones, cairn_project_disks, cairn_cone_derivatives, project_cone, project_disk
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

  !> Derivative of the nearest point of each cone by r, times a weight.
  subroutine cairn_cone_derivatives(dim, n, mu, weight, r, derivative) bind(c)
    integer(c_int32_t), value   :: dim        !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n          !< contacts
    real(c_double), intent(in)  :: mu(n)      !< friction [-]
    real(c_double), intent(in)  :: weight(n)  !< any unit
    real(c_double), intent(in)  :: r(dim, n)  !< any unit
    real(c_double), intent(out) :: derivative(dim, dim, n) !< unit of the weight, symmetric
    integer(c_int64_t) :: a
    do a = 1, n
      call derive_cone(dim, mu(a), weight(a), r(:, a), derivative(:, :, a))
    end do
  end subroutine cairn_cone_derivatives

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

  !> One contact.
  pure subroutine project_cone(dim, mu, r)
    integer(c_int32_t), intent(in) :: dim    !< 2 or 3
    real(c_double), intent(in)     :: mu     !< friction [-]
    real(c_double), intent(inout)  :: r(dim) !< any unit
    real(c_double) :: tangent, n, t, along
    tangent = length(dim, r)
    if (r(1) >= 0 .and. tangent <= mu*r(1)) return ! mu may be 0: of itself 0 <= mu r_N says nothing then
    call side_of_cone(mu, n, t)
    along = max(0.0_c_double, n*r(1) + t*tangent)/(n*n + t*t)
    r(1) = n*along
    if (tangent > 0) r(2:) = (t*along/tangent)*r(2:)
  end subroutine project_cone

  !> One contact: beside the cone along its side, and across it as the point turns about the axis.
  pure subroutine derive_cone(dim, mu, weight, r, d)
    integer(c_int32_t), intent(in) :: dim    !< 2 or 3
    real(c_double), intent(in)     :: mu     !< friction [-]
    real(c_double), intent(in)     :: weight !< any unit
    real(c_double), intent(in)     :: r(dim) !< any unit
    real(c_double), intent(out)    :: d(dim, dim) !< unit of the weight
    real(c_double) :: tangent, n, t, along, axis(dim), turn
    integer :: k
    d = 0
    tangent = length(dim, r)
    if (r(1) >= 0 .and. tangent <= mu*r(1)) then
      do k = 1, dim
        d(k, k) = weight
      end do
      return
    end if
    call side_of_cone(mu, n, t)
    along = n*r(1) + t*tangent
    if (.not. along > 0) return
    axis(1) = n
    axis(2:) = t*r(2:)/tangent
    do k = 1, dim
      d(:, k) = (weight/(n*n + t*t)*axis(k))*axis
    end do
    if (dim == 2) return
    turn = weight*t*(along/(n*n + t*t))/tangent
    axis(2:) = [-r(3)/tangent, r(2)/tangent]
    do k = 2, dim
      d(2:, k) = d(2:, k) + turn*axis(k)*axis(2:)
    end do
  end subroutine derive_cone

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

  !> A point of the side of a cone, divided by mu where mu is large, so that no mu is too large.
  pure subroutine side_of_cone(mu, n, t)
    real(c_double), intent(in)  :: mu   !< friction [-]
    real(c_double), intent(out) :: n, t !< along the normal, across it [-]
    n = 1
    t = mu
    if (mu > 1) then
      n = 1/mu
      t = 1
    end if
  end subroutine side_of_cone

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
