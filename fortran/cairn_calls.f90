!> Base of the modules of Cairn for Fortran: errors, texts and sizes. Programs use the module cairn.
module cairn_calls
  use, intrinsic :: iso_c_binding
  implicit none
  private
  public :: cairn_error, c_error, dp, mask_of, c_text, has_size, report_back, tell, from_c

  integer, parameter :: dp = c_double

  !> Error of a call: code 0 is success, item the number of the wrong entry (-1: none in particular).
  type :: cairn_error
    integer :: code = 0
    integer(c_int64_t) :: item = -1
    character(:), allocatable :: message
  end type
  type, bind(c) :: c_error
    integer(c_int32_t) :: code = 0
    integer(c_int64_t) :: item = -1
    character(c_char) :: message(256) = c_null_char
  end type

contains

  pure integer(c_int8_t) function mask_of(driven)
    logical, intent(in) :: driven(:)
    integer :: i

    mask_of = 0
    do i = 1, size(driven)
      if (driven(i)) mask_of = ibset(mask_of, i - 1)
    end do
  end function mask_of

  pure function c_text(text) result(terminated)
    character(*), intent(in) :: text
    character(len_trim(text) + 1, c_char) :: terminated

    terminated = trim(text)//c_null_char
  end function c_text

  logical function has_size(name, is, wanted, error)
    character(*), intent(in) :: name
    integer, intent(in) :: is, wanted
    type(cairn_error), intent(out), optional :: error
    character(12) :: numbers(2)

    has_size = is == wanted
    if (has_size) return
    write (numbers, "(i0)") is, wanted
    call tell(cairn_error(1, -1_c_int64_t, name//" has "//trim(numbers(1))//" numbers; it needs "//trim(numbers(2))), error)
  end function has_size

  subroutine report_back(code, what, error)
    integer(c_int32_t), intent(in) :: code
    type(c_error), intent(in) :: what
    type(cairn_error), intent(out), optional :: error
    character(size(what%message)) :: text
    integer :: i

    if (code == 0) return
    do i = 1, size(what%message)
      text(i:i) = what%message(i)
    end do
    call tell(cairn_error(int(code), what%item, text(:index(text, c_null_char) - 1)), error)
  end subroutine report_back

  subroutine tell(what, error)
    type(cairn_error), intent(in) :: what
    type(cairn_error), intent(out), optional :: error

    if (.not. present(error)) error stop "cairn: "//what%message
    error = what
  end subroutine tell

  !> A text that ends with a nought.
  pure function from_c(text) result(plain)
    character(c_char), intent(in) :: text(:)
    character(:), allocatable :: plain
    integer :: i

    plain = ""
    do i = 1, size(text)
      if (text(i) == c_null_char) return
      plain = plain//text(i)
    end do
  end function from_c
end module cairn_calls
