!> A Fortran program on its own: meshes that touch on average over their sides (a mortar), which carries a uniform pressure through
!> cells of other sizes exactly, and a mesh whose arms touch each other.
program touching
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0)
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_mesh) :: mesh
  type(cairn_error) :: error
  type(cairn_report) :: report

  call patch()
  call fork()
contains
  !> Two cells on three under 1 kPa, brought to rest by long implicit steps.
  subroutine patch()
    integer, parameter :: columns(2) = [2, 3], rows = 2
    real(dp), parameter :: young = 1e6_dp, pressure = 1e3_dp, h = 0.1_dp
    real(dp) :: force(2, 9), share(4), level(3)
    real(dp), allocatable :: moved(:, :), impulse(:, :)
    integer :: rock, number, k

    call create_scene(scene, 2)
    call add_material(scene, "rock", rock)
    call set_default_law(scene, "GapCoulomb", [0.0_dp])
    call block(columns(1), rows, 0.5_dp, young)
    call touch_nodes(mesh, [0, 3, 6])
    call set_contact(mesh, .false., .true.)
    call add_mesh(scene, mesh, "over", rock, number, error=error)
    call expect(index(error%message, "is of contact nodes and the edges between them") > 0, "a mortar has sides of its own")
    call touch_sides(mesh, reshape([0, 3, 3, 6], [2, 2]))
    call hold_nodes(mesh, [2], [.true., .false.])
    call add_mesh(scene, mesh, "over", rock, number)
    call destroy_mesh(mesh)
    call block(columns(2), rows, 0.0_dp, young)
    call touch_sides(mesh, reshape([5, 2, 8, 5, 11, 8], [2, 3]))
    call hold_nodes(mesh, [0, 3, 6, 9], [.false., .true.])
    call hold_nodes(mesh, [0], [.true., .true.])
    call add_mesh(scene, mesh, "under", rock, k)
    call destroy_mesh(mesh)
    call start()
    force = 0
    force(2, 3::3) = -pressure*[0.25_dp, 0.5_dp, 0.25_dp]
    call load_mesh(simulation, number, force)
    do k = 1, 60
      call step_simulation(simulation, h, report)
    end do
    call expect(report%status == cairn_converged .and. report%contacts == 3, "three nodes meet the sides below")
    call mesh_field(simulation, 1, "impulse", impulse)
    share = -impulse(2, 3::3)/(h*pressure)
    call expect(maxval(abs(share - [1, 2, 2, 1]/6.0_dp)) < 1e-11_dp, "the pressure goes through uniformly")
    print "(a, *(1x, es24.16e3))", "share", share
    call mesh_field(simulation, 0, "displacement", moved)
    level = [0.5_dp, 0.75_dp, 1.0_dp]
    call expect(maxval(abs(moved(2, :)/(pressure/young) + [level, level, level])) < 1e-10_dp, "the strain is the same everywhere")
    print "(a, *(1x, es24.16e3))", "over", moved
    call mesh_field(simulation, 1, "displacement", moved)
    print "(a, *(1x, es24.16e3))", "under", moved
    call destroy_simulation(simulation)
  end subroutine patch

  !> A block of 1 by a half, its lower side there, of so many cells; nodes from the bottom up, columns from left to right.
  subroutine block(columns, rows, height, young)
    integer, intent(in) :: columns, rows
    real(dp), intent(in) :: height, young
    integer :: i, j, k, cell(4, columns*rows)
    real(dp) :: node(2, (columns + 1)*(rows + 1))

    node = reshape([(([i/real(columns, dp), height + 0.5_dp*j/rows], j=0, rows), i=0, columns)], shape(node))
    do i = 0, columns - 1
      do j = 0, rows - 1
        k = (rows + 1)*i + j
        cell(:, rows*i + j + 1) = [k, k + rows + 1, k + rows + 2, k + 1]
      end do
    end do
    call create_mesh(mesh, node)
    call add_elastic_cells(mesh, "q4", cell, young, 0.3_dp, 1000.0_dp, plane_stress=.true.)
  end subroutine block

  !> Two arms on a back with a narrow slot between them: the upper arm is pushed on to the lower.
  subroutine fork()
    real(dp), parameter :: gap = 0.02_dp, h = 1e-3_dp, level(4) = [0.0_dp, 0.2_dp, 0.2_dp + gap, (0.2_dp + gap) + 0.2_dp]
    integer :: cell(4, 9), side(2, 8), rock, k, i, j, n
    real(dp) :: node(2, 20), force(2, 20), least
    real(dp), allocatable :: moved(:, :), impulse(:, :)

    node = reshape([(([0.25_dp*i, level(j)], j=1, 4), i=0, 4)], [2, 20])
    n = 0
    do i = 0, 3
      do j = 0, 2
        if (j == 1 .and. i > 0) cycle
        n = n + 1
        cell(:, n) = [4*i + j, 4*i + j + 4, 4*i + j + 5, 4*i + j + 1]
      end do
    end do
    ! the slot from its mouth at the lower arm to its end and back, its body on the left of each side; and the back
    side(:, :3) = reshape([17, 13, 13, 9, 9, 5], [2, 3])
    side(:, 4:) = reshape([5, 6, 6, 10, 10, 14, 14, 18, 2, 1], [2, 5])
    call create_scene(scene, 2)
    call add_material(scene, "rock", rock)
    call set_default_law(scene, "GapCoulomb", [0.0_dp])
    call create_mesh(mesh, node)
    call add_elastic_cells(mesh, "q4", cell, 1e5_dp, 0.2_dp, 1000.0_dp)
    call set_damping(mesh, 0.0_dp, 2e-3_dp, .false.)
    call hold_nodes(mesh, [0, 1, 2, 3], [.true., .true.])
    call set_contact(mesh, .true., .false.)
    call touch_nodes(mesh, [1, 2, 5, 6, 9, 10, 13, 14, 17, 18])
    call add_mesh(scene, mesh, "fork", rock, k, error=error)
    call expect(index(error%message, "is of its points and its edges") > 0, "what meets itself has sides")
    call touch_sides(mesh, side)
    call add_mesh(scene, mesh, "fork", rock, k)
    call destroy_mesh(mesh)
    call start()
    force = 0
    force(2, 20) = -800
    call load_mesh(simulation, 0, force)
    least = gap
    do k = 1, 150
      call step_simulation(simulation, h, report)
      call expect(report%status == cairn_converged, "a step converged")
      call mesh_field(simulation, 0, "displacement", moved)
      least = min(least, gap + moved(2, 19) - moved(2, 18))
      call mesh_field(simulation, 0, "impulse", impulse)
      call expect(all(abs(sum(impulse, 2)) <= 1e-13_dp*sum(abs(impulse))), "contacts with itself have no sum")
    end do
    call expect(abs(least) < 5e-3_dp*gap, "its arms meet, and do not pass through each other")
    call expect(abs(energy_term(simulation, "closure")) < 1e-12_dp*report%energy_in_play, "the balance of energy closes")
    print "(a, *(1x, es24.16e3))", "fork", moved
    call destroy_simulation(simulation)
  end subroutine fork

  subroutine start()
    call create_simulation(simulation, scene)
    call destroy_scene(scene)
    call set_number(simulation, "theta", 1.0_dp)
    call set_number(simulation, "tol", 1e-14_dp)
    call set_number(simulation, "max_iter", 50000.0_dp)
  end subroutine start

  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program touching
