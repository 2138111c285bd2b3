!> Rods that push and pull: see rods.
module rod
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use law_context, only: cairn_law_context
  use rods, only: rods_prepare, rods_solve, rods_residual, rods_commit, rods_energy, own => rod_parameters
  implicit none
  private
  public :: law_prepare, law_solve, law_residual, law_commit, law_energy
  character(*), parameter :: row = "rod"
  logical, parameter :: pushes = .true.
contains

  include "rod_slots.inc"
end module rod
