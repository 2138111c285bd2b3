! Contact law @NAME@: Signorini-Coulomb, and a share of the overlap is pushed back in each step.
! Build:  gfortran -O3 -march=native -shared -fPIC cairn_plug.f90 @NAME@.f90 -o lib@NAME@.so
module @NAME@
  use, intrinsic :: iso_c_binding
  use cairn_plug, only: cairn_law_context, cairn_plug_descriptor, describe_law
  implicit none
  private
contains

  !> n contacts at once: u + bias must obey Coulomb's cone of friction mu.
  subroutine prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c, name="")
    integer(c_int32_t), value           :: n, c             !< contacts; components: 2 in 2D, 3 in 3D
    type(cairn_law_context), intent(in) :: context          !< step h [s]
    real(c_double), intent(in)          :: gap(n)           !< negative when overlapping [m]
    real(c_double), intent(in)          :: u_begin(n, c)    !< absent when the descriptor says normal_bias [m/s]
    real(c_double), intent(in)          :: params(n, *)     !< in the order of the descriptor: mu, share
    real(c_double), intent(inout)       :: state(n, *)      !< none here
    real(c_double), intent(out)         :: bias(n, c)       !< normal first [m/s]
    real(c_double), intent(out)         :: compliance(n, c) !< softness, added to the inverse mass [1/kg]
    real(c_double), intent(out)         :: mu(n)            !< friction [-]
    bias = 0
    bias(:, 1) = (max(gap, 0.0_c_double) + params(:, 2)*min(gap, 0.0_c_double))/context%h
    compliance = 0
    mu = params(:, 1)
  end subroutine prepare

  subroutine describe(descriptor) bind(c, name="cairn_describe_@NAME@")
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    call describe_law(descriptor, "@NAME@", prepare, parameters="mu::0:inf share:0.2:0:1", normal_bias=.true.)
  end subroutine describe
end module @NAME@
