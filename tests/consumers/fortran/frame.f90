!> A Fortran program with a frame of beams and a truss of bars whose tips move as functions of time, two blocks that are tied, and a
!> ring of springs, forces of its own, that a pressure follows. It ends in the numbers of the same scenes in Python.
module frame_motions
  use, intrinsic :: iso_c_binding
  implicit none
  integer, parameter :: dp = c_double, ring = 12
contains

  real(c_double) function swing(time, context) bind(c)
    real(c_double), value :: time
    type(c_ptr), value :: context
    real(c_double), pointer :: amplitude

    call c_f_pointer(context, amplitude)
    swing = amplitude*sin(30*time)
  end function swing

  !> Springs of 1 kN/m along both axes of each node.
  integer(c_int32_t) function springs(context, n, numbers, time, step, rate, displacement, velocity, force, tangent, energy, &
                                      dissipated) bind(c)
    type(c_ptr), value              :: context
    integer(c_int64_t), value       :: n, numbers
    real(dp), value                 :: time, step, rate
    real(dp), intent(in)            :: displacement(n), velocity(n)
    real(dp), intent(out)           :: force(n)
    real(dp), intent(out), optional :: tangent(numbers)
    real(dp), intent(inout)         :: energy, dissipated

    force = 1e3_dp*displacement
    energy = 500*sum(displacement**2)
    dissipated = 0
    if (present(tangent)) tangent = 1e3_dp
    springs = merge(1, 0, c_associated(context) .or. time + step + rate + velocity(1) > huge(time)) ! read, so that none is idle
  end function springs
end module frame_motions

program frame
  use cairn
  use frame_motions
  implicit none
  real(dp), parameter :: corner(2, 4) = reshape([0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 1.0_dp, 1.0_dp, 2.0_dp, 1.5_dp], [2, 4])
  integer, parameter :: bar(2, 4) = reshape([0, 1, 1, 2, 2, 3, 0, 2], [2, 4])
  real(dp), parameter :: young(4) = [1e6_dp, 2e6_dp, 1e6_dp, 3e6_dp], area(4) = [1e-3_dp, 1e-3_dp, 2e-3_dp, 1e-3_dp]
  real(dp), parameter :: density(4) = 1e3_dp, stress(4) = [1e3_dp, -2e3_dp, 5e2_dp, 0.0_dp]
  type(cairn_error) :: error

  call beams
  call bars
  call falling
  call blocks
  call pressed
  print "(a)", "as in Python"

contains

  subroutine begin(scene, mesh, simulation, number, gravity)
    type(cairn_scene), intent(out) :: scene
    type(cairn_mesh), intent(in) :: mesh
    type(cairn_simulation), intent(out) :: simulation
    integer, intent(out) :: number
    real(dp), intent(in) :: gravity(:)
    integer :: steel

    call create_scene(scene, size(gravity))
    call set_gravity(scene, gravity)
    call add_material(scene, "steel", steel)
    call add_mesh(scene, mesh, "mesh", steel, number=number)
    call create_simulation(simulation, scene)
  end subroutine begin

  subroutine go_on(simulation, steps, h)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: steps
    real(dp), intent(in) :: h
    integer :: i

    do i = 1, steps
      call step_simulation(simulation, h)
    end do
  end subroutine go_on

  subroutine same(simulation, number, node, python, what)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: number, node
    real(dp), intent(in) :: python(:)
    character(*), intent(in) :: what
    real(dp), allocatable :: u(:, :)

    call mesh_field(simulation, number, "displacement", u)
    if (any(abs(u(:, node + 1) - python) > 1e-11_dp*maxval(abs(u)))) then
      print *, what, u(:, node + 1), python
      error stop "not as in Python"
    end if
  end subroutine same

  subroutine beams
    type(cairn_scene) :: scene
    type(cairn_mesh) :: mesh
    type(cairn_simulation) :: simulation
    real(dp), target :: amplitude
    integer :: number

    amplitude = 0.01_dp
    call create_mesh(mesh, corner)
    call set_beams(mesh, bar, young, area, density, reshape([1e-7_dp, 2e-7_dp, 1e-7_dp, 1e-7_dp], [1, 4]), &
                   shear_area=[1e-3_dp, 8e-4_dp, 1e-3_dp, 1e-3_dp], initial_stress=stress, poisson=0.2_dp, clamped=[0])
    call set_damping(mesh, 1.0_dp, 1e-4_dp, .false.)
    call hold_nodes(mesh, [0], [.true., .true.])
    call hold_nodes(mesh, [3], [.true., .false.])
    call begin(scene, mesh, simulation, number, [0.0_dp, -9.81_dp])
    call displace_nodes(simulation, number, [3], "x", swing, c_loc(amplitude))
    call displace_nodes(simulation, number, [2], "x", swing, c_loc(amplitude), error)
    if (index(error%message, "node 2 of the mesh 'mesh' along x is not held") == 0) error stop "what is not held is moved"
    call go_on(simulation, 100, 1e-3_dp)
    call same(simulation, number, 3, [0.0014112001022090759_dp, -0.055156040554898755_dp], "beams")
    call destroy_simulation(simulation)
    call destroy_mesh(mesh)
    call destroy_scene(scene)
  end subroutine beams

  subroutine bars
    type(cairn_scene) :: scene
    type(cairn_mesh) :: mesh
    type(cairn_simulation) :: simulation
    integer :: number

    call create_mesh(mesh, corner)
    call set_bars(mesh, bar, young(:3), area, density, error=error)
    if (index(error%message, "young has 3 numbers; it needs 4") == 0) error stop "three moduli are enough for four bars"
    call set_bars(mesh, bar, young, area, density, stress)
    call set_damping(mesh, 1.0_dp, 1e-4_dp, .false.)
    call hold_nodes(mesh, [0], [.true., .true.])
    call hold_nodes(mesh, [1, 3], [.false., .true.])
    call begin(scene, mesh, simulation, number, [0.0_dp, -9.81_dp])
    call displace_nodes(simulation, number, [3], "y", [0.02_dp, 0.05_dp, 0.08_dp], [0.0_dp, 0.03_dp, 0.01_dp])
    call drive_nodes(simulation, number, [1], "y", [0.0_dp], [0.0_dp])
    call go_on(simulation, 100, 1e-3_dp)
    call same(simulation, number, 2, [0.013096465435789462_dp, -0.015626827368360074_dp], "bars")
    call destroy_simulation(simulation)
    call destroy_mesh(mesh)
    call destroy_scene(scene)
  end subroutine bars

  !> Beams that fall about their foot through half a turn.
  subroutine falling
    type(cairn_scene) :: scene
    type(cairn_mesh) :: mesh
    type(cairn_simulation) :: simulation
    integer :: number

    call create_mesh(mesh, corner)
    call set_kinematics(mesh, "corotational", error=error)
    if (index(error%message, "of bars and beams: give these first") == 0) error stop "kinematics of nothing"
    call set_beams(mesh, bar, young, area, density, reshape([1e-7_dp, 2e-7_dp, 1e-7_dp, 1e-7_dp], [1, 4]), &
                   shear_area=[1e-3_dp, 8e-4_dp, 1e-3_dp, 1e-3_dp], initial_stress=stress, poisson=0.2_dp, clamped=[0])
    call set_kinematics(mesh, "corotational")
    call set_damping(mesh, 1.0_dp, 1e-4_dp, .false.)
    call hold_nodes(mesh, [0], [.true., .true.])
    call begin(scene, mesh, simulation, number, [0.0_dp, -9.81_dp])
    call go_on(simulation, 100, 5e-3_dp)
    call same(simulation, number, 3, [0.442032205809348_dp, -0.8325335972162807_dp], "falling beams")
    call destroy_simulation(simulation)
    call destroy_mesh(mesh)
    call destroy_scene(scene)
  end subroutine falling

  !> Two cells below three: a column of one material under its weight, as if it were whole, on average.
  subroutine blocks
    type(cairn_scene) :: scene
    type(cairn_mesh) :: mesh
    type(cairn_simulation) :: simulation
    real(dp) :: place(2, 14)
    real(dp), allocatable :: u(:, :)
    integer :: number, i

    do i = 0, 2
      place(:, i + 1) = [0.5_dp*i, 0.0_dp]
      place(:, i + 4) = [0.5_dp*i, 0.5_dp]
    end do
    do i = 0, 3
      place(:, i + 7) = [i/3.0_dp, 0.5_dp]
      place(:, i + 11) = [i/3.0_dp, 1.0_dp]
    end do
    call create_mesh(mesh, place)
    call add_elastic_cells(mesh, "q4", reshape([0, 1, 4, 3, 1, 2, 5, 4], [4, 2]), 1e5_dp, 0.0_dp, 1000.0_dp)
    call add_elastic_cells(mesh, "q4", reshape([6, 7, 11, 10, 7, 8, 12, 11, 8, 9, 13, 12], [4, 3]), 1e5_dp, 0.0_dp, 1000.0_dp)
    call tie_sides(mesh, reshape([6, 7, 7, 8, 8, 9], [2, 3]), reshape([4, 3, 5, 4], [2, 2]))
    call set_damping(mesh, 30.0_dp, 0.0_dp, .false.)
    call hold_nodes(mesh, [0, 1, 2], [.true., .true.])
    call begin(scene, mesh, simulation, number, [0.0_dp, -9.81_dp])
    call set_number(simulation, "theta", 1.0_dp)
    call go_on(simulation, 400, 1e-2_dp)
    call mesh_field(simulation, number, "displacement", u)
    ! of a column that stands: rho g (L y - y^2 / 2) / E
    if (any(abs(u(2, 11:14) + 0.04905_dp) > 1e-9_dp) .or. any(abs(u(2, 7:10) + 0.0367875_dp) > 1e-9_dp)) error stop "a tied column"
    call destroy_simulation(simulation)
    call destroy_mesh(mesh)
    call destroy_scene(scene)
  end subroutine blocks

  !> Springs that couple no nodes, under a pressure round them: a corner is pushed out by p sin(a) r.
  subroutine pressed
    type(cairn_scene) :: scene
    type(cairn_mesh) :: mesh
    type(cairn_simulation) :: simulation
    type(cairn_body_calls) :: calls
    real(dp) :: place(2, ring), radius, passes
    real(dp), allocatable :: x(:, :)
    integer(c_int64_t) :: start(2*ring + 1)
    integer(c_int32_t) :: row(2*ring)
    integer :: number, set, i, skin(2, ring)

    do i = 1, ring
      place(:, i) = [cos(2*acos(-1.0_dp)*i/ring), sin(2*acos(-1.0_dp)*i/ring)]
      skin(:, i) = [i - 1, mod(i, ring)]
    end do
    start = [(int(i, c_int64_t), i=0, 2*ring)]
    row = [(int(i, c_int32_t), i=0, 2*ring - 1)]
    call create_mesh(mesh, place)
    calls = new_body_calls(2*ring, 2*ring)
    calls%forces = c_funloc(springs)
    calls%gives_energy = 1
    call set_sides(mesh, skin, error=error)
    if (index(error%message, "whose forces another code finds") == 0) error stop "sides of nothing"
    call set_calls(mesh, start, row, calls, node_mass=spread(1e-3_dp, 1, ring))
    call set_sides(mesh, skin, thickness=0.5_dp)
    call begin(scene, mesh, simulation, number, [0.0_dp, 0.0_dp])
    call set_number(simulation, "theta", 1.0_dp)
    call set_number(simulation, "newton_tol", 1e-12_dp)
    call press_mesh(simulation, number, skin, set)
    call set_pressure(simulation, number, set, 1000.0_dp, 1000.0_dp)
    call go_on(simulation, 3, 1.0_dp)
    call mesh_field(simulation, number, "position", x)
    radius = 1/(1 + 0.5_dp*sin(2*acos(-1.0_dp)/ring))
    if (any(abs(norm2(x, 1) - radius) > 1e-5_dp)) error stop "the pressure on springs"
    passes = report_number(simulation, "newton_passes")
    if (passes > 3.5_dp) error stop "the tangent does not know the pressure"
    call destroy_simulation(simulation)
    call destroy_mesh(mesh)
    call destroy_scene(scene)
  end subroutine pressed
end program frame
