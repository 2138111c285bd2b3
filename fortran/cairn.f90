!> Cairn for Fortran programs: a scene, a simulation, arrays in and out. The same calls as cairn/cairn.h, with sizes taken from
!> the arrays and texts as they are. Every call has a last optional argument, error; without it a wrong call stops the program
!> with its message.
module cairn
  use, intrinsic :: iso_c_binding
  implicit none
  private
  public :: cairn_scene, cairn_simulation, cairn_nscd, cairn_report, cairn_error
  public :: cairn_converged, cairn_iteration_limit, cairn_diverged
  public :: create_scene, destroy_scene, set_gravity, add_material, set_law, set_default_law, add_bodies, add_contactors
  public :: drive_bodies, plug_contact_law
  public :: create_simulation, destroy_simulation, step_simulation, drive_simulation
  public :: body_count, contact_count, body_field, contact_arrays

  integer, parameter :: dp = c_double
  enum, bind(c)
    enumerator :: cairn_converged = 0, cairn_iteration_limit = 1, cairn_diverged = 2
  end enum

  type :: cairn_scene
    private
    type(c_ptr) :: handle = c_null_ptr
    integer :: dim = 0
  end type
  type :: cairn_simulation
    private
    type(c_ptr) :: handle = c_null_ptr
    integer :: dim = 0
  end type

  !> What was wrong: code 0 is success, item the one that was wrong (-1: none in particular).
  type :: cairn_error
    integer :: code = 0
    integer(c_int64_t) :: item = -1
    character(:), allocatable :: message
  end type
  type, bind(c) :: c_error
    integer(c_int32_t) :: code = 0
    integer(c_int64_t) :: item = -1
    character(c_char) :: message(256) = c_null_char
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

  !> What the last step did.
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
    real(c_double) :: closure                  !< what is left of the energy balance since the start [J]
    real(c_double) :: energy_in_play           !< the scale of closure [J]
  end type

  interface
    integer(c_int32_t) function c_scene_create(dim, scene, error) bind(c, name="cairn_scene_create")
      import
      integer(c_int32_t), value :: dim
      type(c_ptr), intent(out) :: scene
      type(c_error), intent(inout) :: error
    end function
    subroutine c_scene_destroy(scene) bind(c, name="cairn_scene_destroy")
      import
      type(c_ptr), value :: scene
    end subroutine
    integer(c_int32_t) function c_scene_set_gravity(scene, gravity, error) bind(c, name="cairn_scene_set_gravity")
      import
      type(c_ptr), value :: scene
      real(c_double), intent(in) :: gravity(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_material(scene, name, material, error) bind(c, name="cairn_scene_add_material")
      import
      type(c_ptr), value :: scene
      character(c_char), intent(in) :: name(*)
      integer(c_int32_t), intent(out) :: material
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_set_law(scene, a, b, law, n, parameter, error) bind(c, name="cairn_scene_set_law")
      import
      type(c_ptr), value :: scene
      integer(c_int32_t), value :: a, b, n
      character(c_char), intent(in) :: law(*)
      real(c_double), intent(in) :: parameter(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_plug_contact_law(library, law, replace, error) bind(c, name="cairn_plug_contact_law")
      import
      character(c_char), intent(in) :: library(*), law(*)
      integer(c_int32_t), value :: replace
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_bodies(scene, n, position, rotation, velocity, mass, inertia, first, error) &
        bind(c, name="cairn_scene_add_bodies")
      import
      type(c_ptr), value :: scene
      integer(c_int64_t), value :: n
      real(c_double), intent(in) :: position(*), mass(*), inertia(*)
      real(c_double), intent(in), optional :: rotation(*), velocity(*)
      integer(c_int64_t), intent(out) :: first
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_contactors(scene, shape, n, body, material, radius, offset, direction, first, &
        error) bind(c, name="cairn_scene_add_contactors")
      import
      type(c_ptr), value :: scene
      character(c_char), intent(in) :: shape(*)
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: body(*)
      integer(c_int32_t), intent(in) :: material(*)
      real(c_double), intent(in), optional :: radius(*), offset(*), direction(*)
      integer(c_int64_t), intent(out) :: first
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_drive(scene, n, bodies, mask, velocity, error) bind(c, name="cairn_scene_drive")
      import
      type(c_ptr), value :: scene
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(*)
      integer(c_int8_t), value :: mask
      real(c_double), intent(in), optional :: velocity(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_simulation_create(scene, options, simulation, error) bind(c, name="cairn_simulation_create")
      import
      type(c_ptr), value :: scene
      type(cairn_nscd), intent(in) :: options
      type(c_ptr), intent(out) :: simulation
      type(c_error), intent(inout) :: error
    end function
    subroutine c_simulation_destroy(simulation) bind(c, name="cairn_simulation_destroy")
      import
      type(c_ptr), value :: simulation
    end subroutine
    integer(c_int32_t) function c_simulation_step(simulation, h, report, error) bind(c, name="cairn_simulation_step")
      import
      type(c_ptr), value :: simulation
      real(c_double), value :: h
      type(cairn_report), intent(out) :: report
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_simulation_drive(simulation, n, bodies, mask, velocity, error) &
        bind(c, name="cairn_simulation_drive")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(*)
      integer(c_int8_t), value :: mask
      real(c_double), intent(in), optional :: velocity(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int64_t) function c_simulation_bodies(simulation) bind(c, name="cairn_simulation_bodies")
      import
      type(c_ptr), value :: simulation
    end function
    integer(c_int64_t) function c_simulation_contacts(simulation) bind(c, name="cairn_simulation_contacts")
      import
      type(c_ptr), value :: simulation
    end function
    integer(c_int32_t) function c_body_field(simulation, name, capacity, values, count, error) &
        bind(c, name="cairn_simulation_body_field")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: name(*)
      integer(c_int64_t), value :: capacity
      real(c_double), intent(inout) :: values(*)
      integer(c_int64_t), intent(out) :: count
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
  end interface

contains

  subroutine create_scene(scene, dim, error)
    type(cairn_scene), intent(out) :: scene
    integer, intent(in) :: dim                                   !< 2 or 3
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    scene%dim = dim
    call report_back(c_scene_create(int(dim, c_int32_t), scene%handle, what), what, error)
  end subroutine create_scene

  subroutine destroy_scene(scene)
    type(cairn_scene), intent(inout) :: scene

    call c_scene_destroy(scene%handle)
    scene%handle = c_null_ptr
  end subroutine destroy_scene

  subroutine set_gravity(scene, gravity, error)
    type(cairn_scene), intent(in) :: scene
    real(dp), intent(in) :: gravity(:)                           !< (dim) [m/s2]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("gravity", size(gravity), scene%dim, error)) return
    call report_back(c_scene_set_gravity(scene%handle, gravity, what), what, error)
  end subroutine set_gravity

  subroutine add_material(scene, name, material, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: name
    integer, intent(out) :: material                             !< its number, for contactors and laws
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: number
    type(c_error) :: what

    number = -1
    call report_back(c_scene_add_material(scene%handle, c_text(name), number, what), what, error)
    material = number
  end subroutine add_material

  !> Law of the contacts between two materials, for example "Coulomb" with [mu].
  subroutine set_law(scene, material_a, material_b, law, parameters, error)
    type(cairn_scene), intent(in) :: scene
    integer, intent(in) :: material_a, material_b
    character(*), intent(in) :: law                              !< a name of laws.def
    real(dp), intent(in) :: parameters(:)                        !< in the order of laws.def
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_scene_set_law(scene%handle, int(material_a, c_int32_t), int(material_b, c_int32_t), c_text(law), &
                                     size(parameters, kind=c_int32_t), parameters, what), what, error)
  end subroutine set_law

  !> A contact law from a shared library that describes it (module cairn_plug); set_law knows it by its name from now on.
  subroutine plug_contact_law(library, law, replace, error)
    character(*), intent(in) :: library                          !< path
    character(*), intent(in) :: law                              !< as in cairn_describe_NAME
    logical, intent(in), optional :: replace                     !< in the place of the law of that name
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what
    integer(c_int32_t) :: instead

    instead = 0
    if (present(replace)) instead = merge(1_c_int32_t, 0_c_int32_t, replace)
    call report_back(c_plug_contact_law(c_text(library), c_text(law), instead, what), what, error)
  end subroutine plug_contact_law

  !> Law of all pairs of materials that have none of their own.
  subroutine set_default_law(scene, law, parameters, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: law
    real(dp), intent(in) :: parameters(:)
    type(cairn_error), intent(out), optional :: error

    call set_law(scene, -1, -1, law, parameters, error)
  end subroutine set_default_law

  subroutine add_bodies(scene, position, mass, inertia, first, rotation, velocity, error)
    type(cairn_scene), intent(in) :: scene
    real(dp), intent(in), contiguous :: position(:, :)           !< (dim, n) [m]
    real(dp), intent(in) :: mass(:)                              !< (n) [kg]; infinite: moved by nothing
    real(dp), intent(in), contiguous :: inertia(:, :)            !< (1 or 3, n) [kg m2]
    integer(c_int64_t), intent(out) :: first                     !< id of the first; the others follow
    real(dp), intent(in), contiguous, optional :: rotation(:, :) !< (1, n) [rad] or (4, n) quaternion w x y z
    real(dp), intent(in), contiguous, optional :: velocity(:, :) !< (3 or 6, n)
    type(cairn_error), intent(out), optional :: error
    integer :: n, turns, axes
    type(c_error) :: what

    first = -1
    n = size(mass)
    turns = merge(1, 4, scene%dim == 2)
    axes = merge(1, 3, scene%dim == 2)
    if (.not. has_size("position", size(position), scene%dim*n, error)) return
    if (.not. has_size("inertia", size(inertia), axes*n, error)) return
    if (present(rotation)) then
      if (.not. has_size("rotation", size(rotation), turns*n, error)) return
    end if
    if (present(velocity)) then
      if (.not. has_size("velocity", size(velocity), (scene%dim + axes)*n, error)) return
    end if
    call report_back(c_scene_add_bodies(scene%handle, int(n, c_int64_t), position, rotation, velocity, mass, inertia, first, &
                                        what), what, error)
  end subroutine add_bodies

  !> Shapes by which bodies touch: "disk", "segment", "half_plane", "sphere", "plane", "tube".
  subroutine add_contactors(scene, shape, body, material, radius, offset, direction, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: shape
    integer(c_int64_t), intent(in) :: body(:)                    !< (n) ids
    integer, intent(in) :: material(:)                           !< (n)
    real(dp), intent(in), contiguous, optional :: radius(:)      !< (n) [m]
    real(dp), intent(in), contiguous, optional :: offset(:, :)   !< (dim, n) [m], in the axes of the body
    real(dp), intent(in), contiguous, optional :: direction(:, :) !< (dim + 1, n) unit vector, then half length [m]
    type(cairn_error), intent(out), optional :: error
    integer :: n
    integer(c_int64_t) :: first
    type(c_error) :: what

    n = size(body)
    if (.not. has_size("material", size(material), n, error)) return
    if (present(radius)) then
      if (.not. has_size("radius", size(radius), n, error)) return
    end if
    if (present(offset)) then
      if (.not. has_size("offset", size(offset), scene%dim*n, error)) return
    end if
    if (present(direction)) then
      if (.not. has_size("direction", size(direction), (scene%dim + 1)*n, error)) return
    end if
    call report_back(c_scene_add_contactors(scene%handle, c_text(shape), int(n, c_int64_t), body, &
                                            int(material, c_int32_t), radius, offset, direction, first, what), what, error)
  end subroutine add_contactors

  !> Dofs of bodies take their value from velocity, or stay at zero: driven(i) says whether dof i does.
  subroutine drive_bodies(scene, body, driven, velocity, error)
    type(cairn_scene), intent(in) :: scene
    integer(c_int64_t), intent(in) :: body(:)                    !< (n) ids
    logical, intent(in) :: driven(:)                             !< (3 or 6)
    real(dp), intent(in), contiguous, optional :: velocity(:, :) !< (3 or 6, n) [m/s], [rad/s]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. drive_sizes(scene%dim, size(body), driven, velocity, error)) return
    call report_back(c_scene_drive(scene%handle, size(body, kind=c_int64_t), body, mask_of(driven), velocity, what), what, error)
  end subroutine drive_bodies

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

  !> As drive_bodies, between steps.
  subroutine drive_simulation(simulation, body, driven, velocity, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in) :: body(:)
    logical, intent(in) :: driven(:)
    real(dp), intent(in), contiguous, optional :: velocity(:, :)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. drive_sizes(simulation%dim, size(body), driven, velocity, error)) return
    call report_back(c_simulation_drive(simulation%handle, size(body, kind=c_int64_t), body, mask_of(driven), velocity, what), &
                     what, error)
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

  !> A field of bodies by its name ("position", "velocity", "rotation", ...), in the order of insertion: (components, n). A field
  !> that nothing in the scene needs has no components.
  subroutine body_field(simulation, name, values, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:, :)
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: numbers, written, n
    integer(c_int32_t) :: code
    real(dp) :: nothing(1)
    type(c_error) :: what

    n = body_count(simulation)
    numbers = 0
    code = c_body_field(simulation%handle, c_text(name), -1_c_int64_t, nothing, numbers, what)
    allocate (values(numbers/max(n, 1_c_int64_t), n))
    if (code == 0 .and. numbers > 0) &
      code = c_body_field(simulation%handle, c_text(name), numbers, values, written, what)
    call report_back(code, what, error)
  end subroutine body_field

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

  logical function drive_sizes(dim, n, driven, velocity, error) result(right)
    integer, intent(in) :: dim, n
    logical, intent(in) :: driven(:)
    real(dp), intent(in), optional :: velocity(:, :)
    type(cairn_error), intent(out), optional :: error
    integer :: dofs

    dofs = merge(3, 6, dim == 2)
    right = has_size("driven", size(driven), dofs, error)
    if (right .and. present(velocity)) right = has_size("velocity", size(velocity), dofs*n, error)
  end function drive_sizes

  pure integer(c_int8_t) function mask_of(driven)
    logical, intent(in) :: driven(:)
    integer :: i

    mask_of = 0
    do i = 1, size(driven)
      if (driven(i)) mask_of = ibset(mask_of, i - 1)
    end do
  end function mask_of

  pure function c_text(text) result(terminated)
    character(*), intent(in) :: text
    character(len_trim(text) + 1, c_char) :: terminated

    terminated = trim(text)//c_null_char
  end function c_text

  logical function has_size(name, is, wanted, error)
    character(*), intent(in) :: name
    integer, intent(in) :: is, wanted
    type(cairn_error), intent(out), optional :: error
    character(12) :: numbers(2)

    has_size = is == wanted
    if (has_size) return
    write (numbers, "(i0)") is, wanted
    call tell(cairn_error(1, -1_c_int64_t, name//" has "//trim(numbers(1))//" numbers; it needs "//trim(numbers(2))), error)
  end function has_size

  subroutine report_back(code, what, error)
    integer(c_int32_t), intent(in) :: code
    type(c_error), intent(in) :: what
    type(cairn_error), intent(out), optional :: error
    character(size(what%message)) :: text
    integer :: i

    if (code == 0) return
    do i = 1, size(what%message)
      text(i:i) = what%message(i)
    end do
    call tell(cairn_error(int(code), what%item, text(:index(text, c_null_char) - 1)), error)
  end subroutine report_back

  subroutine tell(what, error)
    type(cairn_error), intent(in) :: what
    type(cairn_error), intent(out), optional :: error

    if (.not. present(error)) error stop "cairn: "//what%message
    error = what
  end subroutine tell
end module cairn
