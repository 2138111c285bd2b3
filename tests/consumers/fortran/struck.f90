!> A Fortran program on its own: rigid squares that a criterion makes deformable, by the force of a contact as they strike the
!> ground and by their mean stress, and rigid again; and a mesh that becomes a body of another shape.
program struck
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0), n = 4
  real(dp), parameter :: low = -0.5_dp, high = 0.5_dp
  real(dp), parameter :: square(2, 4) = reshape([low, low, high, low, high, high, low, high], [2, 4])
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_mesh) :: mesh
  type(cairn_error) :: error
  type(cairn_report) :: report
  integer :: rock, hull

  call by_force()
  call by_stress(0.8e4_dp, .true.)
  call by_stress(3e4_dp, .false.)
  call as_another()
contains
  !> Two squares fall, and one of them is watched.
  subroutine by_force()
    integer(c_int64_t) :: one, other
    integer :: step, kinds(120)
    real(dp), allocatable :: values(:, :)

    call ground(-10.0_dp)
    one = body([0.0_dp, 0.52_dp], [0.0_dp, -2.0_dp, 0.0_dp])
    other = body([3.0_dp, 0.52_dp], [0.0_dp, -2.0_dp, 0.0_dp])
    call start()
    call grid([-0.5_dp, 0.02_dp])
    call reshape_when(simulation, [one], mesh, error=error)
    call expect(index(error%message, "there is no threshold") > 0, "a criterion has a threshold")
    call reshape_when(simulation, [one], mesh, force=1e5_dp, back=1e2_dp)
    call destroy_mesh(mesh)
    do step = 1, 120
      call step_simulation(simulation, 5e-4_dp, report)
      call expect(report%status == cairn_converged, "a step converged")
      kinds(step) = mesh_of_body(simulation, one)
      if (step == 25) then
        call mesh_field(simulation, kinds(step), "velocity", values)
        print "(a, *(1x, es24.16e3))", "deforming", values
      end if
      call expect(mesh_of_body(simulation, other) == -1, "the other stays rigid")
    end do
    call expect(kinds(1) == -1 .and. maxval(kinds) == 0 .and. kinds(120) == -1, "it is deformable for a while")
    call expect(abs(energy_term(simulation, "closure")) < 1e-12_dp*report%energy_in_play, "the balance of energy closes")
    print "(a, *(1x, i0))", "kinds", kinds
    call body_field(simulation, "id", values)
    print "(a, *(1x, es24.16e3))", "id", values
    call body_field(simulation, "position", values)
    print "(a, *(1x, es24.16e3))", "position", values(:, 2:)
    call body_field(simulation, "velocity", values)
    print "(a, *(1x, es24.16e3))", "velocity", values(:, 2:)
    print "(a, *(1x, es24.16e3))", "lost", energy_term(simulation, "dissipated_reshaping"), energy_term(simulation, "kinetic")
    call destroy_simulation(simulation)
  end subroutine by_force

  !> A square under 10 kN has a mean stress of 10 kPa.
  subroutine by_stress(threshold, deforms)
    real(dp), intent(in) :: threshold
    logical, intent(in) :: deforms
    integer(c_int64_t) :: watched, above
    integer :: step
    real(dp), allocatable :: moved(:, :)

    call ground(0.0_dp)
    watched = body([0.0_dp, 0.5_dp], [0.0_dp, 0.0_dp, 0.0_dp])
    above = body([0.0_dp, 1.5_dp], [0.0_dp, 0.0_dp, 0.0_dp])
    call set_body_field(scene, "force", reshape([0.0_dp, -1e4_dp, 0.0_dp], [3, 1]), [above])
    call start()
    call grid([-0.5_dp, 0.0_dp])
    call reshape_when(simulation, [watched], mesh, stress=threshold)
    call destroy_mesh(mesh)
    do step = 1, 5
      call step_simulation(simulation, 1e-3_dp, report)
    end do
    call expect((mesh_of_body(simulation, watched) == 0) .eqv. deforms, "its mean stress is weighed")
    if (deforms) then
      call mesh_field(simulation, 0, "displacement", moved)
      print "(a, *(1x, es24.16e3))", "pressed", moved
    end if
    call destroy_simulation(simulation)
  end subroutine by_stress

  !> A square in flight becomes a mesh, and that a disk.
  subroutine as_another()
    integer(c_int64_t) :: one, disk
    integer :: step
    real(dp), allocatable :: values(:, :)

    call ground(0.0_dp)
    one = body([2.0_dp, 5.0_dp], [1.0_dp, -2.0_dp, 3.0_dp])
    call start()
    call grid([low, low])
    do step = 1, 40
      if (step == 11) call deform_body(simulation, one, mesh)
      if (step == 31) then
        call rigidify_mesh_as(simulation, 0, "disk", [rock], 2.0_dp, [0.3_dp], radius=[0.4_dp, 0.4_dp], error=error)
        call expect(index(error%message, "radius has 2 numbers; it needs 1") > 0, "numbers of a shape are of its contactors")
        call rigidify_mesh_as(simulation, 0, "disk", [rock], 2.0_dp, [0.3_dp], radius=[0.4_dp], body=disk)
      end if
      call step_simulation(simulation, 1e-3_dp, report)
    end do
    call destroy_mesh(mesh)
    call body_field(simulation, "id", values)
    call expect(nint(values(1, 2), c_int64_t) == disk .and. disk > one, "the disk has a number of its own")
    print "(a, *(1x, es24.16e3))", "disk_id", values(1, 2)
    call body_field(simulation, "position", values)
    print "(a, *(1x, es24.16e3))", "disk_position", values(:, 2)
    call body_field(simulation, "velocity", values)
    print "(a, *(1x, es24.16e3))", "disk_velocity", values(:, 2)
    call body_field(simulation, "inertia", values)
    print "(a, *(1x, es24.16e3))", "disk_inertia", values(:, 2)
    print "(a, *(1x, es24.16e3))", "disk_lost", energy_term(simulation, "dissipated_reshaping")
    call destroy_simulation(simulation)
  end subroutine as_another

  subroutine ground(gravity)
    real(dp), intent(in) :: gravity
    integer(c_int64_t) :: id
    real(dp) :: infinite(1)

    infinite = ieee_value(1.0_dp, ieee_positive_inf)
    call create_scene(scene, 2)
    call set_gravity(scene, [0.0_dp, gravity])
    call add_material(scene, "rock", rock)
    call set_default_law(scene, "Coulomb", [0.3_dp])
    call add_bodies(scene, reshape([0.0_dp, 0.0_dp], [2, 1]), infinite, reshape(infinite, [1, 1]), id)
    call add_contactors(scene, "half_plane", [id], [rock], direction=reshape([0.0_dp, 1.0_dp, 0.0_dp], [3, 1]))
    call add_polygons(scene, [4], square, hull)
  end subroutine ground

  integer(c_int64_t) function body(place, velocity) result(id)
    real(dp), intent(in) :: place(2), velocity(3)

    call add_bodies(scene, reshape(place, [2, 1]), [1000.0_dp], reshape([1000/6.0_dp], [1, 1]), id)
    call add_hull_contactors(scene, "polygon", [id], [rock], [hull])
    call set_body_field(scene, "velocity", reshape(velocity, [3, 1]), [id])
  end function body

  subroutine start()
    call create_simulation(simulation, scene)
    call destroy_scene(scene)
    call set_number(simulation, "theta", 0.5_dp)
    call set_number(simulation, "tol", 1e-12_dp)
    call set_number(simulation, "max_iter", 50000.0_dp)
  end subroutine start

  !> Nodes and cells of a square as it came in, its lower corner there, columns from left to right.
  subroutine grid(corner)
    real(dp), intent(in) :: corner(2)
    integer :: i, j, k, cell(4, n*n)
    real(dp) :: node(2, (n + 1)**2)

    node = reshape([(([corner(1) + i/real(n, dp), corner(2) + j/real(n, dp)], j=0, n), i=0, n)], shape(node))
    do i = 0, n - 1
      do j = 0, n - 1
        k = (n + 1)*i + j
        cell(:, n*i + j + 1) = [k, k + n + 1, k + n + 2, k + 1]
      end do
    end do
    call create_mesh(mesh, node)
    call add_elastic_cells(mesh, "q4", cell, 1e7_dp, 0.3_dp, 900.0_dp)
  end subroutine grid

  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program struck
