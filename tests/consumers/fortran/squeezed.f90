!> A Fortran program on its own: a layer that stands in the stress of its weight stays where it is, and a block of rubber that is
!> squeezed faster than a whole step can follow is made in parts, for which a routine gives the load.
module squeezing
  use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_funloc, c_int32_t, c_loc, c_ptr
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0), n = 2, top(n + 1) = [7, 8, 9]

  !> Context of the routine: its arguments and data.
  type :: squeezed_block
    type(cairn_simulation) :: simulation
    integer :: number = -1, calls = 0
    real(dp) :: first = -1, reached = 0, longest = 0
  end type
contains
  !> Lateral forces on the top (2, nodes) [N].
  function push(time) result(force)
    real(dp), intent(in) :: time
    real(dp) :: force(2, (n + 1)**2)

    force = 0
    force(1, top) = 4e5_dp*time
  end function push

  subroutine before(handle, time, h, context) bind(c)
    type(c_ptr), value :: handle, context
    real(c_double), value :: time, h
    type(squeezed_block), pointer :: block

    call c_f_pointer(context, block)
    block%calls = block%calls + 1
    if (block%first < 0) block%first = time
    block%reached = time + h
    block%longest = max(block%longest, h)
    call load_mesh(block%simulation, block%number, push(time), push(time + h))
  end subroutine before
end module squeezing

program squeezed
  use squeezing
  implicit none
  real(dp), parameter :: g = 10, density = 1000, h = 0.08_dp
  integer, parameter :: cell(4, n*n) = reshape([0, 1, 4, 3, 1, 2, 5, 4, 3, 4, 7, 6, 4, 5, 8, 7], [4, n*n])
  type(squeezed_block), target :: given, plain
  type(cairn_scene) :: scene
  type(cairn_mesh) :: mesh
  type(cairn_error) :: error
  real(dp) :: node(2, (n + 1)**2)
  real(dp), allocatable :: place(:, :), stress(:, :), moved(:, :), other(:, :)
  integer :: rock, number, i, j, p, step

  node = reshape([((real([i, j], dp)/n, i=0, n), j=0, n)], [2, (n + 1)**2])

  ! under its weight, in the stress that bears it
  call create_scene(scene, 2)
  call set_gravity(scene, [0.0_dp, -g])
  call add_material(scene, "rock", rock)
  call create_mesh(mesh, node)
  call add_elastic_cells(mesh, "q4", cell, 1e7_dp, 0.3_dp, density)
  call stress_points(mesh, place)
  call expect(size(place, 1) == 2 .and. size(place, 2) == 4*n*n, "a stress has four points in each cell")
  call expect(all(place > 0 .and. place < 1), "they are inside")
  allocate (stress(6, size(place, 2)), source=0.0_dp)
  do p = 1, size(place, 2)
    stress(2, p) = density*g*(place(2, p) - 1)
    stress([1, 3], p) = 0.5_dp*stress(2, p)
  end do
  call set_initial_stress(mesh, stress(:, 1:5), error)
  call expect(error%code /= 0 .and. index(error%message, "stress is of 5 cells") > 0, "a stress of too few cells is refused")
  call set_initial_stress(mesh, stress)
  call hold_nodes(mesh, [(i, i=0, n)], [.true., .true.])
  call hold_nodes(mesh, [(i, i=0, (n + 1)**2 - 1)], [.true., .false.])
  call add_mesh(scene, mesh, "layer", rock, number)
  call destroy_mesh(mesh)
  call create_simulation(plain%simulation, scene)
  do step = 1, 5
    call step_simulation(plain%simulation, 1e-2_dp)
  end do
  call mesh_field(plain%simulation, number, "displacement", moved)
  call expect(maxval(abs(moved)) < 1e-12_dp, "the layer stays where it is")
  call destroy_simulation(plain%simulation)
  call destroy_scene(scene)

  ! squeezed and pushed aside, with loads by the routine and along a line
  call create_scene(scene, 2)
  call add_material(scene, "rock", rock)
  call create_mesh(mesh, node)
  call add_solid_cells(mesh, "q4", cell, "neo_hookean", ["young  ", "poisson"], [1e5_dp, 0.3_dp], density, "total_lagrangian")
  call hold_nodes(mesh, [(i, i=0, n)], [.true., .true.])
  node(1, :) = 0
  node(2, :) = -14*node(2, :)
  call set_motion(mesh, velocity=node)
  call add_mesh(scene, mesh, "rubber", rock, number)
  call destroy_mesh(mesh)
  call squeeze(given)
  call before_parts(given%simulation, c_funloc(before), c_loc(given))
  call step_simulation(given%simulation, h)
  call squeeze(plain)
  call step_simulation(plain%simulation, h)
  call expect(report_number(given%simulation, "sub_steps") > 1, "a whole step cannot follow")
  call expect(given%calls >= nint(report_number(given%simulation, "sub_steps")), "the routine is asked for each part")
  call expect(abs(given%first) <= 0 .and. abs(given%longest - h/2) < epsilon(h), "the first part is half of the step")
  call expect(abs(given%reached - h) < epsilon(h), "and the last one ends where it does")
  call mesh_field(given%simulation, number, "displacement", moved)
  call mesh_field(plain%simulation, number, "displacement", other)
  call expect(minval(abs(moved(1, top))) > 1e-2_dp*maxval(abs(moved)), "the top is pushed aside")
  call expect(maxval(abs(moved - other)) < 1e-9_dp*maxval(abs(moved)), "loads along a line are those of the routine")
  call destroy_simulation(given%simulation)
  call destroy_simulation(plain%simulation)
  call destroy_scene(scene)
  print "(a)", "the block is squeezed in parts"
contains
  subroutine squeeze(block)
    type(squeezed_block), intent(inout) :: block

    block%number = number
    call create_simulation(block%simulation, scene)
    call set_number(block%simulation, "newton_passes", 4.0_dp)
    call set_number(block%simulation, "cut_back", 9.0_dp)
    call load_mesh(block%simulation, number, push(0.0_dp), push(h))
  end subroutine squeeze

  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program squeezed
