!> Deformable bodies whose compliance S between contact nodes would exceed the memory. S = unit Z' Z is kept by its factor, L Z = B'
!> of A = L L' (entries of a unit are powers of two). A column of Z is nonzero only along the path from its node to the root of the
!> elimination tree (its reach, Gilbert & Peierls 1988). The effect of impulses is accumulated in y = unit Z H r, in the order of
!> elimination: the velocity of a node is its own plus Z' y, and an impulse adds to y along the reach of its nodes. Sweeps equal
!> those over S up to rounding.
module reached_bodies
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_int64_t, c_ptr
  use contact_batch, only: cairn_condensed, cairn_reach, mapping_nodes
  implicit none
  private
  public :: is_reached, load_reached, load_reached_spins, add_reached, block_between, cairn_reached_velocity, cairn_condensed_block
contains

  pure logical function is_reached(body)
    type(cairn_condensed), intent(in) :: body
    is_reached = c_associated(body%reach)
  end function is_reached

  !> v = v + the part of the velocities of points that impulses made, of contacts on bodies of this kind.
  subroutine load_reached(n, contacts, dim, body, node, weight, condensed, v)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: dim          !< 2 or 3
    integer(c_int32_t), intent(in)    :: body(n)      !< which condensed body, from 0
    integer(c_int32_t), intent(in)    :: node(n, mapping_nodes) !< places among its contact nodes, from 0
    real(c_double), intent(in)        :: weight(n, mapping_nodes) !< of the nodes [-]
    type(cairn_condensed), intent(in) :: condensed(0:*)
    real(c_double), intent(inout)     :: v(n, dim)    !< [m/s]
    real(c_double) :: of_node(3)
    integer :: i, j
    do i = 1, contacts
      if (.not. is_reached(condensed(body(i)))) cycle
      do j = 1, mapping_nodes
        if (.not. abs(weight(i, j)) > 0) cycle
        call velocity_of(dim, condensed(body(i)), node(i, j), of_node)
        v(i, :) = v(i, :) + weight(i, j)*of_node(:dim)
      end do
    end do
  end subroutine load_reached

  !> The same of the spins of faces.
  subroutine load_reached_spins(n, contacts, c, dim, body, node, spin, condensed, v)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: c            !< components of a contact
    integer, value                    :: dim          !< 2 or 3
    integer(c_int32_t), intent(in)    :: body(n)      !< which condensed body, from 0
    integer(c_int32_t), intent(in)    :: node(n, mapping_nodes) !< places among its contact nodes, from 0
    real(c_double), intent(in)        :: spin(n, dim, mapping_nodes, c - dim) !< of nodes [1/m]
    type(cairn_condensed), intent(in) :: condensed(0:*)
    real(c_double), intent(inout)     :: v(n, c - dim) !< [rad/s]
    real(c_double) :: of_node(3)
    integer :: i, j, k
    do i = 1, contacts
      if (.not. is_reached(condensed(body(i)))) cycle
      do j = 1, mapping_nodes
        if (.not. any(abs(spin(i, :, j, :)) > 0)) cycle
        call velocity_of(dim, condensed(body(i)), node(i, j), of_node)
        do k = 1, c - dim
          v(i, k) = v(i, k) + dot_product(spin(i, :, j, k), of_node(:dim))
        end do
      end do
    end do
  end subroutine load_reached_spins

  !> Z' y of one contact node.
  subroutine cairn_reached_velocity(dimension, body, node, velocity) bind(c)
    integer(c_int32_t), value         :: dimension !< 2 or 3
    type(cairn_condensed), intent(in) :: body      !< see cairn/core.h
    integer(c_int32_t), value         :: node      !< place among its contact nodes, from 0
    real(c_double), intent(out)       :: velocity(dimension) !< [m/s]
    real(c_double) :: v(3)
    call velocity_of(int(dimension), body, node, v)
    velocity = v(:dimension)
  end subroutine cairn_reached_velocity

  subroutine velocity_of(dim, body, node, velocity)
    integer, intent(in)               :: dim
    type(cairn_condensed), intent(in) :: body
    integer(c_int32_t), intent(in)    :: node
    real(c_double), intent(out)       :: velocity(3)
    type(cairn_reach), pointer :: reach
    integer(c_int64_t), pointer, contiguous :: place(:), length(:)
    real(c_double), pointer, contiguous :: value(:), y(:)
    integer(c_int64_t) :: from, k
    call c_f_pointer(body%reach, reach)
    call c_f_pointer(reach%y, y, [reach%numbers])
    call open_node(dim, reach, node, place, length, value)
    velocity = 0
    from = 0
    do k = 1, size(place, kind=c_int64_t)
      call add_products(dim, length(k), value(from + 1:from + dim*length(k)), y(place(k) + 1:place(k) + length(k)), velocity)
      from = from + dim*length(k)
    end do
  end subroutine velocity_of

  !> Segments of the reach of a node: where they begin in y and how long they are; its columns, segment by segment.
  subroutine open_node(dim, reach, node, place, length, value)
    integer, intent(in)            :: dim
    type(cairn_reach), intent(in)  :: reach
    integer(c_int32_t), intent(in) :: node !< from 0
    integer(c_int64_t), pointer, contiguous, intent(out) :: place(:), length(:)
    real(c_double), pointer, contiguous, intent(out)     :: value(:)
    integer(c_int64_t), pointer, contiguous :: first(:), all_places(:), all_lengths(:)
    type(c_ptr), pointer, contiguous :: values(:)
    call c_f_pointer(reach%first, first, [node + 2])
    call c_f_pointer(reach%place, all_places, [first(node + 2)])
    call c_f_pointer(reach%length, all_lengths, [first(node + 2)])
    call c_f_pointer(reach%value, values, [node + 1])
    place => all_places(first(node + 1) + 1:first(node + 2))
    length => all_lengths(first(node + 1) + 1:first(node + 2))
    call c_f_pointer(values(node + 1), value, [dim*sum(length)])
  end subroutine open_node

  pure subroutine add_products(dim, length, value, y, sum)
    integer, intent(in)            :: dim
    integer(c_int64_t), intent(in) :: length
    real(c_double), intent(in)     :: value(length, dim), y(length)
    real(c_double), intent(inout)  :: sum(3)
    integer :: k
    do k = 1, dim
      sum(k) = sum(k) + by_eights(length, value(:, k), y)
    end do
  end subroutine add_products

  !> A product in eight sums, in an order that the processor does not choose.
  pure real(c_double) function by_eights(length, a, b) result(total)
    integer(c_int64_t), intent(in) :: length
    real(c_double), intent(in)     :: a(length), b(length)
    real(c_double) :: s(8)
    integer(c_int64_t) :: i, whole
    integer :: k
    s = 0
    whole = length - mod(length, 8_c_int64_t)
    do i = 1, whole, 8
      do k = 1, 8
        s(k) = s(k) + a(i + k - 1)*b(i + k - 1)
      end do
    end do
    do i = whole + 1, length
      s(i - whole) = s(i - whole) + a(i)*b(i)
    end do
    total = ((s(1) + s(5)) + (s(3) + s(7))) + ((s(2) + s(6)) + (s(4) + s(8)))
  end function by_eights

  !> Adds an impulse p on a node: y = y + unit Z p.
  subroutine add_reached(dim, body, node, p)
    integer, intent(in)               :: dim
    type(cairn_condensed), intent(in) :: body
    integer(c_int32_t), intent(in)    :: node !< from 0
    real(c_double), intent(in)        :: p(3) !< [N s]
    type(cairn_reach), pointer :: reach
    integer(c_int64_t), pointer, contiguous :: place(:), length(:)
    real(c_double), pointer, contiguous :: value(:), y(:)
    integer(c_int64_t) :: from, k
    call c_f_pointer(body%reach, reach)
    call c_f_pointer(reach%y, y, [reach%numbers])
    call open_node(dim, reach, node, place, length, value)
    from = 0
    do k = 1, size(place, kind=c_int64_t)
      call add_segment(dim, length(k), reach%unit*p, value(from + 1:from + dim*length(k)), y(place(k) + 1:place(k) + length(k)))
      from = from + dim*length(k)
    end do
  end subroutine add_reached

  pure subroutine add_segment(dim, length, p, value, y)
    integer, intent(in)            :: dim
    integer(c_int64_t), intent(in) :: length
    real(c_double), intent(in)     :: p(3), value(length, dim)
    real(c_double), intent(inout)  :: y(length)
    integer(c_int64_t) :: i
    if (dim == 2) then
      do i = 1, length
        y(i) = y(i) + (p(1)*value(i, 1) + p(2)*value(i, 2))
      end do
    else
      do i = 1, length
        y(i) = y(i) + (p(1)*value(i, 1) + p(2)*value(i, 2) + p(3)*value(i, 3))
      end do
    end if
  end subroutine add_segment

  !> Compliance between two contact nodes of a body, of either kind.
  subroutine block_between(dim, body, row, column, block)
    integer, intent(in)               :: dim
    type(cairn_condensed), intent(in) :: body
    integer(c_int32_t), intent(in)    :: row, column !< nodes, from 0
    real(c_double), intent(out)       :: block(dim, dim) !< [1/kg]
    real(c_double), pointer, contiguous :: compliance(:, :)
    if (is_reached(body)) then
      call product_of(dim, body, row, column, block)
    else
      call c_f_pointer(body%compliance, compliance, [body%leading, body%dofs])
      block = compliance(dim*row + 1:dim*row + dim, dim*column + 1:dim*column + dim)
    end if
  end subroutine block_between

  subroutine cairn_condensed_block(dimension, body, row, column, block) bind(c)
    integer(c_int32_t), value         :: dimension !< 2 or 3
    type(cairn_condensed), intent(in) :: body      !< see cairn/core.h
    integer(c_int32_t), value         :: row, column !< contact nodes, from 0
    real(c_double), intent(out)       :: block(dimension, dimension) !< [1/kg]
    call block_between(int(dimension), body, row, column, block)
  end subroutine cairn_condensed_block

  !> unit Z' Z where the reaches of both nodes meet.
  subroutine product_of(dim, body, row, column, block)
    integer, intent(in)               :: dim
    type(cairn_condensed), intent(in) :: body
    integer(c_int32_t), intent(in)    :: row, column
    real(c_double), intent(out)       :: block(dim, dim)
    type(cairn_reach), pointer :: reach
    integer(c_int64_t), pointer, contiguous :: place_a(:), length_a(:), place_b(:), length_b(:)
    real(c_double), pointer, contiguous :: a(:), b(:)
    integer(c_int64_t) :: i, j, from_a, from_b, begin, n, at_a, at_b
    integer :: k, l
    call c_f_pointer(body%reach, reach)
    call open_node(dim, reach, row, place_a, length_a, a)
    call open_node(dim, reach, column, place_b, length_b, b)
    block = 0
    i = 1
    j = 1
    from_a = 0
    from_b = 0
    do while (i <= size(place_a) .and. j <= size(place_b))
      begin = max(place_a(i), place_b(j))
      n = min(place_a(i) + length_a(i), place_b(j) + length_b(j)) - begin
      do l = 1, merge(dim, 0, n > 0)
        at_b = from_b + (l - 1)*length_b(j) + begin - place_b(j)
        do k = 1, dim
          at_a = from_a + (k - 1)*length_a(i) + begin - place_a(i)
          block(k, l) = block(k, l) + by_eights(n, a(at_a + 1:at_a + n), b(at_b + 1:at_b + n))
        end do
      end do
      if (place_a(i) + length_a(i) <= place_b(j) + length_b(j)) then
        from_a = from_a + dim*length_a(i)
        i = i + 1
      else
        from_b = from_b + dim*length_b(j)
        j = j + 1
      end if
    end do
    block = reach%unit*block
  end subroutine product_of
end module reached_bodies
