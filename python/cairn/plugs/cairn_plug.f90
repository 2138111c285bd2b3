!> What a contact law of one's own needs to be plugged into Cairn: the context of a step, and the descriptor by which the library
!> says what it offers. Compile it with the law; it says the same as cairn/plug.h.
module cairn_plug
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_funloc, c_funptr, c_int32_t, c_null_char, c_ptr, c_sizeof
  implicit none
  private
  public :: cairn_law_context, cairn_plug_descriptor, describe_law
  public :: law_prepare, law_solve, law_commit
  integer(c_int32_t), parameter :: abi = 1, kind_law = 1

  !> What a law may ask about the step beside its own contacts.
  type, bind(c) :: cairn_law_context
    real(c_double) :: h        !< step [s]
    real(c_double) :: theta    !< of the theta-method
    type(c_ptr)    :: geometry !< (n, 3) contact area [m2], effective radius [m], effective mass [kg]; not for normal_bias
    type(c_ptr)    :: fields   !< (n, 4) temperatures and potentials, if the scene has them
  end type cairn_law_context

  type, bind(c) :: cairn_plug_descriptor
    integer(c_int32_t)     :: abi, size, context_size, kind
    integer(c_int32_t)     :: components2, components3
    integer(c_int32_t)     :: normal_bias, thread_unsafe
    character(kind=c_char) :: name(64), parameters(1024), state(1024)
    type(c_funptr)         :: prepare, solve, commit, force, complaint
  end type cairn_plug_descriptor
  !> The slots of a law: n contacts of c components, each component contiguous over the contacts; see cairn/core.h.
  abstract interface
    subroutine law_prepare(n, c, context, gap, u_begin, params, state, bias, compliance, mu) bind(c)
      import :: c_int32_t, c_double, cairn_law_context
      integer(c_int32_t), value           :: n, c
      type(cairn_law_context), intent(in) :: context
      real(c_double), intent(in)          :: gap(n)           !< [m]
      real(c_double), intent(in)          :: u_begin(n, c)    !< relative velocity at the start of the step [m/s]
      real(c_double), intent(in)          :: params(n, *)     !< in the order of the descriptor
      real(c_double), intent(inout)       :: state(n, *)      !< in the order of the descriptor
      real(c_double), intent(out)         :: bias(n, c)       !< added to the relative velocity [m/s]
      real(c_double), intent(out)         :: compliance(n, c) !< added to the diagonal of the Delassus block [1/kg]
      real(c_double), intent(out)         :: mu(n)            !< friction of the cone [-]
    end subroutine law_prepare
    subroutine law_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
      import :: c_int32_t, c_double
      integer(c_int32_t), value     :: n, c
      real(c_double), intent(in)    :: w(n, c, c)   !< Delassus blocks, compliance included [1/kg]
      real(c_double), intent(in)    :: u_free(n, c) !< relative velocity with r = 0 here, bias included [m/s]
      real(c_double), intent(in)    :: bias(n, c)   !< [m/s]
      real(c_double), intent(in)    :: params(n, *), state(n, *)
      real(c_double), intent(inout) :: r(n, c)      !< impulse [N s]
      integer(c_int32_t), intent(out), optional :: status(n) !< 0 open, 1 stick, 2 slip, 3 bonded
    end subroutine law_solve
    subroutine law_commit(n, c, context, gap, u, r, params, state) bind(c)
      import :: c_int32_t, c_double, cairn_law_context
      integer(c_int32_t), value           :: n, c
      type(cairn_law_context), intent(in) :: context
      real(c_double), intent(in)          :: gap(n)   !< at detection [m]
      real(c_double), intent(in)          :: u(n, c)  !< relative velocity at the end of the step [m/s]
      real(c_double), intent(in)          :: r(n, c)  !< impulse [N s]
      real(c_double), intent(in)          :: params(n, *)
      real(c_double), intent(inout)       :: state(n, *)
    end subroutine law_commit
  end interface
contains

  !> Fills the descriptor of a contact law.
  subroutine describe_law(descriptor, name, prepare, parameters, state, components, solve, commit, normal_bias, thread_safe)
    type(cairn_plug_descriptor), intent(inout) :: descriptor  !< as Cairn gave it
    character(*), intent(in)                   :: name        !< as in cairn_describe_NAME
    procedure(law_prepare)                     :: prepare     !< bias, compliance, friction of the cone
    character(*), intent(in), optional         :: parameters  !< "name:default:smallest:largest ...", no default: required
    character(*), intent(in), optional         :: state       !< "name:value of a new contact ..."
    integer, intent(in), optional              :: components(2) !< unknowns of a contact in 2D and 3D: (2, 3), 0 for none
    procedure(law_solve), optional             :: solve       !< its own local solution; without it the law is a cone
    procedure(law_commit), optional            :: commit      !< once a step is accepted: the state
    logical, intent(in), optional              :: normal_bias !< a cone whose bias is along the normal, of gap and parameters alone
    logical, intent(in), optional              :: thread_safe !< false: never two calls at a time
    descriptor%abi = abi
    descriptor%size = int(c_sizeof(descriptor), c_int32_t)
    descriptor%context_size = int(4*c_sizeof(0.0_c_double), c_int32_t)
    descriptor%kind = kind_law
    descriptor%components2 = 2
    descriptor%components3 = 3
    if (present(components)) then
      descriptor%components2 = int(components(1), c_int32_t)
      descriptor%components3 = int(components(2), c_int32_t)
    end if
    if (present(normal_bias)) descriptor%normal_bias = merge(1, 0, normal_bias)
    if (present(thread_safe)) descriptor%thread_unsafe = merge(0, 1, thread_safe)
    call put(descriptor%name, name)
    if (present(parameters)) call put(descriptor%parameters, parameters)
    if (present(state)) call put(descriptor%state, state)
    descriptor%prepare = c_funloc(prepare)
    if (present(solve)) descriptor%solve = c_funloc(solve)
    if (present(commit)) descriptor%commit = c_funloc(commit)
  end subroutine describe_law

  !> Text as C reads it; what does not fit is left without an end, which Cairn refuses.
  subroutine put(target, text)
    character(kind=c_char), intent(out) :: target(:)
    character(*), intent(in)            :: text
    integer :: i
    do i = 1, size(target)
      target(i) = c_null_char
      if (i <= len(text)) target(i) = text(i:i)
    end do
  end subroutine put
end module cairn_plug
