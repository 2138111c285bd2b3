!> Contacts of a batch that see each other, since they rest on one body that deforms: each in turn, with the velocities that those
!> before it left.
module contacts_in_turn
  use, intrinsic :: iso_c_binding, only: c_associated, c_int32_t, c_double, c_f_pointer, c_f_procpointer
  use contact_batch, only: cairn_record, cairn_batch, cairn_side, law_solve, record_size, max_components, mapping_nodes, &
    mapping_dofs
  use batch_kinematics, only: batch_view
  use condensed_bodies, only: load_one, add_mapped, add_responses
  use reached_bodies, only: load_reached
  use contact_block, only: prepare_block2, solve_block2, contact_block_size
  implicit none
  private
  public :: sweep_in_turn, give_in_turn

  integer, parameter :: widest = 2*record_size

  !> One contact: its columns side by side, and of each side the velocities as they stand.
  type :: one_contact
    real(c_double) :: frame(6) = 0, bias(max_components) = 0, r(max_components) = 0
    real(c_double) :: lever(mapping_nodes, 2) = 0, v(widest, 2) = 0
    integer(c_int32_t) :: body(2) = 0, node(mapping_nodes, 2) = 0, dof(mapping_dofs, 2) = 0
  end type one_contact
contains

  !> A sweep; the law is Coulomb's cone on full blocks.
  subroutine sweep_in_turn(batch, sides, record, general, relaxation, view, change)
    type(cairn_batch), intent(in)     :: batch      !< see cairn/core.h
    type(cairn_side), intent(in)      :: sides(0:*)
    type(cairn_record), intent(inout) :: record(0:*)
    type(cairn_record), intent(in)    :: general(0:*)
    real(c_double), value             :: relaxation !< [-]
    type(batch_view), intent(in)      :: view
    real(c_double), intent(out)       :: change     !< sum of dr.W dr [J]
    type(one_contact) :: one
    procedure(law_solve), pointer :: solve
    real(c_double), pointer, contiguous :: delassus(:)
    real(c_double) :: w(max_components**2), u(max_components), r(max_components), dr(max_components), mu(1), none(1)
    real(c_double) :: local(contact_block_size)
    integer :: i, k, l, c, n
    n = view%n
    c = view%c
    none = 0
    call c_f_procpointer(batch%solve, solve)
    call c_f_pointer(batch%delassus, delassus, [c*c*n])
    change = 0
    do i = 1, view%contacts
      call open_contact(batch, sides, view, record, general, i, one)
      do k = 1, c*c
        w(k) = delassus(i + n*(k - 1))
      end do
      if (batch%relaxes /= 0) w(1:c*c) = w(1:c*c)*(1/relaxation)
      u = one%bias
      if (associated(view%compliance)) then
        do k = 1, c
          u(k) = u(k) + view%compliance(i + n*(k - 1))*one%r(k)
        end do
      end if
      call view%gather_a(1_c_int32_t, int(c, c_int32_t), view%width_a, 1.0_c_double, one%v(:, 1), one%frame, one%lever(:, 1), u)
      call view%gather_b(1_c_int32_t, int(c, c_int32_t), view%width_b, -1.0_c_double, one%v(:, 2), one%frame, one%lever(:, 2), u)
      do k = 1, c
        do l = 1, c
          u(k) = u(k) - w(k + c*(l - 1))*one%r(l)
        end do
      end do
      mu(1) = view%params(i)
      r = one%r
      if (c == 2) then ! as the law's own solution, without a loop over one contact
        call prepare_block2(w, local)
        call solve_block2(local, u, mu(1), r)
      else
        call solve(1_c_int32_t, int(c, c_int32_t), w, u, one%bias, mu, none, r)
      end if
      dr = r - one%r
      do k = 1, c
        view%r(i + n*(k - 1)) = r(k)
        do l = 1, c
          change = change + w(k + c*(l - 1))*dr(k)*dr(l)
        end do
      end do
      call give(batch, view, i, one, dr, record)
    end do
  end subroutine sweep_in_turn

  !> The impulses of the batch, to the bodies.
  subroutine give_in_turn(batch, sides, record, general, view)
    type(cairn_batch), intent(in)     :: batch
    type(cairn_side), intent(in)      :: sides(0:*)
    type(cairn_record), intent(inout) :: record(0:*)
    type(cairn_record), intent(in)    :: general(0:*)
    type(batch_view), intent(in)      :: view
    type(one_contact) :: one
    integer :: i, k
    logical :: pushes
    do i = 1, view%contacts
      pushes = .false.
      do k = 1, view%c
        pushes = pushes .or. abs(view%r(i + view%n*(k - 1))) > 0
      end do
      if (.not. pushes) cycle
      call open_contact(batch, sides, view, record, general, i, one)
      call give(batch, view, i, one, one%r, record)
    end do
  end subroutine give_in_turn

  subroutine open_contact(batch, sides, view, record, general, i, one)
    type(cairn_batch), intent(in)    :: batch
    type(cairn_side), intent(in)     :: sides(0:*)
    type(batch_view), intent(in)     :: view
    type(cairn_record), intent(in)   :: record(0:*), general(0:*)
    integer, value                   :: i !< which, from 1
    type(one_contact), intent(inout) :: one
    integer :: k, n
    n = view%n
    do k = 1, merge(2, 6, view%dim == 2)
      one%frame(k) = view%frame(i + n*(k - 1))
    end do
    do k = 1, view%c
      one%bias(k) = view%bias(i + n*(k - 1))
      one%r(k) = view%r(i + n*(k - 1))
    end do
    one%body(1) = view%body_a(i)
    one%body(2) = view%body_b(i)
    do k = 1, sides(batch%side_a)%lever
      one%lever(k, 1) = view%lever_a(i + n*(k - 1))
    end do
    do k = 1, sides(batch%side_b)%lever
      one%lever(k, 2) = view%lever_b(i + n*(k - 1))
    end do
    if (view%mapped_a) then
      call place_of(view%node_a, view%dof_a, 1)
      call load_one(view%dim, view%nodes_a, one%dof(:, 1), one%lever(:, 1), view%velocity, one%v(:, 1))
      if (view%reached_a) call load_reached(1, 1, view%dim, one%body(1), one%node(:, 1), one%lever(:, 1), view%condensed, &
        one%v(:, 1))
    else
      one%v(1:record_size, 1) = record(one%body(1))%x
      if (view%width_a > record_size) one%v(record_size + 1:widest, 1) = general(one%body(1))%x
    end if
    if (view%mapped_b) then
      call place_of(view%node_b, view%dof_b, 2)
      call load_one(view%dim, view%nodes_b, one%dof(:, 2), one%lever(:, 2), view%velocity, one%v(:, 2))
      if (view%reached_b) call load_reached(1, 1, view%dim, one%body(2), one%node(:, 2), one%lever(:, 2), view%condensed, &
        one%v(:, 2))
    else
      one%v(1:record_size, 2) = record(one%body(2))%x
      if (view%width_b > record_size) one%v(record_size + 1:widest, 2) = general(one%body(2))%x
    end if
  contains
    subroutine place_of(node, dof, side)
      integer(c_int32_t), intent(in) :: node(n, mapping_nodes), dof(n, mapping_dofs)
      integer, value :: side
      one%node(:, side) = node(i, :)
      one%dof(:, side) = dof(i, :)
    end subroutine place_of
  end subroutine open_contact

  !> A change of impulse, to both bodies.
  subroutine give(batch, view, i, one, dr, record)
    type(cairn_batch), intent(in)     :: batch
    type(batch_view), intent(in)      :: view
    integer, value                    :: i !< which, from 1
    type(one_contact), intent(inout)  :: one
    real(c_double), intent(in)        :: dr(max_components) !< [N s]
    type(cairn_record), intent(inout) :: record(0:*)
    integer(c_int32_t) :: c
    integer :: first
    c = int(view%c, c_int32_t)
    if (.not. any(abs(dr(1:c)) > 0)) return ! nothing changed
    if (view%stride_a > 0) then
      first = view%stride_a*view%dim*(i - 1) + 1
      call add_responses(1, 1, view%dim, view%stride_a, 1.0_c_double, dr, one%dof(:, 1), view%response_a(first:), view%velocity)
    else if (view%mapped_a) then
      call add_mapped(1, 1, view%dim, 1.0_c_double, dr, one%frame, one%body(1), one%node(:, 1), one%lever(:, 1), view%condensed)
    else if (batch%moves_a /= 0) then
      call view%scatter_a(1_c_int32_t, c, view%width_a, 1.0_c_double, dr, one%frame, one%lever(:, 1), one%v(:, 1))
      record(one%body(1))%x = one%v(1:record_size, 1)
    end if
    if (view%stride_b > 0) then
      first = view%stride_b*view%dim*(i - 1) + 1
      call add_responses(1, 1, view%dim, view%stride_b, -1.0_c_double, dr, one%dof(:, 2), view%response_b(first:), view%velocity)
    else if (view%mapped_b) then
      call add_mapped(1, 1, view%dim, -1.0_c_double, dr, one%frame, one%body(2), one%node(:, 2), one%lever(:, 2), view%condensed)
    else if (batch%moves_b /= 0) then
      call view%scatter_b(1_c_int32_t, c, view%width_b, -1.0_c_double, dr, one%frame, one%lever(:, 2), one%v(:, 2))
      record(one%body(2))%x = one%v(1:record_size, 2)
    end if
  end subroutine give
end module contacts_in_turn
