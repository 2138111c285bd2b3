!> Data of a solver's sweep: batches of mutually independent contacts, and the kinds of side they rest on. The C twins of these
!> types, with the meaning of every member, are in cairn/core.h.
module contact_batch
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double, c_ptr, c_funptr
  use law_context, only: cairn_law_context
  implicit none
  private
  public :: cairn_record, cairn_batch, cairn_side, cairn_schedule, cairn_condensed, cairn_reach
  public :: side_gather, side_scatter, side_delassus, law_solve, law_residual, mapping_nodes, mapping_dofs
  public :: record_size, max_batch, max_components, batch_workspace, rope_bodies, rope_numbers

  integer, parameter :: record_size = 8     !< numbers of a body's velocity record: one cache line
  integer, parameter :: max_batch = 128     !< contacts of a batch, at most
  integer, parameter :: max_components = 6  !< unknowns of a contact, at most

  integer, parameter :: batch_workspace = 80*max_batch !< numbers of workspace a thread

  integer, parameter :: mapping_nodes = 4   !< nodes that a contact on a body that deforms rests on, at most

  integer, parameter :: mapping_dofs = 6    !< places of a mapped contact: of its nodes, of its body, rows of its response

  integer, parameter :: rope_bodies = 2     !< bodies that the far part of a rope moves: that at its end, that of its pulley
  integer, parameter :: rope_numbers = 2 + 12*rope_bodies !< see cairn_batch in cairn/core.h

  !> Copied whole: as one object, the compiler moves the line at once.
  type, bind(c) :: cairn_record
    real(c_double) :: x(record_size)
  end type cairn_record

  type, bind(c) :: cairn_condensed
    integer(c_int64_t) :: dofs
    integer(c_int64_t) :: leading
    type(c_ptr) :: velocity
    type(c_ptr) :: compliance
    type(c_ptr) :: reach
  end type cairn_condensed

  type, bind(c) :: cairn_reach
    integer(c_int64_t) :: numbers
    real(c_double) :: unit
    type(c_ptr) :: first
    type(c_ptr) :: place
    type(c_ptr) :: length
    type(c_ptr) :: value
    type(c_ptr) :: y
  end type cairn_reach

  type, bind(c) :: cairn_batch
    integer(c_int32_t) :: count
    integer(c_int32_t) :: contacts
    integer(c_int32_t) :: components
    integer(c_int32_t) :: block
    integer(c_int32_t) :: side_a
    integer(c_int32_t) :: side_b
    integer(c_int32_t) :: moves_a
    integer(c_int32_t) :: moves_b
    integer(c_int32_t) :: hub
    integer(c_int32_t) :: group
    integer(c_int32_t) :: law
    integer(c_int32_t) :: first
    integer(c_int32_t) :: velocities
    integer(c_int32_t) :: pack
    integer(c_int32_t) :: relaxes
    integer(c_int32_t) :: bonds
    integer(c_int32_t) :: repeats
    integer(c_int32_t) :: mapped_a
    integer(c_int32_t) :: mapped_b
    integer(c_int32_t) :: in_turn
    integer(c_int32_t) :: nodes_a
    integer(c_int32_t) :: nodes_b
    integer(c_int32_t) :: stride_a
    integer(c_int32_t) :: stride_b
    type(c_ptr) :: body_a
    type(c_ptr) :: body_b
    type(c_ptr) :: node_a
    type(c_ptr) :: node_b
    type(c_ptr) :: dof_a
    type(c_ptr) :: dof_b
    type(c_ptr) :: turns
    type(c_ptr) :: spin_a
    type(c_ptr) :: spin_b
    type(c_ptr) :: condensed
    type(c_ptr) :: condensed_velocity
    type(c_ptr) :: response_a
    type(c_ptr) :: response_b
    type(c_ptr) :: frame
    type(c_ptr) :: lever_a
    type(c_ptr) :: lever_b
    type(c_ptr) :: delassus
    type(c_ptr) :: bias
    type(c_ptr) :: compliance
    type(c_ptr) :: params
    type(c_ptr) :: r
    type(c_ptr) :: rho
    type(c_ptr) :: scale
    type(c_ptr) :: state
    type(c_ptr) :: status
    type(c_funptr) :: solve
    type(c_funptr) :: residual
    type(c_ptr) :: context
    type(c_ptr) :: rope_body
    type(c_ptr) :: rope
  end type cairn_batch

  type, bind(c) :: cairn_side
    type(c_funptr) :: gather
    type(c_funptr) :: scatter
    type(c_funptr) :: delassus
    integer(c_int32_t) :: lever
    integer(c_int32_t) :: width
  end type cairn_side

  type, bind(c) :: cairn_schedule
    integer(c_int32_t) :: stages
    integer(c_int32_t) :: batches
    integer(c_int32_t) :: threads
    integer(c_int32_t) :: associated !< 1: see radial_sweep
    real(c_double) :: relaxation
    real(c_double) :: softening_relaxation
    type(c_ptr) :: first_task
    type(c_ptr) :: first_batch
    type(c_ptr) :: batch
    type(c_ptr) :: side
    type(c_ptr) :: record
    type(c_ptr) :: general
    type(c_ptr) :: work
  end type cairn_schedule

  abstract interface
    !> u = u + sign H'v
    subroutine side_gather(n, c, width, sign, v, frame, lever, u) bind(c)
      import :: c_int32_t, c_double
      integer(c_int32_t), value :: n, c, width
      real(c_double), value :: sign
      real(c_double), intent(in) :: v(n, width), frame(n, *), lever(n, *)
      real(c_double), intent(inout) :: u(n, c)
    end subroutine side_gather
    !> v = v + sign A^-1 H dr
    subroutine side_scatter(n, c, width, sign, dr, frame, lever, v) bind(c)
      import :: c_int32_t, c_double
      integer(c_int32_t), value :: n, c, width
      real(c_double), value :: sign
      real(c_double), intent(in) :: dr(n, c), frame(n, *), lever(n, *)
      real(c_double), intent(inout) :: v(n, width)
    end subroutine side_scatter
    !> w = w + factor H' A^-1 H
    subroutine side_delassus(n, c, width, factor, v, frame, lever, w) bind(c)
      import :: c_int32_t, c_double
      integer(c_int32_t), value :: n, c, width
      real(c_double), value :: factor
      real(c_double), intent(in) :: v(n, width), frame(n, *), lever(n, *)
      real(c_double), intent(inout) :: w(n, c, c)
    end subroutine side_delassus
    subroutine law_solve(n, c, w, u_free, bias, params, state, r, status) bind(c)
      import :: c_int32_t, c_double
      integer(c_int32_t), value :: n, c
      real(c_double), intent(in) :: w(n, *), u_free(n, *), bias(n, *), params(n, *), state(n, *)
      real(c_double), intent(inout) :: r(n, *)
      integer(c_int32_t), intent(out), optional :: status(n)
    end subroutine law_solve
    subroutine law_residual(n, c, context, rho, w, u, bias, r, params, state, f, weight, status) bind(c)
      import :: c_int32_t, c_double, cairn_law_context
      integer(c_int32_t), value :: n, c
      type(cairn_law_context), intent(in) :: context
      real(c_double), intent(in) :: rho(n), w(n, *), u(n, *), bias(n, *), r(n, *), params(n, *), state(n, *)
      real(c_double), intent(out) :: f(n, *), weight(n, *)
      integer(c_int32_t), intent(out) :: status(n)
    end subroutine law_residual
  end interface
end module contact_batch
