!> Contacts that sinter or weld: bodies that touch are under Coulomb's cone until the pressure between them has made a bond,
!> when the integral of its part beyond a threshold over time reaches a dose; from the next step on it is one of mohr_coulomb, until
!> it breaks, and can be made anew. Making it takes no energy and stores none, nor does its breaking.
module sintering
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use law_context, only: cairn_law_context
  use mohr_coulomb, only: cairn_law_mohr_coulomb_prepare, bond_solve => law_solve, bond_residual => law_residual, &
                          cairn_law_mohr_coulomb_commit
  implicit none
  private
  public :: cairn_law_sintering_prepare, cairn_law_sintering_solve, cairn_law_sintering_residual, cairn_law_sintering_commit
  integer, parameter :: own = 7, of_bond = 7 !< parameters: five of a bond, then threshold [Pa] and dose [Pa s]
  integer, parameter :: s_sound = 1, s_area = 2, s_gap = 3, s_dose = 4, s_seen = 5, states = 5
contains

  !> Parameters for mohr_coulomb, which reads a second friction if a state asks for it; that state has another meaning here.
  pure subroutine bond_of(n, params, bond)
    integer(c_int32_t), intent(in) :: n                  !< contacts
    real(c_double), intent(in)     :: params(n, own)     !< see laws.def
    real(c_double), intent(inout)  :: bond(n, of_bond)   !< see mohr_coulomb
    bond(:, :of_bond - 1) = params(:, :of_bond - 1)
    bond(:, of_bond) = huge(bond)
  end subroutine bond_of

  !> Bodies that come in touching are not joined.
  subroutine cairn_law_sintering_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states) !< 1 sound; area [m2], gap [m] of the bond; dose [Pa s]; 1: seen
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    real(c_double) :: bond(n, of_bond)
    where (.not. state(:, s_seen) > 0) state(:, s_sound) = 0
    state(:, s_seen) = 1
    call bond_of(n, params, bond)
    call cairn_law_mohr_coulomb_prepare(n, c, context, gap, u_begin, bond, state, bias, compliance, mu)
  end subroutine cairn_law_sintering_prepare

  subroutine cairn_law_sintering_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
    integer(c_int32_t), value     :: n                  !< contacts
    integer(c_int32_t), value     :: c                  !< components
    real(c_double), intent(in)    :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)    :: u_free(n, c)       !< relative velocity with r = 0 here, bias included [m/s]
    real(c_double), intent(in)    :: bias(n, c)         !< in u_free [m/s]
    real(c_double), intent(in)    :: params(n, own + 4) !< see laws.def; step, geometry
    real(c_double), intent(in)    :: state(n, states)   !< see prepare
    real(c_double), intent(inout) :: r(n, c)            !< impulse [N s]
    integer(c_int32_t), intent(out), optional :: status(n) !< see cairn_contact_status
    real(c_double) :: bond(n, of_bond + 4)
    call bond_of(n, params, bond)
    bond(:, of_bond + 1:) = params(:, own + 1:)
    call bond_solve(n, c, w, u_free, bias, bond, state, r, status)
  end subroutine cairn_law_sintering_solve

  subroutine cairn_law_sintering_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
    integer(c_int32_t), value           :: n                  !< contacts
    integer(c_int32_t), value           :: c                  !< components
    type(cairn_law_context), intent(in) :: context            !< step
    real(c_double), intent(in)          :: rho(n)             !< 1/W_NN [kg]
    real(c_double), intent(in)          :: w(n, c, c)         !< Delassus blocks [1/kg]
    real(c_double), intent(in)          :: u(n, c)            !< relative velocity, bias included [m/s]
    real(c_double), intent(in)          :: bias(n, c)         !< in u [m/s]
    real(c_double), intent(in)          :: r(n, c)            !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own + 4) !< see laws.def; step, geometry
    real(c_double), intent(in)          :: state(n, states)   !< see prepare
    real(c_double), intent(out)         :: f(n, c)            !< [N s]
    real(c_double), intent(out)         :: weight(n, c)       !< [1/kg]
    integer(c_int32_t), intent(out)     :: status(n)          !< see cairn_contact_status
    real(c_double) :: bond(n, of_bond + 4)
    call bond_of(n, params, bond)
    bond(:, of_bond + 1:) = params(:, own + 1:)
    call bond_residual(n, c, context, rho, w, u, bias, r, bond, state, f, weight, status)
  end subroutine cairn_law_sintering_residual

  !> A bond that breaks begins its dose anew.
  subroutine cairn_law_sintering_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step, geometry
    real(c_double), intent(in)          :: gap(n)           !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)          !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)          !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own)   !< see laws.def
    real(c_double), intent(inout)       :: state(n, states) !< see prepare
    real(c_double), pointer, contiguous :: geometry(:, :)
    real(c_double) :: bond(n, of_bond), beyond
    logical :: was(n)
    integer :: i
    call c_f_pointer(context%geometry, geometry, [n, 3])
    call bond_of(n, params, bond)
    was = state(:, s_sound) > 0
    call cairn_law_mohr_coulomb_commit(n, c, context, gap, u, r, bond, state)
    do i = 1, n
      if (was(i)) then
        if (.not. state(i, s_sound) > 0) state(i, s_dose) = 0
        cycle
      end if
      if (.not. geometry(i, 1) > 0) cycle ! a corner has no area
      beyond = r(i, 1)/(context%h*geometry(i, 1)) - params(i, 6)
      if (.not. beyond > 0) cycle
      state(i, s_dose) = state(i, s_dose) + context%h*beyond
      if (state(i, s_dose) < params(i, 7)) cycle
      state(i, s_sound) = 1
      state(i, s_area) = geometry(i, 1)
      state(i, s_gap) = max(gap(i) + context%h*u(i, 1), 0.0_c_double)
    end do
  end subroutine cairn_law_sintering_commit
end module sintering
