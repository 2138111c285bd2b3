!> Kinematics of a batch, common to all solvers: relative velocities of its contacts, and changes of impulse applied to their
!> bodies.
module batch_kinematics
  use, intrinsic :: iso_c_binding, only: c_associated, c_int32_t, c_double, c_f_pointer, c_f_procpointer
  use contact_batch, only: cairn_record, cairn_batch, cairn_side, cairn_condensed, side_gather, side_scatter, side_delassus, &
    record_size, max_batch, batch_workspace, mapping_nodes, mapping_dofs, rope_bodies, rope_numbers
  use condensed_bodies, only: load_mapped, load_spins, add_mapped, add_moments, add_responses, delassus_mapped, delassus_shared
  use condensed_bodies, only: delassus_turning
  use reached_bodies, only: load_reached, load_reached_spins
  use velocity_records, only: load_records, store_records, add_to_hub
  implicit none
  private
  public :: open_batch, load_bodies, load_moved, relative_velocity, bare_velocity, add_impulse, delassus_block, batch_view

  !> A batch with its blocks as Fortran arrays (component c of contact i at (c-1) n + i).
  type :: batch_view
    integer(c_int32_t) :: n = 0, c = 0, width_a = 0, width_b = 0
    integer(c_int32_t) :: numbers = 0 !< of a record: in the plane the last two are none
    integer :: contacts = 0, dim = 0, nodes_a = 0, nodes_b = 0, stride_a = 0, stride_b = 0
    logical :: mapped_a = .false., mapped_b = .false. !< rests on nodes of a condensed body
    logical :: reached_a = .false., reached_b = .false. !< of which one has a reach
    integer(c_int32_t), pointer, contiguous :: body_a(:) => null(), body_b(:) => null(), node_a(:) => null(), node_b(:) => null()
    integer(c_int32_t), pointer, contiguous :: dof_a(:) => null(), dof_b(:) => null()
    integer :: pushes = 0 !< components by which impulses move a mapped side
    integer(c_int32_t), pointer, contiguous :: turns(:) => null() !< which of its faces have a spin
    real(c_double), pointer, contiguous :: spin_a(:) => null(), spin_b(:) => null()
    real(c_double), pointer, contiguous :: velocity(:) => null(), response_a(:) => null(), response_b(:) => null()
    type(cairn_condensed), pointer, contiguous :: condensed(:) => null()
    real(c_double), pointer, contiguous :: frame(:) => null(), lever_a(:) => null(), lever_b(:) => null()
    real(c_double), pointer, contiguous :: bias(:) => null(), compliance(:) => null(), params(:) => null(), r(:) => null()
    integer :: velocities = 0
    integer(c_int32_t), pointer, contiguous :: rope_body(:, :) => null() !< of ropes over a pulley
    real(c_double), pointer, contiguous :: rope(:, :) => null()
    procedure(side_gather), pointer, nopass :: gather_a => null(), gather_b => null()
    procedure(side_scatter), pointer, nopass :: scatter_a => null(), scatter_b => null()
  end type batch_view
contains

  !> Unpacks a packed batch into the end of the workspace; changes there are not written back.
  subroutine open_batch(batch, sides, work, view)
    type(cairn_batch), intent(in) :: batch      !< see cairn/core.h
    type(cairn_side), intent(in)  :: sides(0:*) !< rows of sides.def
    real(c_double), intent(inout), target, contiguous :: work(:) !< workspace of the thread
    type(batch_view), intent(out) :: view
    real(c_double), pointer, contiguous :: packed(:)
    integer :: n, c
    n = batch%count
    c = batch%components
    view%n = n
    view%c = c
    view%numbers = merge(6, record_size, batch%velocities == 3)
    ! for fixed sides the velocity alone is read
    view%width_a = merge(sides(batch%side_a)%width, record_size, batch%moves_a /= 0)
    view%width_b = merge(sides(batch%side_b)%width, record_size, batch%moves_b /= 0)
    call c_f_pointer(batch%body_a, view%body_a, [n])
    call c_f_pointer(batch%body_b, view%body_b, [n])
    call c_f_procpointer(sides(batch%side_a)%gather, view%gather_a)
    call c_f_procpointer(sides(batch%side_b)%gather, view%gather_b)
    if (batch%mapped_a + batch%mapped_b > 0) call open_mappings(batch, view)
    if (c_associated(batch%rope)) then
      view%velocities = batch%velocities
      view%contacts = batch%contacts
      call c_f_pointer(batch%rope_body, view%rope_body, [rope_bodies, n])
      call c_f_pointer(batch%rope, view%rope, [rope_numbers, n])
    end if
    call c_f_procpointer(sides(batch%side_a)%scatter, view%scatter_a)
    call c_f_procpointer(sides(batch%side_b)%scatter, view%scatter_b)
    if (batch%pack > 0) then
      call c_f_pointer(batch%frame, packed, [batch%pack*n])
      associate (own => work(batch_workspace - 16*max_batch + 1:))
        view%frame => own(1:6*n)
        view%lever_a => own(6*n + 1:7*n)
        view%lever_b => own(7*n + 1:8*n)
        view%bias => own(8*n + 1:11*n)
        view%params => own(11*n + 1:12*n)
        view%r => own(12*n + 1:15*n)
      end associate
      call unpack_batch(n/8, c, batch%pack, packed, view%frame, view%lever_a, view%lever_b, view%bias, view%params, view%r)
    else
      call c_f_pointer(batch%frame, view%frame, [6*n])
      call c_f_pointer(batch%lever_a, view%lever_a, [n*sides(batch%side_a)%lever])
      call c_f_pointer(batch%lever_b, view%lever_b, [n*sides(batch%side_b)%lever])
      call c_f_pointer(batch%bias, view%bias, [n*c])
      if (c_associated(batch%compliance)) call c_f_pointer(batch%compliance, view%compliance, [n*c])
      call c_f_pointer(batch%params, view%params, [n])
      call c_f_pointer(batch%r, view%r, [n*c])
    end if
  end subroutine open_batch

  subroutine open_mappings(batch, view)
    type(cairn_batch), intent(in)   :: batch
    type(batch_view), intent(inout) :: view
    integer, parameter :: many = huge(0) ! as many as the batch refers to
    view%contacts = batch%contacts
    view%dim = merge(2, 3, batch%velocities == 3)
    view%mapped_a = batch%mapped_a /= 0
    view%mapped_b = batch%mapped_b /= 0
    view%reached_a = batch%mapped_a == 2
    view%reached_b = batch%mapped_b == 2
    view%nodes_a = batch%nodes_a
    view%nodes_b = batch%nodes_b
    view%stride_a = batch%stride_a
    view%stride_b = batch%stride_b
    view%pushes = view%dim
    if (c_associated(batch%turns)) then
      view%pushes = view%c
      call c_f_pointer(batch%turns, view%turns, [view%n])
    end if
    call c_f_pointer(batch%condensed, view%condensed, [many])
    call c_f_pointer(batch%condensed_velocity, view%velocity, [many])
    if (view%mapped_a) then
      call c_f_pointer(batch%node_a, view%node_a, [mapping_nodes*view%n])
      call c_f_pointer(batch%dof_a, view%dof_a, [mapping_dofs*view%n])
      if (associated(view%turns)) call c_f_pointer(batch%spin_a, view%spin_a, &
        [view%n*view%dim*mapping_nodes*(view%c - view%dim)])
    end if
    if (view%mapped_b) then
      call c_f_pointer(batch%node_b, view%node_b, [mapping_nodes*view%n])
      call c_f_pointer(batch%dof_b, view%dof_b, [mapping_dofs*view%n])
      if (associated(view%turns)) call c_f_pointer(batch%spin_b, view%spin_b, &
        [view%n*view%dim*mapping_nodes*(view%c - view%dim)])
    end if
    if (view%stride_a > 0) call c_f_pointer(batch%response_a, view%response_a, [view%stride_a*view%pushes*view%n])
    if (view%stride_b > 0) call c_f_pointer(batch%response_b, view%response_b, [view%stride_b*view%pushes*view%n])
  end subroutine open_mappings

  subroutine unpack_batch(packs, c, lines, packed, frame, lever_a, lever_b, bias, mu, r)
    integer, value              :: packs                   !< eights of contacts
    integer, value              :: c                       !< components, 2 or 3
    integer, value              :: lines                   !< of a pack
    real(c_double), intent(in)  :: packed(8, lines, packs) !< see cairn/core.h
    real(c_double), intent(out) :: frame(8, packs, *)      !< normal, in 3D first tangent [-]
    real(c_double), intent(out) :: lever_a(8, packs), lever_b(8, packs) !< [m]
    real(c_double), intent(out) :: bias(8, packs, c)       !< [m/s]
    real(c_double), intent(out) :: mu(8, packs)            !< [-]
    real(c_double), intent(out) :: r(8, packs, c)          !< [N s]
    real(c_double) :: s, a
    integer :: i, k
    do k = 1, packs
      frame(:, k, 1:c) = packed(:, 1:c, k)
      lever_a(:, k) = packed(:, c + 1, k)
      lever_b(:, k) = packed(:, c + 2, k)
      bias(:, k, 1) = packed(:, c + 3, k)
      bias(:, k, 2:c) = 0
      mu(:, k) = packed(:, c + 4, k)
      r(:, k, :) = packed(:, c + 5:2*c + 4, k)
      if (c == 2) cycle
      do i = 1, 8
        s = sign(1.0_c_double, packed(i, 3, k))
        a = -1/(s + packed(i, 3, k))
        frame(i, k, 4) = 1 + s*packed(i, 1, k)**2*a
        frame(i, k, 5) = s*packed(i, 1, k)*packed(i, 2, k)*a
        frame(i, k, 6) = -s*packed(i, 1, k)
      end do
    end do
  end subroutine unpack_batch

  !> Records of both sides of every contact, as columns.
  subroutine load_bodies(view, record, general, va, vb)
    type(batch_view), intent(in)    :: view
    type(cairn_record), intent(in)  :: record(0:*)              !< velocity records of bodies
    type(cairn_record), intent(in)  :: general(0:*)             !< further inertia of bodies, read by wide sides alone
    real(c_double), intent(out)     :: va(view%n, view%width_a) !< columns of side A
    real(c_double), intent(out)     :: vb(view%n, view%width_b) !< columns of side B
    if (view%mapped_a) then
      call load_mapped(view%n, view%contacts, view%dim, view%nodes_a, view%dof_a, view%lever_a, view%velocity, va)
      if (view%c > view%dim) va(:, view%dim + 1:view%c) = 0
      if (associated(view%turns)) call load_spins(view%n, view%contacts, view%c, view%dim, view%nodes_a, view%dof_a, &
        view%spin_a, view%velocity, va(1, view%dim + 1))
      if (view%reached_a) call add_reaches(view, view%body_a, view%node_a, view%lever_a, view%spin_a, va)
    else
      call load_records(view%n, view%numbers, view%body_a, record, va)
      if (view%width_a > record_size) &
        call load_records(view%n, record_size, view%body_a, general, va(1, record_size + 1))
    end if
    if (view%mapped_b) then
      call load_mapped(view%n, view%contacts, view%dim, view%nodes_b, view%dof_b, view%lever_b, view%velocity, vb)
      if (view%c > view%dim) vb(:, view%dim + 1:view%c) = 0
      if (associated(view%turns)) call load_spins(view%n, view%contacts, view%c, view%dim, view%nodes_b, view%dof_b, &
        view%spin_b, view%velocity, vb(1, view%dim + 1))
      if (view%reached_b) call add_reaches(view, view%body_b, view%node_b, view%lever_b, view%spin_b, vb)
    else
      call load_records(view%n, view%numbers, view%body_b, record, vb)
      if (view%width_b > record_size) &
        call load_records(view%n, record_size, view%body_b, general, vb(1, record_size + 1))
    end if
    if (associated(view%rope)) call load_ropes(view%contacts, view%velocities, view%rope_body, record, view%rope)
  end subroutine load_bodies

  !> Records of the sides that impulses move by them, all that add_impulse reads: nodes of meshes have none.
  subroutine load_moved(batch, view, record, general, va, vb)
    type(cairn_batch), intent(in)   :: batch
    type(batch_view), intent(in)    :: view
    type(cairn_record), intent(in)  :: record(0:*)              !< velocity records of bodies
    type(cairn_record), intent(in)  :: general(0:*)             !< further inertia of bodies, read by wide sides alone
    real(c_double), intent(inout)   :: va(view%n, view%width_a) !< columns of side A
    real(c_double), intent(inout)   :: vb(view%n, view%width_b) !< columns of side B
    if (batch%moves_a /= 0 .and. .not. view%mapped_a) then
      call load_records(view%n, view%numbers, view%body_a, record, va)
      if (view%width_a > record_size) &
        call load_records(view%n, record_size, view%body_a, general, va(1, record_size + 1))
    end if
    if (batch%moves_b /= 0 .and. .not. view%mapped_b) then
      call load_records(view%n, view%numbers, view%body_b, record, vb)
      if (view%width_b > record_size) &
        call load_records(view%n, record_size, view%body_b, general, vb(1, record_size + 1))
    end if
  end subroutine load_moved

  !> Adds the effect of impulses to the velocities of sides on bodies with a reach.
  subroutine add_reaches(view, body, node, weight, spin, v)
    type(batch_view), intent(in)   :: view
    integer(c_int32_t), intent(in) :: body(view%n), node(view%n, mapping_nodes)
    real(c_double), intent(in)     :: weight(view%n, mapping_nodes) !< of the nodes [-]
    real(c_double), pointer, contiguous, intent(in) :: spin(:) !< null where nothing turns [1/m]
    real(c_double), intent(inout)  :: v(view%n, *)   !< columns of the side [m/s, rad/s]
    call load_reached(view%n, view%contacts, view%dim, body, node, weight, view%condensed, v)
    if (associated(spin)) call load_reached_spins(view%n, view%contacts, int(view%c), view%dim, body, node, spin, view%condensed, &
      v(1, view%dim + 1))
  end subroutine add_reaches

  !> Contribution of the far parts of ropes to u_N: the velocity at which their ends leave their pulleys.
  subroutine load_ropes(contacts, k, body, record, rope)
    integer, intent(in)            :: contacts
    integer, intent(in)            :: k                            !< velocities of a record
    integer(c_int32_t), intent(in) :: body(rope_bodies, contacts)  !< places of records
    type(cairn_record), intent(in) :: record(0:*)                  !< velocity records of bodies
    real(c_double), intent(inout)  :: rope(rope_numbers, contacts) !< see cairn_batch in cairn/core.h
    integer :: i, j
    do i = 1, contacts
      rope(1, i) = 0
      do j = 1, rope_bodies
        rope(1, i) = rope(1, i) + dot_product(rope(12*j - 9:12*j - 10 + k, i), record(body(j, i))%x(:k))
      end do
    end do
  end subroutine load_ropes

  !> The tension of a rope is that on both sides of its pulley.
  subroutine pull_ropes(contacts, k, dr, body, rope, record)
    integer, intent(in)               :: contacts
    integer, intent(in)               :: k                            !< velocities of a record
    real(c_double), intent(in)        :: dr(contacts)                 !< change of the impulse along the rope [N s]
    integer(c_int32_t), intent(in)    :: body(rope_bodies, contacts)  !< places of records
    real(c_double), intent(in)        :: rope(rope_numbers, contacts) !< see cairn_batch in cairn/core.h
    type(cairn_record), intent(inout) :: record(0:*)                  !< velocity records of bodies
    integer :: i, j
    do i = 1, contacts
      do j = 1, rope_bodies
        associate (v => record(body(j, i))%x)
          v(:k) = v(:k) + dr(i)*rope(12*j - 3:12*j - 4 + k, i)
        end associate
      end do
    end do
  end subroutine pull_ropes

  !> u = v_A - v_B in local axes, the law's bias and compliance added: the velocity that the cone's condition is on.
  subroutine relative_velocity(view, va, vb, u)
    type(batch_view), intent(in) :: view
    real(c_double), intent(in)   :: va(view%n, view%width_a) !< columns of side A
    real(c_double), intent(in)   :: vb(view%n, view%width_b) !< columns of side B
    real(c_double), intent(out)  :: u(view%n*view%c)         !< relative velocity and bias [m/s]
    integer :: i
    do i = 1, view%n*view%c
      u(i) = view%bias(i)
    end do
    if (associated(view%compliance)) then
      do i = 1, view%n*view%c
        u(i) = u(i) + view%compliance(i)*view%r(i)
      end do
    end if
    call view%gather_a(view%n, view%c, view%width_a, 1.0_c_double, va, view%frame, view%lever_a, u)
    call view%gather_b(view%n, view%c, view%width_b, -1.0_c_double, vb, view%frame, view%lever_b, u)
    if (associated(view%rope)) u(:view%contacts) = u(:view%contacts) + view%rope(1, :view%contacts)
    call leave_spins(view, u)
  end subroutine relative_velocity

  !> A node or a point of a mesh has no spin, and takes no moment: relative to it nothing turns.
  subroutine leave_spins(view, u)
    type(batch_view), intent(in)  :: view
    real(c_double), intent(inout) :: u(view%n, view%c) !< relative velocity [m/s, rad/s]
    integer :: i
    if (.not. (view%mapped_a .or. view%mapped_b)) return
    if (associated(view%turns)) then
      do i = 1, view%contacts
        if (view%turns(i) == 0) u(i, view%dim + 1:) = 0
      end do
    else
      u(:, view%dim + 1:) = 0
    end if
  end subroutine leave_spins

  !> u = v_A - v_B in local axes.
  subroutine bare_velocity(view, va, vb, u)
    type(batch_view), intent(in) :: view
    real(c_double), intent(in)   :: va(view%n, view%width_a) !< columns of side A
    real(c_double), intent(in)   :: vb(view%n, view%width_b) !< columns of side B
    real(c_double), intent(out)  :: u(view%n*view%c)         !< relative velocity [m/s]
    u = 0
    call view%gather_a(view%n, view%c, view%width_a, 1.0_c_double, va, view%frame, view%lever_a, u)
    call view%gather_b(view%n, view%c, view%width_b, -1.0_c_double, vb, view%frame, view%lever_b, u)
    if (associated(view%rope)) u(:view%contacts) = u(:view%contacts) + view%rope(1, :view%contacts)
    call leave_spins(view, u)
  end subroutine bare_velocity

  !> Bodies take a change of impulse. va and vb are the records as loaded; lost afterwards.
  subroutine add_impulse(batch, view, dr, va, vb, record)
    type(cairn_batch), intent(in)     :: batch
    type(batch_view), intent(in)      :: view
    real(c_double), intent(in)        :: dr(view%n, view%c)       !< change of impulse [N s]
    real(c_double), intent(inout)     :: va(view%n, view%width_a) !< columns of side A
    real(c_double), intent(inout)     :: vb(view%n, view%width_b) !< columns of side B
    type(cairn_record), intent(inout) :: record(0:*)              !< velocity records of bodies
    integer :: k
    k = batch%velocities
    if (view%stride_a > 0) then
      call add_responses(view%n, view%contacts, view%pushes, view%stride_a, 1.0_c_double, dr, view%dof_a, view%response_a, &
        view%velocity)
    else if (view%mapped_a) then
      call add_mapped(view%n, view%contacts, view%dim, 1.0_c_double, dr, view%frame, view%body_a, view%node_a, view%lever_a, &
        view%condensed)
      if (associated(view%turns)) call add_moments(view%n, view%contacts, view%c, view%dim, 1.0_c_double, dr, view%body_a, &
        view%node_a, view%spin_a, view%condensed)
    else if (batch%moves_a /= 0) then
      if (batch%hub == 1) va(:, 1:k) = 0
      call view%scatter_a(view%n, view%c, view%width_a, 1.0_c_double, dr, view%frame, view%lever_a, va)
      if (batch%hub == 1) then
        call add_to_hub(view%n, k, va, record(view%body_a(1))%x)
      else
        call store_records(view%n, batch%contacts, k, view%body_a, va, record)
      end if
    end if
    if (view%stride_b > 0) then
      call add_responses(view%n, view%contacts, view%pushes, view%stride_b, -1.0_c_double, dr, view%dof_b, view%response_b, &
        view%velocity)
    else if (view%mapped_b) then
      call add_mapped(view%n, view%contacts, view%dim, -1.0_c_double, dr, view%frame, view%body_b, view%node_b, view%lever_b, &
        view%condensed)
      if (associated(view%turns)) call add_moments(view%n, view%contacts, view%c, view%dim, -1.0_c_double, dr, view%body_b, &
        view%node_b, view%spin_b, view%condensed)
    else if (batch%moves_b /= 0) then
      if (batch%hub == 2) vb(:, 1:k) = 0
      call view%scatter_b(view%n, view%c, view%width_b, -1.0_c_double, dr, view%frame, view%lever_b, vb)
      if (batch%hub == 2) then
        call add_to_hub(view%n, k, vb, record(view%body_b(1))%x)
      else
        call store_records(view%n, batch%contacts, k, view%body_b, vb, record)
      end if
    end if
    if (associated(view%rope)) call pull_ropes(view%contacts, k, dr(:view%contacts, 1), view%rope_body, view%rope, record)
  end subroutine add_impulse

  !> w = H' A^-1 H of each contact; the side that is a hub is counted `factor` times.
  subroutine delassus_block(batch, sides, view, factor, va, vb, w)
    type(cairn_batch), intent(in) :: batch
    type(cairn_side), intent(in)  :: sides(0:*)
    type(batch_view), intent(in)  :: view
    real(c_double), value         :: factor                   !< 1, or the size of the group that shares a hub
    real(c_double), intent(in)    :: va(view%n, view%width_a) !< columns of side A
    real(c_double), intent(in)    :: vb(view%n, view%width_b) !< columns of side B
    real(c_double), intent(out)   :: w(view%n, view%c, view%c) !< full blocks [1/kg]
    procedure(side_delassus), pointer :: delassus_a, delassus_b
    real(c_double) :: times_a, times_b
    integer :: i
    call c_f_procpointer(sides(batch%side_a)%delassus, delassus_a)
    call c_f_procpointer(sides(batch%side_b)%delassus, delassus_b)
    times_a = merge(factor, 1.0_c_double, batch%hub == 1)
    times_b = merge(factor, 1.0_c_double, batch%hub == 2)
    w = 0
    if (view%mapped_a) then
      call delassus_mapped(view%n, view%contacts, view%c, view%dim, view%nodes_a, view%frame, view%body_a, view%node_a, &
        view%lever_a, view%condensed, w)
      if (associated(view%turns)) call delassus_turning(view%n, view%contacts, view%c, view%dim, view%frame, view%body_a, &
        view%node_a, view%lever_a, view%spin_a, view%condensed, w)
    else if (batch%moves_a /= 0) then
      call delassus_a(view%n, view%c, view%width_a, times_a, va, view%frame, view%lever_a, w)
    end if
    if (view%mapped_b) then
      call delassus_mapped(view%n, view%contacts, view%c, view%dim, view%nodes_b, view%frame, view%body_b, view%node_b, &
        view%lever_b, view%condensed, w)
      if (associated(view%turns)) call delassus_turning(view%n, view%contacts, view%c, view%dim, view%frame, view%body_b, &
        view%node_b, view%lever_b, view%spin_b, view%condensed, w)
    else if (batch%moves_b /= 0) then
      call delassus_b(view%n, view%c, view%width_b, times_b, vb, view%frame, view%lever_b, w)
    end if
    if (view%mapped_a .and. view%mapped_b) then
      call delassus_shared(view%n, view%contacts, view%c, view%dim, view%frame, view%body_a, view%body_b, view%node_a, &
        view%node_b, view%lever_a, view%lever_b, view%condensed, w)
    end if
    if (associated(view%rope)) w(:view%contacts, 1, 1) = w(:view%contacts, 1, 1) + view%rope(2, :view%contacts)
    if (.not. (view%mapped_a .or. view%mapped_b)) return
    do i = 1, view%n
      if (associated(view%turns) .and. i <= view%contacts) then
        if (view%turns(i) /= 0) cycle
      end if
      w(i, view%dim + 1:, :) = 0
      w(i, :, view%dim + 1:) = 0
    end do
  end subroutine delassus_block
end module batch_kinematics
