!> Interface of plugged routines in Fortran: the context of a step, the descriptor by which a library declares its routines, and
!> their abstract interfaces. Compile it with the law; it is equivalent to cairn/plug.h.
module cairn_plug
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_funloc, c_funptr, c_int32_t, c_int64_t, c_null_char, c_ptr, &
                                         c_sizeof
  implicit none
  private
  public :: cairn_law_context, cairn_plug_descriptor, describe_law
  public :: law_prepare, law_solve, law_commit, law_residual, law_energy
  public :: describe_solver, describe_pair, describe_velocity, describe_force
  public :: contact_solver, pair_contact, free_velocity, body_force
  public :: cairn_body_calls, describe_body, open_body, body_forces, body_history, body_state_size, body_save, body_load
  public :: body_destroy
  integer(c_int32_t), parameter :: abi = 2, kind_law = 1, kind_solver = 2, kind_pair = 3, kind_velocity = 4, kind_force = 5, &
                                   kind_body = 6

  !> Data of a step for a law, besides its own contacts.
  type, bind(c) :: cairn_law_context
    real(c_double) :: h        !< step [s]
    real(c_double) :: theta    !< of the theta-method
    type(c_ptr)    :: geometry !< (n, 3) contact area [m2], in 2D of a metre across the plane, effective radius [m], effective
    !< mass [kg]; not for normal_bias
    type(c_ptr)    :: fields   !< (n, 4) temperatures and potentials, if the scene has them
  end type cairn_law_context

  type, bind(c) :: cairn_plug_descriptor
    integer(c_int32_t)     :: abi, size, context_size, kind
    integer(c_int32_t)     :: components2, components3
    integer(c_int32_t)     :: normal_bias, thread_unsafe
    character(kind=c_char) :: name(64), parameters(1024), state(1024)
    type(c_funptr)         :: prepare, solve, commit, force, complaint, residual, energy
    integer(c_int32_t)     :: keeps, unused
  end type cairn_plug_descriptor
  !> How Cairn calls a deformable body: see cairn/body_calls.h. Given to open_body with abi, size, dofs and entries.
  type, bind(c) :: cairn_body_calls
    integer(c_int32_t) :: abi, size
    integer(c_int32_t) :: gives_energy      !< 1: forces fills energy
    integer(c_int32_t) :: gives_dissipation !< 1: forces fills dissipated
    integer(c_int64_t) :: dofs, entries     !< of the mesh, and of the pattern of its tangent
    type(c_ptr)        :: context           !< handed to each call, c_loc of what the body keeps
    type(c_funptr)     :: forces            !< c_funloc of a body_forces
    type(c_funptr)     :: commit, rollback  !< of a body_history, c_null_funptr: nothing is kept
    type(c_funptr)     :: state_size, save, load !< for checkpoints, all or none
    type(c_funptr)     :: create            !< for programs in C: c_null_funptr
    type(c_funptr)     :: destroy           !< of a body_destroy
    type(c_funptr)     :: complaint
  end type cairn_body_calls
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
      real(c_double), intent(in)    :: params(n, *) !< behind those of the descriptor: step, area, effective radius, mass
      real(c_double), intent(in)    :: state(n, *)
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
    subroutine law_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
      import :: c_int32_t, c_double, cairn_law_context
      integer(c_int32_t), value           :: n, c
      type(cairn_law_context), intent(in) :: context
      real(c_double), intent(in)          :: rho(n)       !< 1/W_NN [kg]
      real(c_double), intent(in)          :: w(n, c, c)   !< Delassus blocks [1/kg]
      real(c_double), intent(in)          :: u(n, c)      !< relative velocity that r leaves, bias included [m/s]
      real(c_double), intent(in)          :: bias(n, c)   !< [m/s]
      real(c_double), intent(in)          :: r(n, c)      !< impulse [N s]
      real(c_double), intent(in)          :: params(n, *), state(n, *) !< as solve has them
      real(c_double), intent(out)         :: f(n, c)      !< 0 where the law is obeyed, else about the change of r to it [N s]
      real(c_double), intent(out)         :: weight(n, c) !< by which squares of f are energies [1/kg]
      integer(c_int32_t), intent(out)     :: status(n)    !< 0 open, 1 stick, 2 slip, 3 bonded
    end subroutine law_residual
    subroutine law_energy(n, c, context, gap, u, r, params, state_begin, state, energy) bind(c)
      import :: c_int32_t, c_double, cairn_law_context
      integer(c_int32_t), value           :: n, c
      type(cairn_law_context), intent(in) :: context
      real(c_double), intent(in)          :: gap(n)       !< at detection [m]
      real(c_double), intent(in)          :: u(n, c)      !< relative velocity at the end of the step [m/s]
      real(c_double), intent(in)          :: r(n, c)      !< impulse [N s]
      real(c_double), intent(in)          :: params(n, *)
      real(c_double), intent(in)          :: state_begin(n, *), state(n, *) !< before and after commit
      real(c_double), intent(out)         :: energy(n, 4) !< stored; taken from bodies along n, along t; released of it [J]
    end subroutine law_energy

    !> r of the frictional contact problem u = W r + q, N, T (, T) at each contact, from the r that is there.
    subroutine contact_solver(dim, contacts, row_start, column, block, q, mu, tolerance, max_iterations, params, r, iterations) &
      bind(c)
      import :: c_int32_t, c_int64_t, c_double
      integer(c_int32_t), value       :: dim
      integer(c_int64_t), value       :: contacts
      integer(c_int64_t), intent(in)  :: row_start(0:contacts) !< blocks row_start(a) .. row_start(a+1) - 1 are of row a
      integer(c_int32_t), intent(in)  :: column(0:*)           !< from 0, rising in a row
      real(c_double), intent(in)      :: block(dim, dim, 0:*)  !< [1/kg]
      real(c_double), intent(in)      :: q(dim, 0:contacts - 1) !< [m/s]
      real(c_double), intent(in)      :: mu(0:contacts - 1)
      real(c_double), value           :: tolerance
      integer(c_int32_t), value       :: max_iterations
      real(c_double), intent(in)      :: params(*)
      real(c_double), intent(inout)   :: r(dim, 0:contacts - 1) !< [N s]
      integer(c_int32_t), intent(out) :: iterations
    end subroutine contact_solver
    !> Contacts of n pairs of shapes; see cairn_pair_contact of cairn/core.h. The shape (n, 2) is of 2D, (n, 3) of 3D.
    subroutine pair_contact(n, between, radius_a, radius_b, direction_b, gap, normal, point, status) bind(c)
      import :: c_int32_t, c_double
      integer(c_int32_t), value       :: n
      real(c_double), intent(in)      :: between(n, *)      !< centre of A - centre of B [m]
      real(c_double), intent(in)      :: radius_a(n), radius_b(n) !< [m]
      real(c_double), intent(in)      :: direction_b(n, *)  !< unit vector and half length of B, if it has one
      real(c_double), intent(out)     :: gap(n)             !< [m]
      real(c_double), intent(out)     :: normal(n, *)       !< from B to A
      real(c_double), intent(out)     :: point(n, *)        !< middle of the gap - centre of A [m]
      integer(c_int32_t), intent(out) :: status(n)          !< 0 may touch, 1 never
    end subroutine pair_contact
    !> Velocities of all bodies at the end of the step without contacts; on entry they hold those of Cairn.
    subroutine free_velocity(dim, dofs, bodies, h, theta, time, params, id, mass, inertia, position, velocity, driven, &
                             velocity_free, inverse_mass) bind(c)
      import :: c_int32_t, c_int64_t, c_double, c_ptr
      integer(c_int32_t), value      :: dim, dofs
      integer(c_int64_t), value      :: bodies
      real(c_double), value          :: h, theta, time        !< [s, -, s]
      real(c_double), intent(in)     :: params(*)
      integer(c_int64_t), intent(in) :: id(bodies)
      real(c_double), intent(in)     :: mass(bodies), inertia(2*dim - 3, bodies), position(dim, bodies), velocity(dofs, bodies)
      type(c_ptr), value             :: driven                !< (bodies) int8, bit j: dof j is driven; null if none is
      real(c_double), intent(inout)  :: velocity_free(dofs, bodies) !< [m/s, rad/s]
      real(c_double), intent(inout)  :: inverse_mass(dofs, bodies)  !< diagonal of A^-1, 0 for dofs that do not move
    end subroutine free_velocity
    !> Forces and torques to be added, in space axes.
    subroutine body_force(dim, dofs, bodies, time, params, id, mass, position, velocity, force) bind(c)
      import :: c_int32_t, c_int64_t, c_double
      integer(c_int32_t), value      :: dim, dofs
      integer(c_int64_t), value      :: bodies
      real(c_double), value          :: time                  !< of the theta-method [s]
      real(c_double), intent(in)     :: params(*)
      integer(c_int64_t), intent(in) :: id(bodies)
      real(c_double), intent(in)     :: mass(bodies), position(dim, bodies), velocity(dofs, bodies)
      real(c_double), intent(inout)  :: force(dofs, bodies)   !< [N, N m]
    end subroutine body_force
    !> Opens a deformable body of nodes, once for each simulation: fills calls. Returns 0; another number: no such body.
    integer(c_int32_t) function open_body(dim, nodes, position, start, row, params, calls) bind(c)
      import :: c_int32_t, c_int64_t, c_double, cairn_body_calls
      integer(c_int32_t), value             :: dim
      integer(c_int64_t), value             :: nodes
      real(c_double), intent(in)            :: position(dim, nodes) !< at the start [m]
      integer(c_int64_t), intent(in)        :: start(dim*nodes + 1) !< of the columns of the tangent, from 0
      integer(c_int32_t), intent(in)        :: row(*)               !< from 0, rising in a column
      real(c_double), intent(in)            :: params(*)            !< in the order of the descriptor
      type(cairn_body_calls), intent(inout) :: calls
    end function open_body
    !> Internal forces, from the history of the last commit. 0, anything else: there are none, Cairn tries a smaller change.
    integer(c_int32_t) function body_forces(context, dofs, entries, time, step, rate, displacement, velocity, force, tangent, &
                                            energy, dissipated) bind(c)
      import :: c_int32_t, c_int64_t, c_double, c_ptr
      type(c_ptr), value                    :: context
      integer(c_int64_t), value             :: dofs, entries
      real(c_double), value                 :: time               !< there [s]
      real(c_double), value                 :: step               !< of the step at hand [s]
      real(c_double), value                 :: rate               !< derivative of velocities by displacements [1/s]
      real(c_double), intent(in)            :: displacement(dofs) !< [m]
      real(c_double), intent(in)            :: velocity(dofs)     !< there [m/s]
      real(c_double), intent(out)           :: force(dofs)        !< that the body opposes to its displacements [N]
      real(c_double), intent(out), optional :: tangent(entries)   !< not present: not asked for [N/m]
      real(c_double), intent(inout)         :: energy, dissipated !< stored there, in the step [J]; left alone if not known
    end function body_forces
    !> The step was accepted (commit), and ended where the forces were asked for last; or undone (rollback). 0: done.
    integer(c_int32_t) function body_history(context) bind(c)
      import :: c_int32_t, c_ptr
      type(c_ptr), value :: context
    end function body_history
    !> Numbers that save gives.
    integer(c_int64_t) function body_state_size(context) bind(c)
      import :: c_int64_t, c_ptr
      type(c_ptr), value :: context
    end function body_state_size
    !> Writes the history of the body for a checkpoint. 0: done.
    integer(c_int32_t) function body_save(context, size, state) bind(c)
      import :: c_int32_t, c_int64_t, c_double, c_ptr
      type(c_ptr), value          :: context
      integer(c_int64_t), value   :: size
      real(c_double), intent(out) :: state(size)
    end function body_save
    !> Goes on from it. 0: done.
    integer(c_int32_t) function body_load(context, size, state) bind(c)
      import :: c_int32_t, c_int64_t, c_double, c_ptr
      type(c_ptr), value         :: context
      integer(c_int64_t), value  :: size
      real(c_double), intent(in) :: state(size)
    end function body_load
    !> The simulation is gone.
    subroutine body_destroy(context) bind(c)
      import :: c_ptr
      type(c_ptr), value :: context
    end subroutine body_destroy
  end interface
contains

  !> Fills the descriptor of a contact solver.
  subroutine describe_solver(descriptor, name, routine, parameters)
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    character(*), intent(in)                   :: name
    procedure(contact_solver)                  :: routine
    character(*), intent(in), optional         :: parameters
    call describe_routine(descriptor, name, kind_solver, parameters)
    descriptor%prepare = c_funloc(routine)
  end subroutine describe_solver

  !> Fills the descriptor of the contact of a pair of shapes.
  subroutine describe_pair(descriptor, name, routine)
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    character(*), intent(in)                   :: name
    procedure(pair_contact)                    :: routine
    call describe_routine(descriptor, name, kind_pair)
    descriptor%prepare = c_funloc(routine)
  end subroutine describe_pair

  !> Fills the descriptor of a free velocity.
  subroutine describe_velocity(descriptor, name, routine, parameters)
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    character(*), intent(in)                   :: name
    procedure(free_velocity)                   :: routine
    character(*), intent(in), optional         :: parameters
    call describe_routine(descriptor, name, kind_velocity, parameters)
    descriptor%prepare = c_funloc(routine)
  end subroutine describe_velocity

  !> Fills the descriptor of a body force.
  subroutine describe_force(descriptor, name, routine, parameters)
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    character(*), intent(in)                   :: name
    procedure(body_force)                      :: routine
    character(*), intent(in), optional         :: parameters
    call describe_routine(descriptor, name, kind_force, parameters)
    descriptor%prepare = c_funloc(routine)
  end subroutine describe_force

  !> Fills the descriptor of a deformable body.
  subroutine describe_body(descriptor, name, routine, parameters)
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    character(*), intent(in)                   :: name
    procedure(open_body)                       :: routine
    character(*), intent(in), optional         :: parameters
    call describe_routine(descriptor, name, kind_body, parameters)
    descriptor%prepare = c_funloc(routine)
  end subroutine describe_body

  !> Not given the routine: gfortran 12 hands on a c_funloc as the place of a copy on the stack.
  subroutine describe_routine(descriptor, name, kind, parameters)
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    character(*), intent(in)                   :: name
    integer(c_int32_t), intent(in)             :: kind
    character(*), intent(in), optional         :: parameters
    descriptor%abi = abi
    descriptor%size = int(c_sizeof(descriptor), c_int32_t)
    descriptor%context_size = int(4*c_sizeof(0.0_c_double), c_int32_t)
    descriptor%kind = kind
    call put(descriptor%name, name)
    if (present(parameters)) call put(descriptor%parameters, parameters)
  end subroutine describe_routine

  !> Fills the descriptor of a contact law.
  subroutine describe_law(descriptor, name, prepare, parameters, state, components, solve, commit, normal_bias, thread_safe, &
                          residual, energy, keeps)
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
    procedure(law_residual), optional          :: residual    !< of a law with solve: how far its impulses are from it
    procedure(law_energy), optional            :: energy      !< energy stored and dissipated in an accepted step
    logical, intent(in), optional              :: keeps       !< pairs stay contacts while the first state variable is above 0
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
    if (present(residual)) descriptor%residual = c_funloc(residual)
    if (present(energy)) descriptor%energy = c_funloc(energy)
    if (present(keeps)) descriptor%keeps = merge(1, 0, keeps)
  end subroutine describe_law

  !> Copies a text with a terminating null for C; a text that is too long has no null, which Cairn refuses.
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
