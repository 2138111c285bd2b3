!> Between the lists of pairs and the narrow phase: brings a batch's geometry together, and puts its contacts in place.
module pair_geometry
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int8_t
  implicit none
  private
  public :: cairn_pair_gather, cairn_pair_keep

  integer(c_int32_t), parameter :: image_bits = 2**30 - 1

contains

  !> Relative places, radii and directions of a batch of pairs, each component contiguous.
  pure subroutine cairn_pair_gather(dim, n, a, b, image, centre, radius, has_direction, direction, periodic, vectors, &
                                    between, radius_a, radius_b, direction_b) bind(c)
    integer(c_int32_t), value :: dim                    !< 2 or 3
    integer(c_int32_t), value :: n                      !< pairs
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    integer(c_int32_t), intent(in) :: image(n)          !< of b seen from a; read if periodic
    real(c_double), intent(in) :: centre(dim, 0:*)      !< of the contactors [m]
    real(c_double), intent(in) :: radius(0:*)           !< [m]
    integer(c_int32_t), value :: has_direction          !< 0: direction_b is not made
    real(c_double), intent(in) :: direction(dim + 1, 0:*) !< in space, then half length [m]
    integer(c_int32_t), value :: periodic               !< 0: image and vectors are not read
    real(c_double), intent(in) :: vectors(3, 3)         !< of the cell, in columns [m]
    real(c_double), intent(out) :: between(n, dim)      !< centre of a - centre of b [m]
    real(c_double), intent(out) :: radius_a(n), radius_b(n) !< [m]
    real(c_double), intent(inout) :: direction_b(n, dim + 1) !< of b
    integer(c_int32_t) :: i, k, j, lattice

    if (dim == 2) then
      do i = 1, n
        between(i, 1) = centre(1, a(i)) - centre(1, b(i))
        between(i, 2) = centre(2, a(i)) - centre(2, b(i))
        radius_a(i) = radius(a(i))
        radius_b(i) = radius(b(i))
      end do
    else
      do i = 1, n
        between(i, 1) = centre(1, a(i)) - centre(1, b(i))
        between(i, 2) = centre(2, a(i)) - centre(2, b(i))
        between(i, 3) = centre(3, a(i)) - centre(3, b(i))
        radius_a(i) = radius(a(i))
        radius_b(i) = radius(b(i))
      end do
    end if
    if (periodic /= 0) then
      do k = 1, dim
        do i = 1, n
          lattice = iand(shiftr(image(i), 10*(k - 1)), 1023) - 512
          if (lattice == 0) cycle
          do j = 1, k
            between(i, j) = between(i, j) - lattice*vectors(j, k)
          end do
        end do
      end do
    end if
    if (has_direction == 0) return
    do k = 1, dim + 1
      do i = 1, n
        direction_b(i, k) = direction(k, b(i))
      end do
    end do
  end subroutine cairn_pair_gather

  !> Compacts a batch of contacts to those that count: gap within the margin, or declared. Entries past these are overwritten by the
  !> next batch, which avoids mispredicted branches.
  pure subroutine cairn_pair_keep(dim, n, a, b, image, centre, gap, normal, point, status, constant, margin, a_out, b_out, &
                                  image_out, feature_out, gap_out, normal_out, point_out, kept, refused) bind(c)
    integer(c_int32_t), value :: dim                    !< 2 or 3
    integer(c_int32_t), value :: n                      !< pairs
    integer(c_int32_t), intent(in) :: a(n), b(n)        !< contactors
    integer(c_int32_t), intent(in) :: image(n)          !< bit 30 set: declared
    real(c_double), intent(in) :: centre(dim, 0:*)      !< of the contactors [m]
    real(c_double), intent(in) :: gap(n)                !< [m]
    real(c_double), intent(in) :: normal(n, dim)        !< unit
    real(c_double), intent(in) :: point(n, dim)         !< from the centre of a [m]
    integer(c_int32_t), intent(in) :: status(n)         !< 1: does not touch; 2: refused; 3: as the pair before it
    real(c_double), value :: constant                   !< margin of every pair [m]; negative: margin is read instead
    real(c_double), intent(in) :: margin(0:*)           !< of the contactors [m]
    integer(c_int32_t), intent(inout) :: a_out(0:n - 1), b_out(0:n - 1), feature_out(0:n - 1)
    integer(c_int32_t), intent(inout) :: image_out(0:n - 1) !< without the bit
    real(c_double), intent(inout) :: gap_out(0:n - 1)   !< [m]
    real(c_double), intent(inout) :: normal_out(dim, 0:n - 1)
    real(c_double), intent(inout) :: point_out(dim, 0:n - 1) !< [m]
    integer(c_int32_t), intent(out) :: kept             !< how many count
    integer(c_int32_t), intent(out) :: refused          !< first of those that count and were refused, from 0 on; -1: none
    integer, parameter :: some = 256 !< block size of the branch-free selection
    integer(c_int32_t) :: counts(some), begin, i, j, k
    logical :: near

    refused = -1
    k = 0
    do begin = 0, n - 1, some
      do j = 1, min(some, n - begin)
        i = begin + j
        if (constant < 0) then
          near = gap(i) <= margin(a(i)) + margin(b(i))
        else
          near = gap(i) <= constant
        end if
        counts(j) = merge(1, 0, ((near .and. status(i) /= 1) .or. image(i) > image_bits) .and. status(i) /= 3)
      end do
      do j = 1, min(some, n - begin)
        i = begin + j
        if (counts(j) == 1 .and. status(i) == 2 .and. refused < 0) refused = i - 1
        a_out(k) = a(i)
        b_out(k) = b(i)
        image_out(k) = iand(image(i), image_bits)
        feature_out(k) = 0
        gap_out(k) = gap(i)
        normal_out(1, k) = normal(i, 1)
        normal_out(2, k) = normal(i, 2)
        point_out(1, k) = centre(1, a(i)) + point(i, 1)
        point_out(2, k) = centre(2, a(i)) + point(i, 2)
        if (dim == 3) then
          normal_out(3, k) = normal(i, 3)
          point_out(3, k) = centre(3, a(i)) + point(i, 3)
        end if
        k = k + counts(j)
      end do
    end do
    kept = k
  end subroutine cairn_pair_keep

end module pair_geometry
