!> Coulomb's friction with a static and a kinetic coefficient: the latter at contacts that slid in the step before.
module dry_friction
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  implicit none
  private
  public :: friction_of, slid
contains

  !> The kinetic coefficient is never above the static one.
  pure real(c_double) function friction_of(static, kinetic, slides)
    real(c_double), intent(in) :: static, kinetic !< [-]
    real(c_double), intent(in) :: slides          !< above 0: slid in the step before
    friction_of = static
    if (slides > 0) friction_of = min(static, kinetic)
  end function friction_of

  !> 1 if a contact slid, else 0. In sliding r_T - m u_T is outside the cone by m |u_T|, more than the error of a solver.
  pure real(c_double) function slid(c, mass, mu, normal, r, u)
    integer(c_int32_t), intent(in) :: c      !< components
    real(c_double), intent(in)     :: mass   !< effective mass [kg]
    real(c_double), intent(in)     :: mu     !< friction [-]
    real(c_double), intent(in)     :: normal !< impulse that bounds friction [N s]
    real(c_double), intent(in)     :: r(c)   !< impulse [N s]
    real(c_double), intent(in)     :: u(c)   !< relative velocity at the end of the step [m/s]
    real(c_double) :: size, t(c - 1)
    slid = 0
    if (.not. normal > 0) return
    t = r(2:) - mass*u(2:)
    size = maxval(abs(t))
    if (size > 0) size = size*sqrt(sum((t/size)**2))
    if (size >= mu*normal*(1 - 8*epsilon(mu))) slid = 1
  end function slid
end module dry_friction
