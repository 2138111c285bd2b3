!> Disks that fall onto a floor, over the ranks of MPI: mpirun -n 4 ./pile_over_ranks_fortran libcairn_mpi.so
program pile_over_ranks
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use mpi
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0), side = 8, n = side*side
  real(dp), parameter :: pi = 3.141592653589793_dp
  real(dp), parameter :: normals(3, 2) = reshape([0.0_dp, 1.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp], [3, 2])
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_nscd) :: options
  real(dp) :: center(2, n), radius(n), mass(n), infinite, kinetic
  real(dp), allocatable :: position(:, :)
  integer(c_int64_t) :: grains, wall
  character(1000) :: library
  integer :: rock, k, step, rank, ranks, code

  call MPI_Init(code)
  infinite = ieee_value(1.0_dp, ieee_positive_inf)
  call create_scene(scene, 2)
  call set_gravity(scene, [-6.0_dp, -9.81_dp])
  call add_material(scene, "rock", rock)
  call set_law(scene, rock, rock, "Coulomb", [0.4_dp])
  do k = 0, n - 1
    center(:, k + 1) = [0.6_dp + mod(k, side) + 0.01_dp*mod(k*7, 5), 0.6_dp + k/side]
    radius(k + 1) = 0.42_dp + 0.01_dp*mod(k*3, 7)
    mass(k + 1) = 2600*pi*radius(k + 1)*radius(k + 1)
  end do
  call add_bodies(scene, center, mass, reshape(0.5_dp*mass*radius*radius, [1, n]), grains)
  call add_contactors(scene, "disk", [(grains + k, k=0, n - 1)], [(rock, k=1, n)], radius=radius)
  do k = 1, 2
    call add_bodies(scene, reshape([0.0_dp, 0.0_dp], [2, 1]), [infinite], reshape([infinite], [1, 1]), wall)
    call add_contactors(scene, "half_plane", [wall], [rock], direction=reshape(normals(:, k), [3, 1]))
    call drive_bodies(scene, [wall], [.true., .true., .true.], reshape([0.0_dp, 0.0_dp, 0.0_dp], [3, 1]))
  end do

  options%tolerance = 1e-6_dp
  call create_simulation(simulation, scene, options)
  call destroy_scene(scene)
  call set_option(simulation, "solver", "nlgs")
  call get_command_argument(1, library)
  call simulate_over_mpi(simulation, MPI_COMM_WORLD, trim(library))
  do step = 1, 40
    call step_simulation(simulation, 4e-3_dp)
  end do
  call gather_contacts(simulation)
  call ranks_of(simulation, rank, ranks)
  call body_field(simulation, "position", position)
  kinetic = energy_term(simulation, "kinetic")
  if (rank == 0) print "(a, i0, a, i0, a, es25.17, es25.17, a, es25.17)", "ranks ", ranks, " contacts ", &
    contact_count(simulation), " place ", position(1, 1), position(2, n), " kinetic ", kinetic
  call destroy_simulation(simulation)
  call MPI_Finalize(code)
end program pile_over_ranks
