!> Drives, servo walls and cells by functions of time as text, and probes, for Fortran. Programs use the module cairn; cairn.h
!> lists the functions of an expression.
module cairn_controls
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: drive_bodies_by, set_servo, grow_bodies, drive_cell, press_cell, weigh_cell, cell_state, add_probe, read_probe

  interface
    integer(c_int32_t) function c_drive_by(simulation, n, bodies, dof, velocity, error) &
        bind(c, name="cairn_simulation_drive_by")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(*)
      character(c_char), intent(in) :: dof(*), velocity(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_servo(simulation, body, normal, stress, area, depth, error) &
        bind(c, name="cairn_simulation_set_servo")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), value :: body
      real(c_double), intent(in) :: normal(*)
      character(c_char), intent(in) :: stress(*), area(*)
      real(c_double), value :: depth
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_grow(simulation, n, bodies, rate, error) bind(c, name="cairn_simulation_grow")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(*)
      character(c_char), intent(in), optional :: rate(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_drive_cell(simulation, component, rate, error) bind(c, name="cairn_simulation_drive_cell")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: component(*), rate(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_press_cell(simulation, component, stress, error) bind(c, name="cairn_simulation_press_cell")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: component(*), stress(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_weigh_cell(simulation, inertia, depth, keeps_volume, error) &
        bind(c, name="cairn_simulation_weigh_cell")
      import
      type(c_ptr), value :: simulation
      real(c_double), value :: inertia, depth
      integer(c_int32_t), value :: keeps_volume
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_cell(simulation, vectors, rate, stress, error) bind(c, name="cairn_simulation_cell")
      import
      type(c_ptr), value :: simulation
      real(c_double), intent(out) :: vectors(*), rate(*), stress(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_add_probe(simulation, quantity, n, bodies, take, every, probe, error) &
        bind(c, name="cairn_simulation_add_probe")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: quantity(*), take(*)
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(*)
      integer(c_int32_t), value :: every
      integer(c_int32_t), intent(out) :: probe
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_read_probe(simulation, probe, capacity, times, values, n, error) &
        bind(c, name="cairn_simulation_read_probe")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: probe
      integer(c_int64_t), value :: capacity
      real(c_double), intent(inout) :: times(*), values(*)
      integer(c_int64_t), intent(inout) :: n
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> Velocity of a dof of bodies as a function of time [m/s, rad/s].
  subroutine drive_bodies_by(simulation, bodies, dof, velocity, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in), contiguous :: bodies(:)      !< their numbers
    character(*), intent(in) :: dof                              !< "vx", "vy", "w"; in 3D "vx" to "vz", "wx" to "wz"
    character(*), intent(in) :: velocity                         !< "0.1*sin(2*pi*t)"
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_drive_by(simulation%handle, size(bodies, kind=c_int64_t), bodies, c_text(dof), c_text(velocity), what), &
                     what, error)
  end subroutine drive_bodies_by

  !> Force of a body, that of a stress on an area along a normal out of the solid.
  subroutine set_servo(simulation, body, normal, stress, area, depth, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in) :: body
    real(dp), intent(in), contiguous :: normal(:)                !< (dim)
    character(*), intent(in) :: stress                           !< of time [Pa]
    character(*), intent(in), optional :: area                   !< "grains", "walls", or of time [m2]; "grains" without
    real(dp), intent(in), optional :: depth                      !< in 2D [m]; 1 without
    type(cairn_error), intent(out), optional :: error
    character(:), allocatable :: kind
    real(dp) :: thick
    type(c_error) :: what

    if (.not. has_size("normal", size(normal), simulation%dim, error)) return
    kind = "grains"
    if (present(area)) kind = area
    thick = 1
    if (present(depth)) thick = depth
    call report_back(c_set_servo(simulation%handle, body, normal, c_text(stress), c_text(kind), thick, what), what, error)
  end subroutine set_servo

  !> Sizes of bodies grow by d(ln size)/dt = rate [1/s], shapes and densities kept; without a rate no more.
  subroutine grow_bodies(simulation, bodies, rate, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in), contiguous :: bodies(:)      !< their numbers
    character(*), intent(in), optional :: rate                   !< of time [1/s]
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: code
    type(c_error) :: what

    if (present(rate)) then
      code = c_grow(simulation%handle, size(bodies, kind=c_int64_t), bodies, c_text(rate), what)
    else
      code = c_grow(simulation%handle, size(bodies, kind=c_int64_t), bodies, error=what)
    end if
    call report_back(code, what, error)
  end subroutine grow_bodies

  !> Component "xx", "yy", "zz", "xy", "xz" or "yz" of the velocity gradient of the periodic cell [1/s].
  subroutine drive_cell(simulation, component, rate, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: component, rate
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_drive_cell(simulation%handle, c_text(component), c_text(rate), what), what, error)
  end subroutine drive_cell

  !> The same of the stress of contacts that the cell follows, compression positive [Pa].
  subroutine press_cell(simulation, component, stress, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: component, stress
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_press_cell(simulation%handle, c_text(component), c_text(stress), what), what, error)
  end subroutine press_cell

  !> Inertia of the cell over the mass of the bodies, thickness in 2D [m], whether lengths that nothing drives keep the volume.
  subroutine weigh_cell(simulation, inertia, depth, keeps_volume, error)
    type(cairn_simulation), intent(in) :: simulation
    real(dp), intent(in) :: inertia, depth
    logical, intent(in), optional :: keeps_volume
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: keeps
    type(c_error) :: what

    keeps = 0
    if (present(keeps_volume)) keeps = merge(1, 0, keeps_volume)
    call report_back(c_weigh_cell(simulation%handle, inertia, depth, keeps, what), what, error)
  end subroutine weigh_cell

  !> Cell vectors by columns [m], velocity gradient [1/s], stress of a driven cell in the last step [Pa], (dim, dim) each.
  subroutine cell_state(simulation, vectors, rate, stress, error)
    type(cairn_simulation), intent(in) :: simulation
    real(dp), allocatable, intent(out) :: vectors(:, :), rate(:, :), stress(:, :)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    allocate (vectors(simulation%dim, simulation%dim), rate(simulation%dim, simulation%dim), &
              stress(simulation%dim, simulation%dim))
    call report_back(c_cell(simulation%handle, vectors, rate, stress, what), what, error)
  end subroutine cell_state

  !> A number that is kept every so many steps: "position.z", "contact_force.x", "energy.kinetic", ...; see cairn.h.
  integer(c_int32_t) function add_probe(simulation, quantity, bodies, take, every, error) result(probe)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: quantity
    integer(c_int64_t), intent(in), contiguous :: bodies(:)      !< none: all
    character(*), intent(in), optional :: take                   !< "mean", "sum", "min" or "max"; "mean" without
    integer, intent(in), optional :: every                       !< steps; 1 without
    type(cairn_error), intent(out), optional :: error
    character(:), allocatable :: kind
    integer(c_int32_t) :: steps
    type(c_error) :: what

    kind = "mean"
    if (present(take)) kind = take
    steps = 1
    if (present(every)) steps = int(every, c_int32_t)
    probe = -1
    call report_back(c_add_probe(simulation%handle, c_text(quantity), size(bodies, kind=c_int64_t), bodies, c_text(kind), &
                                 steps, probe, what), what, error)
  end function add_probe

  !> Times [s] and values of a probe until now.
  subroutine read_probe(simulation, probe, times, values, error)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int32_t), intent(in) :: probe
    real(dp), allocatable, intent(out) :: times(:), values(:)
    type(cairn_error), intent(out), optional :: error
    integer(c_int64_t) :: n, rows
    integer(c_int32_t) :: code
    type(c_error) :: what

    n = 0
    allocate (times(0), values(0))
    code = c_read_probe(simulation%handle, probe, 0_c_int64_t, times, values, n, what)
    if (code == 0 .and. n > 0) then
      deallocate (times, values)
      rows = n
      allocate (times(rows), values(rows))
      code = c_read_probe(simulation%handle, probe, rows, times, values, n, what)
    end if
    call report_back(code, what, error)
  end subroutine read_probe
end module cairn_controls
