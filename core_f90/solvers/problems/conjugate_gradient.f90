!> Conjugate projected gradient (Renouf & Alart 2005): conjugate directions within the active faces of the cones, projection where a
!> step would leave them. Friction is bounded by the present normal impulse, so the limit obeys Coulomb's law itself.
module conjugate_gradient
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  use cone_projection, only: project_disk
  implicit none
  private
  public :: cairn_tangent_gradient, cairn_conjugate_direction, cairn_disk_step
contains

  !> w = -rho times the part of u along which r may move.
  subroutine cairn_tangent_gradient(dim, n, mu, rho, r, u, w) bind(c)
    integer(c_int32_t), value   :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n         !< contacts
    real(c_double), intent(in)  :: mu(n)     !< friction [-]
    real(c_double), intent(in)  :: rho(n)    !< preconditioner [kg]
    real(c_double), intent(in)  :: r(dim, n) !< impulse [N s]
    real(c_double), intent(in)  :: u(dim, n) !< W r + q [m/s]
    real(c_double), intent(out) :: w(dim, n) !< [N s]
    integer(c_int64_t) :: a
    do a = 1, n
      w(:, a) = -rho(a)*u(:, a)
      call keep_inside(dim, mu(a), r(:, a), w(:, a))
    end do
  end subroutine cairn_tangent_gradient

  !> p = w + b p, with p first brought into the faces where r stays; b is 0 at a restart.
  subroutine cairn_conjugate_direction(dim, n, mu, r, w, b, p) bind(c)
    integer(c_int32_t), value     :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), value     :: n         !< contacts
    real(c_double), intent(in)    :: mu(n)     !< friction [-]
    real(c_double), intent(in)    :: r(dim, n) !< impulse [N s]
    real(c_double), intent(in)    :: w(dim, n) !< [N s]
    real(c_double), value         :: b         !< [-]
    real(c_double), intent(inout) :: p(dim, n) !< [N s]
    integer(c_int64_t) :: a
    do a = 1, n
      p(:, a) = w(:, a) + b*p(:, a)
      call keep_inside(dim, mu(a), r(:, a), p(:, a))
    end do
  end subroutine cairn_conjugate_direction

  !> r + step p, r_N then not below 0 and r_T on the disk mu r_N.
  subroutine cairn_disk_step(dim, n, mu, step, p, r) bind(c)
    integer(c_int32_t), value     :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), value     :: n         !< contacts
    real(c_double), intent(in)    :: mu(n)     !< friction [-]
    real(c_double), value         :: step      !< [-]
    real(c_double), intent(in)    :: p(dim, n) !< [N s]
    real(c_double), intent(inout) :: r(dim, n) !< impulse [N s]
    integer(c_int64_t) :: a
    do a = 1, n
      r(:, a) = r(:, a) + step*p(:, a)
      call project_disk(dim, mu(a), r(:, a))
    end do
  end subroutine cairn_disk_step

  !> A contact that is open may only close; one that slips may turn or come back.
  pure subroutine keep_inside(dim, mu, r, w)
    integer(c_int32_t), intent(in) :: dim    !< 2 or 3
    real(c_double), intent(in)     :: mu     !< friction [-]
    real(c_double), intent(in)     :: r(dim) !< impulse [N s]
    real(c_double), intent(inout)  :: w(dim) !< any unit
    real(c_double) :: tangent, out
    if (r(1) <= 0) then
      w(1) = max(0.0_c_double, w(1))
      w(2:) = 0
      return
    end if
    tangent = sqrt(sum(r(2:)**2))
    if (tangent < mu*r(1)*(1 - 8*epsilon(out))) return
    if (tangent > 0) then
      out = sum(r(2:)*w(2:))/tangent
      if (out > 0) w(2:) = w(2:) - (out/tangent)*r(2:)
    else
      w(2:) = 0
    end if
  end subroutine keep_inside
end module conjugate_gradient
