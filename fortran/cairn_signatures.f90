!> Interfaces shared by similar routines of the C API, and wrappers that call these: for scenes and simulations, for numbers,
!> texts and fields by their names. Programs use the module cairn.
module cairn_signatures
  use, intrinsic :: iso_c_binding
  use cairn_calls
  implicit none
  private
  public :: destroyer, counter, gravity_setter, bodies_adder, driver, field_setter, field_reader, number_reader, text_reader
  public :: joint_adder, give_joint
  public :: give_gravity, give_bodies, give_drive, give_field, read_field, number_of, text_of

  abstract interface
    subroutine destroyer(handle) bind(c)
      import
      type(c_ptr), value :: handle
    end subroutine
    integer(c_int64_t) function counter(handle) bind(c)
      import
      type(c_ptr), value :: handle
    end function
    integer(c_int32_t) function gravity_setter(handle, gravity, error) bind(c)
      import
      type(c_ptr), value :: handle
      real(c_double), intent(in) :: gravity(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function bodies_adder(handle, n, position, rotation, velocity, mass, inertia, first, error) bind(c)
      import
      type(c_ptr), value :: handle
      integer(c_int64_t), value :: n
      real(c_double), intent(in) :: position(*), mass(*), inertia(*)
      real(c_double), intent(in), optional :: rotation(*), velocity(*)
      integer(c_int64_t), intent(out) :: first
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function driver(handle, n, bodies, mask, velocity, error) bind(c)
      import
      type(c_ptr), value :: handle
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(*)
      integer(c_int8_t), value :: mask
      real(c_double), intent(in), optional :: velocity(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function field_setter(handle, name, n, bodies, values, error) bind(c)
      import
      type(c_ptr), value :: handle
      character(c_char), intent(in) :: name(*)
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in), optional :: bodies(*)
      real(c_double), intent(in) :: values(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function field_reader(handle, name, capacity, values, count, error) bind(c)
      import
      type(c_ptr), value :: handle
      character(c_char), intent(in) :: name(*)
      integer(c_int64_t), value :: capacity
      real(c_double), intent(inout) :: values(*)
      integer(c_int64_t), intent(out) :: count
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function number_reader(handle, name, value, error) bind(c)
      import
      type(c_ptr), value :: handle
      character(c_char), intent(in) :: name(*)
      real(c_double), intent(out) :: value
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function text_reader(handle, name, capacity, text, error) bind(c)
      import
      type(c_ptr), value :: handle
      character(c_char), intent(in) :: name(*)
      integer(c_int64_t), value :: capacity
      character(c_char), intent(inout) :: text(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function joint_adder(to, kind, a, b, point, axis, count, names, values, ends, error) bind(c)
      import
      type(c_ptr), value :: to
      character(c_char), intent(in) :: kind(*)
      integer(c_int64_t), value :: a, b
      real(c_double), intent(in) :: point(*)
      real(c_double), intent(in), optional :: axis(*)
      integer(c_int32_t), value :: count
      type(c_ptr), intent(in) :: names(*)
      real(c_double), intent(in) :: values(*)
      integer(c_int64_t), intent(out) :: ends(*)
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  subroutine give_gravity(to, handle, dim, gravity, error)
    procedure(gravity_setter) :: to
    type(c_ptr), intent(in) :: handle
    integer, intent(in) :: dim
    real(dp), intent(in) :: gravity(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("gravity", size(gravity), dim, error)) return
    call report_back(to(handle, gravity, what), what, error)
  end subroutine give_gravity

  subroutine give_bodies(to, handle, dim, position, mass, inertia, first, rotation, velocity, error)
    procedure(bodies_adder) :: to
    type(c_ptr), intent(in) :: handle
    integer, intent(in) :: dim
    real(dp), intent(in), contiguous :: position(:, :), inertia(:, :)
    real(dp), intent(in) :: mass(:)
    integer(c_int64_t), intent(out) :: first
    real(dp), intent(in), contiguous, optional :: rotation(:, :), velocity(:, :)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    first = -1
    if (.not. body_sizes(dim, position, mass, inertia, rotation, velocity, error)) return
    call report_back(to(handle, size(mass, kind=c_int64_t), position, rotation, velocity, mass, inertia, first, what), what, error)
  end subroutine give_bodies

  subroutine give_drive(to, handle, dim, body, driven, velocity, error)
    procedure(driver) :: to
    type(c_ptr), intent(in) :: handle
    integer, intent(in) :: dim
    integer(c_int64_t), intent(in) :: body(:)
    logical, intent(in) :: driven(:)
    real(dp), intent(in), contiguous, optional :: velocity(:, :)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. drive_sizes(dim, size(body), driven, velocity, error)) return
    call report_back(to(handle, size(body, kind=c_int64_t), body, mask_of(driven), velocity, what), what, error)
  end subroutine give_drive

  subroutine give_field(to, handle, dim, name, values, body, error)
    procedure(field_setter) :: to
    type(c_ptr), intent(in) :: handle
    integer, intent(in) :: dim
    character(*), intent(in) :: name
    real(dp), intent(in), contiguous :: values(:, :)
    integer(c_int64_t), intent(in), contiguous, optional :: body(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. field_fits(dim, name, values, body, error)) return
    call report_back(to(handle, c_text(name), size(values, 2, c_int64_t), body, values, what), what, error)
  end subroutine give_field

  !> (components, n), asked for their number first.
  subroutine read_field(from, handle, name, n, values, error)
    procedure(field_reader) :: from
    type(c_ptr), intent(in) :: handle
    character(*), intent(in) :: name
    integer(c_int64_t), intent(in) :: n
    real(dp), allocatable, intent(out) :: values(:, :)
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: numbers, written
    integer(c_int32_t) :: code
    real(dp) :: nothing(1)
    type(c_error) :: what

    numbers = 0
    code = from(handle, c_text(name), -1_c_int64_t, nothing, numbers, what)
    allocate (values(numbers/max(n, 1_c_int64_t), n))
    if (code == 0 .and. numbers > 0) code = from(handle, c_text(name), numbers, values, written, what)
    call report_back(code, what, error)
  end subroutine read_field

  real(dp) function number_of(from, handle, name, error) result(value)
    procedure(number_reader) :: from
    type(c_ptr), intent(in) :: handle
    character(*), intent(in) :: name
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    value = 0
    call report_back(from(handle, c_text(name), value, what), what, error)
  end function number_of

  function text_of(from, handle, name, error) result(text)
    procedure(text_reader) :: from
    type(c_ptr), intent(in) :: handle
    character(*), intent(in) :: name
    type(cairn_error), intent(out), optional :: error
    character(:), allocatable :: text
    character(c_char) :: room(1024)
    type(c_error) :: what

    room = c_null_char
    call report_back(from(handle, c_text(name), size(room, kind=c_int64_t), room, what), what, error)
    text = from_c(room)
  end function text_of

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

  logical function field_fits(dim, name, values, body, error) result(right)
    integer, intent(in) :: dim
    character(*), intent(in) :: name
    real(dp), intent(in) :: values(:, :)
    integer(c_int64_t), intent(in), optional :: body(:)
    type(cairn_error), intent(out), optional :: error
    integer :: components

    right = .true.
    select case (name)
    case ("position")
      components = dim
    case ("rotation")
      components = merge(1, 4, dim == 2)
    case ("velocity", "force")
      components = merge(3, 6, dim == 2)
    case default
      components = 1
    end select
    right = has_size("values", size(values), components*size(values, 2), error)
    if (right .and. present(body)) right = has_size("body", size(body), size(values, 2), error)
  end function field_fits

  logical function body_sizes(dim, position, mass, inertia, rotation, velocity, error) result(right)
    integer, intent(in) :: dim
    real(dp), intent(in) :: position(:, :), mass(:), inertia(:, :)
    real(dp), intent(in), optional :: rotation(:, :), velocity(:, :)
    type(cairn_error), intent(out), optional :: error
    integer :: n, turns, axes

    n = size(mass)
    turns = merge(1, 4, dim == 2)
    axes = merge(1, 3, dim == 2)
    right = has_size("position", size(position), dim*n, error)
    if (right) right = has_size("inertia", size(inertia), axes*n, error)
    if (right .and. present(rotation)) right = has_size("rotation", size(rotation), turns*n, error)
    if (right .and. present(velocity)) right = has_size("velocity", size(velocity), (dim + axes)*n, error)
  end function body_sizes

  subroutine give_joint(to, handle, dim, kind, a, point, b, axis, names, values, ends, error)
    procedure(joint_adder) :: to
    type(c_ptr), intent(in) :: handle
    integer, intent(in) :: dim
    character(*), intent(in) :: kind
    integer(c_int64_t), intent(in) :: a
    real(dp), intent(in), contiguous :: point(:, :)
    integer(c_int64_t), intent(in), optional :: b
    real(dp), intent(in), contiguous, optional :: axis(:), values(:)
    character(*), intent(in), optional :: names(:)
    integer(c_int64_t), intent(out), optional :: ends(2)
    type(cairn_error), intent(out), optional :: error
    character(c_char), allocatable, target :: text(:, :)
    type(c_ptr), allocatable :: start(:)
    real(dp), allocatable :: number(:)
    character(:), allocatable :: word
    integer(c_int64_t) :: other, made(2)
    integer :: n, i, k
    type(c_error) :: what

    if (present(ends)) ends = -1
    n = 0
    if (present(names)) n = size(names)
    if (.not. has_size("point", size(point), dim*merge(3, merge(2, 1, kind == "Distance"), kind == "Cable"), error)) return
    if (present(axis)) then
      if (.not. has_size("axis", size(axis), dim, error)) return
    end if
    allocate (number(0))
    if (present(values)) number = values
    if (.not. has_size("values", size(number), n, error)) return
    other = -1
    if (present(b)) other = b
    allocate (start(n))
    if (present(names)) then
      allocate (text(len(names) + 1, n), source=c_null_char)
      do i = 1, n
        word = c_text(names(i))
        do k = 1, len(word)
          text(k, i) = word(k:k)
        end do
        start(i) = c_loc(text(1, i))
      end do
    end if
    made = -1
    call report_back(to(handle, c_text(kind), a, other, point, axis, int(n, c_int32_t), start, number, made, what), what, error)
    if (present(ends)) ends = made
  end subroutine give_joint
end module cairn_signatures
