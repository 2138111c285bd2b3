!> Primal-dual interior point for the convex problem that is left when s = mu |u_T| is held: r in K, y = W r + q + s in K*, r.y
!> = 0 (cone quadratic programs: Andersen, Roos & Terlaky 2003; s follows from iteration to iteration: Acary, Cadoux, Lemarechal
!> & Malick 2011). In variables x = (mu r_N, r_T), z = (y_N / mu, y_T) both cones are Lorentz's; directions are those of
!> Nesterov & Todd.
module interior_point
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_interior_scaling, cairn_interior_length
contains

  !> Block of each contact that joins W: theta x = z, theta = beta^2 (2 w w' - J), and the inverse J x/det x, both in the variables
  !> of the problem: r and y.
  subroutine cairn_interior_scaling(dim, n, mu, r, y, theta, inverse) bind(c)
    integer(c_int32_t), value   :: dim         !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n           !< contacts
    real(c_double), intent(in)  :: mu(n)       !< friction, positive [-]
    real(c_double), intent(in)  :: r(dim, n)   !< impulse, inside its cone [N s]
    real(c_double), intent(in)  :: y(dim, n)   !< velocity, inside the dual cone [m/s]
    real(c_double), intent(out) :: theta(dim, dim, n)  !< [1/kg]
    real(c_double), intent(out) :: inverse(dim, n)     !< of r, in the dual space [1/(N s)]
    real(c_double) :: x(dim), z(dim), w(dim), d(dim), det_x, det_z, gamma
    integer(c_int64_t) :: a
    integer :: i, j
    do a = 1, n
      d = 1
      d(1) = mu(a)
      x = d*r(:, a)
      z = y(:, a)/d
      det_x = determinant(dim, x)
      det_z = determinant(dim, z)
      inverse(:, a) = -d*x/det_x
      inverse(1, a) = d(1)*x(1)/det_x
      x = x/sqrt(det_x)
      z = z/sqrt(det_z)
      gamma = sqrt((1 + sum(x*z))/2)
      w = (z - x)/(2*gamma)
      w(1) = (z(1) + x(1))/(2*gamma)
      do j = 1, dim
        do i = 1, dim
          theta(i, j, a) = 2*w(i)*w(j)
        end do
        theta(j, j, a) = theta(j, j, a) + merge(-1.0_c_double, 1.0_c_double, j == 1)
      end do
      theta(:, :, a) = theta(:, :, a)*sqrt(det_z/det_x)
      do j = 1, dim
        theta(:, j, a) = theta(:, j, a)*d*d(j)
      end do
    end do
  end subroutine cairn_interior_scaling

  !> x_N^2 - |x_T|^2 without cancellation
  pure real(c_double) function determinant(dim, x)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in)     :: x(dim)
    real(c_double) :: tangent
    tangent = sqrt(sum(x(2:)**2))
    determinant = max((x(1) - tangent)*(x(1) + tangent), tiny(tangent))
  end function determinant

  !> Largest step t <= 1 that leaves r + t dr and y + t dy in their cones.
  subroutine cairn_interior_length(dim, n, mu, r, dr, y, dy, length) bind(c)
    integer(c_int32_t), value   :: dim         !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n           !< contacts
    real(c_double), intent(in)  :: mu(n)       !< friction, positive [-]
    real(c_double), intent(in)  :: r(dim, n), dr(dim, n) !< impulse and its change [N s]
    real(c_double), intent(in)  :: y(dim, n), dy(dim, n) !< velocity and its change [m/s]
    real(c_double), intent(out) :: length(2)   !< of impulses, of velocities
    real(c_double) :: d(dim)
    integer(c_int64_t) :: a
    length = 1
    do a = 1, n
      d = 1
      d(1) = mu(a)
      length(1) = min(length(1), to_boundary(dim, d*r(:, a), d*dr(:, a)))
      length(2) = min(length(2), to_boundary(dim, y(:, a)/d, dy(:, a)/d))
    end do
  end subroutine cairn_interior_length

  !> Least positive root of det(x + t dx), at most 1.
  pure real(c_double) function to_boundary(dim, x, dx) result(t)
    integer(c_int32_t), intent(in) :: dim
    real(c_double), intent(in)     :: x(dim), dx(dim)
    real(c_double) :: a, b, c, root
    a = dx(1)**2 - sum(dx(2:)**2)
    b = x(1)*dx(1) - sum(x(2:)*dx(2:))
    c = determinant(dim, x)
    t = 1
    root = b*b - a*c
    if (root >= 0) then
      root = sqrt(root)
      if (b < 0) then
        t = min(t, c/(-b + root))
      else if (a < 0) then
        t = min(t, (-b - root)/a)
      end if
    end if
    if (x(1) + t*dx(1) < 0) t = min(t, -x(1)/dx(1))
  end function to_boundary
end module interior_point
