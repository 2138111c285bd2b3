!> Bars, beams and tied sides of Cairn for Fortran. Programs use the module cairn.
module cairn_frames
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_meshes, only: cairn_mesh
  implicit none
  private
  public :: set_bars, set_beams, set_kinematics, tie_sides

  interface
    integer(c_int32_t) function c_mesh_set_bars(mesh, n, node, young, area, density, initial_stress, error) &
        bind(c, name="cairn_mesh_set_bars")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      real(c_double), intent(in) :: young(*), area(*), density(*)
      real(c_double), intent(in), optional :: initial_stress(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_beams(mesh, n, node, young, area, density, initial_stress, inertia, shear_area, &
        torsion, poisson, up, clamped, clamped_node, error) bind(c, name="cairn_mesh_set_beams")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: n
      integer(c_int32_t), intent(in) :: node(*)
      real(c_double), intent(in) :: young(*), area(*), density(*), inertia(*)
      real(c_double), intent(in), optional :: initial_stress(*), shear_area(*), torsion(*), up(*)
      real(c_double), value :: poisson
      integer(c_int64_t), value :: clamped
      integer(c_int32_t), intent(in) :: clamped_node(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_set_kinematics(mesh, kinematics, error) bind(c, name="cairn_mesh_set_kinematics")
      import
      type(c_ptr), value :: mesh
      character(kind=c_char), intent(in) :: kinematics(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_mesh_tie_sides(mesh, followers, follow, leaders, lead, within, error) &
        bind(c, name="cairn_mesh_tie_sides")
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: followers, leaders
      integer(c_int32_t), intent(in) :: follow(*), lead(*)
      real(c_double), value :: within
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> Bars between nodes, about which they turn freely, instead of cells; half of the mass of each at both of its ends.
  subroutine set_bars(mesh, node, young, area, density, initial_stress, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in), contiguous :: node(:, :)                          !< (2, n) from 0
    real(dp), intent(in), contiguous :: young(:), area(:), density(:)      !< (n) [Pa], [m2], [kg/m3]
    real(dp), intent(in), contiguous, optional :: initial_stress(:)        !< (n) [Pa] along each, tension positive; none
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. fits(node, young, area, density, initial_stress, error)) return
    call report_back(c_mesh_set_bars(mesh%handle, size(node, 2, c_int64_t), int(node, c_int32_t), young, area, density, &
                                     initial_stress, what), what, error)
  end subroutine set_bars

  !> Beams, stiffly joined, instead of cells: rotations have no inertia and follow the displacements.
  subroutine set_beams(mesh, node, young, area, density, inertia, shear_area, torsion, initial_stress, poisson, up, clamped, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in), contiguous :: node(:, :)                          !< (2, n) from 0
    real(dp), intent(in), contiguous :: young(:), area(:), density(:)      !< (n) [Pa], [m2], [kg/m3]
    real(dp), intent(in), contiguous :: inertia(:, :)                      !< (1, n), in 3D (2, n) [m4]: along both axes
    real(dp), intent(in), contiguous, optional :: shear_area(:)            !< (n) [m2]; they do not shear
    real(dp), intent(in), contiguous, optional :: torsion(:)               !< (n) [m4]; the sum of both moments
    real(dp), intent(in), contiguous, optional :: initial_stress(:)        !< (n) [Pa] along each, tension positive; none
    real(dp), intent(in), optional :: poisson                              !< 0.3
    real(dp), intent(in), contiguous, optional :: up(:)                    !< (3) the second axis is in its and the beam's plane; z
    integer, intent(in), optional :: clamped(:)                            !< nodes that do not turn, from 0; none
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t), allocatable :: still(:)
    real(dp) :: ratio
    type(c_error) :: what

    if (.not. fits(node, young, area, density, initial_stress, error)) return
    if (.not. has_size("inertia", size(inertia), (mesh%dim - 1)*size(node, 2), error)) return
    if (present(shear_area)) then
      if (.not. has_size("shear_area", size(shear_area), size(node, 2), error)) return
    end if
    if (present(torsion)) then
      if (.not. has_size("torsion", size(torsion), size(node, 2), error)) return
    end if
    if (present(up)) then
      if (.not. has_size("up", size(up), 3, error)) return
    end if
    ratio = 0.3_dp
    if (present(poisson)) ratio = poisson
    allocate (still(0))
    if (present(clamped)) still = int(clamped, c_int32_t)
    call report_back(c_mesh_set_beams(mesh%handle, size(node, 2, c_int64_t), int(node, c_int32_t), young, area, density, &
                                      initial_stress, inertia, shear_area, torsion, ratio, up, size(still, kind=c_int64_t), &
                                      still, what), what, error)
  end subroutine set_beams

  !> How far these bars or beams move, after the call that gives them: "small", their matrices; "corotational", turns of any size;
  !> of bars also "total_lagrangian", Green's strain and the second stress of Piola and Kirchhoff.
  subroutine set_kinematics(mesh, kinematics, error)
    type(cairn_mesh), intent(in) :: mesh
    character(*), intent(in) :: kinematics
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_mesh_set_kinematics(mesh%handle, c_text(kinematics), what), what, error)
  end subroutine set_kinematics

  !> Ties slave sides to master sides weakly, by dual mortar multipliers on their overlap; both as touch_sides takes them.
  subroutine tie_sides(mesh, follow, lead, within, error)
    type(cairn_mesh), intent(in) :: mesh
    integer, intent(in), contiguous :: follow(:, :), lead(:, :)            !< from 0, the finer ones follow
    real(dp), intent(in), optional :: within                               !< distance between both over their size, 1e-6
    type(cairn_error), intent(out), optional :: error
    real(dp) :: reach
    type(c_error) :: what

    if (.not. has_size("follow", size(follow), merge(2, 4, mesh%dim == 2)*size(follow, 2), error)) return
    if (.not. has_size("lead", size(lead), merge(2, 4, mesh%dim == 2)*size(lead, 2), error)) return
    reach = 1e-6_dp
    if (present(within)) reach = within
    call report_back(c_mesh_tie_sides(mesh%handle, size(follow, 2, c_int64_t), int(follow, c_int32_t), &
                                      size(lead, 2, c_int64_t), int(lead, c_int32_t), reach, what), what, error)
  end subroutine tie_sides

  logical function fits(node, young, area, density, initial_stress, error)
    integer, intent(in) :: node(:, :)
    real(dp), intent(in) :: young(:), area(:), density(:)
    real(dp), intent(in), optional :: initial_stress(:)
    type(cairn_error), intent(out), optional :: error

    fits = has_size("node", size(node), 2*size(node, 2), error)
    if (fits) fits = has_size("young", size(young), size(node, 2), error)
    if (fits) fits = has_size("area", size(area), size(node, 2), error)
    if (fits) fits = has_size("density", size(density), size(node, 2), error)
    if (fits .and. present(initial_stress)) fits = has_size("initial_stress", size(initial_stress), size(node, 2), error)
  end function fits
end module cairn_frames
