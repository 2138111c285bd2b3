!> Data of the step that a law may read beside its own contacts; its C twin is in cairn/core.h.
module law_context
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_ptr
  implicit none
  private
  public :: cairn_law_context

  type, bind(c) :: cairn_law_context
    real(c_double) :: h
    real(c_double) :: theta
    type(c_ptr) :: geometry
    type(c_ptr) :: fields
    integer(c_int32_t) :: over_bodies
  end type cairn_law_context
end module law_context
