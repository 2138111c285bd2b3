!> Bonds: a contact of bodies that came in together and touched is held fast for good, rotations included, at the gap it had;
!> any other is Signorini-Coulomb.
module bonded
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use coulomb_cone, only: cairn_cone_full2, cairn_cone_full3
  use cone_residual, only: cone_map, cone_status
  use lane_blocks, only: held_impulses
  implicit none
  private
  public :: cairn_law_bonded_prepare, cairn_law_bonded_solve, cairn_law_bonded_residual
contains

  !> A bond has no drift: u_n = -(gap - bond gap)/h.
  subroutine cairn_law_bonded_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components: 3 in 2D, 6 in 3D
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, 1)     !< friction where there is no bond [-]
    real(c_double), intent(inout)       :: state(n, 2)      !< 0 no bond, 1 new bond, 2 bond, 3 bond behind a step
    !< that did not converge; gap at which it bonded [m]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    do i = 1, n
      if (state(i, 1) > 0 .and. state(i, 1) < 2) then
        state(i, 1) = 2
        state(i, 2) = gap(i)
      end if
      if (state(i, 1) > 0) then
        bias(i, 1) = (gap(i) - state(i, 2))/context%h
      else
        bias(i, 1) = max(gap(i), 0.0_c_double)/context%h
      end if
    end do
    compliance = 0
    mu = params(:, 1)
  end subroutine cairn_law_bonded_prepare

  !> Impulses that hold bonds fast, Coulomb's elsewhere, each contact by itself.
  subroutine cairn_law_bonded_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n            !< contacts
    integer(c_int32_t), value     :: c            !< components: 3 in 2D, 6 in 3D
    real(c_double), intent(in)    :: w(n, c, c)   !< Delassus blocks [1/kg], with rotations [1/(kg m), 1/(kg m2)]
    real(c_double), intent(in)    :: u_free(n, c) !< relative velocity with r = 0 here, bias included [m/s, rad/s]
    real(c_double), intent(in)    :: bias(n, c)   !< of the law, already in u_free [m/s]
    real(c_double), intent(in)    :: params(n, 1) !< friction where there is no bond [-]
    real(c_double), intent(in)    :: state(n, 2)  !< above 0: a bond; gap at which it bonded [m]
    real(c_double), intent(inout) :: r(n, c)      !< impulse [N s], then moment [N m s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: held(n, c)
    integer :: k
    if (all(state(:, 1) > 0)) then
      call held_impulses(n, c, w, u_free, r)
    else
      if (c == 3) then
        call cairn_cone_full2(n, c, w, u_free, bias, params, state, r)
      else
        call cairn_cone_full3(n, c, w, u_free, bias, params, state, r)
      end if
      r(:, merge(3, 4, c == 3):) = 0
      if (any(state(:, 1) > 0)) then
        call held_impulses(n, c, w, u_free, held)
        do k = 1, c
          where (state(:, 1) > 0) r(:, k) = held(:, k)
        end do
      end if
    end if
    if (present(status)) status = merge(3, 0, state(:, 1) > 0)
  end subroutine cairn_law_bonded_solve

  !> F of a bond: all components of u + b vanish, each by its own part of W. F of the cone where there is none.
  subroutine cairn_law_bonded_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n            !< contacts
    integer(c_int32_t), value           :: c            !< components: 3 in 2D, 6 in 3D
    type(cairn_law_context), intent(in) :: context      !< step
    real(c_double), intent(in)          :: rho(n)       !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)      !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)   !< of the law, in u [m/s]
    real(c_double), intent(in)          :: r(n, c)      !< impulse [N s], then moment [N m s]
    real(c_double), intent(in)          :: params(n, 1) !< friction where there is no bond [-]
    real(c_double), intent(in)          :: state(n, 2)  !< above 0: a bond
    real(c_double), intent(out)         :: f(n, c)      !< residual [N s]
    real(c_double), intent(out)         :: weight(n, c) !< by which squares of f are energies [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)    !< see cairn_contact_status
    integer :: axes, i, k
    axes = merge(2, 3, c == 3)
    call cone_map(n, axes, .false., params(:, 1), rho, r, u, f)
    do k = 1, c
      do i = 1, n
        if (state(i, 1) > 0) then
          weight(i, k) = w(i, k, k)
          f(i, k) = 0
          if (w(i, k, k) > 0) f(i, k) = u(i, k)/w(i, k, k)
        else
          weight(i, k) = merge(1/rho(i), 0.0_c_double, k <= axes)
          if (k > axes) f(i, k) = 0
        end if
      end do
    end do
    call cone_status(n, axes, params(:, 1), r, status)
    where (state(:, 1) > 0) status = 3
  end subroutine cairn_law_bonded_residual
end module bonded
