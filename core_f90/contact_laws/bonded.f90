!> Bonds: a contact that touches when it is first seen is held fast for good, rotations included, at the gap it had;
!> any other is Signorini-Coulomb.
module bonded
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use coulomb_cone, only: cairn_cone_full2, cairn_cone_full3
  implicit none
  private
  public :: cairn_law_bonded_prepare, cairn_law_bonded_solve
  real(c_double), parameter :: touch = 2.0_c_double**(-30) !< gap / effective radius that positions in doubles cannot tell from 0
contains

  !> A fresh contact, whose state is no number, bonds or not; a bond has no drift: u_n = -(gap - bond gap)/h.
  subroutine cairn_law_bonded_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components: 3 in 2D, 6 in 3D
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, 1)     !< friction where there is no bond [-]
    real(c_double), intent(inout)       :: state(n)         !< gap at which it bonded [m]; huge if it did not; NaN if fresh
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    real(c_double), pointer, contiguous :: geometry(:, :)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    bias = 0
    do i = 1, n
      if (.not. abs(state(i)) <= huge(state)) then
        state(i) = huge(state)
        if (gap(i) <= touch*geometry(i, 2)) state(i) = gap(i)
      end if
      if (state(i) < huge(state)) then
        bias(i, 1) = (gap(i) - state(i))/context%h
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
    real(c_double), intent(in)    :: state(n)     !< gap at which it bonded [m]; huge if it did not
    real(c_double), intent(inout) :: r(n, c)      !< impulse [N s], then moment [N m s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    integer :: i
    if (c == 3) then
      call cairn_cone_full2(n, c, w, u_free, bias, params, state, r)
    else
      call cairn_cone_full3(n, c, w, u_free, bias, params, state, r)
    end if
    do i = 1, n
      if (state(i) < huge(state)) then
        call hold(c, w(i, :, :), u_free(i, :), r(i, :))
      else
        r(i, merge(3, 4, c == 3):c) = 0
      end if
    end do
    if (present(status)) status = merge(3, 0, state < huge(state))
  end subroutine cairn_law_bonded_solve

  !> r = -W^-1 u by elimination without roots or pivots: W is symmetric and at least semidefinite; a component that nothing
  !> moves (its pivot is rounding) carries nothing.
  pure subroutine hold(c, w, u, r)
    integer, value              :: c       !< components
    real(c_double), intent(in)  :: w(c, c) !< Delassus block
    real(c_double), intent(in)  :: u(c)    !< relative velocity with r = 0
    real(c_double), intent(out) :: r(c)    !< impulse
    real(c_double) :: a(c, c)
    integer :: k, l
    a = w
    r = -u
    do k = 1, c
      if (.not. a(k, k) > 16*epsilon(w)*w(k, k)) then
        a(k, :) = 0
        a(:, k) = 0
        r(k) = 0
        cycle
      end if
      do l = k + 1, c
        r(l) = r(l) - a(l, k)/a(k, k)*r(k)
        a(l, k + 1:) = a(l, k + 1:) - a(l, k)/a(k, k)*a(k, k + 1:)
      end do
    end do
    do k = c, 1, -1
      if (.not. a(k, k) > 0) cycle
      r(k) = (r(k) - dot_product(a(k, k + 1:), r(k + 1:)))/a(k, k)
    end do
  end subroutine hold
end module bonded
