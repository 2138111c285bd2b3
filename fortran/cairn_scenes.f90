!> Scenes of Cairn for Fortran. Programs use the module cairn.
module cairn_scenes
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_signatures
  implicit none
  private
  public :: cairn_scene, create_scene, destroy_scene, set_gravity, set_cell, add_material, add_material_of_group
  public :: set_law, set_default_law, set_rule, plug_contact_law, add_bodies, set_body_field, drive_bodies
  public :: add_contactors, add_polygons, add_polyhedra, add_round_hulls, add_hull_contactors, add_surface
  public :: add_joint, contactor_sizes

  type :: cairn_scene
    type(c_ptr) :: handle = c_null_ptr !< of the C API
    integer :: dim = 0
  end type

  procedure(destroyer), bind(c, name="cairn_scene_destroy") :: c_scene_destroy
  procedure(gravity_setter), bind(c, name="cairn_scene_set_gravity") :: c_scene_set_gravity
  procedure(bodies_adder), bind(c, name="cairn_scene_add_bodies") :: c_scene_add_bodies
  procedure(driver), bind(c, name="cairn_scene_drive") :: c_scene_drive
  procedure(field_setter), bind(c, name="cairn_scene_set_body_field") :: c_scene_set_body_field
  procedure(joint_adder), bind(c, name="cairn_scene_add_joint") :: c_scene_add_joint

  interface
    integer(c_int32_t) function c_scene_create(dim, scene, error) bind(c, name="cairn_scene_create")
      import
      integer(c_int32_t), value :: dim
      type(c_ptr), intent(out) :: scene
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
    integer(c_int32_t) function c_scene_set_cell(scene, lengths, corner, lean, shear_rate, error) &
        bind(c, name="cairn_scene_set_cell")
      import
      type(c_ptr), value :: scene
      real(c_double), intent(in) :: lengths(*)
      real(c_double), intent(in), optional :: corner(*)
      real(c_double), value :: lean, shear_rate
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_material_of_group(scene, name, group, material, error) &
        bind(c, name="cairn_scene_add_material_of_group")
      import
      type(c_ptr), value :: scene
      character(c_char), intent(in) :: name(*), group(*)
      integer(c_int32_t), intent(out) :: material
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_set_rule(scene, a, b, law, n, parameter, error) bind(c, name="cairn_scene_set_rule")
      import
      type(c_ptr), value :: scene
      character(c_char), intent(in) :: a(*), b(*)
      character(c_char), intent(in), optional :: law(*)
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: parameter(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_polygons(scene, n, first_vertex, vertex, first, error) &
        bind(c, name="cairn_scene_add_polygons")
      import
      type(c_ptr), value :: scene
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: first_vertex(*)
      real(c_double), intent(in) :: vertex(*)
      integer(c_int32_t), intent(out) :: first
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_polyhedra(scene, n, first_vertex, vertex, first_face, first_corner, corner, first, &
        error) bind(c, name="cairn_scene_add_polyhedra")
      import
      type(c_ptr), value :: scene
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: first_vertex(*), first_face(*), first_corner(*), corner(*)
      real(c_double), intent(in) :: vertex(*)
      integer(c_int32_t), intent(out) :: first
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_round_hulls(scene, shape, n, sizes, first, error) &
        bind(c, name="cairn_scene_add_round_hulls")
      import
      type(c_ptr), value :: scene
      character(c_char), intent(in) :: shape(*)
      integer(c_int64_t), value :: n
      real(c_double), intent(in) :: sizes(*)
      integer(c_int32_t), intent(out) :: first
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_hull_contactors(scene, shape, n, body, material, hull, offset, first, error) &
        bind(c, name="cairn_scene_add_hull_contactors")
      import
      type(c_ptr), value :: scene
      character(c_char), intent(in) :: shape(*)
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: body(*)
      integer(c_int32_t), intent(in) :: material(*), hull(*)
      real(c_double), intent(in), optional :: offset(*)
      integer(c_int64_t), intent(out) :: first
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_scene_add_surface(scene, body, material, vertices, vertex, triangles, triangle, error) &
        bind(c, name="cairn_scene_add_surface")
      import
      type(c_ptr), value :: scene
      integer(c_int64_t), value :: body, vertices, triangles
      integer(c_int32_t), value :: material
      real(c_double), intent(in) :: vertex(*)
      integer(c_int32_t), intent(in) :: triangle(*)
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

    call give_gravity(c_scene_set_gravity, scene%handle, scene%dim, gravity, error)
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

    call give_bodies(c_scene_add_bodies, scene%handle, scene%dim, position, mass, inertia, first, rotation, velocity, error)
  end subroutine add_bodies

  !> Shapes by which bodies touch: "disk", "segment", "half_plane", "ring", "sphere", "plane", "tube".
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
    if (.not. contactor_sizes(scene%dim, n, material, radius, offset, direction, error)) return
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

    call give_drive(c_scene_drive, scene%handle, scene%dim, body, driven, velocity, error)
  end subroutine drive_bodies

  !> A periodic cell: lengths [m], 0 or infinite along an axis that is not periodic.
  subroutine set_cell(scene, lengths, corner, lean, shear_rate, error)
    type(cairn_scene), intent(in) :: scene
    real(dp), intent(in) :: lengths(:)                           !< (dim) [m]
    real(dp), intent(in), optional :: corner(:)                  !< (dim) [m], zero
    real(dp), intent(in), optional :: lean                       !< of the upper face along x [m], zero
    real(dp), intent(in), optional :: shear_rate                 !< at which it moves [1/s], zero
    type(cairn_error), intent(out), optional :: error
    real(dp) :: leaning(2)
    type(c_error) :: what

    if (.not. has_size("lengths", size(lengths), scene%dim, error)) return
    if (present(corner)) then
      if (.not. has_size("corner", size(corner), scene%dim, error)) return
    end if
    leaning = 0
    if (present(lean)) leaning(1) = lean
    if (present(shear_rate)) leaning(2) = shear_rate
    call report_back(c_scene_set_cell(scene%handle, lengths, corner, leaning(1), leaning(2), what), what, error)
  end subroutine set_cell

  !> The material of that name for contactors of a group that rules may name.
  subroutine add_material_of_group(scene, name, group, material, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: name, group
    integer, intent(out) :: material
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: number
    type(c_error) :: what

    number = -1
    call report_back(c_scene_add_material_of_group(scene%handle, c_text(name), c_text(group), number, what), what, error)
    material = number
  end subroutine add_material_of_group

  !> The law between materials or groups by their names, "*" for all; without a law they pass through each other.
  subroutine set_rule(scene, a, b, law, parameters, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: a, b
    character(*), intent(in), optional :: law                    !< a name of laws.def
    real(dp), intent(in), optional :: parameters(:)              !< in the order of laws.def
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: n
    type(c_error) :: what

    n = 0
    if (present(parameters)) n = size(parameters, kind=c_int32_t)
    if (present(law)) then
      call report_back(c_scene_set_rule(scene%handle, c_text(a), c_text(b), c_text(law), n, parameters, what), what, error)
    else
      call report_back(c_scene_set_rule(scene%handle, c_text(a), c_text(b), n=n, error=what), what, error)
    end if
  end subroutine set_rule

  !> "position", "rotation", "velocity", "force" or "damping" of bodies, of all in the order of insertion without ids.
  subroutine set_body_field(scene, name, values, body, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: name
    real(dp), intent(in), contiguous :: values(:, :)             !< (components, n)
    integer(c_int64_t), intent(in), contiguous, optional :: body(:) !< (n) ids
    type(cairn_error), intent(out), optional :: error

    call give_field(c_scene_set_body_field, scene%handle, scene%dim, name, values, body, error)
  end subroutine set_body_field

  !> Polygons, vertices of each in order; hull is the number of the first.
  subroutine add_polygons(scene, vertices, vertex, hull, error)
    type(cairn_scene), intent(in) :: scene
    integer, intent(in) :: vertices(:)                           !< (n) of each
    real(dp), intent(in), contiguous :: vertex(:, :)             !< (2, all) [m]
    integer, intent(out) :: hull
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: first
    type(c_error) :: what

    first = -1
    hull = -1
    if (.not. has_size("vertex", size(vertex), 2*sum(vertices), error)) return
    call report_back(c_scene_add_polygons(scene%handle, size(vertices, kind=c_int64_t), starts(vertices), vertex, first, what), &
                     what, error)
    hull = first
  end subroutine add_polygons

  !> Convex polyhedra; hull is the number of the first.
  subroutine add_polyhedra(scene, vertices, vertex, faces, corners, corner, hull, error)
    type(cairn_scene), intent(in) :: scene
    integer, intent(in) :: vertices(:), faces(:)                 !< (n) of each polyhedron
    real(dp), intent(in), contiguous :: vertex(:, :)             !< (3, all) [m]
    integer, intent(in) :: corners(:)                            !< of each face
    integer, intent(in) :: corner(:)                             !< from 0 within the hull, anticlockwise from outside
    integer, intent(out) :: hull
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: first
    type(c_error) :: what

    first = -1
    hull = -1
    if (.not. has_size("vertex", size(vertex), 3*sum(vertices), error)) return
    if (.not. has_size("faces", size(faces), size(vertices), error)) return
    if (.not. has_size("corners", size(corners), sum(faces), error)) return
    if (.not. has_size("corner", size(corner), sum(corners), error)) return
    call report_back(c_scene_add_polyhedra(scene%handle, size(vertices, kind=c_int64_t), starts(vertices), vertex, &
                                           starts(faces), starts(corners), int(corner, c_int64_t), first, what), what, error)
    hull = first
  end subroutine add_polyhedra

  !> "capsule", "cylinder": radius and length along the third axis [m]; "superquadric": half axes [m], exponents e1, e2.
  subroutine add_round_hulls(scene, shape, sizes, hull, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: shape
    real(dp), intent(in), contiguous :: sizes(:, :)              !< (2 or 5, n)
    integer, intent(out) :: hull                                 !< number of the first
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: first
    type(c_error) :: what

    first = -1
    hull = -1
    if (.not. has_size("sizes", size(sizes), merge(5, 2, shape == "superquadric")*size(sizes, 2), error)) return
    call report_back(c_scene_add_round_hulls(scene%handle, c_text(shape), size(sizes, 2, c_int64_t), sizes, first, what), &
                     what, error)
    hull = first
  end subroutine add_round_hulls

  !> Contactors that are hulls: "polygon", "polyhedron", "capsule", "cylinder", "superquadric".
  subroutine add_hull_contactors(scene, shape, body, material, hull, offset, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: shape
    integer(c_int64_t), intent(in) :: body(:)                    !< (n) ids
    integer, intent(in) :: material(:), hull(:)                  !< (n)
    real(dp), intent(in), contiguous, optional :: offset(:, :)   !< (dim, n) [m], in the axes of the body
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: first
    type(c_error) :: what

    if (.not. has_size("material", size(material), size(body), error)) return
    if (.not. has_size("hull", size(hull), size(body), error)) return
    if (present(offset)) then
      if (.not. has_size("offset", size(offset), scene%dim*size(body), error)) return
    end if
    call report_back(c_scene_add_hull_contactors(scene%handle, c_text(shape), size(body, kind=c_int64_t), body, &
                                                 int(material, c_int32_t), int(hull, c_int32_t), offset, first, what), what, error)
  end subroutine add_hull_contactors

  !> A surface of triangles on a body, solid behind.
  subroutine add_surface(scene, body, material, vertex, triangle, error)
    type(cairn_scene), intent(in) :: scene
    integer(c_int64_t), intent(in) :: body                       !< id
    integer, intent(in) :: material
    real(dp), intent(in), contiguous :: vertex(:, :)             !< (3, v) [m], from its centre, in its axes
    integer, intent(in), contiguous :: triangle(:, :)            !< (3, m) from 0, anticlockwise from the free side
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("vertex", size(vertex), 3*size(vertex, 2), error)) return
    if (.not. has_size("triangle", size(triangle), 3*size(triangle, 2), error)) return
    call report_back(c_scene_add_surface(scene%handle, body, int(material, c_int32_t), size(vertex, 2, c_int64_t), vertex, &
                                         size(triangle, 2, c_int64_t), int(triangle, c_int32_t), what), what, error)
  end subroutine add_surface

  !> Joins body a to body b, or to the world without it, as they stand: "Ball", "Hinge", "Pivot", "Fixed", "Slider", "Distance",
  !> "Cable". names: "strength", "lowest", "highest", "stiffness", "damping", "rest", "speed", "effort"; of a Cable "length" and
  !> "pulley", an id; as cairn/cairn.h has them.
  subroutine add_joint(scene, kind, a, point, b, axis, names, values, ends, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: kind
    integer(c_int64_t), intent(in) :: a                          !< id
    real(dp), intent(in), contiguous :: point(:, :)              !< (dim, 1) [m], absolute; of a Distance (dim, 2), on a and b; of a
    !< Cable (dim, 3), on a, at its pulley and on b
    integer(c_int64_t), intent(in), optional :: b                !< id
    real(dp), intent(in), contiguous, optional :: axis(:)        !< (dim), of a Hinge or a Slider
    character(*), intent(in), optional :: names(:)               !< of numbers that the joint has
    real(dp), intent(in), contiguous, optional :: values(:)      !< as many
    integer(c_int64_t), intent(out), optional :: ends(2)         !< ids of its contactors, that "key" of contacts names
    type(cairn_error), intent(out), optional :: error

    call give_joint(c_scene_add_joint, scene%handle, scene%dim, kind, a, point, b, axis, names, values, ends, error)
  end subroutine add_joint

  !> Offset of each in the joined array, counted from 0, with the end of the last.
  pure function starts(numbers)
    integer, intent(in) :: numbers(:)
    integer(c_int64_t) :: starts(size(numbers) + 1)
    integer :: i

    starts(1) = 0
    do i = 1, size(numbers)
      starts(i + 1) = starts(i) + numbers(i)
    end do
  end function starts

  logical function contactor_sizes(dim, n, material, radius, offset, direction, error) result(right)
    integer, intent(in) :: dim, n, material(:)
    real(dp), intent(in), optional :: radius(:), offset(:, :), direction(:, :)
    type(cairn_error), intent(out), optional :: error

    right = has_size("material", size(material), n, error)
    if (right .and. present(radius)) right = has_size("radius", size(radius), n, error)
    if (right .and. present(offset)) right = has_size("offset", size(offset), dim*n, error)
    if (right .and. present(direction)) right = has_size("direction", size(direction), (dim + 1)*n, error)
  end function contactor_sizes
end module cairn_scenes
