!> Smooth DEM in a Fortran program, for comparison with the C API: laws with their options, growth of bodies.
module fortran_smooth
  use, intrinsic :: iso_c_binding
  use cairn
  implicit none
  private
  public :: cairn_fortran_smooth_force, cairn_fortran_growth
  real(c_double), parameter :: radius = 0.01_c_double, overlap = 1e-5_c_double, young = 1e8_c_double
contains

  !> Force of law 1, 2 or 3 on a sphere that overlaps a plane, and the code of the error of a wrong option.
  subroutine cairn_fortran_smooth_force(law, force, refused) bind(c)
    integer(c_int32_t), value       :: law
    real(c_double), intent(out)     :: force
    integer(c_int32_t), intent(out) :: refused
    type(cairn_scene) :: scene
    type(cairn_simulation) :: simulation
    type(cairn_error) :: error
    real(c_double), allocatable :: impulse(:, :)
    real(c_double) :: inertia(3, 1), up(4, 1)
    integer(c_int64_t) :: first, plane
    integer :: rock
    real(c_double), parameter :: h = 1e-9_c_double, third(17) = [ &
      1.0_c_double, young, 0.3_c_double, 0.0_c_double, 0.0_c_double, 1.0_c_double, 2.0_c_double, 2.0_c_double/7, 0.5_c_double, &
      2.0_c_double, 0.1_c_double, 2.25_c_double, 0.3_c_double, 2.0_c_double, 0.0_c_double, 1.0_c_double, -1.0_c_double]

    call create_scene(scene, 3)
    call set_gravity(scene, [0.0_c_double, 0.0_c_double, -9.81_c_double])
    call add_material(scene, "rock", rock)
    select case (law)
    case (1)
      call set_default_law(scene, "GranularContact", third)
    case (2)
      call set_default_law(scene, "PlasticContact", [1e5_c_double, 3e5_c_double, 1e4_c_double, 0.05_c_double, 0.0_c_double, &
                                                     2.0_c_double/7, 0.5_c_double])
    case default
      call set_default_law(scene, "LiquidBridge", [young, 0.07_c_double, 1e-10_c_double, 0.3_c_double, 1.0_c_double, &
                                                   0.3_c_double, 1.0_c_double, 0.5_c_double])
    end select
    inertia = 4e-5_c_double
    call add_bodies(scene, reshape([0.0_c_double, 0.0_c_double, radius - overlap], [3, 1]), [1.0_c_double], inertia, first=first)
    call add_contactors(scene, "sphere", [first], [rock], radius=[radius])
    inertia = ieee_infinity()
    call add_bodies(scene, reshape([0.0_c_double, 0.0_c_double, 0.0_c_double], [3, 1]), [ieee_infinity()], inertia, first=plane)
    up(:, 1) = [0.0_c_double, 0.0_c_double, 1.0_c_double, 0.0_c_double]
    call add_contactors(scene, "plane", [plane], [rock], direction=up)
    call create_simulation(simulation, scene)
    call set_option(simulation, "strategy", "smooth_dem")
    call set_number(simulation, "mass_scale", 0.5_c_double, error)
    refused = error%code
    call step_simulation(simulation, h)
    call contact_field(simulation, "impulse", impulse)
    force = impulse(3, 1)/h
    call destroy_simulation(simulation)
    call destroy_scene(scene)
  end subroutine cairn_fortran_smooth_force

  !> Mass of a disk that grows for a second, and three steps after its end; the code of the error of a wrong rate.
  subroutine cairn_fortran_growth(mass, refused) bind(c)
    real(c_double), intent(out)     :: mass(2)
    integer(c_int32_t), intent(out) :: refused
    type(cairn_scene) :: scene
    type(cairn_simulation) :: simulation
    type(cairn_error) :: error
    real(c_double), allocatable :: found(:, :)
    integer(c_int64_t) :: first
    integer :: rock, k

    call create_scene(scene, 2)
    call add_material(scene, "rock", rock)
    call add_bodies(scene, reshape([0.0_c_double, 0.0_c_double], [2, 1]), [2.0_c_double], reshape([0.3_c_double], [1, 1]), &
                    first=first)
    call add_contactors(scene, "disk", [first], [rock], radius=[0.1_c_double])
    call create_simulation(simulation, scene)
    call grow_bodies(simulation, [first], "2*", error)
    refused = error%code
    call grow_bodies(simulation, [first], "2*t")
    do k = 1, 100
      call step_simulation(simulation, 1e-2_c_double)
    end do
    call body_field(simulation, "mass", found)
    mass(1) = found(1, 1)
    call grow_bodies(simulation, [first])
    do k = 1, 3
      call step_simulation(simulation, 1e-2_c_double)
    end do
    call body_field(simulation, "mass", found)
    mass(2) = found(1, 1)
    call destroy_simulation(simulation)
    call destroy_scene(scene)
  end subroutine cairn_fortran_growth

  real(c_double) function ieee_infinity()
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
    ieee_infinity = ieee_value(1.0_c_double, ieee_positive_inf)
  end function ieee_infinity
end module fortran_smooth
