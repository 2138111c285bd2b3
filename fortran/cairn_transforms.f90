!> Bodies that are made deformable or rigid in a run, and materials of the program's own, for Fortran. Programs use the module
!> cairn.
module cairn_transforms
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use cairn_meshes, only: cairn_mesh
  use cairn_scenes, only: contactor_sizes
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: deform_body, rigidify_mesh, rigidify_mesh_as, reshape_when, mesh_of_body, plug_material, give_material

  interface
    integer(c_int32_t) function c_deform(simulation, body, mesh, name, material, side_material, number, error) &
        bind(c, name="cairn_simulation_deform")
      import
      type(c_ptr), value :: simulation, mesh
      integer(c_int64_t), value :: body
      character(c_char), intent(in) :: name(*)
      integer(c_int32_t), value :: material, side_material
      integer(c_int32_t), intent(out) :: number
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_rigidify(simulation, mesh, body, error) bind(c, name="cairn_simulation_rigidify")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: mesh
      integer(c_int64_t), intent(out) :: body
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_rigidify_as(simulation, mesh, rotation, mass, inertia, shape, n, material, radius, offset, &
        direction, hull, body, error) bind(c, name="cairn_simulation_rigidify_as")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: mesh
      real(c_double), intent(in), optional :: rotation(*)
      real(c_double), value :: mass
      real(c_double), intent(in) :: inertia(*)
      character(c_char), intent(in) :: shape(*)
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: material(*)
      real(c_double), intent(in), optional :: radius(*), offset(*), direction(*)
      integer(c_int32_t), intent(in), optional :: hull(*)
      integer(c_int64_t), intent(out) :: body
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_reshape_when(simulation, n, bodies, mesh, force, stress, back, material, side_material, error) &
        bind(c, name="cairn_simulation_reshape_when")
      import
      type(c_ptr), value :: simulation, mesh
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(*)
      real(c_double), value :: force, stress, back
      integer(c_int32_t), value :: material, side_material
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_of_body(simulation, body, mesh, error) bind(c, name="cairn_simulation_mesh_of_body")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), value :: body
      integer(c_int32_t), intent(out) :: mesh
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_plug_material(library, material, routine, state, error) bind(c, name="cairn_plug_material")
      import
      character(c_char), intent(in) :: library(*), material(*), routine(*)
      integer(c_int32_t), value :: state
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_plug_plane_stress_material(library, material, routine, state, error) &
        bind(c, name="cairn_plug_plane_stress_material")
      import
      character(c_char), intent(in) :: library(*), material(*), routine(*)
      integer(c_int32_t), value :: state
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_give_material(material, routine, state, error) bind(c, name="cairn_give_material")
      import
      character(c_char), intent(in) :: material(*)
      type(c_funptr), value :: routine
      integer(c_int32_t), value :: state
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_give_plane_stress_material(material, routine, state, error) &
        bind(c, name="cairn_give_plane_stress_material")
      import
      character(c_char), intent(in) :: material(*)
      type(c_funptr), value :: routine
      integer(c_int32_t), value :: state
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> Between steps a rigid body becomes deformable: a mesh of cells, of its shape in its initial position, takes over its
  !> position, mass, momentum, force and damping, and the memory of its contacts.
  subroutine deform_body(simulation, body, mesh, number, name, material, side_material, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in) :: body
    type(cairn_mesh), intent(in) :: mesh                         !< touches with its whole surface if nothing is said of that
    integer, intent(out), optional :: number                     !< of the mesh, from 0
    character(*), intent(in), optional :: name                   !< "body N" without
    integer, intent(in), optional :: material, side_material     !< without: that of the contactors of the body; of the nodes
    type(cairn_error), intent(out), optional :: error
    character(:), allocatable :: named
    integer(c_int32_t) :: of_nodes, of_sides, made
    type(c_error) :: what

    named = ""
    if (present(name)) named = name
    of_nodes = -1
    if (present(material)) of_nodes = int(material, c_int32_t)
    of_sides = -1
    if (present(side_material)) of_sides = int(side_material, c_int32_t)
    made = -1
    call report_back(c_deform(simulation%handle, body, mesh%handle, c_text(named), of_nodes, of_sides, made, what), what, error)
    if (present(number)) number = made
  end subroutine deform_body

  !> Between steps such a mesh becomes the rigid body that it was, with the momentum of its nodes. Meshes after it count one less.
  subroutine rigidify_mesh(simulation, mesh, body, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh                                  !< number of the mesh, from 0
    integer(c_int64_t), intent(out), optional :: body            !< the number that it had
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: id
    type(c_error) :: what

    id = -1
    call report_back(c_rigidify(simulation%handle, int(mesh, c_int32_t), id, what), what, error)
    if (present(body)) body = id
  end subroutine rigidify_mesh

  !> Makes a mesh a rigid body of another shape, under a new number, also a mesh that was no rigid body before: its contactors are
  !> placed about the centre of mass of the mesh.
  subroutine rigidify_mesh_as(simulation, mesh, shape, material, mass, inertia, rotation, radius, offset, direction, hull, body, &
                              error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh                                  !< number of the mesh, from 0
    character(*), intent(in) :: shape                            !< as of insert_contactors
    integer, intent(in) :: material(:)                           !< (n) of its contactors
    real(dp), intent(in) :: mass                                 !< of the shape, scaled to that of the mesh [kg]
    real(dp), intent(in), contiguous :: inertia(:)               !< the same (1 | 3) [kg m2]
    real(dp), intent(in), contiguous, optional :: rotation(:)    !< how it stands (1 | 4); without: upright
    real(dp), intent(in), contiguous, optional :: radius(:), offset(:, :), direction(:, :)
    integer(c_int32_t), intent(in), contiguous, optional :: hull(:)
    integer(c_int64_t), intent(out), optional :: body            !< its number
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: id
    integer :: n
    type(c_error) :: what

    n = size(material)
    if (.not. has_size("inertia", size(inertia), merge(1, 3, simulation%dim == 2), error)) return
    if (present(rotation)) then
      if (.not. has_size("rotation", size(rotation), merge(1, 4, simulation%dim == 2), error)) return
    end if
    if (.not. contactor_sizes(simulation%dim, n, material, radius, offset, direction, error)) return
    if (present(hull)) then
      if (.not. has_size("hull", size(hull), n, error)) return
    end if
    id = -1
    call report_back(c_rigidify_as(simulation%handle, int(mesh, c_int32_t), rotation, mass, inertia, c_text(shape), &
                                   int(n, c_int64_t), int(material, c_int32_t), radius, offset, direction, hull, id, what), &
                     what, error)
    if (present(body)) body = id
  end subroutine rigidify_mesh_as

  !> From now on rigid bodies are made deformable after a step in which a contact of theirs bore more than `force`, or a principal
  !> value of their mean stress was above `stress`; and rigid again after one in which none bore `back`.
  subroutine reshape_when(simulation, body, mesh, force, stress, back, material, side_material, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in), contiguous :: body(:)
    type(cairn_mesh), intent(in) :: mesh                         !< of the shape of each, as of deform_body; it is copied
    real(dp), intent(in), optional :: force, stress              !< [N], [Pa]; one of them, or both
    real(dp), intent(in), optional :: back                       !< [N]; without: never
    integer, intent(in), optional :: material, side_material     !< as of deform_body
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: of_nodes, of_sides
    real(dp) :: threshold(2), again
    type(c_error) :: what

    threshold = ieee_value(1.0_dp, ieee_positive_inf)
    if (present(force)) threshold(1) = force
    if (present(stress)) threshold(2) = stress
    again = 0
    if (present(back)) again = back
    of_nodes = -1
    if (present(material)) of_nodes = int(material, c_int32_t)
    of_sides = -1
    if (present(side_material)) of_sides = int(side_material, c_int32_t)
    call report_back(c_reshape_when(simulation%handle, size(body, kind=c_int64_t), body, mesh%handle, threshold(1), threshold(2), &
                                    again, of_nodes, of_sides, what), what, error)
  end subroutine reshape_when

  !> The mesh that a body was made, -1: it is rigid.
  integer function mesh_of_body(simulation, body, error) result(mesh)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in) :: body
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: number
    type(c_error) :: what

    number = -1
    call report_back(c_mesh_of_body(simulation%handle, body, number, what), what, error)
    mesh = number
  end function mesh_of_body

  !> A subroutine UMAT of a shared library as a material of that name for add_solid_cells, whose values are its PROPS.
  subroutine plug_material(library, material, state, routine, error, plane_stress)
    character(*), intent(in) :: library                          !< path
    character(*), intent(in) :: material
    integer, intent(in) :: state                                 !< numbers STATEV at each point
    character(*), intent(in), optional :: routine                !< "umat" without; an underscore may follow
    type(cairn_error), intent(out), optional :: error
    logical, intent(in), optional :: plane_stress                !< it is written for elements of plane stress, NDI = 2
    character(:), allocatable :: symbol
    type(c_error) :: what
    integer(c_int32_t) :: numbers, status

    symbol = "umat"
    if (present(routine)) symbol = routine
    numbers = int(state, c_int32_t)
    if (given(plane_stress)) then
      status = c_plug_plane_stress_material(c_text(library), c_text(material), c_text(symbol), numbers, what)
    else
      status = c_plug_material(c_text(library), c_text(material), c_text(symbol), numbers, what)
    end if
    call report_back(status, what, error)
  end subroutine plug_material

  logical function given(choice)
    logical, intent(in), optional :: choice

    given = .false.
    if (present(choice)) given = choice
  end function given

  !> Adds a material by a UMAT that the program links: c_funloc(umat), of an external subroutine.
  subroutine give_material(material, routine, state, error, plane_stress)
    character(*), intent(in) :: material
    type(c_funptr), intent(in) :: routine
    integer, intent(in) :: state                                 !< numbers STATEV at each point
    type(cairn_error), intent(out), optional :: error
    logical, intent(in), optional :: plane_stress
    type(c_error) :: what
    integer(c_int32_t) :: numbers, status

    numbers = int(state, c_int32_t)
    if (given(plane_stress)) then
      status = c_give_plane_stress_material(c_text(material), routine, numbers, what)
    else
      status = c_give_material(c_text(material), routine, numbers, what)
    end if
    call report_back(status, what, error)
  end subroutine give_material
end module cairn_transforms
