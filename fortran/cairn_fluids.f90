!> A meshless liquid among the bodies of a scene, for Fortran: the calls of cairn/fluids.h. Programs use the module cairn.
module cairn_fluids
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_signatures
  use cairn_scenes, only: cairn_scene
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: cairn_fluid_settings, set_fluid, set_fluid_rule, add_fluid_points, add_inflow, add_outflow
  public :: particle_count, fluid_field, fluid_number, fluid_force, fluid_pressure, fluid_level

  !> Numbers of a liquid; a variable of this type starts with water of no viscosity, without a spacing.
  type, bind(c) :: cairn_fluid_settings
    real(c_double) :: spacing = 0              !< of the particles, to be given [m]
    real(c_double) :: density = 1000           !< at rest [kg/m3]
    real(c_double) :: viscosity = 0            !< dynamic [Pa s]
    real(c_double) :: sound_speed = 0          !< [m/s]; 0: found from the scene, incompressible: it does not give way
    real(c_double) :: surface_tension = 0      !< [N/m]
    real(c_double) :: smoothing = 1.5_dp       !< length of the kernel over the spacing, 1 to 3
    real(c_double) :: artificial = 0           !< viscosity of Monaghan [-]
    real(c_double) :: depth = 1                !< of a plane scene [m]
    integer(c_int32_t) :: incompressible = 0   !< 1: in the step of the contacts of NSCD
  end type

  procedure(field_reader), bind(c, name="cairn_simulation_fluid_field") :: c_fluid_field
  procedure(number_reader), bind(c, name="cairn_simulation_fluid_number") :: c_fluid_number
  procedure(counter), bind(c, name="cairn_simulation_particles") :: c_particles

  abstract interface
    integer(c_int32_t) function gauge(simulation, n, place, values, error) bind(c)
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), value :: n
      real(c_double), intent(in) :: place(*)
      real(c_double), intent(inout) :: values(*)
      type(c_error), intent(inout) :: error
    end function
  end interface
  procedure(gauge), bind(c, name="cairn_simulation_fluid_pressure") :: c_fluid_pressure
  procedure(gauge), bind(c, name="cairn_simulation_fluid_level") :: c_fluid_level

  interface
    integer(c_int32_t) function c_set_fluid(scene, settings, n, position, velocity, pressure, error) &
        bind(c, name="cairn_scene_set_fluid")
      import
      type(c_ptr), value :: scene
      type(cairn_fluid_settings), intent(in) :: settings
      integer(c_int64_t), value :: n
      real(c_double), intent(in) :: position(*)
      real(c_double), intent(in), optional :: velocity(*), pressure(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_fluid_rule(scene, name, rule, error) bind(c, name="cairn_scene_set_fluid_rule")
      import
      type(c_ptr), value :: scene
      character(c_char), intent(in) :: name(*), rule(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_add_points(scene, body, n, offset, normal, depth, volume, error) &
        bind(c, name="cairn_scene_add_fluid_points")
      import
      type(c_ptr), value :: scene
      integer(c_int64_t), value :: body, n
      real(c_double), intent(in) :: offset(*), normal(*), depth(*), volume(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_add_inflow(scene, low, high, axis, rows, speed, error) bind(c, name="cairn_scene_add_inflow")
      import
      type(c_ptr), value :: scene
      real(c_double), intent(in) :: low(*), high(*), speed(*)
      integer(c_int32_t), value :: axis
      integer(c_int64_t), value :: rows
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_add_outflow(scene, low, high, axis, sign, pressure, error) &
        bind(c, name="cairn_scene_add_outflow")
      import
      type(c_ptr), value :: scene
      real(c_double), intent(in) :: low(*), high(*)
      integer(c_int32_t), value :: axis, sign
      real(c_double), value :: pressure
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_fluid_force(simulation, body, force, error) bind(c, name="cairn_simulation_fluid_force")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), value :: body
      real(c_double), intent(inout) :: force(*)
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> The liquid of a scene, in place of the one that it had; without particles: none.
  subroutine set_fluid(scene, settings, position, velocity, pressure, error)
    type(cairn_scene), intent(in) :: scene
    type(cairn_fluid_settings), intent(in) :: settings
    real(dp), intent(in), contiguous :: position(:, :)           !< (dim, n), outside bodies and walls [m]
    real(dp), intent(in), contiguous, optional :: velocity(:, :) !< (dim, n) [m/s]; rest without
    real(dp), intent(in), contiguous, optional :: pressure(:)    !< (n) [Pa]; that of rest below the highest particle without
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("position", size(position), scene%dim*size(position, 2), error)) return
    if (present(velocity)) then
      if (.not. has_size("velocity", size(velocity), size(position), error)) return
    end if
    if (present(pressure)) then
      if (.not. has_size("pressure", size(pressure), size(position, 2), error)) return
    end if
    call report_back(c_set_fluid(scene%handle, settings, size(position, 2, c_int64_t), position, velocity, pressure, what), &
                     what, error)
  end subroutine set_fluid

  !> How the liquid meets a material or group, "*": all: "no_slip", "free_slip", "none", or the drag of grains "di_felice",
  !> "ergun", "gidaspow".
  subroutine set_fluid_rule(scene, name, rule, error)
    type(cairn_scene), intent(in) :: scene
    character(*), intent(in) :: name, rule
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_set_fluid_rule(scene%handle, c_text(name), c_text(rule), what), what, error)
  end subroutine set_fluid_rule

  !> Points below the surface of a body of any shape, in its axes; see cairn/fluids.h.
  subroutine add_fluid_points(scene, body, offset, normal, depth, volume, error)
    type(cairn_scene), intent(in) :: scene
    integer(c_int64_t), intent(in) :: body                       !< its number
    real(dp), intent(in), contiguous :: offset(:, :)             !< (dim, n) from the centre of mass [m]
    real(dp), intent(in), contiguous :: normal(:, :)             !< (dim, n) out of the body
    real(dp), intent(in), contiguous :: depth(:)                 !< (n) below the surface [m]
    real(dp), intent(in), contiguous :: volume(:)                !< (n) of each, in 2D area [m3 or m2]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("offset", size(offset), scene%dim*size(depth), error)) return
    if (.not. has_size("normal", size(normal), size(offset), error)) return
    if (.not. has_size("volume", size(volume), size(depth), error)) return
    call report_back(c_add_points(scene%handle, body, size(depth, kind=c_int64_t), offset, normal, depth, volume, what), &
                     what, error)
  end subroutine add_fluid_points

  !> A box out of which the liquid comes, at least as long as particles reach; see cairn/fluids.h.
  subroutine add_inflow(scene, low, high, axis, speed, error)
    type(cairn_scene), intent(in) :: scene
    real(dp), intent(in), contiguous :: low(:), high(:)          !< its lowest and highest corner (dim) [m]
    integer, intent(in) :: axis                                  !< along which it comes, from 1
    real(dp), intent(in), contiguous :: speed(:)                 !< of each row of particles, or one for all; < 0: down [m/s]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("low", size(low), scene%dim, error)) return
    if (.not. has_size("high", size(high), scene%dim, error)) return
    call report_back(c_add_inflow(scene%handle, low, high, int(axis - 1, c_int32_t), size(speed, kind=c_int64_t), speed, what), &
                     what, error)
  end subroutine add_inflow

  !> A box into which the liquid flows and is gone; see cairn/fluids.h.
  subroutine add_outflow(scene, low, high, axis, sign, pressure, error)
    type(cairn_scene), intent(in) :: scene
    real(dp), intent(in), contiguous :: low(:), high(:)          !< its lowest and highest corner (dim) [m]
    integer, intent(in) :: axis                                  !< along which it leaves, from 1
    integer, intent(in) :: sign                                  !< 1: up the axis, -1: down
    real(dp), intent(in) :: pressure                             !< in the box [Pa]; NaN: that of each particle goes on
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("low", size(low), scene%dim, error)) return
    if (.not. has_size("high", size(high), scene%dim, error)) return
    call report_back(c_add_outflow(scene%handle, low, high, int(axis - 1, c_int32_t), int(sign, c_int32_t), pressure, what), &
                     what, error)
  end subroutine add_outflow

  integer(c_int64_t) function particle_count(simulation)
    type(cairn_simulation), intent(in) :: simulation

    particle_count = c_particles(simulation%handle)
  end function particle_count

  !> Reads a field of the particles ("position", "velocity", "pressure", "density", "mass", "porosity", "open", "end").
  subroutine fluid_field(simulation, name, values, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    real(dp), allocatable, intent(out) :: values(:, :)           !< (components, n)
    type(cairn_error), intent(out), optional :: error

    call read_field(c_fluid_field, simulation%handle, name, particle_count(simulation), values, error)
  end subroutine fluid_field

  !> A number of the last step ("sub_steps", "volume", "compression", "residual", ...).
  real(dp) function fluid_number(simulation, name, error) result(value)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: name
    type(cairn_error), intent(out), optional :: error

    value = number_of(c_fluid_number, simulation%handle, name, error)
  end function fluid_number

  !> Mean force of the liquid on a body over the last step, and its torque about the centre of mass (3 | 6) [N, N m].
  function fluid_force(simulation, body, error) result(force)
    type(cairn_simulation), intent(in) :: simulation
    integer(c_int64_t), intent(in) :: body
    type(cairn_error), intent(out), optional :: error
    real(dp), allocatable :: force(:)
    type(c_error) :: what

    allocate (force(merge(3, 6, simulation%dim == 2)), source=0.0_dp)
    call report_back(c_fluid_force(simulation%handle, body, force, what), what, error)
  end function fluid_force

  !> Mean pressure about places, 0 outside the liquid [Pa].
  function fluid_pressure(simulation, place, error) result(pressure)
    type(cairn_simulation), intent(in) :: simulation
    real(dp), intent(in), contiguous :: place(:, :)              !< (dim, n) [m]
    type(cairn_error), intent(out), optional :: error
    real(dp) :: pressure(size(place, 2))

    pressure = 0
    call read_gauges(c_fluid_pressure, simulation, place, pressure, error)
  end function fluid_pressure

  !> Heights of the free surface above or below places, NaN where there is no liquid [m].
  function fluid_level(simulation, place, error) result(level)
    type(cairn_simulation), intent(in) :: simulation
    real(dp), intent(in), contiguous :: place(:, :)              !< (dim, n) [m]
    type(cairn_error), intent(out), optional :: error
    real(dp) :: level(size(place, 2))

    level = 0
    call read_gauges(c_fluid_level, simulation, place, level, error)
  end function fluid_level

  subroutine read_gauges(from, simulation, place, values, error)
    procedure(gauge) :: from
    type(cairn_simulation), intent(in) :: simulation
    real(dp), intent(in), contiguous :: place(:, :)
    real(dp), intent(inout) :: values(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("place", size(place), simulation%dim*size(values), error)) return
    call report_back(from(simulation%handle, size(values, kind=c_int64_t), place, values, what), what, error)
  end subroutine read_gauges
end module cairn_fluids
