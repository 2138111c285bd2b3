!> Deformable bodies of Cairn for Fortran whose forces are not linear: cells of materials of solids, and the forces of another code.
!> Programs use the module cairn.
module cairn_solids
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_meshes, only: cairn_mesh
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: set_sides, set_rigid, tie_node, set_contact, press_mesh, set_pressure, mesh_cells
  public :: cairn_body_calls, add_solid_cells, new_body_calls, set_calls, plug_body
  public :: body_forces, body_history, body_state_size, body_save, body_load, body_create

  !> How Cairn calls another code, see cairn/body_calls.h; from new_body_calls.
  type, bind(c) :: cairn_body_calls
    integer(c_int32_t) :: abi = 1, size = 0
    integer(c_int32_t) :: gives_energy = 0      !< 1: forces fills energy
    integer(c_int32_t) :: gives_dissipation = 0 !< 1: forces fills dissipated; of a code that spends nothing it is 0
    integer(c_int64_t) :: dofs = 0, entries = 0 !< as the code knows them: refused where the mesh or its pattern has others
    type(c_ptr)        :: context = c_null_ptr  !< passed to each call, c_loc of the data of the code
    type(c_funptr)     :: forces = c_null_funptr !< c_funloc of a body_forces
    type(c_funptr)     :: commit = c_null_funptr, rollback = c_null_funptr !< of a body_history; null: nothing is kept
    type(c_funptr)     :: state_size = c_null_funptr, save = c_null_funptr, load = c_null_funptr !< for checkpoints, all or none
    type(c_funptr)     :: create = c_null_funptr !< of a body_create, for a second simulation of the scene
    type(c_funptr)     :: destroy = c_null_funptr, complaint = c_null_funptr
  end type cairn_body_calls

  abstract interface
    !> Internal forces, from the history of the last commit. 0, anything else: there are none, Cairn tries a smaller change.
    integer(c_int32_t) function body_forces(context, dofs, entries, time, step, rate, displacement, velocity, force, tangent, &
                                            energy, dissipated) bind(c)
      import
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
      import
      type(c_ptr), value :: context
    end function body_history
    !> Numbers that save gives.
    integer(c_int64_t) function body_state_size(context) bind(c)
      import
      type(c_ptr), value :: context
    end function body_state_size
    !> Writes the state of the body for a checkpoint; returns 0 on success.
    integer(c_int32_t) function body_save(context, size, state) bind(c)
      import
      type(c_ptr), value          :: context
      integer(c_int64_t), value   :: size
      real(c_double), intent(out) :: state(size)
    end function body_save
    !> Goes on from it. 0: done.
    integer(c_int32_t) function body_load(context, size, state) bind(c)
      import
      type(c_ptr), value         :: context
      integer(c_int64_t), value  :: size
      real(c_double), intent(in) :: state(size)
    end function body_load
    !> A context at the start of its history. 0: done.
    integer(c_int32_t) function body_create(context, another) bind(c)
      import
      type(c_ptr), value       :: context
      type(c_ptr), intent(out) :: another
    end function body_create
  end interface

  interface
    integer(c_int32_t) function c_mesh_add_solid_cells(mesh, element, n, node, material, count, names, values, density, &
        kinematics, plane, mean_dilatation, thickness, error) bind(c, name="cairn_mesh_add_solid_cells")
      import
      type(c_ptr), value :: mesh
      character(c_char), intent(in) :: element(*), material(*), kinematics(*), plane(*)
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      integer(c_int32_t), value :: count, mean_dilatation
      type(c_ptr), intent(in) :: names(*)
      real(c_double), intent(in) :: values(*)
      real(c_double), value :: density, thickness
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_calls(mesh, start, row, mass, node_mass, calls, error) &
        bind(c, name="cairn_mesh_set_calls")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), intent(in) :: start(*)
      integer(c_int32_t), intent(in) :: row(*)
      real(c_double), intent(in), optional :: mass(*), node_mass(*)
      type(cairn_body_calls), intent(in) :: calls
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_plug_body(mesh, library, body, count, params, start, row, mass, node_mass, error) &
        bind(c, name="cairn_mesh_plug_body")
      import
      type(c_ptr), value :: mesh
      character(c_char), intent(in) :: library(*), body(*)
      integer(c_int32_t), value :: count
      real(c_double), intent(in) :: params(*)
      integer(c_int64_t), intent(in) :: start(*)
      integer(c_int32_t), intent(in) :: row(*)
      real(c_double), intent(in), optional :: mass(*), node_mass(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_sides(mesh, n, node, plane, thickness, error) bind(c, name="cairn_mesh_set_sides")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      character(c_char), intent(in) :: plane(*)
      real(c_double), value :: thickness
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_rigid(mesh, n, node, error) bind(c, name="cairn_mesh_set_rigid")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_tie_node(mesh, node, n, leader, weight, error) bind(c, name="cairn_mesh_tie_node")
      import
      type(c_ptr), value :: mesh
      integer(c_int32_t), value :: node
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: leader(*)
      real(c_double), intent(in) :: weight(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_contact(mesh, self_contact, mortar, error) bind(c, name="cairn_mesh_set_contact")
      import
      type(c_ptr), value :: mesh
      integer(c_int32_t), value :: self_contact, mortar
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_press_mesh(simulation, mesh, nodes, n, node, set, error) &
        bind(c, name="cairn_simulation_press_mesh")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: mesh, nodes
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      integer(c_int32_t), intent(out) :: set
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_pressure(simulation, mesh, set, begin, end, error) &
        bind(c, name="cairn_simulation_set_pressure")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: mesh, set
      real(c_double), value :: begin, end
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_cells(simulation, mesh, name, capacity, values, count, error) &
        bind(c, name="cairn_simulation_mesh_cells")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: mesh
      character(c_char), intent(in) :: name(*)
      integer(c_int64_t), value :: capacity
      real(c_double), intent(inout) :: values(*)
      integer(c_int64_t), intent(out) :: count
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> Cells of a material of bulk_materials.def ("neo_hookean", "j2_plasticity", ...), its parameters by their names.
  subroutine add_solid_cells(mesh, element, node, material, names, values, density, kinematics, plane, mean_dilatation, &
                             thickness, error)
    type(cairn_mesh), intent(in) :: mesh
    character(*), intent(in) :: element, material
    integer, intent(in), contiguous :: node(:, :)                !< (nodes of a cell, n) from 0, anticlockwise in 2D
    character(*), intent(in) :: names(:)                         !< those that are not named have their defaults
    real(dp), intent(in), contiguous :: values(:)                !< one for each name
    real(dp), intent(in) :: density                              !< [kg/m3]
    character(*), intent(in), optional :: kinematics             !< "small" (without), "corotational", "total_lagrangian", ...
    character(*), intent(in), optional :: plane                  !< "strain" (without), "stress", "axisymmetric", in 2D
    logical, intent(in), optional :: mean_dilatation             !< cells do not lock near poisson = 1/2; not without
    real(dp), intent(in), optional :: thickness                  !< in 2D [m], 1 without
    type(cairn_error), intent(out), optional :: error
    character(c_char), allocatable, target :: text(:, :)
    type(c_ptr) :: at(max(1, size(names)))
    character(:), allocatable :: strains, in_plane
    integer(c_int32_t) :: mean
    integer :: i, length
    real(dp) :: depth
    type(c_error) :: what

    if (.not. has_size("values", size(values), size(names), error)) return
    at = c_null_ptr
    allocate (text(len(names) + 1, size(names)), source=c_null_char)
    do i = 1, size(names)
      length = len_trim(names(i))
      text(:length, i) = transfer(names(i), text, length)
      at(i) = c_loc(text(1, i))
    end do
    strains = "small"
    if (present(kinematics)) strains = kinematics
    in_plane = "strain"
    if (present(plane)) in_plane = plane
    mean = 0
    if (present(mean_dilatation)) mean = merge(1_c_int32_t, 0_c_int32_t, mean_dilatation)
    depth = 1
    if (present(thickness)) depth = thickness
    call report_back(c_mesh_add_solid_cells(mesh%handle, c_text(element), size(node, 2, c_int64_t), int(node, c_int32_t), &
                                            c_text(material), size(names, kind=c_int32_t), at, values, density, c_text(strains), &
                                            c_text(in_plane), mean, depth, what), what, error)
  end subroutine add_solid_cells

  !> Calls of a code with so many dofs and entries of its tangent, to be filled.
  function new_body_calls(dofs, entries) result(calls)
    integer, intent(in) :: dofs, entries
    type(cairn_body_calls) :: calls

    calls%size = int(c_sizeof(calls), c_int32_t)
    calls%dofs = dofs
    calls%entries = entries
  end function new_body_calls

  !> Forces of another code in the place of cells, with the pattern of their tangent: a lower triangle by columns, or all entries.
  subroutine set_calls(mesh, start, row, calls, mass, node_mass, error)
    type(cairn_mesh), intent(in) :: mesh
    integer(c_int64_t), intent(in), contiguous :: start(:)       !< (dofs + 1) of the columns, from 0
    integer(c_int32_t), intent(in), contiguous :: row(:)         !< (entries) from 0, rising in a column
    type(cairn_body_calls), intent(in) :: calls
    real(dp), intent(in), contiguous, optional :: mass(:)        !< (entries) [kg], or
    real(dp), intent(in), contiguous, optional :: node_mass(:)   !< (nodes) [kg]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. fits(mesh, start, row, mass, node_mass, error)) return
    call report_back(c_mesh_set_calls(mesh%handle, start, row, mass, node_mass, calls, what), what, error)
  end subroutine set_calls

  !> Adds a body computed by the routine `body` of a shared library.
  subroutine plug_body(mesh, library, body, params, start, row, mass, node_mass, error)
    type(cairn_mesh), intent(in) :: mesh
    character(*), intent(in) :: library, body
    real(dp), intent(in), contiguous :: params(:)                !< in the order of its descriptor
    integer(c_int64_t), intent(in), contiguous :: start(:)       !< (dofs + 1) of the columns, from 0
    integer(c_int32_t), intent(in), contiguous :: row(:)         !< (entries) from 0, rising in a column
    real(dp), intent(in), contiguous, optional :: mass(:)        !< (entries) [kg], or
    real(dp), intent(in), contiguous, optional :: node_mass(:)   !< (nodes) [kg]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. fits(mesh, start, row, mass, node_mass, error)) return
    call report_back(c_mesh_plug_body(mesh%handle, c_text(library), c_text(body), size(params, kind=c_int32_t), params, start, &
                                      row, mass, node_mass, what), what, error)
  end subroutine plug_body

  !> The sides of the boundary of a mesh whose forces another code finds, as touch_sides takes them, for pressures on them.
  subroutine set_sides(mesh, node, plane, thickness, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in), contiguous :: node(:, :)                !< from 0, -1 for the fourth node of a triangle
    character(*), intent(in), optional :: plane                  !< "strain" (without), "stress", "axisymmetric", in 2D
    real(dp), intent(in), optional :: thickness                  !< in 2D [m], 1 without
    type(cairn_error), intent(out), optional :: error
    character(:), allocatable :: in_plane
    real(dp) :: depth
    type(c_error) :: what

    if (.not. has_size("node", size(node), merge(2, 4, mesh%dim == 2)*size(node, 2), error)) return
    in_plane = "strain"
    if (present(plane)) in_plane = plane
    depth = 1
    if (present(thickness)) depth = thickness
    call report_back(c_mesh_set_sides(mesh%handle, size(node, 2, c_int64_t), int(node, c_int32_t), c_text(in_plane), depth, what), &
                     what, error)
  end subroutine set_sides

  !> Nodes that move as one rigid body; calls add parts.
  subroutine set_rigid(mesh, node, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in) :: node(:)                               !< from 0
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_mesh_set_rigid(mesh%handle, size(node, kind=c_int64_t), int(node, c_int32_t), what), what, error)
  end subroutine set_rigid

  !> A node whose displacement is the sum of those of others by their weights.
  subroutine tie_node(mesh, node, leader, weight, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in) :: node, leader(:)                       !< from 0
    real(dp), intent(in), contiguous :: weight(:)                !< one for each leader
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("weight", size(weight), size(leader), error)) return
    call report_back(c_mesh_tie_node(mesh%handle, int(node, c_int32_t), size(leader, kind=c_int64_t), int(leader, c_int32_t), &
                                     weight, what), what, error)
  end subroutine tie_node

  !> Self-contact by points on its own sides; mortar contact of its nodes with sides of other meshes.
  subroutine set_contact(mesh, self_contact, mortar, error)
    type(cairn_mesh), intent(in) :: mesh
    logical, intent(in) :: self_contact, mortar
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_mesh_set_contact(mesh%handle, merge(1_c_int32_t, 0_c_int32_t, self_contact), &
                                        merge(1_c_int32_t, 0_c_int32_t, mortar), what), what, error)
  end subroutine set_contact

  !> Sides of a mesh that is not linear, on which a pressure follows their normals.
  subroutine press_mesh(simulation, mesh, node, set, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh                                  !< its number
    integer, intent(in), contiguous :: node(:, :)                !< (nodes of a side, n) from 0, as mesh_boundary has them
    integer, intent(out) :: set                                  !< number of these sides
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: which
    type(c_error) :: what

    which = -1
    call report_back(c_press_mesh(simulation%handle, int(mesh, c_int32_t), size(node, 1, c_int32_t), size(node, 2, c_int64_t), &
                                  int(node, c_int32_t), which, what), what, error)
    set = which
  end subroutine press_mesh

  !> The pressure of such sides at both ends of the coming steps.
  subroutine set_pressure(simulation, mesh, set, begin, end, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh, set                             !< their numbers
    real(dp), intent(in) :: begin, end                           !< [Pa]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_set_pressure(simulation%handle, int(mesh, c_int32_t), int(set, c_int32_t), begin, end, what), what, error)
  end subroutine set_pressure

  !> Reads a field of cells of solid materials: "stress" (6, cells), or a state by its name (1, cells).
  subroutine mesh_cells(simulation, mesh, name, values, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh                                  !< its number
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:, :)
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: numbers, written
    integer(c_int32_t) :: code
    integer :: wide
    real(dp) :: nothing(1)
    type(c_error) :: what

    numbers = 0
    wide = merge(6, 1, name == "stress")
    code = c_mesh_cells(simulation%handle, int(mesh, c_int32_t), c_text(name), -1_c_int64_t, nothing, numbers, what)
    allocate (values(wide, numbers/wide))
    if (code == 0 .and. numbers > 0) &
      code = c_mesh_cells(simulation%handle, int(mesh, c_int32_t), c_text(name), numbers, values, written, what)
    call report_back(code, what, error)
  end subroutine mesh_cells

  logical function fits(mesh, start, row, mass, node_mass, error)
    type(cairn_mesh), intent(in) :: mesh
    integer(c_int64_t), intent(in) :: start(:)
    integer(c_int32_t), intent(in) :: row(:)
    real(dp), intent(in), optional :: mass(:), node_mass(:)
    type(cairn_error), intent(out), optional :: error

    fits = has_size("start", size(start), mesh%dim*mesh%nodes + 1, error)
    if (fits) fits = has_size("row", size(row), int(start(size(start))), error)
    if (fits .and. present(mass)) fits = has_size("mass", size(mass), size(row), error)
    if (fits .and. present(node_mass)) fits = has_size("node_mass", size(node_mass), mesh%nodes, error)
  end function fits
end module cairn_solids
