!> Shape functions that elements of several dimensions share.
module shape_families
  use, intrinsic :: iso_c_binding, only: c_double
  implicit none
  private
  public :: simplex, product_of_lines, quadratic_simplex, product_of_parabolas, serendipity, gauss_product

contains

  !> Linear on a simplex, the first node at the origin of xi.
  pure subroutine simplex(dim, xi, value, gradient)
    integer, intent(in)         :: dim
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(dim + 1), gradient(dim, dim + 1)
    integer :: i
    value(1) = 1 - sum(xi)
    value(2:) = xi
    gradient = 0
    gradient(:, 1) = -1
    do i = 1, dim
      gradient(i, i + 1) = 1
    end do
  end subroutine simplex

  !> Products of functions linear along each axis, on [-1, 1]^dim with a node at each corner.
  pure subroutine product_of_lines(dim, nodes, corner, xi, value, gradient)
    integer, intent(in)         :: dim, nodes
    real(c_double), intent(in)  :: corner(dim, nodes), xi(dim)
    real(c_double), intent(out) :: value(nodes), gradient(dim, nodes)
    real(c_double) :: f(dim)
    integer :: i, k
    do i = 1, nodes
      f = 0.5_c_double*(1 + corner(:, i)*xi)
      value(i) = product(f)
      do k = 1, dim
        gradient(k, i) = 0.5_c_double*corner(k, i)*product(f(:k - 1))*product(f(k + 1:))
      end do
    end do
  end subroutine product_of_lines

  !> Quadratic on a simplex: corners first, then the middle of each edge, whose ends are edge(:, k) (Zienkiewicz & Taylor 2000).
  pure subroutine quadratic_simplex(dim, edges, edge, xi, value, gradient)
    integer, intent(in)         :: dim, edges, edge(2, edges)
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(dim + 1 + edges), gradient(dim, dim + 1 + edges)
    real(c_double) :: l(dim + 1), dl(dim, dim + 1)
    integer :: i, k
    call simplex(dim, xi, l, dl)
    do i = 1, dim + 1
      value(i) = l(i)*(2*l(i) - 1)
      gradient(:, i) = (4*l(i) - 1)*dl(:, i)
    end do
    do k = 1, edges
      value(dim + 1 + k) = 4*l(edge(1, k))*l(edge(2, k))
      gradient(:, dim + 1 + k) = 4*(l(edge(1, k))*dl(:, edge(2, k)) + l(edge(2, k))*dl(:, edge(1, k)))
    end do
  end subroutine quadratic_simplex

  !> Products of Lagrange's parabolas along each axis, on [-1, 1]^dim with nodes at -1, 0 and 1.
  pure subroutine product_of_parabolas(dim, nodes, place, xi, value, gradient)
    integer, intent(in)         :: dim, nodes
    integer, intent(in)         :: place(dim, nodes) !< of the nodes: -1, 0 or 1
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes), gradient(dim, nodes)
    real(c_double) :: f(dim), df(dim)
    integer :: i, k
    do i = 1, nodes
      do k = 1, dim
        if (place(k, i) == 0) then
          f(k) = 1 - xi(k)**2
          df(k) = -2*xi(k)
        else
          f(k) = 0.5_c_double*xi(k)*(xi(k) + place(k, i))
          df(k) = xi(k) + 0.5_c_double*place(k, i)
        end if
      end do
      value(i) = product(f)
      do k = 1, dim
        gradient(k, i) = df(k)*product(f(:k - 1))*product(f(k + 1:))
      end do
    end do
  end subroutine product_of_parabolas

  !> Quadratic along the edges, nodes at corners and in the middle of edges alone (Zienkiewicz & Taylor 2000).
  pure subroutine serendipity(dim, nodes, place, xi, value, gradient)
    integer, intent(in)         :: dim, nodes
    integer, intent(in)         :: place(dim, nodes) !< of the nodes: -1, 0 or 1, at most one of them 0
    real(c_double), intent(in)  :: xi(dim)
    real(c_double), intent(out) :: value(nodes), gradient(dim, nodes)
    real(c_double) :: f(dim), df(dim), inner
    integer :: i, k
    do i = 1, nodes
      do k = 1, dim
        if (place(k, i) == 0) then
          f(k) = 1 - xi(k)**2
          df(k) = -2*xi(k)
        else
          f(k) = 0.5_c_double*(1 + place(k, i)*xi(k))
          df(k) = 0.5_c_double*place(k, i)
        end if
      end do
      inner = 1
      if (all(place(:, i) /= 0)) inner = sum(place(:, i)*xi) - (dim - 1)
      value(i) = product(f)*inner
      do k = 1, dim
        gradient(k, i) = df(k)*product(f(:k - 1))*product(f(k + 1:))*inner
        if (all(place(:, i) /= 0)) gradient(k, i) = gradient(k, i) + place(k, i)*product(f)
      end do
    end do
  end subroutine serendipity

  !> Gauss's rule of one, two or three points along each axis of [-1, 1]^dim, the first axis fastest.
  pure subroutine gauss_product(dim, along, xi, weight)
    integer, intent(in)         :: dim, along
    real(c_double), intent(out) :: xi(dim, along**dim), weight(along**dim)
    real(c_double) :: place(3), share(3)
    integer :: p, k, left, at
    place = 0
    share = 2
    if (along == 2) place(:2) = [-1, 1]/sqrt(3.0_c_double)
    if (along == 2) share = 1
    if (along == 3) place = [-1, 0, 1]*sqrt(0.6_c_double)
    if (along == 3) share = [5, 8, 5]/9.0_c_double
    do p = 1, along**dim
      left = p - 1
      weight(p) = 1
      do k = 1, dim
        at = mod(left, along) + 1
        left = left/along
        xi(k, p) = place(at)
        weight(p) = weight(p)*share(at)
      end do
    end do
  end subroutine gauss_product
end module shape_families
