!> Colours of contacts: two of one colour do not couple, so a colour may be swept by many threads, and bits do not tell how many.
module nlgs_coloured
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_colour_blocks
contains

  !> The first colour that no neighbour has, contact after contact; then contacts in the order of colours.
  subroutine cairn_colour_blocks(n, row_start, column, colour, order, colours, colour_start) bind(c)
    integer(c_int64_t), value       :: n                 !< contacts
    integer(c_int64_t), intent(in)  :: row_start(n+1)    !< of W, from 0
    integer(c_int32_t), intent(in)  :: column(*)         !< from 0
    integer(c_int32_t), intent(out) :: colour(n)         !< from 0
    integer(c_int32_t), intent(out) :: order(n)          !< contacts, from 0
    integer(c_int64_t), intent(out) :: colours           !< how many
    integer(c_int64_t), intent(out) :: colour_start(n+1) !< from 0; the first `colours` + 1
    integer(c_int64_t) :: a, k, b, c
    colour = -1
    order = -1 ! here: the last contact that saw this colour beside it
    colours = 0
    do a = 1, n
      do k = row_start(a) + 1, row_start(a+1)
        b = column(k) + 1
        if (colour(b) >= 0) order(colour(b) + 1) = int(a, c_int32_t)
      end do
      do c = 0, n - 1
        if (order(c+1) /= a) exit
      end do
      colour(a) = int(c, c_int32_t)
      colours = max(colours, c + 1)
    end do
    ! a coupling that one of two rows alone has
    do a = 1, n
      do k = row_start(a) + 1, row_start(a+1)
        b = column(k) + 1
        if (b == a .or. colour(b) /= colour(a)) cycle
        colour(a) = int(colours, c_int32_t)
        colours = colours + 1
      end do
    end do
    colour_start = 0
    do a = 1, n
      colour_start(colour(a) + 2) = colour_start(colour(a) + 2) + 1
    end do
    do c = 1, colours
      colour_start(c+1) = colour_start(c+1) + colour_start(c)
    end do
    do a = 1, n
      c = colour(a) + 1
      colour_start(c) = colour_start(c) + 1
      order(colour_start(c)) = int(a - 1, c_int32_t)
    end do
    do c = colours, 1, -1
      colour_start(c+1) = colour_start(c)
    end do
    colour_start(1) = 0
  end subroutine cairn_colour_blocks
end module nlgs_coloured
