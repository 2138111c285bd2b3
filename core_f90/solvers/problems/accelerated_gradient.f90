!> Accelerated projected gradient with restart (Nesterov 1983; Mazhar, Heyn, Negrut & Tasora 2015). The gradient is De Saxce's:
!> where it comes to rest, Coulomb's law holds, and not its convex relaxation.
module accelerated_gradient
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  use cone_projection, only: project_cone
  implicit none
  private
  public :: cairn_gradient_step, cairn_extrapolate
contains

  !> r = P_K(y - step rho (u + (mu |u_T|, 0, 0))), u at y.
  subroutine cairn_gradient_step(dim, n, mu, rho, step, y, u, r) bind(c)
    integer(c_int32_t), value   :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n         !< contacts
    real(c_double), intent(in)  :: mu(n)     !< friction [-]
    real(c_double), intent(in)  :: rho(n)    !< scale of the contact [kg]
    real(c_double), value       :: step      !< [-]
    real(c_double), intent(in)  :: y(dim, n) !< impulse [N s]
    real(c_double), intent(in)  :: u(dim, n) !< relative velocity [m/s]
    real(c_double), intent(out) :: r(dim, n) !< impulse [N s]
    integer(c_int64_t) :: a
    do a = 1, n
      r(:, a) = y(:, a) - step*rho(a)*u(:, a)
      r(1, a) = r(1, a) - step*rho(a)*mu(a)*sqrt(sum(u(2:, a)**2))
      call project_cone(dim, mu(a), r(:, a))
    end do
  end subroutine cairn_gradient_step

  !> y = r + momentum (r - r_last), or y = r where the step turned back (O'Donoghue & Candes 2015); then momentum begins anew.
  subroutine cairn_extrapolate(n, momentum, r, r_last, y, turned_back) bind(c)
    integer(c_int64_t), value       :: n         !< numbers
    real(c_double), value           :: momentum  !< [-]
    real(c_double), intent(in)      :: r(n)      !< impulse [N s]
    real(c_double), intent(in)      :: r_last(n) !< [N s]
    real(c_double), intent(inout)   :: y(n)      !< where the gradient was taken, and will be [N s]
    integer(c_int32_t), intent(out) :: turned_back
    turned_back = merge(1, 0, sum((y - r)*(r - r_last)) > 0)
    if (turned_back == 1) then
      y = r
    else
      y = r + momentum*(r - r_last)
    end if
  end subroutine cairn_extrapolate
end module accelerated_gradient
