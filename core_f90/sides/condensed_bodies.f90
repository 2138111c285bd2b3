!> Bodies that deform, as contacts see them: velocities of their contact nodes and the compliance between these. A contact rests on
!> up to four nodes with weights (its mapping); the impulse it gives changes the velocities of all contact nodes of the body:
!>   v_c = v_c + S H dr,   S = B A^-1 B' on the contact dofs, A the matrix of the body's step.
!> Where the contact turns with its face, columns of H are the rows by which velocities of the nodes make the spin of the face: they
!> are zero for a translation and right for a rotation, so that a moment acts as a couple on the nodes, of that moment.
module condensed_bodies
  use, intrinsic :: iso_c_binding, only: c_associated, c_int32_t, c_int64_t, c_double, c_ptr, c_f_pointer
  use contact_batch, only: cairn_batch, cairn_condensed, mapping_nodes, mapping_dofs
  use reached_bodies, only: is_reached, add_reached, block_between
  implicit none
  private
  public :: load_mapped, load_one, load_spins, add_mapped, add_moments, add_responses
  public :: delassus_mapped, delassus_turning, delassus_shared, cairn_mapped_responses
contains

  !> Velocity of the point of the body that each contact rests on: the mean of its nodes, by weight.
  subroutine load_mapped(n, contacts, dim, nodes, dof, weight, velocity, v)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: dim          !< 2 or 3
    integer, value                    :: nodes        !< of a contact, at most
    integer(c_int32_t), intent(in)    :: dof(n, *)    !< places of the first dof of each node, from 0
    real(c_double), intent(in)        :: weight(n, *) !< of the nodes; 0 where there are fewer [-]
    real(c_double), intent(in)        :: velocity(0:*) !< of all condensed bodies [m/s]
    real(c_double), intent(out)       :: v(n, dim)    !< [m/s]
    integer :: i, j, k
    do k = 1, dim
      !$omp simd
      do i = 1, contacts
        v(i, k) = weight(i, 1)*velocity(dof(i, 1) + k - 1)
      end do
      do j = 2, nodes
        !$omp simd
        do i = 1, contacts
          v(i, k) = v(i, k) + weight(i, j)*velocity(dof(i, j) + k - 1)
        end do
      end do
      v(contacts + 1:n, k) = 0
    end do
  end subroutine load_mapped

  !> Spins of the faces that contacts rest on, about the axes of each contact; 0 where they have none.
  subroutine load_spins(n, contacts, c, dim, nodes, dof, spin, velocity, v)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: c            !< components of a contact
    integer, value                    :: dim          !< 2 or 3
    integer, value                    :: nodes        !< of a contact, at most
    integer(c_int32_t), intent(in)    :: dof(n, *)    !< places of the first dof of each node, from 0
    real(c_double), intent(in)        :: spin(n, dim, mapping_nodes, c - dim) !< of nodes [1/m]
    real(c_double), intent(in)        :: velocity(0:*) !< of all condensed bodies [m/s]
    real(c_double), intent(out)       :: v(n, c - dim) !< [rad/s]
    integer :: i, j, k, l
    v = 0
    do k = 1, c - dim
      do j = 1, nodes
        do l = 1, dim
          do i = 1, contacts
            v(i, k) = v(i, k) + spin(i, l, j, k)*velocity(dof(i, j) + l - 1)
          end do
        end do
      end do
    end do
  end subroutine load_spins

  !> load_mapped of one contact, without loops over contacts.
  pure subroutine load_one(dim, nodes, dof, weight, velocity, v)
    integer, value                    :: dim          !< 2 or 3
    integer, value                    :: nodes        !< of the contact
    integer(c_int32_t), intent(in)    :: dof(*)       !< places of the first dof of each node, from 0
    real(c_double), intent(in)        :: weight(*)    !< of the nodes; 0 where there are fewer [-]
    real(c_double), intent(in)        :: velocity(0:*) !< of all condensed bodies [m/s]
    real(c_double), intent(out)       :: v(dim)       !< [m/s]
    integer :: k
    do k = 1, dim
      v(k) = 0 + weight(1)*velocity(dof(1) + k - 1) ! no loop, so that each product is rounded with its sum, as in load_mapped
      if (nodes > 1) v(k) = v(k) + weight(2)*velocity(dof(2) + k - 1)
      if (nodes > 2) v(k) = v(k) + weight(3)*velocity(dof(3) + k - 1)
      if (nodes > 3) v(k) = v(k) + weight(4)*velocity(dof(4) + k - 1)
    end do
  end subroutine load_one

  !> v_c = v_c + sign (S H) dr of small bodies, S H as the batch keeps it; no two contacts share a body.
  subroutine add_responses(n, contacts, dim, stride, sign, dr, dof, response, velocity)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: dim          !< 2 or 3, or the components of a contact that turns
    integer, value                    :: stride       !< rows of a response
    real(c_double), value             :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)        :: dr(n, dim)   !< change of impulse along the axes of the contact [N s]
    integer(c_int32_t), intent(in)    :: dof(n, mapping_dofs) !< fifth: place of the body, from 0; sixth: its rows
    real(c_double), intent(in)        :: response(stride, dim, n) !< [1/kg]
    real(c_double), intent(inout)     :: velocity(0:*) !< of all condensed bodies [m/s]
    integer :: i
    if (dim == 2 .and. stride == 8) then
      do i = 1, contacts
        call add_line(sign*dr(i, 1), sign*dr(i, 2), response(1, 1, i), velocity(dof(i, 5)))
      end do
      return
    end if
    do i = 1, contacts
      call add_rows(dof(i, 6), stride, dim, sign*dr(i, :), response(1, 1, i), velocity(dof(i, 5)))
    end do
  end subroutine add_responses

  pure subroutine add_line(p, q, response, v)
    real(c_double), value         :: p, q            !< [N s]
    real(c_double), intent(in)    :: response(8, 2)  !< [1/kg]
    real(c_double), intent(inout) :: v(8)            !< a cache line [m/s]
    integer :: l
    !$omp simd
    do l = 1, 8
      v(l) = v(l) + (p*response(l, 1) + q*response(l, 2))
    end do
  end subroutine add_line

  pure subroutine add_rows(rows, stride, dim, p, response, v)
    integer, value                :: rows, stride, dim
    real(c_double), intent(in)    :: p(dim)                !< [N s]
    real(c_double), intent(in)    :: response(stride, dim) !< [1/kg]
    real(c_double), intent(inout) :: v(rows)               !< [m/s]
    integer :: k, l
    do k = 1, dim
      !$omp simd
      do l = 1, rows
        v(l) = v(l) + p(k)*response(l, k)
      end do
    end do
  end subroutine add_rows

  !> S H of every contact of a batch, on the sides that keep it.
  subroutine cairn_mapped_responses(batch, dimension) bind(c)
    type(cairn_batch), intent(in) :: batch     !< see cairn/core.h
    integer(c_int32_t), value     :: dimension !< 2 or 3
    type(cairn_condensed), pointer, contiguous :: condensed(:)
    integer, parameter :: many = huge(0)
    call c_f_pointer(batch%condensed, condensed, [many])
    if (batch%stride_a > 0) &
      call one_side(batch%stride_a, batch%body_a, batch%node_a, batch%lever_a, batch%spin_a, batch%response_a)
    if (batch%stride_b > 0) &
      call one_side(batch%stride_b, batch%body_b, batch%node_b, batch%lever_b, batch%spin_b, batch%response_b)
  contains
    subroutine one_side(stride, body, node, lever, spin, response)
      integer(c_int32_t), value :: stride
      type(c_ptr), value        :: body, node, lever, spin, response
      integer :: pushes
      integer(c_int32_t), pointer, contiguous :: which(:), nodes(:, :)
      real(c_double), pointer, contiguous :: frame(:), weight(:, :), turning(:, :, :, :), s_h(:, :, :)
      call c_f_pointer(body, which, [batch%count])
      call c_f_pointer(node, nodes, [int(batch%count), mapping_nodes])
      call c_f_pointer(lever, weight, [int(batch%count), mapping_nodes])
      call c_f_pointer(batch%frame, frame, [6*batch%count])
      pushes = int(merge(batch%components, dimension, c_associated(batch%turns)))
      call c_f_pointer(response, s_h, [int(stride), pushes, int(batch%count)])
      call fill_responses(int(batch%count), int(batch%contacts), int(dimension), pushes, int(stride), frame, which, nodes, weight, &
        condensed, s_h)
      if (.not. c_associated(batch%turns)) return
      call c_f_pointer(spin, turning, [int(batch%count), int(dimension), mapping_nodes, pushes - int(dimension)])
      call fill_turning(int(batch%count), int(batch%contacts), int(dimension), pushes, int(stride), which, nodes, turning, &
        condensed, s_h)
    end subroutine one_side
  end subroutine cairn_mapped_responses

  subroutine fill_responses(n, contacts, dim, pushes, stride, frame, body, node, weight, condensed, response)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: dim          !< 2 or 3
    integer, value                    :: pushes       !< columns of a response
    integer, value                    :: stride       !< rows of a response
    real(c_double), intent(in)        :: frame(n, *)  !< normal, in 3D first tangent [-]
    integer(c_int32_t), intent(in)    :: body(n)      !< which condensed body, from 0
    integer(c_int32_t), intent(in)    :: node(n, mapping_nodes) !< places among its contact nodes, from 0
    real(c_double), intent(in)        :: weight(n, mapping_nodes) !< of the nodes [-]
    type(cairn_condensed), intent(in) :: condensed(0:*)
    real(c_double), intent(out)       :: response(stride, pushes, n) !< [1/kg]
    real(c_double), pointer, contiguous :: compliance(:, :)
    real(c_double) :: axes(3, 3), push
    integer :: i, j, k, l, dofs
    do i = 1, contacts
      call axes_of(n, dim, i, frame, axes)
      response(:, :, i) = 0
      associate (of => condensed(body(i)))
        dofs = int(of%dofs)
        call c_f_pointer(of%compliance, compliance, [of%leading, of%dofs])
      end associate
      do j = 1, mapping_nodes
        if (.not. abs(weight(i, j)) > 0) cycle
        do k = 1, dim
          do l = 1, dim
            push = weight(i, j)*axes(l, k)
            response(1:dofs, k, i) = response(1:dofs, k, i) + push*compliance(1:dofs, dim*node(i, j) + l)
          end do
        end do
      end do
    end do
    response(:, :, contacts + 1:n) = 0
  end subroutine fill_responses

  !> Columns of the response to contact moments, each of which acts as forces `spin` on the nodes of its contact.
  subroutine fill_turning(n, contacts, dim, pushes, stride, body, node, spin, condensed, response)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: dim          !< 2 or 3
    integer, value                    :: pushes       !< columns of a response
    integer, value                    :: stride       !< rows of a response
    integer(c_int32_t), intent(in)    :: body(n)      !< which condensed body, from 0
    integer(c_int32_t), intent(in)    :: node(n, mapping_nodes) !< places among its contact nodes, from 0
    real(c_double), intent(in)        :: spin(n, dim, mapping_nodes, pushes - dim) !< of nodes [1/m]
    type(cairn_condensed), intent(in) :: condensed(0:*)
    real(c_double), intent(inout)     :: response(stride, pushes, n) !< [1/kg, 1/(kg m)]
    real(c_double), pointer, contiguous :: compliance(:, :)
    integer :: i, j, k, l, dofs
    do i = 1, contacts
      associate (of => condensed(body(i)))
        dofs = int(of%dofs)
        call c_f_pointer(of%compliance, compliance, [of%leading, of%dofs])
      end associate
      do k = 1, pushes - dim
        do j = 1, mapping_nodes
          do l = 1, dim
            if (abs(spin(i, l, j, k)) > 0) response(1:dofs, dim + k, i) = response(1:dofs, dim + k, i) &
              + spin(i, l, j, k)*compliance(1:dofs, dim*node(i, j) + l)
          end do
        end do
      end do
    end do
  end subroutine fill_turning

  !> v_c = v_c + sign S H dr, one contact after the other; no two contacts of a batch share a body.
  subroutine add_mapped(n, contacts, dim, sign, dr, frame, body, node, weight, condensed)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: dim          !< 2 or 3
    real(c_double), value             :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)        :: dr(n, dim)   !< change of impulse along the axes of the contact [N s]
    real(c_double), intent(in)        :: frame(n, *)  !< normal, in 3D first tangent [-]
    integer(c_int32_t), intent(in)    :: body(n)      !< which condensed body, from 0
    integer(c_int32_t), intent(in)    :: node(n, mapping_nodes) !< places among its contact nodes, from 0
    real(c_double), intent(in)        :: weight(n, mapping_nodes) !< of the nodes [-]
    type(cairn_condensed), intent(in) :: condensed(0:*)
    real(c_double), pointer, contiguous :: v_c(:), compliance(:, :)
    real(c_double) :: axes(3, 3), p(3)
    integer :: i, j, first
    do i = 1, contacts
      if (dim == 2) then
        p(1) = sign*(dr(i, 1)*frame(i, 1) - dr(i, 2)*frame(i, 2))
        p(2) = sign*(dr(i, 1)*frame(i, 2) + dr(i, 2)*frame(i, 1))
        p(3) = 0
      else
        call axes_of(n, dim, i, frame, axes)
        p = sign*(dr(i, 1)*axes(:, 1) + dr(i, 2)*axes(:, 2) + dr(i, 3)*axes(:, 3))
      end if
      if (.not. (abs(p(1)) > 0 .or. abs(p(2)) > 0 .or. abs(p(3)) > 0)) cycle ! nothing changed
      if (is_reached(condensed(body(i)))) then
        do j = 1, mapping_nodes
          if (abs(weight(i, j)) > 0) call add_reached(dim, condensed(body(i)), node(i, j), weight(i, j)*p)
        end do
        cycle
      end if
      associate (of => condensed(body(i)))
        call c_f_pointer(of%velocity, v_c, [of%dofs])
        call c_f_pointer(of%compliance, compliance, [of%leading, of%dofs])
      end associate
      if (dim == 2 .and. all(abs(weight(i, 1:2)) > 0)) then ! on an edge
        call add_edge(node(i, 1), node(i, 2), weight(i, 1)*p, weight(i, 2)*p, v_c, compliance)
        first = 3
      else
        first = 1
      end if
      do j = first, mapping_nodes
        if (abs(weight(i, j)) > 0) call add_columns(dim, node(i, j), weight(i, j)*p, v_c, compliance)
      end do
    end do
  end subroutine add_mapped

  !> add_mapped of the moments of contacts that turn.
  subroutine add_moments(n, contacts, c, dim, sign, dr, body, node, spin, condensed)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: c            !< components of a contact
    integer, value                    :: dim          !< 2 or 3
    real(c_double), value             :: sign         !< +1 on side A, -1 on side B
    real(c_double), intent(in)        :: dr(n, c)     !< change of impulse [N s], then of moment [N m s]
    integer(c_int32_t), intent(in)    :: body(n)      !< which condensed body, from 0
    integer(c_int32_t), intent(in)    :: node(n, mapping_nodes) !< places among its contact nodes, from 0
    real(c_double), intent(in)        :: spin(n, dim, mapping_nodes, c - dim) !< of nodes [1/m]
    type(cairn_condensed), intent(in) :: condensed(0:*)
    real(c_double), pointer, contiguous :: v_c(:), compliance(:, :)
    real(c_double) :: p(3)
    integer :: i, j, l
    do i = 1, contacts
      if (.not. any(abs(dr(i, dim + 1:)) > 0)) cycle ! nothing changed
      do j = 1, mapping_nodes
        p = 0
        do l = 1, dim
          p(l) = sign*dot_product(spin(i, l, j, :), dr(i, dim + 1:))
        end do
        if (.not. any(abs(p) > 0)) cycle
        if (is_reached(condensed(body(i)))) then
          call add_reached(dim, condensed(body(i)), node(i, j), p)
          cycle
        end if
        associate (of => condensed(body(i)))
          call c_f_pointer(of%velocity, v_c, [of%dofs])
          call c_f_pointer(of%compliance, compliance, [of%leading, of%dofs])
        end associate
        call add_columns(dim, node(i, j), p, v_c, compliance)
      end do
    end do
  end subroutine add_moments

  !> add_columns of both nodes of an edge in one pass.
  pure subroutine add_edge(node_a, node_b, p, q, v, compliance)
    integer(c_int32_t), intent(in) :: node_a, node_b   !< from 0
    real(c_double), intent(in)     :: p(3), q(3)       !< on each [N s]
    real(c_double), intent(inout), contiguous :: v(:)  !< [m/s]
    real(c_double), intent(in), contiguous :: compliance(:, :) !< [1/kg]
    integer :: a, b, l
    a = 2*node_a
    b = 2*node_b
    !$omp simd
    do l = 1, size(v)
      v(l) = v(l) + (p(1)*compliance(l, a + 1) + p(2)*compliance(l, a + 2)) &
             + (q(1)*compliance(l, b + 1) + q(2)*compliance(l, b + 2))
    end do
  end subroutine add_edge

  !> Adds the effect of an impulse p on a node to the velocities of all nodes, by columns of the compliance.
  pure subroutine add_columns(dim, node, p, v, compliance)
    integer, intent(in)            :: dim
    integer(c_int32_t), intent(in) :: node             !< from 0
    real(c_double), intent(in)     :: p(3)             !< [N s]
    real(c_double), intent(inout), contiguous :: v(:)  !< [m/s]
    real(c_double), intent(in), contiguous :: compliance(:, :) !< [1/kg]
    integer :: at, l
    at = dim*node
    if (dim == 2) then
      do l = 1, size(v)
        v(l) = v(l) + (p(1)*compliance(l, at + 1) + p(2)*compliance(l, at + 2))
      end do
    else
      do l = 1, size(v)
        v(l) = v(l) + (p(1)*compliance(l, at + 1) + p(2)*compliance(l, at + 2) + p(3)*compliance(l, at + 3))
      end do
    end if
  end subroutine add_columns

  !> w = w + H' S H of each contact on its own.
  subroutine delassus_mapped(n, contacts, c, dim, nodes, frame, body, node, weight, condensed, w)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: c            !< components of a contact
    integer, value                    :: dim          !< 2 or 3
    integer, value                    :: nodes        !< of a contact, at most
    real(c_double), intent(in)        :: frame(n, *)  !< normal, in 3D first tangent [-]
    integer(c_int32_t), intent(in)    :: body(n)      !< which condensed body, from 0
    integer(c_int32_t), intent(in)    :: node(n, mapping_nodes) !< places among its contact nodes, from 0
    real(c_double), intent(in)        :: weight(n, mapping_nodes) !< of the nodes [-]
    type(cairn_condensed), intent(in) :: condensed(0:*)
    real(c_double), intent(inout)     :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double) :: axes(3, 3), of_point(3, 3), between(dim, dim), both
    integer :: i, j, l
    do i = 1, contacts
      call axes_of(n, dim, i, frame, axes)
      of_point = 0
      do j = 1, nodes
        do l = 1, nodes
          both = weight(i, j)*weight(i, l)
          if (.not. abs(both) > 0) cycle
          call block_between(dim, condensed(body(i)), node(i, j), node(i, l), between)
          of_point(1:dim, 1:dim) = of_point(1:dim, 1:dim) + both*between
        end do
      end do
      w(i, 1:dim, 1:dim) = w(i, 1:dim, 1:dim) &
        + matmul(transpose(axes(1:dim, 1:dim)), matmul(of_point(1:dim, 1:dim), axes(1:dim, 1:dim)))
    end do
  end subroutine delassus_mapped

  !> The part of w = w + H' S H that is of moments and spins.
  subroutine delassus_turning(n, contacts, c, dim, frame, body, node, weight, spin, condensed, w)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: c            !< components of a contact
    integer, value                    :: dim          !< 2 or 3
    real(c_double), intent(in)        :: frame(n, *)  !< normal, in 3D first tangent [-]
    integer(c_int32_t), intent(in)    :: body(n)      !< which condensed body, from 0
    integer(c_int32_t), intent(in)    :: node(n, mapping_nodes) !< places among its contact nodes, from 0
    real(c_double), intent(in)        :: weight(n, mapping_nodes) !< of the nodes [-]
    real(c_double), intent(in)        :: spin(n, dim, mapping_nodes, c - dim) !< of nodes [1/m]
    type(cairn_condensed), intent(in) :: condensed(0:*)
    real(c_double), intent(inout)     :: w(n, c, c)   !< Delassus blocks [1/kg], with rotations [1/(kg m), 1/(kg m2)]
    real(c_double) :: axes(3, 3), h(dim, mapping_nodes, c), s(dim, dim), block(c, c)
    integer :: i, j, k, l
    do i = 1, contacts
      call axes_of(n, dim, i, frame, axes)
      do j = 1, mapping_nodes
        h(:, j, :dim) = weight(i, j)*axes(:dim, :dim)
        h(:, j, dim + 1:) = spin(i, :, j, :)
      end do
      block = 0
      do j = 1, mapping_nodes
        do l = 1, mapping_nodes
          if (.not. (any(abs(h(:, j, :)) > 0) .and. any(abs(h(:, l, :)) > 0))) cycle ! it rests on fewer
          call block_between(dim, condensed(body(i)), node(i, j), node(i, l), s)
          block = block + matmul(transpose(h(:, j, :)), matmul(s, h(:, l, :)))
        end do
      end do
      block(:dim, :dim) = 0
      do k = 1, c
        w(i, :, k) = w(i, :, k) + block(:, k)
      end do
    end do
  end subroutine delassus_turning

  !> w = w - H_a' S H_b - H_b' S H_a for contacts whose sides rest on the same body. On a common node both contributions cancel:
  !> their weights are subtracted first, since the difference of squares would leave rounding, and thus motion.
  subroutine delassus_shared(n, contacts, c, dim, frame, body_a, body_b, node_a, node_b, weight_a, weight_b, condensed, w)
    integer, value                    :: n            !< contacts, dummies included
    integer, value                    :: contacts     !< contacts that are not dummies
    integer, value                    :: c            !< components of a contact
    integer, value                    :: dim          !< 2 or 3
    real(c_double), intent(in)        :: frame(n, *)  !< normal, in 3D first tangent [-]
    integer(c_int32_t), intent(in)    :: body_a(n), body_b(n) !< which condensed body, from 0
    integer(c_int32_t), intent(in)    :: node_a(n, mapping_nodes), node_b(n, mapping_nodes) !< places among its contact nodes
    real(c_double), intent(in)        :: weight_a(n, mapping_nodes), weight_b(n, mapping_nodes) !< of the nodes [-]
    type(cairn_condensed), intent(in) :: condensed(0:*)
    real(c_double), intent(inout)     :: w(n, c, c)   !< Delassus blocks [1/kg]
    real(c_double) :: axes(3, 3), across(3, 3), between(dim, dim), both
    integer :: i, j, l
    do i = 1, contacts
      if (body_a(i) /= body_b(i)) cycle
      call axes_of(n, dim, i, frame, axes)
      if (rests_on_same(node_a(i, :), node_b(i, :), weight_a(i, :), weight_b(i, :))) then
        call block_of_difference(dim, node_a(i, :), node_b(i, :), weight_a(i, :), weight_b(i, :), condensed(body_a(i)), &
          across(1:dim, 1:dim))
        w(i, 1:dim, 1:dim) = matmul(transpose(axes(1:dim, 1:dim)), matmul(across(1:dim, 1:dim), axes(1:dim, 1:dim)))
        cycle
      end if
      across = 0
      do j = 1, mapping_nodes
        do l = 1, mapping_nodes
          both = weight_a(i, j)*weight_b(i, l)
          if (.not. abs(both) > 0) cycle
          call block_between(dim, condensed(body_a(i)), node_a(i, j), node_b(i, l), between)
          across(1:dim, 1:dim) = across(1:dim, 1:dim) + both*between
        end do
      end do
      across = across + transpose(across)
      w(i, 1:dim, 1:dim) = w(i, 1:dim, 1:dim) &
        - matmul(transpose(axes(1:dim, 1:dim)), matmul(across(1:dim, 1:dim), axes(1:dim, 1:dim)))
    end do
  end subroutine delassus_shared

  pure logical function rests_on_same(node_a, node_b, weight_a, weight_b)
    integer(c_int32_t), intent(in) :: node_a(mapping_nodes), node_b(mapping_nodes)
    real(c_double), intent(in)     :: weight_a(mapping_nodes), weight_b(mapping_nodes) !< [-]
    integer :: j
    rests_on_same = .false.
    do j = 1, mapping_nodes
      if (abs(weight_a(j)) > 0) rests_on_same = rests_on_same .or. any(node_b == node_a(j) .and. abs(weight_b) > 0)
    end do
  end function rests_on_same

  !> S of the point of A less that of B, by the difference of their shares of each node.
  subroutine block_of_difference(dim, node_a, node_b, weight_a, weight_b, body, block)
    integer, intent(in)               :: dim             !< 2 or 3
    integer(c_int32_t), intent(in)    :: node_a(mapping_nodes), node_b(mapping_nodes)
    real(c_double), intent(in)        :: weight_a(mapping_nodes), weight_b(mapping_nodes) !< [-]
    type(cairn_condensed), intent(in) :: body
    real(c_double), intent(out)       :: block(dim, dim) !< [1/kg]
    real(c_double), parameter :: known = 2.0_c_double**(-40) !< share of a node, by where points lie on sides
    integer(c_int32_t) :: node(2*mapping_nodes)
    real(c_double) :: weight(2*mapping_nodes), between(dim, dim)
    integer :: j, l
    node = [node_a, node_b]
    weight = [weight_a, -weight_b]
    do j = 1, mapping_nodes
      if (.not. abs(weight(j)) > 0) cycle
      do l = mapping_nodes + 1, 2*mapping_nodes
        if (node(l) /= node(j) .or. .not. abs(weight(l)) > 0) cycle
        weight(j) = weight(j) + weight(l)
        if (abs(weight(j)) <= known*abs(weight(l))) weight(j) = 0
        weight(l) = 0
      end do
    end do
    block = 0
    do j = 1, 2*mapping_nodes
      do l = 1, 2*mapping_nodes
        if (.not. abs(weight(j)*weight(l)) > 0) cycle
        call block_between(dim, body, node(j), node(l), between)
        block = block + weight(j)*weight(l)*between
      end do
    end do
  end subroutine block_of_difference

  !> Columns n, t and, in 3D, s = n x t.
  pure subroutine axes_of(n, dim, i, frame, axes)
    integer, value              :: n, dim, i
    real(c_double), intent(in)  :: frame(n, *)
    real(c_double), intent(out) :: axes(3, 3)
    axes = 0
    axes(1:dim, 1) = frame(i, 1:dim)
    if (dim == 2) then
      axes(1, 2) = -frame(i, 2)
      axes(2, 2) = frame(i, 1)
      return
    end if
    axes(:, 2) = frame(i, 4:6)
    axes(1, 3) = axes(2, 1)*axes(3, 2) - axes(3, 1)*axes(2, 2)
    axes(2, 3) = axes(3, 1)*axes(1, 2) - axes(1, 1)*axes(3, 2)
    axes(3, 3) = axes(1, 1)*axes(2, 2) - axes(2, 1)*axes(1, 2)
  end subroutine axes_of
end module condensed_bodies
