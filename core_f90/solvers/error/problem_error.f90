!> How far r is from a solution of a frictional contact problem: the natural map in an energy norm, as contact_error has it for the
!> contacts of a simulation. With rho = 1/W_NN of the contact, u = W r + q,
!>   F(r) = r - P_K( r - rho (u + (mu |u_T|, 0, 0)) ),   K Coulomb's cone
!> (De Saxce & Feng 1998; the natural map: Acary & Brogliato 2008); where mu > 1, F of Alart & Curnier (1991), which has the same
!> zeros and does not multiply the rounding of a slip by mu.
module problem_error
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_problem_error, cairn_problem_figures, cairn_problem_speeds, cairn_law_breaks
  integer, parameter :: chunk = 64 ! contacts
contains

  !> Sums of the error, in an order that depends on the number of contacts alone.
  subroutine cairn_problem_error(dim, n, mu, w_nn, r, u, residual, size) bind(c)
    integer(c_int32_t), value   :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n         !< contacts
    real(c_double), intent(in)  :: mu(n)     !< friction [-]
    real(c_double), intent(in)  :: w_nn(n)   !< 1/rho [1/kg]
    real(c_double), intent(in)  :: r(dim, n) !< impulse [N s]
    real(c_double), intent(in)  :: u(dim, n) !< W r + q [m/s]
    real(c_double), intent(out) :: residual  !< sum |F|^2/rho [J]
    real(c_double), intent(out) :: size      !< sum |r|^2/rho [J]
    real(c_double) :: square(chunk)
    integer(c_int64_t) :: a, first, count
    residual = 0
    size = 0
    do first = 1, n, chunk
      count = min(int(chunk, c_int64_t), n - first + 1)
      call map_squares(dim, count, mu(first), w_nn(first), r(1, first), u(1, first), square)
      if (dim == 3) then
        !$omp simd reduction(+:residual, size)
        do a = first, first + count - 1
          residual = residual + w_nn(a)*square(a-first+1)
          size = size + w_nn(a)*(r(1, a)**2 + r(2, a)**2 + r(3, a)**2)
        end do
      else
        !$omp simd reduction(+:residual, size)
        do a = first, first + count - 1
          residual = residual + w_nn(a)*square(a-first+1)
          size = size + w_nn(a)*(r(1, a)**2 + r(2, a)**2)
        end do
      end if
    end do
  end subroutine cairn_problem_error

  !> Figures in mechanical terms beside the error.
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
    real(c_double) :: own(chunk), size(chunk), none(3*chunk), free(chunk), worst, ratio, sink, fastest, outside, given, play
    integer(c_int64_t) :: a, first, place, count
    worst = 0
    place = 0
    sink = 0
    fastest = 0
    outside = 0
    given = 0
    play = 0
    none = 0
    do first = 1, n, chunk
      count = min(int(chunk, c_int64_t), n - first + 1)
      call map_squares(dim, count, mu(first), w_nn(first), r(1, first), u(1, first), own)
      if (dim == 3) then
        !$omp simd reduction(max:sink, fastest, outside) reduction(+:given, play)
        do a = first, first + count - 1
          call figures_of(mu(a), q(1, a), q(2, a), q(3, a), r(1, a), r(2, a), r(3, a), u(1, a), u(2, a), u(3, a), &
                          size(a-first+1), sink, fastest, outside, given, play)
        end do
      else
        !$omp simd reduction(max:sink, fastest, outside) reduction(+:given, play)
        do a = first, first + count - 1
          call figures_of(mu(a), q(1, a), q(2, a), 0.0_c_double, r(1, a), r(2, a), 0.0_c_double, u(1, a), u(2, a), &
                          0.0_c_double, size(a-first+1), sink, fastest, outside, given, play)
        end do
      end if
      if (all(own(:count) <= worst*max(size(:count), own(:count)))) cycle
      call map_squares(dim, count, mu(first), w_nn(first), none, q(1, first), free)
      do a = 1, count
        ratio = own(a)/max(size(a), free(a), own(a), tiny(ratio))
        if (ratio <= worst) cycle
        worst = ratio
        place = first + a - 1
      end do
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
    real(c_double), parameter :: rounding = 8*epsilon(rounding)
    integer(c_int64_t) :: a
    call map_squares(dim, n, mu, w_nn, r, u, speed)
    if (dim == 3) then
      !$omp simd
      do a = 1, n
        speed(a) = max(0.0_c_double, sqrt(speed(a)) - rounding*sqrt(r(1, a)**2 + r(2, a)**2 + r(3, a)**2))*w_nn(a)
      end do
    else
      !$omp simd
      do a = 1, n
        speed(a) = max(0.0_c_double, sqrt(speed(a)) - rounding*sqrt(r(1, a)**2 + r(2, a)**2))*w_nn(a)
      end do
    end if
  end subroutine cairn_problem_speeds

  !> By how much the velocity of each contact breaks the law, normal and tangential conditions apart (the natural map of Alart &
  !> Curnier 1991, divided by rho). Where nothing is projected it is the velocity itself, to all its digits, however large the
  !> impulse beside it is; where a contact slips, less what the rounding of its impulse makes.
  subroutine cairn_law_breaks(dim, n, mu, w_nn, r, u, broken) bind(c)
    integer(c_int32_t), value   :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value   :: n              !< contacts
    real(c_double), intent(in)  :: mu(n)          !< friction [-]
    real(c_double), intent(in)  :: w_nn(n)        !< 1/rho [1/kg]
    real(c_double), intent(in)  :: r(dim, n)      !< impulse [N s]
    real(c_double), intent(in)  :: u(dim, n)      !< relative velocity [m/s]
    real(c_double), intent(out) :: broken(dim, n) !< [m/s]
    real(c_double), parameter :: rounding = 8*epsilon(rounding)
    real(c_double) :: normal, tangent, limit, size, z(2)
    integer(c_int64_t) :: a
    do a = 1, n
      broken(:, a) = u(:, a)
      normal = r(1, a) - u(1, a)/w_nn(a)
      limit = mu(a)*max(normal, 0.0_c_double)
      z = 0
      z(:dim-1) = r(2:, a) - u(2:, a)/w_nn(a)
      tangent = sqrt(z(1)**2 + z(2)**2)
      if (tangent > limit) then
        z(:dim-1) = r(2:, a) - (limit/tangent)*z(:dim-1)
        size = sqrt(z(1)**2 + z(2)**2)
        broken(2:, a) = 0
        if (size > rounding*limit) broken(2:, a) = (1 - rounding*limit/size)*z(:dim-1)*w_nn(a)
      end if
      if (.not. normal > 0) broken(1, a) = r(1, a)*w_nn(a)
    end do
  end subroutine cairn_law_breaks

  !> Contribution of a contact, components (n, t, s), to the figures.
  pure subroutine figures_of(mu, qn, qt, qs, rn, rt, rs, un, ut, us, size, sink, fastest, outside, given, play)
    real(c_double), intent(in)    :: mu         !< friction [-]
    real(c_double), intent(in)    :: qn, qt, qs !< velocity with r = 0 [m/s]
    real(c_double), intent(in)    :: rn, rt, rs !< impulse [N s]
    real(c_double), intent(in)    :: un, ut, us !< relative velocity [m/s]
    real(c_double), intent(out)   :: size       !< |r|^2 [N2 s2]
    real(c_double), intent(inout) :: sink       !< largest -u_N [m/s]
    real(c_double), intent(inout) :: fastest    !< largest |q|^2 [m2/s2]
    real(c_double), intent(inout) :: outside    !< largest distance^2 outside the cone/|r|^2 [-]
    real(c_double), intent(inout) :: given      !< energy that contacts gave [J]
    real(c_double), intent(inout) :: play       !< energy in play [J]
    real(c_double) :: distance
    size = rn*rn + rt*rt + rs*rs
    sink = max(sink, -un)
    fastest = max(fastest, qn*qn + qt*qt + qs*qs)
    distance = max(0.0_c_double, -rn, sqrt(rt*rt + rs*rs) - mu*max(0.0_c_double, rn))
    outside = max(outside, distance*distance/max(size, tiny(size)))
    given = given + max(0.0_c_double, rn*un + rt*ut + rs*us)
    play = play + abs(rn*qn) + abs(rt*qt) + abs(rs*qs)
  end subroutine figures_of

  !> F|^2 of each contact. The maps have no other caller, so compilers inline them into the loop and vectorise it.
  subroutine map_squares(dim, n, mu, w_nn, r, u, square)
    integer(c_int32_t), intent(in) :: dim       !< components of a contact, 2 or 3
    integer(c_int64_t), intent(in) :: n         !< contacts
    real(c_double), intent(in)     :: mu(n)     !< friction [-]
    real(c_double), intent(in)     :: w_nn(n)   !< 1/rho [1/kg]
    real(c_double), intent(in)     :: r(dim, n) !< impulse [N s]
    real(c_double), intent(in)     :: u(dim, n) !< relative velocity [m/s]
    real(c_double), intent(out)    :: square(n) !< [N2 s2]
    integer(c_int64_t) :: a
    if (dim == 3) then
      !$omp simd
      do a = 1, n
        call map_square(mu(a), 1/w_nn(a), r(1, a), r(2, a), r(3, a), u(1, a), u(2, a), u(3, a), square(a))
      end do
    else
      !$omp simd
      do a = 1, n
        call map_square_in_plane(mu(a), 1/w_nn(a), r(1, a), r(2, a), u(1, a), u(2, a), square(a))
      end do
    end if
  end subroutine map_squares

  !> |F|^2 of one contact [N2 s2], components (n, t, s), without branches so that loops over contacts vectorise: the projections
  !> are those of cone_projection.
  pure subroutine map_square(mu, rho, rn, rt, rs, un, ut, us, square)
    real(c_double), intent(in)  :: mu     !< friction [-]
    real(c_double), intent(in)  :: rho    !< [kg]
    real(c_double), intent(in)  :: rn     !< impulse [N s]
    real(c_double), intent(in)  :: rt
    real(c_double), intent(in)  :: rs
    real(c_double), intent(in)  :: un     !< relative velocity [m/s]
    real(c_double), intent(in)  :: ut
    real(c_double), intent(in)  :: us
    real(c_double), intent(out) :: square
    real(c_double) :: n, t, s, tangent, normal, kept, cone_n, cone_t, disk_n, disk_t
    t = rt - rho*ut
    s = rs - rho*us
    tangent = sqrt(t*t + s*s)
    n = rn - rho*un
    disk_n = max(0.0_c_double, n)
    disk_t = min(tangent, mu*disk_n)
    n = n - merge(rho*mu*sqrt(ut*ut + us*us), 0.0_c_double, mu <= 1)
    cone_n = max(0.0_c_double, n + mu*tangent)/(1 + mu*mu)
    cone_t = mu*cone_n
    cone_n = merge(max(0.0_c_double, n), cone_n, tangent <= mu*n) ! mu may be 0
    cone_t = merge(tangent, cone_t, tangent <= mu*n)
    normal = merge(cone_n, disk_n, mu <= 1)
    kept = merge(cone_t, disk_t, mu <= 1)/max(tangent, tiny(tangent))
    square = (rn - normal)**2 + (rt - kept*t)**2 + (rs - kept*s)**2
  end subroutine map_square

  pure subroutine map_square_in_plane(mu, rho, rn, rt, un, ut, square)
    real(c_double), intent(in)  :: mu     !< friction [-]
    real(c_double), intent(in)  :: rho    !< [kg]
    real(c_double), intent(in)  :: rn     !< impulse [N s]
    real(c_double), intent(in)  :: rt
    real(c_double), intent(in)  :: un     !< relative velocity [m/s]
    real(c_double), intent(in)  :: ut
    real(c_double), intent(out) :: square
    real(c_double) :: n, t, tangent, normal, side, cone_n, cone_t, disk_n, disk_t
    t = rt - rho*ut
    tangent = abs(t)
    n = rn - rho*un
    disk_n = max(0.0_c_double, n)
    disk_t = min(tangent, mu*disk_n)
    n = n - merge(rho*mu*abs(ut), 0.0_c_double, mu <= 1)
    cone_n = max(0.0_c_double, n + mu*tangent)/(1 + mu*mu)
    cone_t = mu*cone_n
    cone_n = merge(max(0.0_c_double, n), cone_n, tangent <= mu*n) ! mu may be 0
    cone_t = merge(tangent, cone_t, tangent <= mu*n)
    normal = merge(cone_n, disk_n, mu <= 1)
    side = sign(merge(cone_t, disk_t, mu <= 1), t)
    square = (rn - normal)**2 + (rt - side)**2
  end subroutine map_square_in_plane
end module problem_error
