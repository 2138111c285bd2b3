!> Velocity records of bodies, one cache line each, to and from the contacts of a batch. Whole records are copied in, then turned
!> into columns in the first cache: gathers of single numbers are several times slower.
module velocity_records
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_batch, only: cairn_record
  implicit none
  private
  public :: load_records, store_records, add_to_hub
contains

  !> v(i, k) = record(k, body(i)), of the numbers that a record has.
  subroutine load_records(n, columns, body, record, line, v)
    integer(c_int32_t), value     :: n                        !< contacts
    integer(c_int32_t), value     :: columns                  !< 6 in the plane, else 8
    integer(c_int32_t), intent(in) :: body(n)                 !< places of the records, from 0
    type(cairn_record), intent(in) :: record(0:*)            !< records
    type(cairn_record), intent(out) :: line(n)               !< workspace
    real(c_double), intent(out)   :: v(n, columns)            !< columns
    integer :: i
    do i = 1, n
      line(i) = record(body(i))
    end do
    !$omp simd
    do i = 1, n
      v(i, 1) = line(i)%x(1)
      v(i, 2) = line(i)%x(2)
      v(i, 3) = line(i)%x(3)
      v(i, 4) = line(i)%x(4)
      v(i, 5) = line(i)%x(5)
      v(i, 6) = line(i)%x(6)
    end do
    if (columns == 6) return
    !$omp simd
    do i = 1, n
      v(i, 7) = line(i)%x(7)
      v(i, 8) = line(i)%x(8)
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
