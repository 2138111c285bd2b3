!> Relative velocities of the contacts of a batch, packed or not, with further data for errors and energies.
module contact_velocity
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double, c_f_pointer
  use contact_batch, only: cairn_batch, cairn_side, cairn_record, batch_workspace, max_batch
  use batch_kinematics, only: batch_view, open_batch, load_bodies, relative_velocity, bare_velocity
  use radial_passes, only: radial_velocity2, radial_velocity3
  implicit none
  private
  public :: contact_columns, find_columns

  !> Columns (n, c) of a batch, in the workspace or where the batch has them; `free` is workspace that is left.
  type :: contact_columns
    integer :: n = 0, c = 0
    real(c_double), pointer, contiguous :: u(:) => null(), r(:) => null(), mu(:) => null(), free(:) => null()
  end type contact_columns
contains

  subroutine find_columns(batch, sides, record, general, with_bias, work, columns)
    type(cairn_batch), intent(in)      :: batch       !< see cairn/core.h
    type(cairn_side), intent(in)       :: sides(*)    !< rows of sides.def
    type(cairn_record), intent(in)     :: record(*)   !< velocity records of bodies
    type(cairn_record), intent(in)     :: general(*)  !< further inertia of bodies
    logical, value                     :: with_bias   !< the law's bias added to u
    real(c_double), intent(inout), target :: work(batch_workspace) !< workspace
    type(contact_columns), intent(out) :: columns
    type(batch_view) :: view
    integer(c_int32_t), pointer, contiguous :: body_a(:), body_b(:)
    real(c_double), pointer, contiguous :: packed(:)
    real(c_double) :: bias
    integer :: n, c, vb
    n = batch%count
    c = batch%components
    columns%n = n
    columns%c = c
    columns%u => work(32*n + 1:32*n + c*n)
    columns%free => work(38*n + 1:batch_workspace - 16*max_batch)
    if (batch%pack > 0) then
      bias = merge(1.0_c_double, 0.0_c_double, with_bias)
      columns%mu => work(1:n)
      columns%r => work(n + 1:n + c*n)
      call c_f_pointer(batch%frame, packed, [batch%pack*n])
      call c_f_pointer(batch%body_a, body_a, [n])
      call c_f_pointer(batch%body_b, body_b, [n])
      if (c == 2) call radial_velocity2(n/8, body_a, body_b, packed, record, bias, columns%u, columns%mu, columns%r)
      if (c == 3) call radial_velocity3(n/8, body_a, body_b, packed, record, bias, columns%u, columns%mu, columns%r)
      return
    end if
    call open_batch(batch, sides, work, view)
    columns%mu => view%params
    columns%r => view%r
    vb = 1 + view%width_a*n
    call load_bodies(view, record, general, work(1), work(vb))
    if (with_bias) then
      call relative_velocity(view, work(1), work(vb), work(32*n + 1))
    else
      call bare_velocity(view, work(1), work(vb), work(32*n + 1))
    end if
  end subroutine find_columns
end module contact_velocity
