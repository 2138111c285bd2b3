!> Networks of heat and current of Cairn for Fortran. Programs use the module cairn.
module cairn_networks
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: add_network, set_network, set_network_material, add_conductance, set_film, add_network_source
  public :: set_network_source, add_wires, set_temperature, network_report

  interface
    integer(c_int32_t) function c_add_network(simulation, kind, error) bind(c, name="cairn_simulation_add_network")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: kind(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_network(simulation, kind, name, value, error) bind(c, name="cairn_simulation_set_network")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: kind(*), name(*)
      real(c_double), value :: value
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_network_material(simulation, kind, material, name, value, error) &
        bind(c, name="cairn_simulation_set_network_material")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: kind(*), name(*)
      integer(c_int32_t), value :: material
      real(c_double), value :: value
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_add_conductance(simulation, kind, name, parameters, parameter, error) &
        bind(c, name="cairn_simulation_add_conductance")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: kind(*), name(*)
      integer(c_int32_t), value :: parameters
      real(c_double), intent(in) :: parameter(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_film(simulation, conductance, power, ratio, sliding, error) &
        bind(c, name="cairn_simulation_set_film")
      import
      type(c_ptr), value :: simulation
      real(c_double), value :: conductance, power, ratio, sliding
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_add_network_source(simulation, kind, what, n, bodies, value, coefficient, electrode, &
        source, error) bind(c, name="cairn_simulation_add_network_source")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: kind(*), what(*)
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(*)
      real(c_double), intent(in) :: value(*)
      real(c_double), intent(in), optional :: coefficient(*)
      integer(c_int32_t), value :: electrode
      integer(c_int32_t), intent(out) :: source
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_network_source(simulation, kind, source, n, value, error) &
        bind(c, name="cairn_simulation_set_network_source")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: kind(*)
      integer(c_int32_t), value :: source
      integer(c_int64_t), value :: n
      real(c_double), intent(in) :: value(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_add_wires(simulation, kind, n, bodies, conductance, error) &
        bind(c, name="cairn_simulation_add_wires")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: kind(*)
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: bodies(2, *)
      real(c_double), intent(in) :: conductance(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_set_temperature(simulation, n, bodies, temperature, error) &
        bind(c, name="cairn_simulation_set_temperature")
      import
      type(c_ptr), value :: simulation
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in), optional :: bodies(*)
      real(c_double), intent(in) :: temperature(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_network_report(simulation, kind, name, value, error) &
        bind(c, name="cairn_simulation_network_report")
      import
      type(c_ptr), value :: simulation
      character(c_char), intent(in) :: kind(*), name(*)
      real(c_double), intent(out) :: value
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> kind: "electrical" or "thermal". A network has nothing at first.
  subroutine add_network(simulation, kind, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: kind
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_add_network(simulation%handle, c_text(kind), what), what, error)
  end subroutine add_network

  subroutine set_network(simulation, kind, name, value, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: kind, name !< see cairn/cairn.h
    real(dp), intent(in) :: value
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_set_network(simulation%handle, c_text(kind), c_text(name), value, what), what, error)
  end subroutine set_network

  subroutine set_network_material(simulation, kind, material, name, value, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: kind, name !< of a property
    integer, intent(in) :: material        !< its number
    real(dp), intent(in) :: value
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_set_network_material(simulation%handle, c_text(kind), int(material, c_int32_t), c_text(name), value, &
      what), what, error)
  end subroutine set_network_material

  subroutine add_conductance(simulation, kind, name, parameter, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: kind, name             !< of a row of networks.def
    real(dp), intent(in), contiguous :: parameter(:)   !< in the order of that list
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_add_conductance(simulation%handle, c_text(kind), c_text(name), int(size(parameter), c_int32_t), &
      parameter, what), what, error)
  end subroutine add_conductance

  subroutine set_film(simulation, conductance, power, ratio, sliding, error)
    type(cairn_simulation), intent(in) :: simulation
    real(dp), intent(in) :: conductance, power, ratio, sliding !< [S], [W], [1/s], [m/s]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_set_film(simulation%handle, conductance, power, ratio, sliding, what), what, error)
  end subroutine set_film

  subroutine add_network_source(simulation, kind, what_it_is, bodies, value, source, coefficient, electrode, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: kind, what_it_is                  !< held, flow, convection, radiation
    integer(c_int64_t), intent(in), contiguous :: bodies(:)       !< ids
    real(dp), intent(in), contiguous :: value(:)                  !< [V | K], [A | W], outside [K]
    integer, intent(out), optional :: source                      !< its number
    real(dp), intent(in), contiguous, optional :: coefficient(:)  !< h A [W/K], epsilon A [m2]
    logical, intent(in), optional :: electrode                    !< the bodies are one conductor
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: one, number
    type(c_error) :: what

    if (.not. has_size("value", size(value), size(bodies), error)) return
    if (present(coefficient)) then
      if (.not. has_size("coefficient", size(coefficient), size(bodies), error)) return
    end if
    one = 0
    if (present(electrode)) one = merge(1_c_int32_t, 0_c_int32_t, electrode)
    number = -1
    call report_back(c_add_network_source(simulation%handle, c_text(kind), c_text(what_it_is), size(bodies, kind=c_int64_t), &
      bodies, value, coefficient, one, number, what), what, error)
    if (present(source)) source = number
  end subroutine add_network_source

  subroutine set_network_source(simulation, kind, source, value, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: kind
    integer, intent(in) :: source !< its number
    real(dp), intent(in), contiguous :: value(:)
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_set_network_source(simulation%handle, c_text(kind), int(source, c_int32_t), &
      size(value, kind=c_int64_t), value, what), what, error)
  end subroutine set_network_source

  subroutine add_wires(simulation, kind, bodies, conductance, error)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: kind
    integer(c_int64_t), intent(in), contiguous :: bodies(:, :) !< ids (2, n)
    real(dp), intent(in), contiguous :: conductance(:)         !< [S | W/K]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("bodies", size(bodies), 2*size(conductance), error)) return
    call report_back(c_add_wires(simulation%handle, c_text(kind), size(conductance, kind=c_int64_t), bodies, conductance, &
      what), what, error)
  end subroutine add_wires

  !> Sets temperatures of all bodies in order of insertion, or of the given ones.
  subroutine set_temperature(simulation, temperature, bodies, error)
    type(cairn_simulation), intent(in) :: simulation
    real(dp), intent(in), contiguous :: temperature(:)                !< [K]
    integer(c_int64_t), intent(in), contiguous, optional :: bodies(:) !< ids
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (present(bodies)) then
      if (.not. has_size("bodies", size(bodies), size(temperature), error)) return
    end if
    call report_back(c_set_temperature(simulation%handle, size(temperature, kind=c_int64_t), bodies, temperature, what), &
      what, error)
  end subroutine set_temperature

  real(dp) function network_report(simulation, kind, name, error) result(value)
    type(cairn_simulation), intent(in) :: simulation
    character(*), intent(in) :: kind, name !< see cairn/cairn.h
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    value = 0
    call report_back(c_network_report(simulation%handle, c_text(kind), c_text(name), value, what), what, error)
  end function network_report
end module cairn_networks
