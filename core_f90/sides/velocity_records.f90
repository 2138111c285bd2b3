!> Velocity records of bodies, one cache line each, to and from the contacts of a batch.
module velocity_records
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_batch, only: cairn_record
  implicit none
  private
  public :: load_records, store_records, add_to_hub
contains

  !> v(i, k) = record(k, body(i)), of the numbers that a record has. Numbers are loaded one by one, as store_records wrote them: a
  !> wide load waits until such stores are in the cache, and a body is often in the batch before.
  subroutine load_records(n, columns, body, record, v)
    integer(c_int32_t), value     :: n                        !< contacts
    integer(c_int32_t), value     :: columns                  !< 6 in the plane, else 8
    integer(c_int32_t), intent(in) :: body(n)                 !< places of the records, from 0
    type(cairn_record), intent(in) :: record(0:*)            !< records
    real(c_double), intent(out)   :: v(n, columns)            !< columns
    integer :: i, k
    do i = 1, n - 3, 4
      do k = 1, columns
        v(i, k) = record(body(i))%x(k)
        v(i + 1, k) = record(body(i + 1))%x(k)
        v(i + 2, k) = record(body(i + 2))%x(k)
        v(i + 3, k) = record(body(i + 3))%x(k)
      end do
    end do
    do i = n - mod(n, 4) + 1, n
      do k = 1, columns
        v(i, k) = record(body(i))%x(k)
      end do
    end do
  end subroutine load_records

  !> record(k, body(i)) = v(i, k) for the velocities only; no two contacts share a body. The records are still in the first-level
  !> cache from load_records: scalar writes of three or six numbers cost less than a transposition.
  subroutine store_records(n, contacts, velocities, body, v, record)
    integer(c_int32_t), value     :: n                        !< contacts, dummies included
    integer(c_int32_t), value     :: contacts                 !< contacts that are not dummies
    integer(c_int32_t), value     :: velocities               !< numbers of a record that are velocities: 3, or 6
    integer(c_int32_t), intent(in) :: body(n)                 !< places of the records, from 0
    real(c_double), intent(in)    :: v(n, velocities)         !< columns
    type(cairn_record), intent(inout) :: record(0:*)         !< records
    integer :: i
    if (velocities == 3) then
      do i = 1, contacts
        record(body(i))%x(1:3) = v(i, 1:3)
      end do
    else
      do i = 1, contacts
        record(body(i))%x(1:6) = v(i, 1:6)
      end do
    end if
  end subroutine store_records

  !> Changes of one body that all contacts share, added in the order of the contacts.
  subroutine add_to_hub(n, velocities, change, record)
    integer(c_int32_t), value     :: n                     !< contacts
    integer(c_int32_t), value     :: velocities            !< numbers of a record that are velocities
    real(c_double), intent(in)    :: change(n, velocities) !< change by each contact
    real(c_double), intent(inout) :: record(velocities)    !< velocity of the hub
    real(c_double) :: total
    integer :: i, k
    do k = 1, velocities
      total = 0
      do i = 1, n
        total = total + change(i, k)
      end do
      record(k) = record(k) + total
    end do
  end subroutine add_to_hub
end module velocity_records
