!> A Fortran program on its own: a rigid block on the ground, with a disk on it, becomes rubber in the run, settles, and is made
!> rigid again; momentum, its number and what its contacts remember pass over.
program reshaped
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0), n = 4
  real(dp), parameter :: h = 1e-3_dp, low = -0.5_dp, high = 0.5_dp
  real(dp), parameter :: square(2, 4) = reshape([low, low, high, low, high, high, low, high], [2, 4])
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_mesh) :: mesh
  type(cairn_error) :: error
  type(cairn_report) :: report
  integer(c_int64_t) :: ground, block, disk, back
  integer :: rock, hull, number, step, i, j, k, cell(4, n*n)
  real(dp) :: node(2, (n + 1)**2), infinite(1), mass
  real(dp), allocatable :: position(:, :), velocity(:, :), id(:, :), moved(:, :)

  infinite = ieee_value(1.0_dp, ieee_positive_inf)
  call create_scene(scene, 2)
  call set_gravity(scene, [0.0_dp, -10.0_dp])
  call add_material(scene, "rock", rock)
  call set_default_law(scene, "Coulomb", [0.3_dp])
  call add_bodies(scene, reshape([0.0_dp, 0.0_dp], [2, 1]), infinite, reshape(infinite, [1, 1]), ground)
  call add_contactors(scene, "half_plane", [ground], [rock], direction=reshape([0.0_dp, 1.0_dp, 0.0_dp], [3, 1]))
  call add_polygons(scene, [4], square, hull)
  call add_bodies(scene, reshape([0.0_dp, 0.5_dp], [2, 1]), [1000.0_dp], reshape([1000/6.0_dp], [1, 1]), block)
  call add_hull_contactors(scene, "polygon", [block], [rock], [hull])
  mass = 125
  call add_bodies(scene, reshape([0.1_dp, 1.2_dp], [2, 1]), [mass], reshape([2.5_dp], [1, 1]), disk)
  call add_contactors(scene, "disk", [disk], [rock], radius=[0.2_dp])
  call create_simulation(simulation, scene)
  call destroy_scene(scene)
  call set_number(simulation, "tol", 1e-12_dp)
  call set_number(simulation, "max_iter", 20000.0_dp)

  ! nodes and cells of the block as it came in, columns from left to right
  node = reshape([(([-0.5_dp + i/real(n, dp), j/real(n, dp)], j=0, n), i=0, n)], [2, (n + 1)**2])
  do i = 0, n - 1
    do j = 0, n - 1
      k = (n + 1)*i + j
      cell(:, n*i + j + 1) = [k, k + n + 1, k + n + 2, k + 1]
    end do
  end do
  call create_mesh(mesh, node)
  call add_solid_cells(mesh, "q4", cell, "neo_hookean", ["young  ", "poisson"], [1e7_dp, 0.3_dp], 900.0_dp, "total_lagrangian")

  call advance(20)
  call deform_body(simulation, ground, mesh, error=error)
  call expect(index(error%message, "is held or driven") > 0, "the ground stays as it is")
  call deform_body(simulation, block, mesh, number)
  call expect(number == 0 .and. body_count(simulation) == 2, "the block is a mesh now")
  call step_simulation(simulation, h, report)
  call expect(report%status == cairn_converged .and. report%contacts >= 3, "its contacts go on")
  call advance(59)
  call mesh_field(simulation, number, "position", moved)
  call rigidify_mesh(simulation, number, back)
  call expect(back == block, "it has its number again")
  call advance(20)
  call expect(report%status == cairn_converged, "the last step converged")
  call expect(abs(energy_term(simulation, "closure")) < 1e-10_dp*report%energy_in_play, "the balance of energy closes")
  call body_field(simulation, "id", id)
  call expect(all(nint(id(1, :), c_int64_t) == [ground, block, disk]), "all bodies are there")
  call body_field(simulation, "position", position)
  call body_field(simulation, "velocity", velocity)
  call expect(maxval(abs(velocity)) < 0.1_dp, "they are near rest")
  print "(a, *(1x, es24.16e3))", "moved", moved
  print "(a, *(1x, es24.16e3))", "position", position(:, 2:)
  print "(a, *(1x, es24.16e3))", "velocity", velocity(:, 2:)
  print "(a, *(1x, es24.16e3))", "lost", energy_term(simulation, "dissipated_reshaping")
  call destroy_mesh(mesh)
  call destroy_simulation(simulation)
contains
  subroutine advance(steps)
    integer, intent(in) :: steps

    do step = 1, steps
      call step_simulation(simulation, h, report)
    end do
  end subroutine advance

  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program reshaped
