!> A Fortran program on its own: three spheres on a floor that a current warms through their spots; films break, a run goes on.
program heater
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0)
  real(dp), parameter :: h = 1e-3_dp, weak = 1e-3_dp, strong = 4e-3_dp
  character(*), parameter :: file = "heater.checkpoint.h5"
  type(cairn_simulation) :: simulation
  type(cairn_error) :: error
  real(dp), allocatable :: conductance(:, :), temperature(:, :), again(:, :), current(:, :)
  real(dp) :: infinite, broken
  integer :: flow, step, status

  infinite = ieee_value(1.0_dp, ieee_positive_inf)
  call pile(simulation, weak)
  call add_network(simulation, "magnetic", error)
  call expect(error%code /= 0 .and. index(error%message, "magnetic") > 0, "a network that there is not is refused by name")
  call add_wires(simulation, "thermal", reshape([0_c_int64_t, 1_c_int64_t], [2, 1]), [1.0_dp, 2.0_dp], error)
  call expect(error%code /= 0, "two conductances of one wire are refused")
  do step = 1, 5
    call step_simulation(simulation, h)
  end do
  call contact_field(simulation, "electrical_conductance", conductance)
  call expect(size(conductance) == 3 .and. all(abs(conductance - 1e-3_dp) < 1e-5_dp), "films hold")
  call set_network_source(simulation, "electrical", flow, [-strong, strong])
  do step = 1, 2
    call step_simulation(simulation, h)
  end do
  call contact_field(simulation, "electrical_conductance", conductance)
  call contact_field(simulation, "current", current)
  call expect(all(conductance > 1e-2_dp), "films are gone")
  call expect(all(abs(abs(current) - strong) < 1e-14_dp), "all of the current goes through each spot")
  broken = network_report(simulation, "electrical", "supplied")
  call expect(abs(network_report(simulation, "thermal", "joule") - broken) < 1e-12_dp*broken, "what is supplied is heat")
  call write_checkpoint(simulation, file)
  call go_on(temperature)
  call destroy_simulation(simulation)

  call pile(simulation, strong)
  call restart_simulation(simulation, file)
  call go_on(again)
  call expect(all(again == temperature), "a restart ends in the same bits")
  call expect(temperature(1, 2) > 293.15_dp, "spheres are warm")
  call expect(abs(network_report(simulation, "thermal", "balance")) <= 1e-12_dp*network_report(simulation, "thermal", "in_play"), &
    "heat closes")
  call destroy_simulation(simulation)
  open (unit=10, file=file, iostat=status)
  if (status == 0) close (10, status="delete")
  print "(a)", "the current warms the pile"
contains
  subroutine go_on(end)
    real(dp), allocatable, intent(out) :: end(:, :) !< temperatures [K]

    do step = 1, 10
      call step_simulation(simulation, h)
    end do
    call body_field(simulation, "temperature", end)
  end subroutine go_on

  !> A floor, three spheres on each other, both networks.
  subroutine pile(made, amperes)
    type(cairn_simulation), intent(out) :: made
    real(dp), intent(in) :: amperes !< down from the highest
    type(cairn_scene) :: scene
    integer(c_int64_t) :: floor_id, grains
    integer :: rock, k

    call create_scene(scene, 3)
    call set_gravity(scene, [0.0_dp, 0.0_dp, -9.81_dp])
    call add_material(scene, "rock", rock)
    call set_law(scene, rock, rock, "Coulomb", [0.5_dp])
    call add_bodies(scene, reshape([0.0_dp, 0.0_dp, 0.0_dp], [3, 1]), [infinite], reshape([(infinite, k=1, 3)], [3, 1]), floor_id)
    call add_contactors(scene, "plane", [floor_id], [rock], direction=reshape([0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp], [4, 1]))
    call add_bodies(scene, reshape([(0.0_dp, 0.0_dp, k - 0.5_dp, k=1, 3)], [3, 3]), [1.0_dp, 1.0_dp, 1.0_dp], &
                    reshape([(0.1_dp, k=1, 9)], [3, 3]), grains)
    call add_contactors(scene, "sphere", [grains, grains + 1, grains + 2], [rock, rock, rock], radius=[(0.5_dp, k=1, 3)])
    call create_simulation(made, scene)
    call destroy_scene(scene)
    call conduct(made, "electrical", rock)
    call conduct(made, "thermal", rock)
    call set_network_material(made, "thermal", rock, "capacity", 10.0_dp)
    call set_network(made, "thermal", "joule", 1.0_dp)
    call set_film(made, 1e-3_dp, 1e-2_dp, 0.0_dp, infinite)
    call add_network_source(made, "electrical", "flow", [floor_id, grains + 2], [-amperes, amperes], flow)
  end subroutine pile

  subroutine conduct(made, kind, rock)
    type(cairn_simulation), intent(in) :: made
    character(*), intent(in) :: kind !< of the network
    integer, intent(in) :: rock      !< material
    real(dp) :: none(0)

    call add_network(made, kind)
    call add_conductance(made, kind, "Holm", none)
    call set_network_material(made, kind, rock, "conductivity", 40.0_dp)
    call set_network_material(made, kind, rock, "young", 1e9_dp)
    call set_network_material(made, kind, rock, "poisson", 0.25_dp)
  end subroutine conduct

  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program heater
