!> A disk that floats in a basin of water: its height, the force of the water on it and on the floor, level and pressure.
program basin
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0)
  real(dp), parameter :: h = 2e-3_dp, spacing = 0.05_dp, radius = 0.12_dp, centre(2) = [0.5_dp, 0.4_dp], pi = acos(-1.0_dp)
  real(dp), parameter :: normals(2, 3) = reshape([0.0_dp, 1.0_dp, 1.0_dp, 0.0_dp, -1.0_dp, 0.0_dp], [2, 3])
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_fluid_settings) :: water
  real(dp), allocatable :: place(:, :), disk(:, :)
  real(dp) :: infinite, at(2), mass
  integer(c_int64_t) :: wall, floor_of_it, log
  integer :: wood, i, j, step

  infinite = ieee_value(1.0_dp, ieee_positive_inf)
  call create_scene(scene, 2)
  call set_gravity(scene, [0.0_dp, -9.81_dp])
  call add_material(scene, "wood", wood)
  call set_law(scene, wood, wood, "Coulomb", [0.4_dp])
  do i = 1, 3  ! the floor, and a wall at each side
    call add_bodies(scene, reshape([merge(1.0_dp, 0.0_dp, i == 3), 0.0_dp], [2, 1]), [infinite], reshape([infinite], [1, 1]), wall)
    call add_contactors(scene, "half_plane", [wall], [wood], direction=reshape([normals(:, i), 0.0_dp], [3, 1]))
    if (i == 1) floor_of_it = wall
  end do
  mass = 500*pi*radius**2
  call add_bodies(scene, reshape(centre, [2, 1]), [mass], reshape([0.5_dp*mass*radius**2], [1, 1]), log)
  call add_contactors(scene, "disk", [log], [wood], radius=[radius])

  allocate (place(2, 0))
  do i = 1, 20
    do j = 1, 8
      at = [(i - 0.5_dp)*spacing, (j - 0.5_dp)*spacing]
      if (norm2(at - centre) > radius + 0.25_dp*spacing) place = reshape([place, at], [2, size(place, 2) + 1])
    end do
  end do
  water%spacing = spacing
  water%viscosity = 1e-3_dp
  call set_fluid(scene, water, place)
  call set_fluid_rule(scene, "*", "free_slip")
  call create_simulation(simulation, scene)
  call destroy_scene(scene)
  do step = 1, 100
    call step_simulation(simulation, h)
  end do
  call body_field(simulation, "position", disk)
  print "(a, *(es24.16))", "height", disk(2, log + 1)
  print "(a, *(es24.16))", "disk", fluid_force(simulation, log)
  print "(a, *(es24.16))", "floor", fluid_force(simulation, floor_of_it)
  print "(a, *(es24.16))", "pressure", fluid_pressure(simulation, reshape([0.1_dp, 0.1_dp], [2, 1]))
  print "(a, *(es24.16))", "level", fluid_level(simulation, reshape([0.1_dp, 0.0_dp], [2, 1]))
  print "(a, *(es24.16))", "volume", fluid_number(simulation, "volume")
  call destroy_simulation(simulation)
end program basin
