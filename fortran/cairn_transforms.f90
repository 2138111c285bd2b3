!> Bodies that are made deformable or rigid in a run, and materials of the program's own, for Fortran. Programs use the module
!> cairn.
module cairn_transforms
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_meshes, only: cairn_mesh
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: deform_body, rigidify_mesh, plug_material, give_material

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
    integer(c_int32_t) function c_plug_material(library, material, routine, state, error) bind(c, name="cairn_plug_material")
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
  end interface

contains

  !> Between steps a rigid body becomes deformable: a mesh of cells, of its shape as it stood when it came in, takes its place,
  !> mass, momentum, force and damping, and what its contacts remember.
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

  !> A subroutine UMAT of a shared library as a material of that name for add_solid_cells, whose values are its PROPS.
  subroutine plug_material(library, material, state, routine, error)
    character(*), intent(in) :: library                          !< path
    character(*), intent(in) :: material
    integer, intent(in) :: state                                 !< numbers STATEV at each point
    character(*), intent(in), optional :: routine                !< "umat" without; an underscore may follow
    type(cairn_error), intent(out), optional :: error
    character(:), allocatable :: symbol
    type(c_error) :: what

    symbol = "umat"
    if (present(routine)) symbol = routine
    call report_back(c_plug_material(c_text(library), c_text(material), c_text(symbol), int(state, c_int32_t), what), what, error)
  end subroutine plug_material

  !> The same of one that the program links: c_funloc(umat), of an external subroutine.
  subroutine give_material(material, routine, state, error)
    character(*), intent(in) :: material
    type(c_funptr), intent(in) :: routine
    integer, intent(in) :: state                                 !< numbers STATEV at each point
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_give_material(c_text(material), routine, int(state, c_int32_t), what), what, error)
  end subroutine give_material
end module cairn_transforms
