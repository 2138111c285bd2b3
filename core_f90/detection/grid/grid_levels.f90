!> The hierarchical grid: contactors of like reach share a level, whose cells are just as wide as two reaches, so that
!> whoever meets one of them stands in its cell or beside it (after Ericson 2005, Krijgsman et al. 2014).
module grid_levels
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_grid_classes, cairn_grid_level, cairn_grid_box, cairn_grid_keys
  public :: cell_coordinate, packed_coordinate

  integer, parameter :: fraction_bits = 52, class_bits = 4
  ! far beyond what a product with an inverse cell may be, and far inside 64 bits
  real(c_double), parameter :: farthest = 2.0_c_double**61

contains

  !> How many items, and the widest significand, in each of 16 classes of the significand of their reach; its range.
  pure subroutine cairn_grid_classes(n, reach, items, widest, smallest, largest) bind(c)
    integer(c_int64_t), value :: n                     !< items
    real(c_double), intent(in) :: reach(n)             !< positive [m]
    integer(c_int64_t), intent(out) :: items(0:15)
    real(c_double), intent(out) :: widest(0:15)        !< significand, in 1..2
    real(c_double), intent(out) :: smallest, largest   !< [m]
    integer(c_int64_t) :: i, bits, most(0:15)
    integer(c_int32_t) :: class

    items = 0
    most = 0
    do i = 1, n
      bits = transfer(reach(i), bits)
      class = int(iand(shiftr(bits, fraction_bits - class_bits), 15_c_int64_t), c_int32_t)
      items(class) = items(class) + 1
      most(class) = max(most(class), iand(bits, shiftl(1_c_int64_t, fraction_bits) - 1))
    end do
    smallest = minval(reach)
    largest = maxval(reach)
    widest = 1 + scale(real(most, c_double), -fraction_bits)
  end subroutine cairn_grid_classes

  !> Level of each item: the lowest whose cells hold it, cell = 2**level * unit. How many items each level has.
  pure subroutine cairn_grid_level(first, last, reach, unit, lowest, highest, level, items) bind(c)
    integer(c_int64_t), value :: first, last           !< items to treat
    real(c_double), intent(in) :: reach(0:last - 1)    !< [m]
    real(c_double), value :: unit                      !< half the cell of level 0, a little widened [m]
    integer(c_int32_t), value :: lowest, highest       !< levels
    integer(c_int32_t), intent(inout) :: level(0:last - 1)
    integer(c_int64_t), intent(inout) :: items(lowest:highest)
    integer(c_int64_t) :: i, bits
    real(c_double) :: inverse

    inverse = 1/unit
    do i = first, last - 1
      bits = transfer(reach(i)*inverse, bits)
      level(i) = max(lowest, min(highest, int(shiftr(bits, fraction_bits), c_int32_t) - 1022))
    end do
    do i = first, last - 1
      items(level(i)) = items(level(i)) + 1
    end do
  end subroutine cairn_grid_level

  !> Smallest and largest position of the items of each level; both are kept from call to call.
  pure subroutine cairn_grid_box(dim, first, last, x, level, lowest, highest, low, high) bind(c)
    integer(c_int32_t), value :: dim                   !< 2 or 3
    integer(c_int64_t), value :: first, last           !< items to treat
    real(c_double), intent(in) :: x(dim, 0:last - 1)   !< centres [m]
    integer(c_int32_t), intent(in) :: level(0:last - 1)
    integer(c_int32_t), value :: lowest, highest       !< levels
    real(c_double), intent(inout) :: low(3, lowest:highest), high(3, lowest:highest) !< [m]
    integer(c_int64_t) :: i
    integer(c_int32_t) :: k

    do i = first, last - 1
      do k = 1, dim
        low(k, level(i)) = min(low(k, level(i)), x(k, i))
        high(k, level(i)) = max(high(k, level(i)), x(k, i))
      end do
    end do
  end subroutine cairn_grid_box

  !> Key of each item: level, then row by row the cell in it. Keys of neighbours along x differ by 1.
  pure subroutine cairn_grid_keys(dim, first, last, x, level, lowest, highest, inverse_cell, origin, stride, first_key, &
                                  table_first, table_size, table, table_place, key) bind(c)
    integer(c_int32_t), value :: dim                   !< 2 or 3
    integer(c_int64_t), value :: first, last           !< items to treat
    real(c_double), intent(in) :: x(dim, 0:last - 1)   !< centres [m]
    integer(c_int32_t), intent(in) :: level(0:last - 1)
    integer(c_int32_t), value :: lowest, highest       !< levels
    real(c_double), intent(in) :: inverse_cell(lowest:highest) !< [1/m]
    integer(c_int64_t), intent(in) :: origin(3, lowest:highest) !< grid coordinate that is numbered 0
    integer(c_int64_t), intent(in) :: stride(3, lowest:highest) !< change of the key from one cell to the next along an axis
    integer(c_int64_t), intent(in) :: first_key(lowest:highest)
    integer(c_int64_t), intent(in) :: table_first(3, lowest:highest), table_size(3, lowest:highest) !< see packed_coordinate
    integer(c_int64_t), intent(in) :: table(0:*), table_place(0:*)
    integer(c_int64_t), intent(inout) :: key(0:last - 1)
    integer(c_int64_t) :: i, c
    integer(c_int32_t) :: k, l

    do i = first, last - 1
      l = level(i)
      key(i) = first_key(l)
      do k = 1, dim
        c = cell_coordinate(x(k, i), inverse_cell(l))
        if (table_size(k, l) == 0) then
          c = c - origin(k, l)
        else
          c = packed_coordinate(c, table_size(k, l), table(table_first(k, l)), table_place(table_first(k, l)))
        end if
        key(i) = key(i) + stride(k, l)*c
      end do
    end do
  end subroutine cairn_grid_keys

  !> Cell along an axis. Positions beyond 64 bits share the last cell, which is correct, but slow. Rounding does not part
  !> neighbours: if x2*inverse <= x1*inverse + 1, so are their roundings as long as 1 is a multiple of their last digit; beyond
  !> that, positions have no digits below the size of a cell.
  elemental function cell_coordinate(x, inverse_cell) result(c)
    real(c_double), intent(in) :: x, inverse_cell
    integer(c_int64_t) :: c
    c = floor(max(-farthest, min(x*inverse_cell, farthest)), c_int64_t)
  end function cell_coordinate

  !> Place of a coordinate on an axis where wide stretches without items are cut short: places of occupied coordinates are
  !> those of the table, and adjacent coordinates have adjacent places.
  pure function packed_coordinate(c, n, table, place) result(packed)
    integer(c_int64_t), intent(in) :: c                !< cell coordinate
    integer(c_int64_t), intent(in) :: n                !< occupied coordinates, at least 1
    integer(c_int64_t), intent(in) :: table(0:n - 1)   !< occupied coordinates, ascending
    integer(c_int64_t), intent(in) :: place(0:n - 1)   !< their places: steps of more than 4 cut to 4
    integer(c_int64_t) :: packed, low, high, middle

    low = -1
    high = n
    do while (high - low > 1)
      middle = (low + high)/2
      if (table(middle) <= c) then
        low = middle
      else
        high = middle
      end if
    end do
    if (low < 0) then
      packed = place(0) - min(table(0) - c, 2_c_int64_t)
    else if (low == n - 1) then
      packed = place(low) + min(c - table(low), 2_c_int64_t)
    else if (table(high) - c == 1 .and. c - table(low) > 1) then
      packed = place(high) - 1
    else
      packed = place(low) + min(c - table(low), 2_c_int64_t)
    end if
  end function packed_coordinate

end module grid_levels
