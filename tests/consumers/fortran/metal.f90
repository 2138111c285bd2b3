!> A Fortran program with a material of its own, a subroutine UMAT that it links (tests/python/solids/umat.f90), and the same from
!> a shared library whose path is its argument: a bar that is drawn until it yields, and until the routine gives up.
program metal
  use, intrinsic :: iso_c_binding, only: c_funloc, c_null_funptr
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0)
  real(dp), parameter :: h = 1e-3_dp, props(3) = [300.0_dp, 0.3_dp, 2.0_dp] ! young, poisson, yield stress [Pa]
  character(*), parameter :: names(3) = ["young  ", "poisson", "yield  "]
  type(cairn_error) :: error
  type(cairn_simulation) :: bar
  real(dp), allocatable :: own(:, :), other(:, :), strain(:, :)
  character(4096) :: library
  external :: umat

  call give_material("own", c_null_funptr, 1, error)
  call expect(index(error%message, "routine is NULL") > 0, "a routine that there is not is refused")
  call give_material("own", c_funloc(umat), 1)
  call draw("own", names, props, own)
  call mesh_cells(bar, 0, "statev1", strain)
  call expect(maxval(strain) > 1e-3_dp, "it yields, and tells its own state")
  call expect(energy_term(bar, "dissipated_material") > 0, "which is dissipated")
  call step_simulation(bar, 10.0_dp, error=error) ! beyond half of strain it calls XIT
  call expect(index(error%message, "quad cell") > 0 .and. index(error%message, "own calls XIT") > 0 &
              .and. index(error%message, "bar") > 0, "what it refuses names mesh and cell: "//error%message)
  call mesh_field(bar, 0, "displacement", other)
  call expect(maxval(abs(own - other)) <= 0, "and leaves all as it was")
  call step_simulation(bar, h)
  call destroy_simulation(bar)

  call draw("j2_plasticity", ["young       ", "poisson     ", "yield_stress"], props, other)
  call expect(maxval(abs(own - other)) < 1e-9_dp*maxval(abs(own)), "it is plasticity")
  call destroy_simulation(bar)
  print "(a, *(1x, es24.16e3))", "displacement", own

  if (command_argument_count() > 0) then
    call get_command_argument(1, library)
    call plug_material(library, "plugged", 1, routine="other", error=error)
    call expect(index(error%message, "has no routine other") > 0, "a routine by its name")
    call plug_material(library, "plugged", 1)
    call draw("plugged", names, props, other)
    call expect(maxval(abs(own - other)) < 1e-9_dp*maxval(abs(own)), "of a library it is the same")
    call destroy_simulation(bar)
    call plug_material(library, "flat", 1, plane_stress=.true.)
    call add_flat(error)
    call expect(index(error%message, "flat is a routine for plane stress") > 0, "of plane stress alone: "//error%message)
  end if
  call give_material("flat", c_funloc(umat), 1, plane_stress=.true.)
  call add_flat(error)
  call expect(index(error%message, "flat is a routine for plane stress") > 0, "of plane stress alone: "//error%message)
contains
  !> One that is for plane stress, in plane strain.
  subroutine add_flat(error)
    type(cairn_error), intent(out) :: error
    real(dp), parameter :: place(2, 4) = reshape([0, 0, 1, 0, 1, 1, 0, 1], [2, 4])
    type(cairn_mesh) :: mesh

    call create_mesh(mesh, place)
    call add_solid_cells(mesh, "q4", reshape([0, 1, 2, 3], [4, 1]), "flat", names, props, 1e-3_dp, error=error)
    call destroy_mesh(mesh)
  end subroutine add_flat


  !> Two squares side by side, held on the left, drawn on the right.
  subroutine draw(material, words, values, moved)
    character(*), intent(in) :: material, words(:)
    real(dp), intent(in) :: values(:)
    real(dp), allocatable, intent(out) :: moved(:, :)
    real(dp), parameter :: place(2, 6) = reshape([0, 0, 1, 0, 2, 0, 0, 1, 1, 1, 2, 1], [2, 6])
    type(cairn_scene) :: scene
    type(cairn_mesh) :: mesh
    real(dp) :: velocity(2, 6)
    integer :: rock, number, step

    call create_scene(scene, 2)
    call add_material(scene, "rock", rock)
    call create_mesh(mesh, place)
    call add_solid_cells(mesh, "q4", reshape([0, 1, 4, 3, 1, 2, 5, 4], [4, 2]), material, words, values, 1e-3_dp)
    call hold_nodes(mesh, [0, 3], [.true., .true.])
    call hold_nodes(mesh, [2, 5], [.true., .false.])
    call add_mesh(scene, mesh, "bar", rock, number)
    call destroy_mesh(mesh)
    call create_simulation(bar, scene)
    call destroy_scene(scene)
    call set_number(bar, "newton_tol", 1e-12_dp)
    velocity = 0
    velocity(1, [3, 6]) = 0.5_dp
    call load_mesh(bar, number, held_velocity=velocity)
    do step = 1, 40
      call step_simulation(bar, h)
    end do
    call mesh_field(bar, number, "displacement", moved)
  end subroutine draw

  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program metal
