!> Disks that fall into a box and are written to a run file, which Python, ParaView and `cairn plot heap.vtkhdf` read.
program heap
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0), rows = 9, columns = 12, n = rows*columns
  real(dp), parameter :: h = 1e-3_dp, radius = 0.05_dp, density = 2600, pi = acos(-1.0_dp)
  real(dp), parameter :: normals(2, 3) = reshape([0.0_dp, 1.0_dp, 1.0_dp, 0.0_dp, -1.0_dp, 0.0_dp], [2, 3])
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_run_writer) :: writer
  type(cairn_report) :: report
  type(cairn_nscd) :: options
  real(dp) :: center(2, n), mass(n), size(n), infinite
  real(dp), allocatable :: velocity(:, :)
  integer(c_int64_t) :: grains, wall, ids(n)
  integer :: sand, i, j, step

  infinite = ieee_value(1.0_dp, ieee_positive_inf)
  call create_scene(scene, 2)
  call set_gravity(scene, [0.0_dp, -9.81_dp])
  call add_material(scene, "sand", sand)
  call set_law(scene, sand, sand, "Coulomb", [0.5_dp])

  do j = 1, rows
    do i = 1, columns
      size((j - 1)*columns + i) = radius*(1 - 0.2_dp*mod(7*i + 3*j, 5)/4)
      center(:, (j - 1)*columns + i) = [(2*i + 0.3_dp*mod(j, 2))*radius, (2*j - 0.5_dp)*1.1_dp*radius]
    end do
  end do
  mass = density*pi*size**2
  call add_bodies(scene, center, mass, reshape(0.5_dp*mass*size**2, [1, n]), grains)
  ids = [(grains + i, i=0, n - 1)]
  call add_contactors(scene, "disk", ids, [(sand, i=1, n)], radius=size)

  do i = 1, 3  ! the floor, and a wall at each side
    call add_bodies(scene, reshape([merge((2*columns + 2)*radius, 0.0_dp, i == 3), 0.0_dp], [2, 1]), [infinite], &
                    reshape([infinite], [1, 1]), wall)
    call add_contactors(scene, "half_plane", [wall], [sand], direction=reshape([normals(:, i), 0.0_dp], [3, 1]))
    call drive_bodies(scene, [wall], [.true., .true., .true.], reshape([0.0_dp, 0.0_dp, 0.0_dp], [3, 1]))
  end do

  options%tolerance = 1e-4_dp
  call create_simulation(simulation, scene, options)
  call destroy_scene(scene)
  call create_run_writer(writer, simulation, "heap.vtkhdf", mode=cairn_replace)
  call write_output(writer, simulation)
  do step = 1, 800
    call step_simulation(simulation, h, report)
    call write_step(writer, simulation)
    if (mod(step, 100) == 0) call write_output(writer, simulation)
  end do
  call close_run_writer(writer)

  call body_field(simulation, "velocity", velocity)
  if (maxval(abs(velocity(1:2, :))) > 0.5_dp) error stop "the heap does not come to rest"
  call destroy_simulation(simulation)
  print "(a)", "the heap is in heap.vtkhdf"
end program heap
