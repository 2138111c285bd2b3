!> Simulations of Cairn for Fortran. Programs use the module cairn.
module cairn_simulations
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_signatures
  use cairn_scenes
  implicit none
  private
  public :: cairn_simulation, cairn_nscd, cairn_report
  public :: cairn_converged, cairn_iteration_limit, cairn_diverged, cairn_newton_limit
  public :: create_simulation, destroy_simulation, step_simulation, drive_simulation
  public :: set_option, set_number, option_text, option_number, before_parts
  public :: change_gravity, change_body_field, insert_bodies, insert_contactors, remove_bodies
  public :: insert_joint, remove_joint
  public :: node_count, node_field, change_node_field
  public :: body_count, contact_count, body_field, contact_field, contact_arrays, energy_term, report_number, report_text

  enum, bind(c)
    enumerator :: cairn_converged = 0, cairn_iteration_limit = 1, cairn_diverged = 2, cairn_newton_limit = 3
  end enum

  type :: cairn_simulation
    type(c_ptr) :: handle = c_null_ptr !< of the C API
    integer :: dim = 0
  end type

  !> Options of Non-Smooth Contact Dynamics; a variable of this type starts with the defaults.
  type, bind(c) :: cairn_nscd
    real(c_double) :: theta = 0.5_dp           !< 1/2 to 1
    real(c_double) :: tolerance = 1e-4_dp      !< on the error of the contact problem [-]
    integer(c_int32_t) :: min_iterations = 1
    integer(c_int32_t) :: max_iterations = 1000
    integer(c_int32_t) :: threads = 0          !< 0: as OpenMP decides
    integer(c_int32_t) :: warm_start = 1
    integer(c_int32_t) :: project_positions = 0
    real(c_double) :: margin = -1              !< [m]; negative: from sizes and speeds
  end type

  !> Report of the last step.
  type, bind(c) :: cairn_report
    integer(c_int64_t) :: step
    integer(c_int64_t) :: contacts             !< candidates that were solved
    integer(c_int32_t) :: status               !< cairn_converged, cairn_iteration_limit, cairn_diverged
    integer(c_int32_t) :: iterations
    real(c_double) :: time                     !< end of the step [s]
    real(c_double) :: error                    !< of the contact problem [-]
    real(c_double) :: worst_error              !< of one contact, on its own scale [-]
    real(c_double) :: penetration              !< deepest overlap / size of the smaller body
    real(c_double) :: kinetic                  !< energy [J]
    real(c_double) :: closure                  !< residual of the energy balance since the start [J]
    real(c_double) :: energy_in_play           !< the scale of closure [J]
  end type

  procedure(destroyer), bind(c, name="cairn_simulation_destroy") :: c_simulation_destroy
  procedure(gravity_setter), bind(c, name="cairn_simulation_set_gravity") :: c_simulation_set_gravity
  procedure(bodies_adder), bind(c, name="cairn_simulation_add_bodies") :: c_simulation_add_bodies
  procedure(joint_adder), bind(c, name="cairn_simulation_add_joint") :: c_simulation_add_joint
  procedure(driver), bind(c, name="cairn_simulation_drive") :: c_simulation_drive
  procedure(field_setter), bind(c, name="cairn_simulation_set_body_field") :: c_simulation_set_body_field
  procedure(field_setter), bind(c, name="cairn_simulation_set_node_field") :: c_simulation_set_node_field
  procedure(counter), bind(c, name="cairn_simulation_bodies") :: c_simulation_bodies
  procedure(counter), bind(c, name="cairn_simulation_nodes") :: c_simulation_nodes
  procedure(counter), bind(c, name="cairn_simulation_contacts") :: c_simulation_contacts
  procedure(field_reader), bind(c, name="cairn_simulation_body_field") :: c_body_field
  procedure(field_reader), bind(c, name="cairn_simulation_node_field") :: c_node_field
  procedure(field_reader), bind(c, name="cairn_simulation_contact_field") :: c_contact_field
  procedure(number_reader), bind(c, name="cairn_simulation_get_number") :: c_get_number
  procedure(number_reader), bind(c, name="cairn_simulation_energy") :: c_energy
  procedure(number_reader), bind(c, name="cairn_simulation_report") :: c_report
  procedure(text_reader), bind(c, name="cairn_simulation_get_option") :: c_get_option
  procedure(text_reader), bind(c, name="cairn_simulation_report_text") :: c_report_text

  interface
    integer(c_int32_t) function c_simulation_create(scene, options, simulation, error) bind(c, name="cairn_simulation_create")
      import
      type(c_ptr), value :: scene
      type(cairn_nscd), intent(in) :: options
      type(c_ptr), intent(out) :: simulation
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_simulation_step(simulation, h, report, error) bind(c, name="cairn_simulation_step")
      import
      type(c_ptr), value :: simulation
      real(c_double), value :: h
      type(cairn_report), intent(out) :: report
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_contact_arrays(simulation, bodies, gap, normal, point, impulse, error) &
        bind(c, name="cairn_simulation_contact_arrays")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), intent(inout) :: bodies(*)
      real(c_double), intent(inout) :: gap(*), normal(*), point(*), impulse(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_option(simulation, name, text, error) &
        bind(c, name="cairn_simulation_set_option")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: name(*), text(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_before_parts(simulation, function, context, error) &
        bind(c, name="cairn_simulation_before_parts")
      import
      type(c_ptr), value :: simulation
      type(c_funptr), value :: function
      type(c_ptr), value :: context
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_number(simulation, name, value, error) &
        bind(c, name="cairn_simulation_set_number")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: name(*)
      real(c_double), value :: value
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_simulation_add_contactors(simulation, shape, n, body, material, radius, offset, &
        direction, hull, first, error) bind(c, name="cairn_simulation_add_contactors")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: shape(*)
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: body(*)
      integer(c_int32_t), intent(in) :: material(*)
      real(c_double), intent(in), optional :: radius(*), offset(*), direction(*)
      integer(c_int32_t), intent(in), optional :: hull(*)
      integer(c_int64_t), intent(out) :: first
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_remove_joint(simulation, ends, error) bind(c, name="cairn_simulation_remove_joint")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), intent(in) :: ends(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_remove_bodies(simulation, n, bodies, error) &
        bind(c, name="cairn_simulation_remove_bodies")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(*)
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> The simulation takes a copy of the scene.
  subroutine create_simulation(simulation, scene, options, error)
    type(cairn_simulation), intent(out) :: simulation
    type(cairn_scene), intent(in) :: scene
    type(cairn_nscd), intent(in), optional :: options
    type(cairn_error), intent(out), optional :: error
    type(cairn_nscd) :: chosen
    type(c_error) :: what

    if (present(options)) chosen = options
    simulation%dim = scene%dim
    call report_back(c_simulation_create(scene%handle, chosen, simulation%handle, what), what, error)
  end subroutine create_simulation

  subroutine destroy_simulation(simulation)
    type(cairn_simulation), intent(inout) :: simulation

    call c_simulation_destroy(simulation%handle)
    simulation%handle = c_null_ptr
  end subroutine destroy_simulation

  subroutine step_simulation(simulation, h, report, error)
    type(cairn_simulation), intent(in) :: simulation
    real(dp), intent(in) :: h                                    !< [s]
    type(cairn_report), intent(out), optional :: report
    type(cairn_error), intent(out), optional :: error
    type(cairn_report) :: own
    type(c_error) :: what

    call report_back(c_simulation_step(simulation%handle, h, own, what), what, error)
    if (present(report)) report = own
  end subroutine step_simulation

  !> Drives bodies like drive_bodies, between steps.
  subroutine drive_simulation(simulation, body, driven, velocity, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in) :: body(:)
    logical, intent(in) :: driven(:)
    real(dp), intent(in), contiguous, optional :: velocity(:, :)
    type(cairn_error), intent(out), optional :: error

    call give_drive(c_simulation_drive, simulation%handle, simulation%dim, body, driven, velocity, error)
  end subroutine drive_simulation

  integer(c_int64_t) function body_count(simulation)
    type(cairn_simulation), intent(in) :: simulation

    body_count = c_simulation_bodies(simulation%handle)
  end function body_count

  !> Candidates of the last step.
  integer(c_int64_t) function contact_count(simulation)
    type(cairn_simulation), intent(in) :: simulation

    contact_count = c_simulation_contacts(simulation%handle)
  end function contact_count

  !> Number of nodes of all meshes.
  integer(c_int64_t) function node_count(simulation) result(n)
    type(cairn_simulation), intent(in) :: simulation

    n = c_simulation_nodes(simulation%handle)
  end function node_count

  !> A field of bodies by its name ("position", "velocity", "rotation", ...), in the order of insertion: (components, n). A field
  !> that nothing in the scene needs has no components.
  subroutine body_field(simulation, name, values, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:, :)
    type(cairn_error), intent(out), optional :: error

    call read_field(c_body_field, simulation%handle, name, body_count(simulation), values, error)
  end subroutine body_field

  !> Reads a field of the nodes of meshes ("id", "position", "velocity", "mass", ...).
  subroutine node_field(simulation, name, values, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:, :)
    type(cairn_error), intent(out), optional :: error

    call read_field(c_node_field, simulation%handle, name, node_count(simulation), values, error)
  end subroutine node_field

  !> "position" or "velocity" of nodes of meshes.
  subroutine change_node_field(simulation, name, values, node, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    real(dp), intent(in), contiguous :: values(:, :)             !< (dim, n)
    integer(c_int64_t), intent(in), contiguous, optional :: node(:) !< (n) numbers; all in the order of insertion without
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("values", size(values, 1), simulation%dim, error)) return
    if (present(node)) then
      if (.not. has_size("node", size(node), size(values, 2), error)) return
    end if
    call report_back(c_simulation_set_node_field(simulation%handle, c_text(name), size(values, 2, c_int64_t), node, values, &
                                                 what), what, error)
  end subroutine change_node_field

  !> Contacts of the last step: n candidates, the antagonist body second; impulses act on the candidate, in space axes.
  subroutine contact_arrays(simulation, bodies, gap, normal, point, impulse, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), allocatable, intent(out) :: bodies(:, :) !< (2, n) ids
    real(dp), allocatable, intent(out) :: gap(:)                 !< (n) [m]
    real(dp), allocatable, intent(out) :: normal(:, :)           !< (dim, n)
    real(dp), allocatable, intent(out) :: point(:, :)            !< (dim, n) [m]
    real(dp), allocatable, intent(out) :: impulse(:, :)          !< (dim, n) [N s]
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: n
    type(c_error) :: what

    n = contact_count(simulation)
    allocate (bodies(2, n), gap(n), normal(simulation%dim, n), point(simulation%dim, n), impulse(simulation%dim, n))
    call report_back(c_contact_arrays(simulation%handle, bodies, gap, normal, point, impulse, what), what, error)
  end subroutine contact_arrays

  !> An option that a number cannot say: "strategy" ("nscd", "carpenter", "granular_element", "smooth_dem", "event_driven"),
  !> "solver" ("auto", ...), "integrator" ("newmark", ...: its parameters are options from then on).
  subroutine set_option(simulation, name, text, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name, text
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_set_option(simulation%handle, c_text(name), c_text(text), what), what, error)
  end subroutine set_option

  !> An option of the strategy in use by its name in options.def: "tol", "max_iter", "skin", ...; flags are 0 or 1.
  subroutine set_number(simulation, name, value, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    real(dp), intent(in) :: value
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_set_number(simulation%handle, c_text(name), value, what), what, error)
  end subroutine set_number

  !> A bind(c) routine (simulation, time, h, context: c_ptr, double, double by value, c_ptr) that is called before each part of a
  !> step that the option "cut_back" makes in parts; c_null_funptr: loads of meshes go along a straight line over the step.
  subroutine before_parts(simulation, routine, context, error)
    type(cairn_simulation), intent(in) :: simulation
    type(c_funptr), intent(in) :: routine
    type(c_ptr), intent(in), optional :: context                 !< handed on to it
    type(cairn_error), intent(out), optional :: error
    type(c_ptr) :: kept
    type(c_error) :: what

    kept = c_null_ptr
    if (present(context)) kept = context
    call report_back(c_before_parts(simulation%handle, routine, kept, what), what, error)
  end subroutine before_parts

  function option_text(simulation, name, error) result(text)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    type(cairn_error), intent(out), optional :: error
    character(:), allocatable :: text

    text = text_of(c_get_option, simulation%handle, name, error)
  end function option_text

  real(dp) function option_number(simulation, name, error) result(value)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    type(cairn_error), intent(out), optional :: error

    value = number_of(c_get_number, simulation%handle, name, error)
  end function option_number

  subroutine change_gravity(simulation, gravity, error)
    type(cairn_simulation), intent(in) :: simulation
    real(dp), intent(in) :: gravity(:)                           !< (dim) [m/s2], from now on
    type(cairn_error), intent(out), optional :: error

    call give_gravity(c_simulation_set_gravity, simulation%handle, simulation%dim, gravity, error)
  end subroutine change_gravity

  !> Sets a field like set_body_field, between steps.
  subroutine change_body_field(simulation, name, values, body, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    real(dp), intent(in), contiguous :: values(:, :)             !< (components, n)
    integer(c_int64_t), intent(in), contiguous, optional :: body(:) !< (n) ids; all in the order of insertion without
    type(cairn_error), intent(out), optional :: error

    call give_field(c_simulation_set_body_field, simulation%handle, simulation%dim, name, values, body, error)
  end subroutine change_body_field

  !> Adds bodies like add_bodies, between steps.
  subroutine insert_bodies(simulation, position, mass, inertia, first, rotation, velocity, error)
    type(cairn_simulation), intent(in) :: simulation
    real(dp), intent(in), contiguous :: position(:, :), inertia(:, :)
    real(dp), intent(in) :: mass(:)
    integer(c_int64_t), intent(out) :: first
    real(dp), intent(in), contiguous, optional :: rotation(:, :), velocity(:, :)
    type(cairn_error), intent(out), optional :: error

    call give_bodies(c_simulation_add_bodies, simulation%handle, simulation%dim, position, mass, inertia, first, rotation, &
                     velocity, error)
  end subroutine insert_bodies

  !> Adds contactors like add_contactors, or with `hull` like add_hull_contactors, between steps; materials and hulls of the
  !> scene.
  subroutine insert_contactors(simulation, shape, body, material, radius, offset, direction, hull, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: shape
    integer(c_int64_t), intent(in) :: body(:)
    integer, intent(in) :: material(:)
    real(dp), intent(in), contiguous, optional :: radius(:), offset(:, :), direction(:, :)
    integer(c_int32_t), intent(in), contiguous, optional :: hull(:)
    type(cairn_error), intent(out), optional :: error
    integer :: n
    integer(c_int64_t) :: first
    type(c_error) :: what

    n = size(body)
    if (.not. contactor_sizes(simulation%dim, n, material, radius, offset, direction, error)) return
    if (present(hull)) then
      if (.not. has_size("hull", size(hull), n, error)) return
    end if
    call report_back(c_simulation_add_contactors(simulation%handle, c_text(shape), int(n, c_int64_t), body, &
                                                 int(material, c_int32_t), radius, offset, direction, hull, first, what), &
                     what, error)
  end subroutine insert_contactors

  !> Adds a joint like add_joint, between steps: of rigid bodies in their present position.
  subroutine insert_joint(simulation, kind, a, point, b, axis, names, values, ends, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: kind
    integer(c_int64_t), intent(in) :: a
    real(dp), intent(in), contiguous :: point(:, :)
    integer(c_int64_t), intent(in), optional :: b
    real(dp), intent(in), contiguous, optional :: axis(:), values(:)
    character(*), intent(in), optional :: names(:)
    integer(c_int64_t), intent(out), optional :: ends(2)
    type(cairn_error), intent(out), optional :: error

    call give_joint(c_simulation_add_joint, simulation%handle, simulation%dim, kind, a, point, b, axis, names, values, ends, &
                    error)
  end subroutine insert_joint

  !> Lets go a joint, of the scene or of the run.
  subroutine remove_joint(simulation, ends, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in) :: ends(2)                    !< numbers returned by add_joint or insert_joint
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_remove_joint(simulation%handle, ends, what), what, error)
  end subroutine remove_joint

  !> Bodies go, with their contactors; ids of the others stay.
  subroutine remove_bodies(simulation, body, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in) :: body(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_remove_bodies(simulation%handle, size(body, kind=c_int64_t), body, what), what, error)
  end subroutine remove_bodies

  !> A field of the contacts of the last step by its name in contact_fields.def: (components, n).
  subroutine contact_field(simulation, name, values, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:, :)
    type(cairn_error), intent(out), optional :: error

    call read_field(c_contact_field, simulation%handle, name, contact_count(simulation), values, error)
  end subroutine contact_field

  !> A term of the energy since the start by its name in report.def [J]: "kinetic", "stored", "closure", ...
  real(dp) function energy_term(simulation, name, error) result(value)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    type(cairn_error), intent(out), optional :: error

    value = number_of(c_energy, simulation%handle, name, error)
  end function energy_term

  !> A number of the last step by its name in report.def: "worst_contact", "penetration", ...
  real(dp) function report_number(simulation, name, error) result(value)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    type(cairn_error), intent(out), optional :: error

    value = number_of(c_report, simulation%handle, name, error)
  end function report_number

  !> "status", "solver", "hint" or "warning" of the last step.
  function report_text(simulation, name, error) result(text)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    type(cairn_error), intent(out), optional :: error
    character(:), allocatable :: text

    text = text_of(c_report_text, simulation%handle, name, error)
  end function report_text
end module cairn_simulations
