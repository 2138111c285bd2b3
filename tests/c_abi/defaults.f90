!> The options that the Fortran module starts with, for comparison with those of the C API.
module fortran_defaults
  use cairn, only: cairn_nscd
  implicit none
  private
  public :: cairn_fortran_defaults
contains
  subroutine cairn_fortran_defaults(options) bind(c)
    type(cairn_nscd), intent(out) :: options !< its type gives every component
  end subroutine cairn_fortran_defaults
end module fortran_defaults
