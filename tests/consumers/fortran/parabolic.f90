!> A Fortran program on its own: blocks of cells of second order, of other sizes above than below, meet on average over their sides
!> (a mortar). A uniform pressure goes through, and one that grows along x ends where it does in Python.
program parabolic
  use, intrinsic :: iso_c_binding, only: c_int32_t
  use cairn
  implicit none
  integer, parameter :: dp = kind(1d0)
  real(dp), parameter :: young = 1e6_dp, poisson = 0.3_dp, pressure = 1e4_dp, h = 0.1_dp
  type(cairn_scene) :: scene
  type(cairn_simulation) :: simulation
  type(cairn_mesh) :: mesh
  type(cairn_report) :: report
  integer, parameter :: corner(3, 8) = reshape([0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 0, 0, 2, 2, 0, 2, 2, 2, 2, 0, 2, 2], [3, 8])
  integer, parameter :: edge(2, 12) = reshape([1, 2, 2, 3, 3, 4, 4, 1, 5, 6, 6, 7, 7, 8, 8, 5, 1, 5, 2, 6, 3, 7, 4, 8], [2, 12])
  integer, parameter :: middle(3, 7) = reshape([0, 1, 1, 2, 1, 1, 1, 0, 1, 1, 2, 1, 1, 1, 0, 1, 1, 2, 1, 1, 1], [3, 7])
  integer, parameter :: tetrahedron(4, 6) = reshape([1, 2, 4, 8, 1, 2, 8, 6, 1, 6, 8, 5, 2, 3, 4, 8, 2, 3, 8, 7, &
                                                     2, 7, 8, 6], [4, 6])
  integer, parameter :: side(2, 6) = reshape([1, 2, 2, 3, 1, 3, 1, 4, 2, 4, 3, 4], [2, 6])
  real(dp), allocatable :: node(:, :), load(:)

  call patch(2, "q8", [2, 1, 0], [3, 1, 0])
  call patch(2, "q9", [3, 1, 0], [2, 1, 0])
  call patch(2, "t6", [2, 1, 0], [3, 1, 0])
  call patch(3, "hex20", [2, 1, 1], [3, 2, 1])
  call patch(3, "hex27", [1, 2, 1], [2, 3, 1])
  call patch(3, "tet10", [2, 2, 1], [3, 2, 1])
contains
  !> A block on another under a pressure on its top, brought to rest by long implicit steps.
  subroutine patch(dim, element, above, below)
    integer, intent(in) :: dim, above(3), below(3)
    character(*), intent(in) :: element
    integer :: rock, over, under, k, turn
    real(dp), allocatable :: force(:, :), moved(:, :), place(:, :), share(:)

    do turn = 1, 2
      call create_scene(scene, dim)
      call add_material(scene, "rock", rock)
      call set_default_law(scene, "GapCoulomb", [0.0_dp])
      call block(dim, element, above, 0.5_dp)
      call hold(dim, dim - 1)
      call touch_nodes(mesh, at(dim, 0.5_dp))
      call set_contact(mesh, .false., .true.)
      call touch_boundary(at(dim, 0.5_dp))
      call add_mesh(scene, mesh, "over", rock, over)
      call destroy_mesh(mesh)
      place = node
      share = load
      call block(dim, element, below, 0.0_dp)
      call hold(dim, dim - 1)
      call hold_nodes(mesh, at(dim, 0.0_dp), [(k == dim, k=1, dim)])
      call touch_boundary(at(dim, 0.5_dp))
      call add_mesh(scene, mesh, "under", rock, under)
      call destroy_mesh(mesh)
      call create_simulation(simulation, scene)
      call destroy_scene(scene)
      call set_number(simulation, "theta", 1.0_dp)
      call set_number(simulation, "tol", 1e-14_dp)
      call set_number(simulation, "max_iter", 50000.0_dp)
      allocate (force(dim, size(share)))
      force = 0
      force(dim, :) = -pressure*share
      if (turn == 2) force(dim, :) = force(dim, :)*(1 + place(1, :)/2)
      call load_mesh(simulation, over, force)
      do k = 1, 60
        call step_simulation(simulation, h, report)
      end do
      call expect(report%status == cairn_converged .and. report%contacts == count(abs(place(dim, :) - 0.5_dp) < 1e-9_dp), &
                  element//": each node of the side meets the block below")
      call mesh_field(simulation, over, "displacement", moved)
      if (turn == 1) then
        call expect(maxval(abs(moved(dim, :)/(pressure/young) + place(dim, :))) < 1e-9_dp, element//": the strain is uniform")
        print "(2a, *(1x, es24.16e3))", element, "_uniform", moved
      else
        print "(2a, *(1x, es24.16e3))", element, "_over", moved
        call mesh_field(simulation, under, "displacement", moved)
        print "(2a, *(1x, es24.16e3))", element, "_under", moved
      end if
      call destroy_simulation(simulation)
      deallocate (force)
    end do
  end subroutine patch

  !> Nodes of a cell of second order from its lower corner, in halves of its sides.
  function nodes_of(element) result(at)
    character(*), intent(in) :: element
    integer, allocatable :: at(:, :, :) !< (3, nodes, cells of a square or cube)
    integer :: k, cell, square(3, 9)

    square = reshape([0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 1, 0, 0, 2, 1, 0, 1, 2, 0, 0, 1, 0, 1, 1, 0], [3, 9])
    select case (element)
    case ("q8")
      at = reshape(square(:, :8), [3, 8, 1])
    case ("q9")
      at = reshape(square, [3, 9, 1])
    case ("t6")
      at = reshape([square(:, [1, 2, 3, 5, 6, 9]), square(:, [1, 3, 4, 9, 7, 8])], [3, 6, 2])
    case ("hex20", "hex27")
      at = reshape([corner, (corner(:, edge(1, :)) + corner(:, edge(2, :)))/2, middle], [3, 27, 1])
      if (element == "hex20") at = at(:, :20, :)
    case ("tet10")
      allocate (at(3, 10, 6))
      do cell = 1, 6
        at(:, :4, cell) = corner(:, tetrahedron(:, cell))
        do k = 1, 6
          at(:, 4 + k, cell) = (at(:, side(1, k), cell) + at(:, side(2, k), cell))/2
        end do
      end do
    end select
  end function nodes_of

  !> A block of side 1, half as high, its lower side there: nodes along the last axis first. And the shares of its nodes in the
  !> forces of a unit pressure on its top.
  subroutine block(dim, element, cells, height)
    integer, intent(in) :: dim, cells(3)
    character(*), intent(in) :: element
    real(dp), intent(in) :: height
    integer, allocatable :: local(:, :, :), number(:, :, :), cell(:, :)
    integer :: i, j, k, l, m, n, c, corners
    real(dp) :: across, weight(3)
    logical :: top(27)

    local = nodes_of(element)
    allocate (number(0:2*cells(1), 0:2*cells(2), 0:2*cells(3)))
    do i = 0, 2*cells(1)
      do j = 0, 2*cells(2)
        do k = 0, 2*cells(3)
          number(i, j, k) = merge(0, -1, belongs(local, [i, j, k], dim))
        end do
      end do
    end do
    if (allocated(node)) deallocate (node)
    allocate (node(dim, count(number == 0)))
    n = 0
    do i = 0, 2*cells(1)
      do j = 0, 2*cells(2)
        do k = 0, 2*cells(3)
          if (number(i, j, k) < 0) cycle
          number(i, j, k) = n
          n = n + 1
          node(1, n) = i/(2.0_dp*cells(1))
          node(2, n) = j/(2.0_dp*cells(2))
          if (dim == 3) node(3, n) = k/(2.0_dp*cells(3))
          node(dim, n) = height + node(dim, n)/2
        end do
      end do
    end do
    allocate (cell(size(local, 2), size(local, 3)*product(cells(:dim))))
    c = 0
    do i = 0, cells(1) - 1
      do j = 0, cells(2) - 1
        do k = 0, max(cells(3), 1) - 1
          do l = 1, size(local, 3)
            c = c + 1
            do m = 1, size(local, 2)
              cell(m, c) = number(2*i + local(1, m, l), 2*j + local(2, m, l), 2*k + local(3, m, l))
            end do
          end do
        end do
      end do
    end do
    across = 1/real(product(cells(:dim - 1)), dp)
    select case (element)
    case ("hex20")
      weight = [-1, 4, 0]*across/12
    case ("hex27")
      weight = [1, 4, 16]*across/36
    case ("tet10")
      weight = [0, 1, 0]*across/6
    case default
      weight = [1, 4, 0]*across/6
    end select
    corners = merge(merge(3, 4, element == "t6"), merge(4, 8, element == "tet10"), dim == 2)
    load = [(0.0_dp, i=1, n)]
    do c = 1, size(cell, 2)
      top(:size(cell, 1)) = abs(node(dim, cell(:, c) + 1) - height - 0.5_dp) < 1e-9_dp
      if (count(top(:size(cell, 1))) < 3*(dim - 1)) cycle
      do m = 1, size(cell, 1)
        if (.not. top(m)) cycle
        l = merge(1, merge(2, 3, m <= 20), m <= corners)
        load(cell(m, c) + 1) = load(cell(m, c) + 1) + weight(l)
      end do
    end do
    call create_mesh(mesh, node)
    call add_elastic_cells(mesh, element, cell, young, poisson, 1000.0_dp, plane_stress=.true.)
  end subroutine block

  !> True if a place of the lattice is a node of a cell.
  pure logical function belongs(local, place, dim)
    integer, intent(in) :: local(:, :, :), place(3), dim
    integer :: l, m

    belongs = .false.
    do l = 1, size(local, 3)
      do m = 1, size(local, 2)
        belongs = belongs .or. all(modulo(place(:dim) - local(:dim, m, l), 2) == 0)
      end do
    end do
  end function belongs

  !> Nodes on a level along the last axis.
  function at(dim, level) result(found)
    integer, intent(in) :: dim
    real(dp), intent(in) :: level
    integer, allocatable :: found(:)
    integer :: i

    found = pack([(i - 1, i=1, size(node, 2))], abs(node(dim, :) - level) < 1e-9_dp)
  end function at

  !> On planes of symmetry, across them.
  subroutine hold(dim, planes)
    integer, intent(in) :: dim, planes
    integer :: i, k

    do k = 1, planes
      call hold_nodes(mesh, pack([(i - 1, i=1, size(node, 2))], abs(node(k, :)) < 1e-9_dp), [(i == k, i=1, dim)])
    end do
  end subroutine hold

  !> Sides of the boundary between nodes.
  subroutine touch_boundary(nodes)
    integer, intent(in) :: nodes(:)
    integer(c_int32_t), allocatable :: sides(:, :)
    logical, allocatable :: kept(:)
    integer :: s, k

    call mesh_boundary(mesh, sides)
    kept = [(all([(sides(k, s) < 0 .or. any(nodes == sides(k, s)), k=1, size(sides, 1))]), s=1, size(sides, 2))]
    call touch_sides(mesh, sides(:, pack([(s, s=1, size(sides, 2))], kept)))
  end subroutine touch_boundary

  subroutine expect(condition, what)
    logical, intent(in) :: condition
    character(*), intent(in) :: what

    if (.not. condition) then
      print "(2a)", "not so: ", what
      error stop 1
    end if
  end subroutine expect
end program parabolic
