!> Textbook Gauss-Seidel on disks or spheres with Coulomb friction: contacts in their order, with no stored data but the impulse.
!> The reference for results and speed of batches.
module plain_sweep
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_plain_sweep2, cairn_plain_sweep3
contains

  !> Disks.
  subroutine cairn_plain_sweep2(n, body, normal, lever, mu, bias, inverse_mass, inverse_inertia, v, r) bind(c)
    integer(c_int64_t), value         :: n                  !< contacts
    integer(c_int32_t), intent(in)    :: body(2, n)         !< A and B
    real(c_double), intent(in)        :: normal(2, n)       !< from B to A [-]
    real(c_double), intent(in)        :: lever(2, n)        !< from the centres of A and B to the contact point, along n [m]
    real(c_double), intent(in)        :: mu(n)              !< friction [-]
    real(c_double), intent(in)        :: bias(n)            !< added to the normal velocity [m/s]
    real(c_double), intent(in)        :: inverse_mass(0:*)  !< of bodies [1/kg]
    real(c_double), intent(in)        :: inverse_inertia(0:*) !< of bodies [1/(kg m2)]
    real(c_double), intent(inout)     :: v(3, 0:*)          !< velocity and spin of bodies [m/s, rad/s]
    real(c_double), intent(inout)     :: r(2, n)            !< impulses (n, t) [N s]
    real(c_double) :: nx, ny, un, ut, wn, wt, rn, rt, dn, dt, px, py
    integer(c_int64_t) :: i
    integer :: a, b
    do i = 1, n
      a = body(1, i)
      b = body(2, i)
      nx = normal(1, i)
      ny = normal(2, i)
      un = nx*(v(1, a) - v(1, b)) + ny*(v(2, a) - v(2, b)) + bias(i)
      ut = nx*(v(2, a) - v(2, b)) - ny*(v(1, a) - v(1, b)) + lever(1, i)*v(3, a) - lever(2, i)*v(3, b)
      wn = inverse_mass(a) + inverse_mass(b)
      wt = wn + inverse_inertia(a)*lever(1, i)**2 + inverse_inertia(b)*lever(2, i)**2
      rn = max(0.0_c_double, r(1, i) - un/wn)
      rt = min(mu(i)*rn, max(-mu(i)*rn, r(2, i) - ut/wt))
      dn = rn - r(1, i)
      dt = rt - r(2, i)
      r(1, i) = rn
      r(2, i) = rt
      px = nx*dn - ny*dt
      py = ny*dn + nx*dt
      v(1, a) = v(1, a) + inverse_mass(a)*px
      v(2, a) = v(2, a) + inverse_mass(a)*py
      v(3, a) = v(3, a) + inverse_inertia(a)*lever(1, i)*dt
      v(1, b) = v(1, b) - inverse_mass(b)*px
      v(2, b) = v(2, b) - inverse_mass(b)*py
      v(3, b) = v(3, b) - inverse_inertia(b)*lever(2, i)*dt
    end do
  end subroutine cairn_plain_sweep2

  !> Spheres.
  subroutine cairn_plain_sweep3(n, body, frame, lever, mu, bias, inverse_mass, inverse_inertia, v, r) bind(c)
    integer(c_int64_t), value         :: n                  !< contacts
    integer(c_int32_t), intent(in)    :: body(2, n)         !< A and B
    real(c_double), intent(in)        :: frame(6, n)        !< normal from B to A, first tangent [-]
    real(c_double), intent(in)        :: lever(2, n)        !< from the centres of A and B to the contact point, along n [m]
    real(c_double), intent(in)        :: mu(n)              !< friction [-]
    real(c_double), intent(in)        :: bias(n)            !< added to the normal velocity [m/s]
    real(c_double), intent(in)        :: inverse_mass(0:*)  !< of bodies [1/kg]
    real(c_double), intent(in)        :: inverse_inertia(0:*) !< of bodies [1/(kg m2)]
    real(c_double), intent(inout)     :: v(6, 0:*)          !< velocity and spin of bodies [m/s, rad/s]
    real(c_double), intent(inout)     :: r(3, n)            !< impulses (n, t, s) [N s]
    real(c_double) :: f(3), t(3), s(3), x(3), w(3), u(3), wn, wt, rn, rt, rs, size, d(3), p(3), q(3)
    integer(c_int64_t) :: i
    integer :: a, b
    do i = 1, n
      a = body(1, i)
      b = body(2, i)
      f = frame(1:3, i)
      t = frame(4:6, i)
      s = [f(2)*t(3) - f(3)*t(2), f(3)*t(1) - f(1)*t(3), f(1)*t(2) - f(2)*t(1)]
      x = v(1:3, a) - v(1:3, b)
      w = lever(1, i)*v(4:6, a) - lever(2, i)*v(4:6, b)
      u = [dot_product(f, x) + bias(i), dot_product(t, x) + dot_product(s, w), dot_product(s, x) - dot_product(t, w)]
      wn = inverse_mass(a) + inverse_mass(b)
      wt = wn + inverse_inertia(a)*lever(1, i)**2 + inverse_inertia(b)*lever(2, i)**2
      rn = max(0.0_c_double, r(1, i) - u(1)/wn)
      rt = r(2, i) - u(2)/wt
      rs = r(3, i) - u(3)/wt
      size = rt*rt + rs*rs
      if (size > (mu(i)*rn)**2) then
        size = mu(i)*rn/sqrt(size)
        rt = rt*size
        rs = rs*size
      end if
      d = [rn, rt, rs] - r(:, i)
      r(:, i) = [rn, rt, rs]
      p = f*d(1) + t*d(2) + s*d(3)
      q = d(2)*s - d(3)*t
      v(1:3, a) = v(1:3, a) + inverse_mass(a)*p
      v(4:6, a) = v(4:6, a) + inverse_inertia(a)*lever(1, i)*q
      v(1:3, b) = v(1:3, b) - inverse_mass(b)*p
      v(4:6, b) = v(4:6, b) - inverse_inertia(b)*lever(2, i)*q
    end do
  end subroutine cairn_plain_sweep3
end module plain_sweep
