!> Friction as a linear complementarity problem (Klarbring 1986; Stewart & Trinkle 1996), by Lemke's pivots (Cottle, Pang &
!> Stone 1992) on a dense tableau: for small problems. In the plane it is Coulomb's law; in space the cone has facets, turned by
!> an angle at each contact. Unknowns of a contact: r_N, beta of each facet, and the slip speed gamma;
!>   w_N = u_N,   w_k = d_k.u_T + gamma,   w_gamma = mu r_N - sum beta,   r_T = sum beta_k d_k.
module lemke
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  implicit none
  private
  public :: cairn_lemke_tableau, cairn_lemke_pivots, cairn_lemke_impulses
  ! Bases of packs of equal bodies have conditions of up to 1e7, and a thousand pivots leave rounding of up to 1e-9 in the tableau.
  real(c_double), parameter :: even = 1e-10_c_double !< of the largest right-hand side so far: smaller differences are rounding
  real(c_double), parameter :: least_pivot = 1e-8_c_double !< of the largest entry of its column: smaller ones may be rounding
  real(c_double), parameter :: same = 1e-7_c_double !< of the largest of tied values: smaller differences are rounding
contains

  !> The tableau I w - M z - e z0 = q; only M, e and q are stored: a basic column needs no room.
  subroutine cairn_lemke_tableau(dim, n, facets, row_start, column, block, q, mu, angle, m, tableau) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    integer(c_int32_t), value      :: facets         !< of a cone: 2 in the plane
    integer(c_int64_t), intent(in) :: row_start(n+1) !< from 0
    integer(c_int32_t), intent(in) :: column(*)      !< from 0
    real(c_double), intent(in)     :: block(dim, dim, *) !< [1/kg]
    real(c_double), intent(in)     :: q(dim, n)      !< [m/s]
    real(c_double), intent(in)     :: mu(n)          !< friction [-]
    real(c_double), intent(in)     :: angle(n)       !< of the first facet; unused in the plane
    integer(c_int64_t), value      :: m              !< rows, n (2 + facets)
    real(c_double), intent(out)    :: tableau(m, m+2) !< columns of z, of z0, right-hand side
    integer(c_int64_t) :: a, b, e, i, j, k, size
    real(c_double) :: d(dim-1), left(dim), right(dim)
    size = 2 + facets
    tableau = 0
    tableau(:, m+1) = -1
    do a = 1, n
      i = size*(a - 1)
      tableau(i+1, m+2) = q(1, a)
      tableau(i+size, i+1) = -mu(a)
      do k = 1, facets
        d = direction(dim, facets, int(k), angle(a))
        tableau(i+1+k, m+2) = sum(d*q(2:, a))
        tableau(i+1+k, i+size) = -1
        tableau(i+size, i+1+k) = 1
      end do
      do e = row_start(a) + 1, row_start(a+1)
        b = column(e) + 1
        j = size*(b - 1)
        do k = 0, facets
          right = 0
          right(1) = 1
          if (k > 0) right = [0.0_c_double, direction(dim, facets, int(k), angle(b))]
          right = matmul(block(:, :, e), right)
          tableau(i+1, j+1+k) = tableau(i+1, j+1+k) - right(1)
          do size = 1, facets
            left(2:) = direction(dim, facets, int(size), angle(a))
            tableau(i+1+size, j+1+k) = tableau(i+1+size, j+1+k) - sum(left(2:)*right(2:))
          end do
          size = 2 + facets
        end do
      end do
    end do
  end subroutine cairn_lemke_tableau

  pure function direction(dim, facets, k, angle) result(d)
    integer(c_int32_t), intent(in) :: dim, facets
    integer, intent(in)            :: k
    real(c_double), intent(in)     :: angle
    real(c_double) :: d(dim-1), turn
    if (dim == 2) then
      d = merge(1, -1, k == 1)
    else
      turn = angle + 8*atan(1.0_c_double)*(k - 1)/facets
      d = [cos(turn), sin(turn)]
    end if
  end function direction

  !> Pivots until z0 leaves. basis (m): the basic variable of each row, i for w_i, m + i for z_i, 2m + 1 for z0. Returns 0 solved, 1
  !> a ray, 2 too many pivots.
  integer(c_int32_t) function cairn_lemke_pivots(m, most, tableau, basis, other, pivots) result(status) bind(c)
    integer(c_int64_t), value         :: m              !< rows
    integer(c_int64_t), value         :: most           !< pivots allowed
    real(c_double), intent(inout)     :: tableau(m, m+2) !< as made above
    integer(c_int64_t), intent(inout) :: basis(m)       !< of the rows
    integer(c_int64_t), intent(inout) :: other(m+1)     !< of the columns
    integer(c_int64_t), intent(out)   :: pivots
    integer(c_int64_t) :: row, col, i, leaving
    real(c_double) :: scale
    do i = 1, m
      basis(i) = i
      other(i) = m + i
    end do
    other(m+1) = 2*m + 1
    pivots = 0
    status = 0
    row = minloc(tableau(:, m+2), 1)
    if (tableau(row, m+2) >= 0) return
    scale = maxval(abs(tableau(:, m+2)))
    do i = row + 1, m ! the last of equal ones: in the order of blocking_row the others stay above 0
      if (tableau(i, m+2) <= tableau(row, m+2) + even*scale) row = i
    end do
    col = m + 1
    do
      leaving = basis(row)
      call exchange(m, row, col, tableau)
      basis(row) = other(col)
      other(col) = leaving
      pivots = pivots + 1
      if (leaving == 2*m + 1) return
      status = 2
      if (pivots >= most) return
      status = 1
      leaving = merge(leaving + m, leaving - m, leaving <= m) ! its complement enters
      do col = 1, m
        if (other(col) == leaving) exit
      end do
      scale = max(scale, maxval(abs(tableau(:, m+2)))) ! right-hand sides keep the rounding of the largest that they were
      row = blocking_row(m, col, scale, tableau, basis, other)
      if (row == 0) return
      status = 0
    end do
  end function cairn_lemke_pivots

  !> Least ratio; among ties z0 first, then the lexicographic minimum by the columns of w. Similar contacts give many ties, among
  !> which any other rule cycles or ends on a spurious ray.
  pure integer(c_int64_t) function blocking_row(m, col, scale, tableau, basis, other) result(row)
    integer(c_int64_t), intent(in) :: m, col, basis(m), other(m+1)
    real(c_double), intent(in)     :: scale, tableau(m, m+2)
    real(c_double) :: least, small, ratio
    integer(c_int64_t) :: i, first, tied, rows(m)
    small = least_pivot*maxval(abs(tableau(:, col)))
    row = 0
    first = 0
    least = huge(least)
    do i = 1, m
      if (.not. tableau(i, col) > small) cycle
      ratio = max(tableau(i, m+2), 0.0_c_double)/tableau(i, col)
      if (.not. ratio < least) cycle
      least = ratio
      first = i
    end do
    if (first == 0) return
    tied = 0
    do i = 1, m
      if (.not. tableau(i, col) > small) cycle
      ! the row of the least ratio is tied with itself, although the product may differ by rounding
      if (i /= first .and. max(tableau(i, m+2), 0.0_c_double) - least*tableau(i, col) > even*scale) cycle
      tied = tied + 1
      rows(tied) = i
      if (basis(i) == 2*m + 1) row = i
    end do
    if (row == 0 .and. tied > 1) call order_tied(m, col, tableau, basis, other, tied, rows)
    if (row == 0) row = rows(1)
  end function blocking_row

  !> Reduces tied rows to the lexicographic minimum: column after column of w, divided by the entering column, keeps the least until
  !> a single row is left. Columns of basic w need no storage: they are 1 in their row.
  pure subroutine order_tied(m, col, tableau, basis, other, tied, rows)
    integer(c_int64_t), intent(in)    :: m, col, basis(m), other(m+1)
    real(c_double), intent(in)        :: tableau(m, m+2)
    integer(c_int64_t), intent(inout) :: tied, rows(m)
    integer(c_int64_t) :: i, k, place(m), kept
    real(c_double) :: value(m), most
    place = 0
    do i = 1, m
      if (basis(i) <= m) place(basis(i)) = -i ! the row of a basic one
    end do
    do i = 1, m + 1
      if (other(i) <= m) place(other(i)) = i
    end do
    do k = 1, m
      do i = 1, tied
        if (place(k) > 0) then
          value(i) = tableau(rows(i), place(k))/tableau(rows(i), col)
        else
          value(i) = merge(1.0_c_double, 0.0_c_double, rows(i) == -place(k))/tableau(rows(i), col)
        end if
      end do
      ! entries of a scaled problem are of order 1
      most = minval(value(:tied)) + same*max(1.0_c_double, maxval(abs(value(:tied))))
      kept = 0
      do i = 1, tied
        if (value(i) > most) cycle
        kept = kept + 1
        rows(kept) = rows(i)
      end do
      tied = kept
      if (tied == 1) return
    end do
  end subroutine order_tied

  !> Exchange: the column becomes basic in the row, and the variable that was basic there becomes a column.
  pure subroutine exchange(m, row, col, tableau)
    integer(c_int64_t), intent(in) :: m, row, col
    real(c_double), intent(inout)  :: tableau(m, m+2)
    real(c_double) :: pivot, entering(m), factor
    integer(c_int64_t) :: j
    entering = tableau(:, col)
    pivot = entering(row)
    do j = 1, m + 2
      if (j == col .or. .not. abs(tableau(row, j)) > 0) cycle
      factor = tableau(row, j)/pivot
      tableau(:, j) = tableau(:, j) - factor*entering
      tableau(row, j) = factor
    end do
    tableau(:, col) = -entering/pivot
    tableau(row, col) = 1/pivot
  end subroutine exchange

  subroutine cairn_lemke_impulses(dim, n, facets, angle, m, tableau, basis, r) bind(c)
    integer(c_int32_t), value      :: dim            !< components of a contact, 2 or 3
    integer(c_int64_t), value      :: n              !< contacts
    integer(c_int32_t), value      :: facets         !< of a cone
    real(c_double), intent(in)     :: angle(n)       !< of the first facet
    integer(c_int64_t), value      :: m              !< rows
    real(c_double), intent(in)     :: tableau(m, m+2) !< after the pivots
    integer(c_int64_t), intent(in) :: basis(m)       !< of the rows
    real(c_double), intent(out)    :: r(dim, n)      !< [N s]
    integer(c_int64_t) :: i, a, k
    r = 0
    do i = 1, m
      if (basis(i) <= m .or. basis(i) > 2*m) cycle
      a = (basis(i) - m - 1)/(2 + facets) + 1
      k = basis(i) - m - (2 + facets)*(a - 1)
      if (k == 1) then
        r(1, a) = tableau(i, m+2)
      else if (k < 2 + facets) then
        r(2:, a) = r(2:, a) + tableau(i, m+2)*direction(dim, facets, int(k - 1), angle(a))
      end if
    end do
  end subroutine cairn_lemke_impulses
end module lemke
