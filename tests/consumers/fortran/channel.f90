!> A liquid between plates, which comes in with the parabola of Poiseuille's flow and leaves at the other end: particles, masses
!> that came in and left, and pressures along the middle.
program channel
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0), across = 10, along = 20
  real(dp), parameter :: h = 0.02_dp, spacing = 0.1_dp, width = 1, length = 2, buffer = 0.4_dp, thickness = 0.1_dp
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_fluid_settings) :: liquid
  real(dp), allocatable :: end_of(:, :)
  real(dp) :: infinite, place(2, along*across), velocity(2, along*across), pressure(along*across), profile(across), gauge(2, 2)
  integer(c_int64_t) :: plate
  integer :: rock, i, j, step

  infinite = ieee_value(1.0_dp, ieee_positive_inf)
  call create_scene(scene, 2)
  call add_material(scene, "rock", rock)
  call set_law(scene, rock, rock, "Coulomb", [0.4_dp])
  do i = 0, 1  ! plates that face each other
    call add_bodies(scene, reshape([0.0_dp, i*width], [2, 1]), [infinite], reshape([infinite], [1, 1]), plate)
    call add_contactors(scene, "half_plane", [plate], [rock], direction=reshape([0.0_dp, 1.0_dp - 2*i, 0.0_dp], [3, 1]))
  end do
  do j = 1, across
    profile(j) = 6*((j - 0.5_dp)*spacing)*(1 - (j - 0.5_dp)*spacing)
  end do
  do i = 1, along
    do j = 1, across
      place(:, (i - 1)*across + j) = [(i - 0.5_dp)*spacing, (j - 0.5_dp)*spacing]
      velocity(:, (i - 1)*across + j) = [profile(j), 0.0_dp]
      pressure((i - 1)*across + j) = 12*thickness*(length - (i - 0.5_dp)*spacing)
    end do
  end do
  liquid%spacing = spacing
  liquid%density = 1
  liquid%viscosity = thickness
  liquid%sound_speed = 20
  call set_fluid(scene, liquid, place, velocity, pressure)
  call add_inflow(scene, [-buffer, 0.0_dp], [0.0_dp, width], 1, profile)
  call add_outflow(scene, [length, 0.0_dp], [length + buffer, width], 1, 1, 0.0_dp)
  call create_simulation(simulation, scene)
  call destroy_scene(scene)
  do step = 1, 50
    call step_simulation(simulation, h)
  end do
  call fluid_field(simulation, "end", end_of)
  gauge = reshape([0.5_dp, 0.5_dp, 1.5_dp, 0.5_dp], [2, 2])
  print "(a, *(es24.16))", "particles", real(particle_count(simulation), dp)
  print "(a, *(es24.16))", "inflow", real(count(end_of > 0), dp)
  print "(a, *(es24.16))", "outflow", real(count(end_of < 0), dp)
  print "(a, *(es24.16))", "came_in", fluid_number(simulation, "came_in")
  print "(a, *(es24.16))", "left", fluid_number(simulation, "left")
  print "(a, *(es24.16))", "pressure", fluid_pressure(simulation, gauge)
  call destroy_simulation(simulation)
end program channel
