!> A Fortran program that finds the forces of a deformable body itself: a row of springs, stiffer the more they are stretched, that
!> is held at its left end and hit by a disk at its right one; and a block of rubber that is pressed on its right side.
module springs
  use, intrinsic :: iso_c_binding
  use cairn
  implicit none
  integer, parameter :: dp = c_double, nodes = 6, dofs = 2*nodes, entries = 3*dofs - 3
  real(dp), parameter :: length = 1.0_dp/(nodes - 1)
  type :: row_of_springs
    real(dp) :: stiffness = 2e4_dp
    integer :: calls = 0
  end type row_of_springs
contains

  !> f = k (e + e**3) of the stretch e = longer / length; springs along y keep the nodes on their line.
  integer(c_int32_t) function forces(context, n, numbers, time, step, rate, displacement, velocity, force, tangent, energy, &
                                     dissipated) bind(c)
    type(c_ptr), value              :: context
    integer(c_int64_t), value       :: n, numbers
    real(dp), value                 :: time, step, rate
    real(dp), intent(in)            :: displacement(n), velocity(n)
    real(dp), intent(out)           :: force(n)
    real(dp), intent(out), optional :: tangent(numbers)
    real(dp), intent(inout)         :: energy, dissipated
    type(row_of_springs), pointer :: s
    real(dp) :: diagonal(dofs), beside(dofs), e, pull, slope
    integer :: i, c, k

    call c_f_pointer(context, s)
    s%calls = s%calls + 1
    force = 0
    diagonal = 0
    beside = 0
    energy = 0
    dissipated = 0
    do i = 1, nodes
      force(2*i) = s%stiffness*displacement(2*i)
      diagonal(2*i) = s%stiffness
      energy = energy + s%stiffness*displacement(2*i)**2/2
    end do
    do i = 1, nodes - 1
      e = (displacement(2*i + 1) - displacement(2*i - 1))/length
      pull = s%stiffness*length*(e + e**3)
      slope = s%stiffness*(1 + 3*e**2)
      energy = energy + s%stiffness*length**2*(e**2/2 + e**4/4)
      force(2*i - 1) = force(2*i - 1) - pull
      force(2*i + 1) = force(2*i + 1) + pull
      diagonal(2*i - 1) = diagonal(2*i - 1) + slope
      diagonal(2*i + 1) = diagonal(2*i + 1) + slope
      beside(2*i - 1) = -slope
    end do
    forces = 1
    if (time + step + rate + velocity(1) > huge(time)) return ! read, so that no argument is idle
    forces = 0
    if (.not. present(tangent)) return
    k = 0
    do c = 1, dofs ! the lower triangle by columns: the diagonal, the row below, that of the next node
      tangent(k + 1) = diagonal(c)
      if (c + 1 <= dofs) tangent(k + 2) = 0
      if (c + 2 <= dofs) tangent(k + 3) = beside(c)
      k = k + min(3, dofs - c + 1)
    end do
  end function forces
end module springs

program main
  use springs
  implicit none
  type(cairn_scene) :: scene
  type(cairn_mesh) :: mesh
  type(cairn_simulation) :: simulation
  type(cairn_body_calls) :: calls
  type(cairn_error) :: error
  type(row_of_springs), target :: row_there
  integer(c_int64_t) :: start(dofs + 1), disk
  integer(c_int32_t) :: row(entries)
  real(dp) :: place(2, nodes), closure, in_play, stored
  real(dp), allocatable :: values(:, :)
  integer :: rock, number, block, set, c, r, k, i
  character(:), allocatable :: status

  k = 0
  start(1) = 0
  do c = 1, dofs
    do r = c, min(c + 2, dofs)
      k = k + 1
      row(k) = r - 1
    end do
    start(c + 1) = k
  end do
  place(1, :) = [(length*(i - 1), i=1, nodes)]
  place(2, :) = 0
  call create_scene(scene, 2)
  call add_material(scene, "rock", rock)
  call set_rule(scene, "*", "*", "Coulomb", [0.3_dp])
  call create_mesh(mesh, place)
  calls = new_body_calls(dofs, entries)
  calls%gives_energy = 1
  calls%gives_dissipation = 1
  calls%context = c_loc(row_there)
  call set_calls(mesh, start, row, calls, node_mass=[(0.5_dp, i=1, nodes)], error=error)
  call expect(error%code /= 0 .and. index(error%message, "forces of the calls is NULL") > 0, "calls without forces are refused")
  calls%forces = c_funloc(forces)
  call set_calls(mesh, start, row, calls, node_mass=[(0.5_dp, i=1, nodes)])
  call hold_nodes(mesh, [0], [.true., .true.])
  call touch_nodes(mesh, [nodes - 1])
  call add_mesh(scene, mesh, "springs", rock, number)
  call destroy_mesh(mesh)
  call add_bodies(scene, reshape([1.2_dp, 0.0_dp], [2, 1]), [2.0_dp], reshape([0.02_dp], [1, 1]), disk, &
                  velocity=reshape([-3.0_dp, 0.0_dp, 0.0_dp], [3, 1]))
  call add_contactors(scene, "disk", [disk], [rock], [0.15_dp])

  call create_mesh(mesh, reshape([0.0_dp, 2.0_dp, 1.0_dp, 2.0_dp, 1.0_dp, 3.0_dp, 0.0_dp, 3.0_dp], [2, 4]))
  call add_solid_cells(mesh, "q4", reshape([0, 1, 2, 3], [4, 1]), "neo_hookean", ["young  ", "poisson"], [1e5_dp, 0.3_dp], &
                       1000.0_dp, kinematics="total_lagrangian")
  call set_damping(mesh, 25.0_dp, 0.0_dp, .true.)
  call hold_nodes(mesh, [0, 3], [.true., .false.])
  call hold_nodes(mesh, [0], [.false., .true.])
  call add_mesh(scene, mesh, "rubber", rock, block)
  call destroy_mesh(mesh)

  call create_simulation(simulation, scene)
  call press_mesh(simulation, block, reshape([1, 2], [2, 1]), set)
  call set_pressure(simulation, block, set, 1e3_dp, 1e3_dp)
  do i = 1, 800
    call step_simulation(simulation, 1e-3_dp)
    status = report_text(simulation, "status")
    call expect(status == "converged", "a step converges")
  end do
  call expect(row_there%calls > 800, "the program finds the forces")
  closure = energy_term(simulation, "closure")
  in_play = energy_term(simulation, "in_play")
  stored = energy_term(simulation, "stored")
  call expect(abs(closure) < 1e-9_dp*in_play .and. stored > 0, "the balance closes")
  call mesh_cells(simulation, block, "stress", values)
  call expect(abs(values(1, 1) + 1e3_dp) < 20, "the rubber bears the pressure")
  call mesh_field(simulation, block, "reaction", values)
  call expect(abs(sum(values(1, :)) - 1e3_dp) < 30, "what holds it bears it")
  print "(a, f8.3, a)", "the disk was thrown back, and the rubber bears", sum(values(1, :)), " N"
contains
  subroutine expect(holds, what)
    logical, intent(in) :: holds
    character(*), intent(in) :: what
    if (.not. holds) error stop "wrong: "//what
  end subroutine expect
end program main
