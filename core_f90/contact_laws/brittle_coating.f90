!> Signorini-Coulomb beside a linear spring along the normal that pushes below its rest gap and pulls beyond it, up to a strength:
!> LMGC90's BRITTLE_COATING_CLB. The spring has the force of the end of the step; whether it acts is said by the gap at the begin,
!> so that it acts again where bodies come back.
!> Parameters: friction [-], k [N/m], strength [N], rest gap, reach [m].
module brittle_coating
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use block_cones, only: solve_blocks, status_of_blocks
  implicit none
  private
  public :: cairn_law_brittle_coating_prepare, law_solve, law_residual
  public :: cairn_law_brittle_coating_commit, cairn_law_brittle_coating_energy
  character(*), parameter :: row = "brittle_coating"
  integer, parameter :: own = 5 !< parameters
  integer, parameter :: states(2:3) = [2, 2] !< with so many components
contains

  include "own_solution_slots.inc"

  !> With a spring the contact is on gap/h, or the spring would not know the gap at the end.
  subroutine cairn_law_brittle_coating_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< not asked for [m/s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states(c)) !< 1 the spring acts; energy in it [J]
    real(c_double), intent(out)         :: bias(n, c)       !< [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< none [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    integer :: i
    bias = 0
    compliance = 0
    mu = params(:, 1)
    do i = 1, n
      state(i, 1) = merge(1, 0, acts(params(i, :), gap(i)))
      bias(i, 1) = max(0.0_c_double, gap(i))/context%h
      if (state(i, 1) > 0) bias(i, 1) = gap(i)/context%h
    end do
  end subroutine cairn_law_brittle_coating_prepare

  pure logical function acts(p, gap)
    real(c_double), intent(in) :: p(own) !< see above
    real(c_double), intent(in) :: gap    !< [m]
    acts = gap <= p(5) .and. p(2)*(gap - p(4)) < p(3)
  end function acts

  !> Impulse of one contact: h k (g0 - g) of the spring, taken into block and velocity (Sherman & Morrison 1950), and the cone's.
  pure subroutine one_contact(c, w, q, p, s, r, status)
    integer(c_int32_t), intent(in)  :: c          !< components
    real(c_double), intent(in)      :: w(c, c)    !< Delassus block [1/kg]
    real(c_double), intent(in)      :: q(c)       !< velocity with r = 0, bias included [m/s]
    real(c_double), intent(in)      :: p(own + 4) !< parameters, step, geometry
    real(c_double), intent(in)      :: s(states(c))  !< see prepare
    real(c_double), intent(out)     :: r(c)       !< [N s]
    integer(c_int32_t), intent(out) :: status     !< see cairn_contact_status
    real(c_double) :: mu(3), none(3), h, k, share(c), block(c, c), free(c)
    integer :: l
    none = 0
    mu = [p(1), 0.0_c_double, 0.0_c_double]
    h = p(own + 1)
    k = 0
    if (s(1) > 0) k = p(2)
    share = w(:, 1)*(h*h*k/(1 + h*h*k*w(1, 1)))
    free = q + w(:, 1)*(h*k*p(4))
    do l = 1, c
      block(:, l) = w(:, l) - share*w(1, l)
    end do
    free = free - share*free(1)
    call solve_blocks(c, .false., block, free, mu, none, r)
    status = status_of_blocks(c, .false., mu, none, r)
    r(1) = r(1) + h*k*(p(4) - h*(free(1) + dot_product(block(1, :), r)))
  end subroutine one_contact

  !> Energy of the spring while it acts.
  subroutine cairn_law_brittle_coating_commit(n, c, context, gap, u, r, params, state) bind(c)
    integer(c_int32_t), value           :: n                !< contacts
    integer(c_int32_t), value           :: c                !< components
    type(cairn_law_context), intent(in) :: context          !< step
    real(c_double), intent(in)          :: gap(n)           !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)          !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)          !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own)   !< see above
    real(c_double), intent(inout)       :: state(n, states(c)) !< see prepare
    real(c_double) :: g
    integer :: i
    do i = 1, n
      g = gap(i) + context%h*u(i, 1)
      state(i, 2) = 0
      if (acts(params(i, :), g)) state(i, 2) = params(i, 2)*(g - params(i, 4))**2/2
    end do
  end subroutine cairn_law_brittle_coating_commit

  !> Energy: a spring that begins to act brings its own, which counts as negative release.
  subroutine cairn_law_brittle_coating_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
    integer(c_int32_t), value           :: n              !< contacts
    integer(c_int32_t), value           :: c              !< components
    type(cairn_law_context), intent(in) :: context        !< step, geometry
    real(c_double), intent(in)          :: gap(n)         !< at detection [m]
    real(c_double), intent(in)          :: u(n, c)        !< relative velocity at the end of the step [m/s]
    real(c_double), intent(in)          :: r(n, c)        !< impulse [N s]
    real(c_double), intent(in)          :: params(n, own) !< see above
    real(c_double), intent(in)          :: state_begin(n, states(c)), state(n, states(c)) !< see prepare
    real(c_double), intent(out)         :: energy(n, 4)   !< see cairn/core.h [J]
    real(c_double) :: g
    integer :: i
    energy = 0
    do i = 1, n
      energy(i, 1) = state(i, 2)
      if (state(i, 1) > 0) then
        g = gap(i) + context%h*u(i, 1)
        energy(i, 2) = params(i, 2)*((g - params(i, 4))**2 - (gap(i) - params(i, 4))**2)/2
      end if
      energy(i, 4) = energy(i, 2) - (state(i, 2) - state_begin(i, 2))
    end do
  end subroutine cairn_law_brittle_coating_energy
end module brittle_coating
