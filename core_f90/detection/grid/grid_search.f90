!> Pairs within reach, from items sorted cell by cell. A row of three cells is a stretch of the sorted items, so that the
!> test of distance runs over long loops; and since cells are visited in order, the row beside moves along with them: no
!> table of cells, no hashing, nothing that grows with the domain.
module grid_search
  use, intrinsic :: iso_c_binding, only: c_double, c_int8_t, c_int32_t, c_int64_t
  use grid_levels, only: cell_coordinate, packed_coordinate
  implicit none
  private
  public :: cairn_grid_cells, cairn_grid_gather, cairn_grid_search

  integer, parameter :: most_levels = 64, most_rows = 9, steps_before_bisection = 6
  ! Sums of squares round: the narrow phase has the last word, with one rounding less.
  real(c_double), parameter :: slack = 1 + 2.0_c_double**(-40)
  ! below it squares lose their digits
  real(c_double), parameter :: smallest_square = tiny(1.0_c_double)*2.0_c_double**60

contains

  !> The cells that are not empty: key and first item of each, then one more cell that ends the list.
  pure subroutine cairn_grid_cells(n, key, cell_key, cell_start, cells) bind(c)
    integer(c_int64_t), value :: n                            !< items
    integer(c_int64_t), intent(in) :: key(0:n - 1)            !< sorted
    integer(c_int64_t), intent(inout) :: cell_key(0:n)
    integer(c_int32_t), intent(inout) :: cell_start(0:n)
    integer(c_int64_t), intent(out) :: cells
    integer(c_int64_t) :: previous, i

    cells = 0
    previous = -1
    do i = 0, n - 1
      if (key(i) == previous) cycle
      previous = key(i)
      cell_key(cells) = previous
      cell_start(cells) = int(i, c_int32_t)
      cells = cells + 1
    end do
    cell_key(cells) = huge(previous)
    cell_start(cells) = int(n, c_int32_t)
  end subroutine cairn_grid_cells

  !> Items first to last-1 in sorted order, each component contiguous.
  pure subroutine cairn_grid_gather(dim, n, first, last, order, x, reach, sorted) bind(c)
    integer(c_int32_t), value :: dim                          !< 2 or 3
    integer(c_int64_t), value :: n                            !< items
    integer(c_int64_t), value :: first, last                  !< items to treat
    integer(c_int32_t), intent(in) :: order(0:n - 1)
    real(c_double), intent(in) :: x(dim, 0:n - 1), reach(0:n - 1) !< [m]
    real(c_double), intent(inout) :: sorted(0:n - 1, dim + 1) !< centre, reach [m]
    integer(c_int64_t) :: i

    if (dim == 2) then
      do i = first, last - 1
        sorted(i, 1) = x(1, order(i))
        sorted(i, 2) = x(2, order(i))
        sorted(i, 3) = reach(order(i))
      end do
    else
      do i = first, last - 1
        sorted(i, 1) = x(1, order(i))
        sorted(i, 2) = x(2, order(i))
        sorted(i, 3) = x(3, order(i))
        sorted(i, 4) = reach(order(i))
      end do
    end if
  end subroutine cairn_grid_gather

  !> Pairs of items whose spheres of reach meet, each once, of which one stands in cells first to last-1: the finer of the
  !> two, or the earlier. `found` is their number; they are in `hits` unless its capacity is below `needed`. Items of levels that
  !> stand apart are not paired among themselves.
  subroutine cairn_grid_search(dim, n, sorted, cells, first, last, cell_key, cell_start, levels, level_cell, inverse_cell, &
                                  origin, extent, stride, first_key, table_first, table_size, table, table_place, &
                                  apart, capacity, hits, found, needed) bind(c)
    integer(c_int32_t), value :: dim                          !< 2 or 3
    integer(c_int64_t), value :: n                            !< items
    real(c_double), intent(in) :: sorted(0:n - 1, dim + 1)    !< centre, reach [m]
    integer(c_int64_t), value :: cells, first, last           !< all cells; those to search from
    integer(c_int64_t), intent(in) :: cell_key(0:cells)
    integer(c_int32_t), intent(in) :: cell_start(0:cells)
    integer(c_int32_t), value :: levels                       !< at most 64
    integer(c_int64_t), intent(in) :: level_cell(0:levels)    !< first cell of each level
    real(c_double), intent(in) :: inverse_cell(0:levels - 1)  !< [1/m]
    integer(c_int64_t), intent(in) :: origin(3, 0:levels - 1), extent(3, 0:levels - 1), stride(3, 0:levels - 1)
    integer(c_int64_t), intent(in) :: first_key(0:levels - 1)
    integer(c_int64_t), intent(in) :: table_first(3, 0:levels - 1), table_size(3, 0:levels - 1), table(0:*), table_place(0:*)
    integer(c_int8_t), intent(in) :: apart(0:levels - 1)      !< 1: no item of the level meets one of such a level
    integer(c_int64_t), value :: capacity                     !< of hits
    integer(c_int32_t), intent(inout) :: hits(2, capacity)    !< places in the sorted order
    integer(c_int64_t), intent(out) :: found, needed
    integer(c_int64_t) :: c, level_end, row(4)
    integer(c_int32_t) :: rows, r, m, level, i, stretches, begins(4 + most_rows*most_levels), ends(4 + most_rows*most_levels)
    integer(c_int64_t) :: seen(most_rows, 0:most_levels - 1), pointer(4), centre_key(0:most_levels - 1)
    integer(c_int32_t) :: seen_begins(most_rows, 0:most_levels - 1), seen_ends(most_rows, 0:most_levels - 1)

    found = 0
    needed = 0
    centre_key = -1
    seen = 0
    seen_begins = 0
    seen_ends = 0
    level = -1
    level_end = first
    pointer = 0
    rows = merge(1, 4, dim == 2)
    row = 0
    do c = first, last - 1
      if (c >= level_end) call enter_level()
      ! the rows after this one
      stretches = 0
      do r = 1, merge(0, rows, apart(level) /= 0)
        call stretch_of_row(cells, cell_key, cell_start, level_end, cell_key(c) + row(r), pointer(r), &
                            begins(stretches + 1), ends(stretches + 1))
        if (ends(stretches + 1) > begins(stretches + 1)) stretches = stretches + 1
      end do
      ! every level above
      do m = level + 1, levels - 1
        if (level_cell(m + 1) == level_cell(m) .or. (apart(level) /= 0 .and. apart(m) /= 0)) cycle
        call stretches_above(m)
        do r = 1, merge(3, 9, dim == 2)
          if (seen_ends(r, m) <= seen_begins(r, m)) cycle
          stretches = stretches + 1
          begins(stretches) = seen_begins(r, m)
          ends(stretches) = seen_ends(r, m)
        end do
      end do
      ! the own row: this cell and the next, without what came before
      r = cell_start(c + 1)
      if (cell_key(c + 1) == cell_key(c) + 1) r = cell_start(c + 2)
      if (apart(level) /= 0) then
        if (stretches == 0) cycle
        r = 0
      end if
      do i = cell_start(c), cell_start(c + 1) - 1
        call meet(dim, n, sorted, i, i + 1, r, capacity, hits, found, needed)
        do m = 1, stretches
          call meet(dim, n, sorted, i, begins(m), ends(m), capacity, hits, found, needed)
        end do
      end do
    end do

  contains

    !> The level that cell c belongs to, and where the rows after its own begin.
    subroutine enter_level()
      do while (c >= level_end)
        level = level + 1
        level_end = level_cell(level + 1)
      end do
      row(1) = stride(2, level)
      if (dim == 3) row(2:4) = stride(3, level) + [-stride(2, level), 0_c_int64_t, stride(2, level)]
      do r = 1, rows
        pointer(r) = lower_bound(cells, cell_key, c, level_end, cell_key(c) + row(r) - 1)
      end do
    end subroutine enter_level

    !> Stretches of the three or nine rows of level m around the cell c, kept while its ancestor stays the same.
    subroutine stretches_above(m)
      integer(c_int32_t), intent(in) :: m
      integer(c_int64_t) :: place(3), key
      integer(c_int32_t) :: k, j, row

      place = 1
      key = first_key(m)
      do k = 1, dim
        place(k) = cell_coordinate(sorted(cell_start(c), k), inverse_cell(m))
        if (table_size(k, m) == 0) then
          place(k) = place(k) - origin(k, m)
        else
          place(k) = packed_coordinate(place(k), table_size(k, m), table(table_first(k, m)), table_place(table_first(k, m)))
        end if
        if (place(k) < 0 .or. place(k) > extent(k, m) + 1) then
          seen_ends(:, m) = seen_begins(:, m)
          centre_key(m) = -1
          return
        end if
        key = key + stride(k, m)*place(k)
      end do
      if (key == centre_key(m)) return
      centre_key(m) = key
      row = 0
      do k = merge(0, -1, dim == 2), merge(0, 1, dim == 2)
        do j = -1, 1
          row = row + 1
          seen_ends(row, m) = seen_begins(row, m)
          if (place(2) + j < 1 .or. place(2) + j > extent(2, m)) cycle
          if (dim == 3) then
            if (place(3) + k < 1 .or. place(3) + k > extent(3, m)) cycle
          end if
          call find_row(m, row, key + j*stride(2, m) + k*stride(3, m))
        end do
      end do
    end subroutine stretches_above

    !> From where this row was found last, a few steps on; else by bisection.
    subroutine find_row(m, row, key)
      integer(c_int32_t), intent(in) :: m, row
      integer(c_int64_t), intent(in) :: key
      integer(c_int64_t) :: p
      integer(c_int32_t) :: step

      p = max(seen(row, m), level_cell(m))
      step = 0
      if (p > level_cell(m)) then
        if (cell_key(p - 1) >= key - 1) step = steps_before_bisection
      end if
      do while (step < steps_before_bisection .and. p < level_cell(m + 1))
        if (cell_key(p) >= key - 1) exit
        p = p + 1
        step = step + 1
      end do
      if (step == steps_before_bisection) p = lower_bound(cells, cell_key, level_cell(m), level_cell(m + 1), key - 1)
      seen(row, m) = p
      call stretch_of_row(cells, cell_key, cell_start, level_cell(m + 1), key, seen(row, m), seen_begins(row, m), &
                          seen_ends(row, m))
    end subroutine find_row

  end subroutine cairn_grid_search

  !> Items of the cells key-1 to key+1; `pointer` moves on to the first cell from key-1.
  pure subroutine stretch_of_row(cells, cell_key, cell_start, level_end, key, pointer, begin, end)
    integer(c_int64_t), intent(in) :: cells, level_end, key
    integer(c_int64_t), intent(in) :: cell_key(0:cells)
    integer(c_int32_t), intent(in) :: cell_start(0:cells)
    integer(c_int64_t), intent(inout) :: pointer
    integer(c_int32_t), intent(out) :: begin, end
    integer(c_int64_t) :: q

    do while (cell_key(pointer) < key - 1)
      if (pointer >= level_end) exit
      pointer = pointer + 1
    end do
    q = pointer
    do while (cell_key(q) <= key + 1)
      if (q >= level_end) exit
      q = q + 1
    end do
    begin = cell_start(pointer)
    end = cell_start(q)
  end subroutine stretch_of_row

  pure function lower_bound(cells, cell_key, first, last, key) result(low)
    integer(c_int64_t), intent(in) :: cells, first, last, key
    integer(c_int64_t), intent(in) :: cell_key(0:cells)
    integer(c_int64_t) :: low, high, middle
    low = first
    high = last
    do while (low < high)
      middle = (low + high)/2
      if (cell_key(middle) < key) then
        low = middle + 1
      else
        high = middle
      end if
    end do
  end function lower_bound

  !> Item i against a stretch of others.
  pure subroutine meet(dim, n, sorted, i, begin, end, capacity, hits, found, needed)
    integer(c_int32_t), intent(in) :: dim, i, begin, end
    integer(c_int64_t), intent(in) :: n, capacity
    real(c_double), intent(in) :: sorted(0:n - 1, dim + 1)
    integer(c_int32_t), intent(inout) :: hits(2, capacity)
    integer(c_int64_t), intent(inout) :: found, needed
    integer(c_int32_t) :: j, met
    real(c_double) :: x, y, z, reach, d2, s
    logical :: room

    if (end <= begin) return
    needed = max(needed, found + (end - begin))
    room = needed <= capacity
    x = sorted(i, 1)
    y = sorted(i, 2)
    z = sorted(i, dim)
    reach = sorted(i, dim + 1)
    do j = begin, end - 1
      s = reach + sorted(j, dim + 1)
      d2 = (sorted(j, 1) - x)*(sorted(j, 1) - x) + (sorted(j, 2) - y)*(sorted(j, 2) - y)
      if (dim == 3) d2 = d2 + (sorted(j, 3) - z)*(sorted(j, 3) - z)
      met = merge(1, 0, d2 <= s*s*slack + smallest_square)
      if (room) then ! stored in any case, kept if it counts: no branch to mispredict
        hits(1, found + 1) = i
        hits(2, found + 1) = j
      end if
      found = found + met
    end do
  end subroutine meet

end module grid_search
