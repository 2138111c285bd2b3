!> A Fortran program on its own: an elastic arch on two rigid blocks settles under its weight and rests; the blocks carry it.
program arch
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0), along = 24, across = 2
  real(dp), parameter :: h = 1e-3_dp, inner = 1, thick = 0.2_dp, density = 2500, g = 9.81_dp, pi = acos(-1.0_dp)
  type(cairn_scene) :: scene
  type(cairn_mesh) :: mesh
  type(cairn_simulation) :: simulation, again
  type(cairn_run_writer) :: writer
  type(cairn_run) :: run
  character(*), parameter :: run_file = "arch.vtkhdf", saved = "arch.checkpoint.h5"
  type(cairn_error) :: error
  real(dp) :: infinite, node(2, (along + 1)*(across + 1)), radius, turn, weight
  real(dp), allocatable :: here(:, :), there(:, :), stored(:), times(:), impulse(:, :), gap(:, :), velocity(:, :), moved(:, :)
  integer :: cell(4, along*across), foot(2*(across + 1)), stone, hull, number, i, j, k, step
  integer(c_int64_t) :: blocks

  infinite = ieee_value(1.0_dp, ieee_positive_inf)
  call create_scene(scene, 2)
  call set_gravity(scene, [0.0_dp, -g])
  call add_material(scene, "stone", stone)
  call set_rule(scene, "*", "*", "Coulomb", [0.7_dp])
  call add_bodies(scene, reshape([-1.1_dp, -0.1_dp, 1.1_dp, -0.1_dp], [2, 2]), [infinite, infinite], &
                  reshape([infinite, infinite], [1, 2]), blocks)
  call add_polygons(scene, [4], reshape([-0.3_dp, -0.1_dp, 0.3_dp, -0.1_dp, 0.3_dp, 0.1_dp, -0.3_dp, 0.1_dp], [2, 4]), hull)
  call add_hull_contactors(scene, "polygon", [blocks, blocks + 1], [stone, stone], [hull, hull])

  ! rows of nodes from the inside to the outside, each from the right foot to the left one
  do j = 0, across
    do i = 0, along
      k = 1 + j*(along + 1) + i
      turn = pi*i/along
      radius = inner + thick*j/across
      node(:, k) = radius*[cos(turn), sin(turn)]
      if (i == 0 .or. i == along) node(2, k) = 0
      if (i == 0) foot(1 + j) = k - 1
      if (i == along) foot(across + 2 + j) = k - 1
    end do
  end do
  do j = 0, across - 1
    do i = 0, along - 1
      k = j*(along + 1) + i
      cell(:, 1 + j*along + i) = [k, k + along + 1, k + along + 2, k + 1]
    end do
  end do
  call create_mesh(mesh, node)
  call add_elastic_cells(mesh, "q4", cell(4:1:-1, :), 1e9_dp, 0.2_dp, density)
  call touch_nodes(mesh, foot)
  call add_mesh(scene, mesh, "arch", stone, number, error=error)
  call expect(error%code /= 0 .and. index(error%message, "inside out") > 0, "cells that are inside out are refused")
  call destroy_mesh(mesh)
  call create_mesh(mesh, node)
  call add_elastic_cells(mesh, "q4", cell, 1e9_dp, 0.2_dp, density)
  call set_damping(mesh, 0.0_dp, 1e-3_dp, .false.)
  call touch_nodes(mesh, foot)
  call add_mesh(scene, mesh, "arch", stone, number)
  call destroy_mesh(mesh)

  call start(simulation)
  call set_number(simulation, "tol", -1.0_dp, error)
  call expect(error%code /= 0 .and. index(error%message, "tol") > 0, "a tolerance below 0 is refused by name")
  call expect(option_text(simulation, "solver") == "auto", "options can be read")
  ! a run file with an output every 100 steps, and a checkpoint half way
  call create_run_writer(writer, simulation, run_file, cairn_replace)
  do step = 1, 400
    call step_simulation(simulation, h)
    call expect(report_text(simulation, "status") == "converged", "every step converges")
    call write_step(writer, simulation)
    if (mod(step, 100) == 0) call write_output(writer, simulation)
    if (step == 200) call write_checkpoint(simulation, saved)
  end do
  call close_run_writer(writer)

  ! another simulation of the scene goes on from the checkpoint to the same bits
  call start(again)
  call restart_simulation(again, saved)
  do step = 201, 400
    call step_simulation(again, h)
  end do
  call mesh_field(simulation, number, "position", here)
  call mesh_field(again, number, "position", there)
  call expect(all(here == there), "a restart goes on to the same bits: positions")
  call mesh_field(simulation, number, "velocity", here)
  call mesh_field(again, number, "velocity", there)
  call expect(all(here == there), "a restart goes on to the same bits: velocities")
  call destroy_simulation(again)
  call destroy_scene(scene)

  call open_run(run, run_file)
  call run_times(run, times)
  call expect(output_count(run) == 4 .and. abs(times(4) - 400*h) < 1e-9_dp, "the file holds four outputs")
  call run_node_field(run, 4, "position", stored)
  call mesh_field(simulation, number, "position", here)
  call expect(all(stored == reshape(here, [size(here)])), "the last of them is what there is now")
  call run_history(run, "energy_kinetic", stored)
  call expect(size(stored) == 400, "the history has a row for each step")
  call run_body_field(run, 1, "colour", stored, error)
  call expect(error%code == 4 .and. index(error%message, "position") > 0, "a field that is not there is refused by name")
  call close_run(run)
  call remove(run_file)
  call remove(saved)

  call contact_field(simulation, "impulse", impulse)
  call contact_field(simulation, "gap", gap)
  call mesh_field(simulation, number, "velocity", velocity)
  call mesh_field(simulation, number, "displacement", moved)
  ! straight sides between nodes: less than the ring
  weight = density*g*along/2*sin(pi/along)*((inner + thick)**2 - inner**2)
  call expect(size(gap, 2) == contact_count(simulation) .and. size(gap, 1) == 1, "gap is (1, contacts)")
  call expect(abs(sum(impulse(2, :))/(weight*h) - 1) < 1e-4_dp, "the blocks carry the weight")
  call expect(maxval(abs(velocity)) < 1e-4_dp, "the arch rests")
  call expect(moved(2, 1 + along/2) < 0, "its crown came down")
  call expect(energy_term(simulation, "stored") > 0, "it is strained")
  call expect(energy_term(simulation, "kinetic") < 1e-6_dp*energy_term(simulation, "stored"), "it has come to rest")
  call destroy_simulation(simulation)
  print "(a)", "the arch rests on its blocks"
contains
  !> A simulation of the scene.
  subroutine start(made)
    type(cairn_simulation), intent(out) :: made

    call create_simulation(made, scene)
    call set_option(made, "solver", "auto")
    call set_number(made, "tol", 1e-8_dp)
    call set_number(made, "theta", 1.0_dp)
  end subroutine start

  subroutine remove(path)
    character(*), intent(in) :: path
    integer :: unit

    open (newunit=unit, file=path)
    close (unit, status="delete")
  end subroutine remove

  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program arch
