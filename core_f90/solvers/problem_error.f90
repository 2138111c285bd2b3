!> How far r is from a solution of a frictional contact problem: the natural map in an energy norm, as contact_error has it for the
!> contacts of a simulation. With rho = 1/W_NN of the contact, u = W r + q,
!>   F(r) = r - P_K( r - rho (u + (mu |u_T|, 0, 0)) ),   K Coulomb's cone
!> (De Saxce & Feng 1998; the natural map: Acary & Brogliato 2008); where mu > 1, F of Alart & Curnier (1991), which has the same
!> zeros and does not multiply the rounding of a slip by mu.
module problem_error
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  use cone_projection, only: project_cone, project_disk
  implicit none
  private
  public :: cairn_problem_error, cairn_problem_figures, cairn_problem_speeds
contains

  !> Sums of the error, in the order of contacts.
  subroutine cairn_problem_error(dim, n, mu, w_nn, r, u, residual, size) bind(c)
    integer(c_int32_t), value   :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n         !< contacts
    real(c_double), intent(in)  :: mu(n)     !< friction [-]
    real(c_double), intent(in)  :: w_nn(n)   !< 1/rho [1/kg]
    real(c_double), intent(in)  :: r(dim, n) !< impulse [N s]
    real(c_double), intent(in)  :: u(dim, n) !< W r + q [m/s]
    real(c_double), intent(out) :: residual  !< sum |F|^2/rho [J]
    real(c_double), intent(out) :: size      !< sum |r|^2/rho [J]
    real(c_double) :: f(dim)
    integer(c_int64_t) :: a
    residual = 0
    size = 0
    do a = 1, n
      call natural_map(dim, mu(a), w_nn(a), r(:, a), u(:, a), f)
      residual = residual + w_nn(a)*sum(f**2)
      size = size + w_nn(a)*sum(r(:, a)**2)
    end do
  end subroutine cairn_problem_error

  !> What a mechanic reads beside the error.
  subroutine cairn_problem_figures(dim, n, mu, w_nn, q, r, u, figures) bind(c)
    integer(c_int32_t), value   :: dim        !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n          !< contacts
    real(c_double), intent(in)  :: mu(n)      !< friction [-]
    real(c_double), intent(in)  :: w_nn(n)    !< 1/rho [1/kg]
    real(c_double), intent(in)  :: q(dim, n)  !< velocity with r = 0 [m/s]
    real(c_double), intent(in)  :: r(dim, n)  !< impulse [N s]
    real(c_double), intent(in)  :: u(dim, n)  !< W r + q [m/s]
    real(c_double), intent(out) :: figures(5) !< worst |F|^2/max(|r|^2, |F(0)|^2, |F|^2) of a contact; its place from 0, or -1;
    !< largest -u_N/|q|; largest distance outside the cone/|r|; energy that contacts gave/energy in play
    real(c_double) :: f(dim), zero(dim), origin, worst, ratio, own, sink, fastest, outside, work, given, play
    integer(c_int64_t) :: a, place
    worst = 0
    place = 0
    sink = 0
    fastest = 0
    outside = 0
    given = 0
    play = 0
    zero = 0
    do a = 1, n
      call natural_map(dim, mu(a), w_nn(a), zero, q(:, a), f)
      origin = sum(f**2)
      call natural_map(dim, mu(a), w_nn(a), r(:, a), u(:, a), f)
      own = sum(f**2)
      ratio = own/max(sum(r(:, a)**2), origin, own, tiny(own))
      if (.not. ratio <= worst) then
        worst = ratio
        place = a
      end if
      sink = max(sink, -u(1, a))
      fastest = max(fastest, sum(q(:, a)**2))
      own = sum(r(:, a)**2)
      ratio = max(0.0_c_double, -r(1, a), sqrt(sum(r(2:, a)**2)) - mu(a)*max(0.0_c_double, r(1, a)))
      outside = max(outside, ratio*ratio/max(own, tiny(own)))
      work = sum(r(:, a)*u(:, a))
      given = given + max(0.0_c_double, work)
      play = play + sum(abs(r(:, a)*q(:, a)))
    end do
    figures = [worst, real(place - 1, c_double), sink/sqrt(max(fastest, tiny(fastest))), sqrt(outside), &
               given/max(play, tiny(play))]
    if (.not. sink > 0) figures(3) = 0
    if (.not. given > 0) figures(5) = 0
  end subroutine cairn_problem_figures

  !> |F| W_NN of each contact: by how much its velocity breaks the law, but for what the rounding of impulses makes of it.
  subroutine cairn_problem_speeds(dim, n, mu, w_nn, r, u, speed) bind(c)
    integer(c_int32_t), value   :: dim        !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n          !< contacts
    real(c_double), intent(in)  :: mu(n)      !< friction [-]
    real(c_double), intent(in)  :: w_nn(n)    !< 1/rho [1/kg]
    real(c_double), intent(in)  :: r(dim, n)  !< impulse [N s]
    real(c_double), intent(in)  :: u(dim, n)  !< relative velocity [m/s]
    real(c_double), intent(out) :: speed(n)   !< [m/s]
    real(c_double) :: f(dim)
    integer(c_int64_t) :: a
    do a = 1, n
      call natural_map(dim, mu(a), w_nn(a), r(:, a), u(:, a), f)
      speed(a) = max(0.0_c_double, sqrt(sum(f**2)) - 64*epsilon(f)*sqrt(sum(r(:, a)**2)))*w_nn(a)
    end do
  end subroutine cairn_problem_speeds

  !> F of one contact.
  pure subroutine natural_map(dim, mu, w_nn, r, u, f)
    integer(c_int32_t), intent(in) :: dim    !< 2 or 3
    real(c_double), intent(in)     :: mu     !< friction [-]
    real(c_double), intent(in)     :: w_nn   !< 1/rho [1/kg]
    real(c_double), intent(in)     :: r(dim) !< impulse [N s]
    real(c_double), intent(in)     :: u(dim) !< relative velocity [m/s]
    real(c_double), intent(out)    :: f(dim) !< residual [N s]
    f = r - u/w_nn
    if (mu <= 1) then
      f(1) = f(1) - mu*sqrt(sum(u(2:)**2))/w_nn
      call project_cone(dim, mu, f)
    else
      call project_disk(dim, mu, f)
    end if
    f = r - f
  end subroutine natural_map
end module problem_error
