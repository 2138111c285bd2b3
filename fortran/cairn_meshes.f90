!> Deformable bodies of Cairn for Fortran. Programs use the module cairn.
module cairn_meshes
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_scenes, only: cairn_scene
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: cairn_mesh, create_mesh, destroy_mesh, add_elastic_cells, set_damping, set_matrices
  public :: stress_points, set_initial_stress
  public :: touch_nodes, touch_points, touch_sides, mesh_boundary, hold_nodes, set_motion, add_mesh
  public :: element_matrices, load_mesh, mesh_field

  type :: cairn_mesh
    type(c_ptr) :: handle = c_null_ptr !< of the C API
    integer :: dim = 0, nodes = 0
  end type

  interface
    integer(c_int32_t) function c_mesh_create(dim, nodes, position, mesh, error) &
        bind(c, name="cairn_mesh_create")
      import
      integer(c_int32_t), value :: dim
      integer(c_int64_t), value :: nodes
      real(c_double), intent(in) :: position(*)
      type(c_ptr), intent(out) :: mesh
      type(c_error), intent(inout) :: error
    end function
    subroutine c_mesh_destroy(mesh) bind(c, name="cairn_mesh_destroy")
      import
      type(c_ptr), value :: mesh
    end subroutine
    integer(c_int32_t) function c_mesh_add_elastic_cells(mesh, element, n, node, young, poisson, density, &
        plane_stress, thickness, error) bind(c, name="cairn_mesh_add_elastic_cells")
      import
      type(c_ptr), value :: mesh
      character(c_char), intent(in) :: element(*)
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      real(c_double), value :: young, poisson, density
      integer(c_int32_t), value :: plane_stress
      real(c_double), value :: thickness
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_stress_points(mesh, capacity, position, count, error) &
        bind(c, name="cairn_mesh_stress_points")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: capacity
      real(c_double), intent(inout) :: position(*)
      integer(c_int64_t), intent(out) :: count
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_initial_stress(mesh, n, stress, error) &
        bind(c, name="cairn_mesh_set_initial_stress")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: n
      real(c_double), intent(in) :: stress(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_damping(mesh, by_mass, by_stiffness, lumped, error) &
        bind(c, name="cairn_mesh_set_damping")
      import
      type(c_ptr), value :: mesh
      real(c_double), value :: by_mass, by_stiffness
      integer(c_int32_t), value :: lumped
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_matrices(mesh, start, row, mass, stiffness, damping, error) &
        bind(c, name="cairn_mesh_set_matrices")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), intent(in) :: start(*)
      integer(c_int32_t), intent(in) :: row(*)
      real(c_double), intent(in) :: mass(*), stiffness(*)
      real(c_double), intent(in), optional :: damping(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_touch_nodes(mesh, n, node, error) &
        bind(c, name="cairn_mesh_touch_nodes")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_touch_points(mesh, n, node, weight, error) &
        bind(c, name="cairn_mesh_touch_points")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      real(c_double), intent(in) :: weight(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_touch_sides(mesh, n, node, error) &
        bind(c, name="cairn_mesh_touch_sides")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_boundary(mesh, capacity, node, count, error) &
        bind(c, name="cairn_mesh_boundary")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: capacity
      integer(c_int32_t), intent(inout) :: node(*)
      integer(c_int64_t), intent(out) :: count
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_hold(mesh, n, node, mask, error) &
        bind(c, name="cairn_mesh_hold")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      integer(c_int8_t), value :: mask
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_motion(mesh, displacement, velocity, error) &
        bind(c, name="cairn_mesh_set_motion")
      import
      type(c_ptr), value :: mesh
      real(c_double), intent(in), optional :: displacement(*), velocity(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_mesh(scene, mesh, name, material, side_material, first, number, error) &
        bind(c, name="cairn_scene_add_mesh")
      import
      type(c_ptr), value :: scene, mesh
      character(c_char), intent(in) :: name(*)
      integer(c_int32_t), value :: material, side_material
      integer(c_int64_t), intent(out) :: first
      integer(c_int32_t), intent(out) :: number
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_element_matrices(element, n, position, density, elasticity, stiffness, mass, error) &
        bind(c, name="cairn_element_matrices")
      import
      character(c_char), intent(in) :: element(*)
      integer(c_int64_t), value :: n
      real(c_double), intent(in) :: position(*), elasticity(*)
      real(c_double), value :: density
      real(c_double), intent(inout) :: stiffness(*), mass(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_load_mesh(simulation, mesh, begin, end, held_velocity, error) &
        bind(c, name="cairn_simulation_load_mesh")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: mesh
      real(c_double), intent(in), optional :: begin(*), end(*), held_velocity(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_field(simulation, mesh, name, capacity, values, count, error) &
        bind(c, name="cairn_simulation_mesh_field")
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

  !> A deformable body by its nodes; described by the calls below, then added to scenes.
  subroutine create_mesh(mesh, position, error)
    type(cairn_mesh), intent(out) :: mesh
    real(dp), intent(in), contiguous :: position(:, :)           !< (dim, nodes) [m]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    mesh%dim = size(position, 1)
    mesh%nodes = size(position, 2)
    call report_back(c_mesh_create(int(mesh%dim, c_int32_t), int(mesh%nodes, c_int64_t), position, mesh%handle, what), what, &
                     error)
  end subroutine create_mesh

  subroutine destroy_mesh(mesh)
    type(cairn_mesh), intent(inout) :: mesh

    call c_mesh_destroy(mesh%handle)
    mesh%handle = c_null_ptr
  end subroutine destroy_mesh

  !> Isotropic elastic cells of an element of elements.def: "t3", "q4", "tet4", "hex8".
  subroutine add_elastic_cells(mesh, element, node, young, poisson, density, plane_stress, thickness, error)
    type(cairn_mesh), intent(in) :: mesh
    character(*), intent(in) :: element
    integer, intent(in), contiguous :: node(:, :)                !< (nodes of a cell, n) from 0, anticlockwise in 2D
    real(dp), intent(in) :: young                                !< [Pa]
    real(dp), intent(in) :: poisson, density                     !< [-], [kg/m3]
    logical, intent(in), optional :: plane_stress                !< in 2D; plane strain without
    real(dp), intent(in), optional :: thickness                  !< in 2D [m], 1 without
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: plane
    real(dp) :: depth
    type(c_error) :: what

    plane = 0
    if (present(plane_stress)) plane = merge(1_c_int32_t, 0_c_int32_t, plane_stress)
    depth = 1
    if (present(thickness)) depth = thickness
    call report_back(c_mesh_add_elastic_cells(mesh%handle, c_text(element), size(node, 2, c_int64_t), int(node, c_int32_t), &
                                              young, poisson, density, plane, depth, what), what, error)
  end subroutine add_elastic_cells

  !> Places of the points of the cells at which a stress can be given.
  subroutine stress_points(mesh, position, error)
    type(cairn_mesh), intent(in) :: mesh
    real(dp), allocatable, intent(out) :: position(:, :)         !< (dim, points) [m]
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: numbers, written
    integer(c_int32_t) :: code
    real(dp) :: nothing(1)
    type(c_error) :: what

    numbers = 0
    code = c_mesh_stress_points(mesh%handle, -1_c_int64_t, nothing, numbers, what)
    allocate (position(mesh%dim, numbers/max(mesh%dim, 1)))
    if (code == 0 .and. numbers > 0) code = c_mesh_stress_points(mesh%handle, numbers, position, written, what)
    call report_back(code, what, error)
  end subroutine stress_points

  !> True stress of the cells before the body moves, in the order in which they came in.
  subroutine set_initial_stress(mesh, stress, error)
    type(cairn_mesh), intent(in) :: mesh
    real(dp), intent(in), contiguous :: stress(:, :)             !< (6, cells | points) [Pa], 11 22 33 12 13 23
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("stress", size(stress), 6*size(stress, 2), error)) return
    call report_back(c_mesh_set_initial_stress(mesh%handle, size(stress, 2, c_int64_t), stress, what), what, error)
  end subroutine set_initial_stress

  !> Rayleigh damping of cells: C = by_mass M + by_stiffness K; lumped: mass in the nodes alone.
  subroutine set_damping(mesh, by_mass, by_stiffness, lumped, error)
    type(cairn_mesh), intent(in) :: mesh
    real(dp), intent(in) :: by_mass                              !< [1/s]
    real(dp), intent(in) :: by_stiffness                         !< [s]
    logical, intent(in) :: lumped
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_mesh_set_damping(mesh%handle, by_mass, by_stiffness, merge(1_c_int32_t, 0_c_int32_t, lumped), what), &
                     what, error)
  end subroutine set_damping

  !> Matrices of your own instead of cells: lower triangles by columns, each from its diagonal on, all numbers from 0.
  subroutine set_matrices(mesh, start, row, mass, stiffness, damping, error)
    type(cairn_mesh), intent(in) :: mesh
    integer(c_int64_t), intent(in), contiguous :: start(:)       !< (dofs + 1) of the columns
    integer(c_int32_t), intent(in), contiguous :: row(:)         !< (n) rising in a column
    real(dp), intent(in), contiguous :: mass(:), stiffness(:)    !< (n) [kg], [N/m]
    real(dp), intent(in), contiguous, optional :: damping(:)     !< (n) [N s/m], none
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("start", size(start), mesh%dim*mesh%nodes + 1, error)) return
    if (.not. has_size("row", size(row), int(start(size(start))), error)) return
    if (.not. has_size("mass", size(mass), size(row), error)) return
    if (.not. has_size("stiffness", size(stiffness), size(row), error)) return
    if (present(damping)) then
      if (.not. has_size("damping", size(damping), size(row), error)) return
    end if
    call report_back(c_mesh_set_matrices(mesh%handle, start, row, mass, stiffness, damping, what), what, error)
  end subroutine set_matrices

  !> Nodes that touch.
  subroutine touch_nodes(mesh, node, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in) :: node(:)                               !< from 0
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_mesh_touch_nodes(mesh%handle, size(node, kind=c_int64_t), int(node, c_int32_t), what), what, error)
  end subroutine touch_nodes

  !> Points between nodes that touch.
  subroutine touch_points(mesh, node, weight, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in), contiguous :: node(:, :)                !< (4, n) from 0, -1 where fewer
    real(dp), intent(in), contiguous :: weight(:, :)             !< (4, n)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("node", size(node), 4*size(node, 2), error)) return
    if (.not. has_size("weight", size(weight), size(node), error)) return
    call report_back(c_mesh_touch_points(mesh%handle, size(node, 2, c_int64_t), int(node, c_int32_t), weight, what), what, error)
  end subroutine touch_points

  !> Sides against which others come: edges (2, n) in 2D, the body on their left, faces (4, n) in 3D, anticlockwise from outside.
  subroutine touch_sides(mesh, node, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in), contiguous :: node(:, :)                !< from 0, -1 for the fourth node of a triangle
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("node", size(node), merge(2, 4, mesh%dim == 2)*size(node, 2), error)) return
    call report_back(c_mesh_touch_sides(mesh%handle, size(node, 2, c_int64_t), int(node, c_int32_t), what), what, error)
  end subroutine touch_sides

  !> Sides of one cell alone, as touch_sides takes them.
  subroutine mesh_boundary(mesh, node, error)
    type(cairn_mesh), intent(in) :: mesh
    integer(c_int32_t), allocatable, intent(out) :: node(:, :)
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: numbers, written
    integer(c_int32_t) :: code, nothing(1)
    integer :: width
    type(c_error) :: what

    numbers = 0
    width = merge(2, 4, mesh%dim == 2)
    code = c_mesh_boundary(mesh%handle, -1_c_int64_t, nothing, numbers, what)
    allocate (node(width, numbers/width))
    if (code == 0 .and. numbers > 0) code = c_mesh_boundary(mesh%handle, numbers, node, written, what)
    call report_back(code, what, error)
  end subroutine mesh_boundary

  !> Displacements of nodes that are held, or driven by load_mesh: held(k) says whether along axis k.
  subroutine hold_nodes(mesh, node, held, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in) :: node(:)                               !< from 0
    logical, intent(in) :: held(:)                               !< (dim)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("held", size(held), mesh%dim, error)) return
    call report_back(c_mesh_hold(mesh%handle, size(node, kind=c_int64_t), int(node, c_int32_t), mask_of(held), what), what, error)
  end subroutine hold_nodes

  !> At the start.
  subroutine set_motion(mesh, displacement, velocity, error)
    type(cairn_mesh), intent(in) :: mesh
    real(dp), intent(in), contiguous, optional :: displacement(:, :), velocity(:, :) !< (dim, nodes) [m], [m/s]: zero
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (present(displacement)) then
      if (.not. has_size("displacement", size(displacement), mesh%dim*mesh%nodes, error)) return
    end if
    if (present(velocity)) then
      if (.not. has_size("velocity", size(velocity), mesh%dim*mesh%nodes, error)) return
    end if
    call report_back(c_mesh_set_motion(mesh%handle, displacement, velocity, what), what, error)
  end subroutine set_motion

  !> name: its own, a group that rules may name; that of its sides is "NAME edges" in 2D, "NAME faces" in 3D.
  subroutine add_mesh(scene, mesh, name, material, number, first, side_material, error)
    type(cairn_scene), intent(in) :: scene
    type(cairn_mesh), intent(in) :: mesh
    character(*), intent(in) :: name
    integer, intent(in) :: material
    integer, intent(out) :: number                               !< of the mesh in the simulation
    integer(c_int64_t), intent(out), optional :: first           !< id of the body of node 0; others follow
    integer, intent(in), optional :: side_material               !< that of the nodes without
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: which, sides
    integer(c_int64_t) :: id
    type(c_error) :: what

    which = -1
    sides = -1
    id = -1
    if (present(side_material)) sides = int(side_material, c_int32_t)
    call report_back(c_scene_add_mesh(scene%handle, mesh%handle, c_text(name), int(material, c_int32_t), sides, id, which, &
                                      what), what, error)
    number = which
    if (present(first)) first = id
  end subroutine add_mesh

  !> Stiffness and mass of elements, for matrices of one's own.
  subroutine element_matrices(element, position, density, elasticity, stiffness, mass, error)
    character(*), intent(in) :: element
    real(dp), intent(in), contiguous :: position(:, :, :)        !< (dim, nodes, n) [m]
    real(dp), intent(in) :: density                              !< [kg/m3], times the thickness in 2D
    real(dp), intent(in), contiguous :: elasticity(:, :)         !< (3, 3) or (6, 6) on xx yy [zz] xy [yz zx] [Pa]
    real(dp), allocatable, intent(out) :: stiffness(:, :, :), mass(:, :, :) !< (dofs, dofs, n) [N/m], [kg]
    type(cairn_error), intent(out), optional :: error
    integer :: dofs
    type(c_error) :: what

    dofs = size(position, 1)*size(position, 2)
    if (.not. has_size("elasticity", size(elasticity), (3*size(position, 1) - 3)**2, error)) return
    allocate (stiffness(dofs, dofs, size(position, 3)), mass(dofs, dofs, size(position, 3)))
    call report_back(c_element_matrices(c_text(element), size(position, 3, c_int64_t), position, density, elasticity, &
                                        stiffness, mass, what), what, error)
  end subroutine element_matrices

  !> Forces on the dofs of a mesh at both ends of the coming steps; velocities of its held dofs.
  subroutine load_mesh(simulation, mesh, begin, end, held_velocity, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh                                  !< its number
    real(dp), intent(in), contiguous, optional :: begin(:, :), end(:, :) !< (dim, nodes) [N]; one: constant
    real(dp), intent(in), contiguous, optional :: held_velocity(:, :)    !< (dim, nodes) [m/s]: zero
    type(cairn_error), intent(out), optional :: error
    integer :: dofs
    real(dp), allocatable :: place(:, :)
    type(c_error) :: what

    call mesh_field(simulation, mesh, "position", place, error)
    if (present(error)) then
      if (error%code /= 0) return
    end if
    dofs = size(place)
    if (present(begin)) then
      if (.not. has_size("begin", size(begin), dofs, error)) return
    end if
    if (present(end)) then
      if (.not. has_size("end", size(end), dofs, error)) return
    end if
    if (present(held_velocity)) then
      if (.not. has_size("held_velocity", size(held_velocity), dofs, error)) return
    end if
    call report_back(c_load_mesh(simulation%handle, int(mesh, c_int32_t), begin, end, held_velocity, what), what, error)
  end subroutine load_mesh

  !> "position", "displacement" or "velocity" of the nodes of a mesh.
  subroutine mesh_field(simulation, mesh, name, values, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: mesh                                  !< its number
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:, :)           !< (dim, nodes)
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: numbers, written
    integer(c_int32_t) :: code
    real(dp) :: nothing(1)
    type(c_error) :: what

    numbers = 0
    code = c_mesh_field(simulation%handle, int(mesh, c_int32_t), c_text(name), -1_c_int64_t, nothing, numbers, what)
    allocate (values(simulation%dim, numbers/simulation%dim))
    if (code == 0 .and. numbers > 0) &
      code = c_mesh_field(simulation%handle, int(mesh, c_int32_t), c_text(name), numbers, values, written, what)
    call report_back(code, what, error)
  end subroutine mesh_field
end module cairn_meshes
