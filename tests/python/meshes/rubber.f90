!> A deformable body of another code: triangles of neo-Hookean rubber in plane strain, one metre thick, on a grid of nodes, which
!> stand row by row. W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)**2 at the gradient of deformation F.
module rubber
  use, intrinsic :: iso_c_binding
  use cairn_plug
  implicit none
  private

  !> State of the body of a simulation.
  type :: block_of_rubber
    real(c_double)                  :: mu, lambda
    integer, allocatable            :: cell(:, :)       !< (3, cells) nodes from 1
    real(c_double), allocatable     :: gradient(:, :, :) !< (2, 3, cells) of the shape functions [1/m]
    real(c_double), allocatable     :: area(:)          !< [m2]
    integer(c_int64_t), allocatable :: place(:, :, :)   !< (6, 6, cells) of entries of a cell in the tangent
  end type block_of_rubber
contains

  subroutine describe(descriptor) bind(c, name="cairn_describe_rubber")
    type(cairn_plug_descriptor), intent(inout) :: descriptor
    call describe_body(descriptor, "rubber", open_rubber, "mu::1e-300:inf lambda::0:inf along::1:inf")
  end subroutine describe

  !> params: mu, lambda [Pa], cells along a row.
  integer(c_int32_t) function open_rubber(dim, nodes, position, start, row, params, calls) bind(c, name="")
    integer(c_int32_t), value             :: dim
    integer(c_int64_t), value             :: nodes
    real(c_double), intent(in)            :: position(dim, nodes), params(*)
    integer(c_int64_t), intent(in)        :: start(dim*nodes + 1)
    integer(c_int32_t), intent(in)        :: row(*)
    type(cairn_body_calls), intent(inout) :: calls
    type(block_of_rubber), pointer :: b
    integer :: along, up, i, j, k, corner
    open_rubber = 1
    along = int(params(3))
    up = int(nodes)/(along + 1) - 1
    if (dim /= 2 .or. up < 1 .or. (along + 1)*(up + 1) /= nodes) return ! these are no rows of a grid
    allocate (b)
    b%mu = params(1)
    b%lambda = params(2)
    allocate (b%cell(3, 2*along*up), b%gradient(2, 3, 2*along*up), b%area(2*along*up), b%place(6, 6, 2*along*up))
    do j = 1, up
      do i = 1, along
        corner = (j - 1)*(along + 1) + i
        k = 2*((j - 1)*along + i)
        b%cell(:, k - 1) = [corner, corner + 1, corner + along + 2]
        b%cell(:, k) = [corner, corner + along + 2, corner + along + 1]
      end do
    end do
    do k = 1, size(b%area)
      call measure(position(:, b%cell(:, k)), b%gradient(:, :, k), b%area(k))
      call find_places(b%cell(:, k), start, row, b%place(:, :, k))
    end do
    if (any(b%area <= 0) .or. any(b%place == 0)) then
      deallocate (b)
      return
    end if
    calls%gives_energy = 1
    calls%gives_dissipation = 1
    calls%context = c_loc(b)
    calls%forces = c_funloc(forces_of_rubber)
    calls%destroy = c_funloc(destroy_rubber)
    open_rubber = 0
  end function open_rubber

  subroutine destroy_rubber(context) bind(c, name="")
    type(c_ptr), value :: context
    type(block_of_rubber), pointer :: b
    call c_f_pointer(context, b)
    deallocate (b)
  end subroutine destroy_rubber

  pure subroutine measure(x, gradient, area)
    real(c_double), intent(in)  :: x(2, 3)
    real(c_double), intent(out) :: gradient(2, 3), area
    integer :: a, b, c
    area = ((x(1, 2) - x(1, 1))*(x(2, 3) - x(2, 1)) - (x(1, 3) - x(1, 1))*(x(2, 2) - x(2, 1)))/2
    do a = 1, 3
      b = mod(a, 3) + 1
      c = mod(b, 3) + 1
      gradient(:, a) = [x(2, b) - x(2, c), x(1, c) - x(1, b)]/(2*area)
    end do
  end subroutine measure

  !> Where entries of the matrix of a cell stand in the pattern, from 1; 0: nowhere.
  pure subroutine find_places(cell, start, row, place)
    integer, intent(in)             :: cell(3)
    integer(c_int64_t), intent(in)  :: start(*)
    integer(c_int32_t), intent(in)  :: row(*)
    integer(c_int64_t), intent(out) :: place(6, 6)
    integer :: i, j, dof(6)
    integer(c_int64_t) :: e
    dof = [2*cell(1) - 1, 2*cell(1), 2*cell(2) - 1, 2*cell(2), 2*cell(3) - 1, 2*cell(3)]
    place = 0
    do j = 1, 6
      do e = start(dof(j)) + 1, start(dof(j) + 1)
        do i = 1, 6
          if (row(e) == dof(i) - 1) place(i, j) = e
        end do
      end do
    end do
  end subroutine find_places

  integer(c_int32_t) function forces_of_rubber(context, dofs, entries, time, step, rate, displacement, velocity, force, tangent, &
                                               energy, dissipated) bind(c, name="")
    type(c_ptr), value                    :: context
    integer(c_int64_t), value             :: dofs, entries
    real(c_double), value                 :: time, step, rate
    real(c_double), intent(in)            :: displacement(dofs), velocity(dofs)
    real(c_double), intent(out)           :: force(dofs)
    real(c_double), intent(out), optional :: tangent(entries)
    real(c_double), intent(inout)         :: energy, dissipated
    type(block_of_rubber), pointer :: r
    real(c_double) :: f(2, 2), inverse(2, 2), volume, logarithm, p(2, 2), by(2, 2, 2, 2), u(2, 3)
    integer :: k, a, b, i, j, l, m
    call c_f_pointer(context, r)
    force = 0
    if (present(tangent)) tangent = 0
    energy = 0
    dissipated = 0
    forces_of_rubber = 1
    do k = 1, size(r%area)
      do a = 1, 3
        u(:, a) = displacement(2*r%cell(a, k) - 1:2*r%cell(a, k))
      end do
      f = matmul(u, transpose(r%gradient(:, :, k)))
      f(1, 1) = f(1, 1) + 1
      f(2, 2) = f(2, 2) + 1
      volume = f(1, 1)*f(2, 2) - f(1, 2)*f(2, 1)
      if (.not. volume > 0) return ! inside out
      logarithm = log(volume)
      inverse = reshape([f(2, 2), -f(2, 1), -f(1, 2), f(1, 1)], [2, 2])/volume
      p = r%mu*f + (r%lambda*logarithm - r%mu)*transpose(inverse)
      energy = energy + r%area(k)*(r%mu*(sum(f*f) - 2 - 2*logarithm) + r%lambda*logarithm**2)/2
      do a = 1, 3
        do i = 1, 2
          m = 2*r%cell(a, k) - 2 + i
          force(m) = force(m) + r%area(k)*dot_product(p(i, :), r%gradient(:, a, k))
        end do
      end do
      if (.not. present(tangent)) cycle
      do concurrent(i=1:2, j=1:2, l=1:2, m=1:2) ! of p(i, j) by f(l, m)
        by(i, j, l, m) = merge(r%mu, 0.0_c_double, i == l .and. j == m) + r%lambda*inverse(j, i)*inverse(m, l) &
                         + (r%mu - r%lambda*logarithm)*inverse(j, l)*inverse(m, i)
      end do
      do b = 1, 3
        do a = 1, 3
          do l = 1, 2
            do i = 1, 2
              associate (entry => tangent(r%place(2*a - 2 + i, 2*b - 2 + l, k)))
                entry = entry + r%area(k)*dot_product(r%gradient(:, a, k), matmul(by(i, :, l, :), r%gradient(:, b, k)))
              end associate
            end do
          end do
        end do
      end do
    end do
    if (time + step + rate + velocity(1) > huge(time)) return ! read, so that no argument is idle
    forces_of_rubber = 0
  end function forces_of_rubber
end module rubber
