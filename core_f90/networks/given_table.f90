!> A table of h(p, gap), bilinear within and constant beyond its ends.
module given_table
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_double
  use contact_spot
  implicit none
  private
  public :: cairn_conductance_given_table
contains

  pure subroutine cairn_conductance_given_table(n, contact, parameters, params, conductance) bind(c)
    integer(c_int32_t), value   :: n                   !< contacts
    real(c_double), intent(in)  :: contact(n, columns) !< see cairn_contact_column [SI]
    integer(c_int32_t), value   :: parameters          !< how many
    real(c_double), intent(in)  :: params(parameters)  !< numbers of pressures and of gaps, area [m2] (0: of the contact); then the
                                                       !< pressures [Pa], the gaps [m], h with pressures fastest
    real(c_double), intent(out) :: conductance(n)      !< [S | W/K]
    integer :: i, np, ng, p, g
    real(c_double) :: s, x, y, h
    np = int(params(1))
    ng = int(params(2))
    do i = 1, n
      s = merge(params(3), contact(i, area), params(3) > 0)
      conductance(i) = 0
      if (.not. s > 0) cycle
      call place(np, params(4:3 + np), max(contact(i, force), 0.0_c_double)/s, p, x)
      call place(ng, params(4 + np:3 + np + ng), contact(i, gap), g, y)
      h = (1 - y)*((1 - x)*at(p, g) + x*at(min(p + 1, np), g)) &
          + y*((1 - x)*at(p, min(g + 1, ng)) + x*at(min(p + 1, np), min(g + 1, ng)))
      conductance(i) = s*h
    end do
  contains
    pure real(c_double) function at(k, l)
      integer, intent(in) :: k, l
      at = params(3 + np + ng + (l - 1)*np + k)
    end function at
  end subroutine cairn_conductance_given_table

  !> Interval of rising nodes that holds a value, and the share of it that lies before the value.
  pure subroutine place(n, node, value, k, share)
    integer, intent(in)         :: n
    real(c_double), intent(in)  :: node(n), value
    integer, intent(out)        :: k
    real(c_double), intent(out) :: share
    k = 1
    do while (k < n - 1)
      if (value < node(k + 1)) exit
      k = k + 1
    end do
    share = 0
    if (n > 1) share = min(max((value - node(k))/(node(k + 1) - node(k)), 0.0_c_double), 1.0_c_double)
  end subroutine place
end module given_table
