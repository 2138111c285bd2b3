!> Lists of pairs: which hits of the search are pairs of contactors that may touch, and their canonical order.
module pair_lists
  use, intrinsic :: iso_c_binding, only: c_double, c_int16_t, c_int32_t, c_int64_t, c_int8_t
  use law_rules, only: rule_between
  implicit none
  private
  public :: cairn_pairs_of_hits, cairn_pairs_of_ghosts, cairn_pair_movable, cairn_pair_admit
  public :: cairn_pair_count, cairn_pair_starts, cairn_pair_scatter, cairn_pair_tidy, cairn_pairs_beyond

  integer(c_int32_t), parameter :: own_image = 512 + 1024*(512 + 1024*512), longest_insertion = 24

contains

  !> Contactors behind the hits of a search without periodic images.
  pure subroutine cairn_pairs_of_hits(n, hits, order, item, a, b, image) bind(c)
    integer(c_int64_t), value :: n                      !< hits
    integer(c_int32_t), intent(in) :: hits(2, n)        !< places in the sorted order
    integer(c_int32_t), intent(in) :: order(0:*)        !< item at each place
    integer(c_int32_t), intent(in) :: item(0:*)         !< contactor of each item
    integer(c_int32_t), intent(inout) :: a(n), b(n)     !< contactors
    integer(c_int32_t), intent(inout) :: image(n)       !< of b seen from a
    integer(c_int64_t) :: k

    do k = 1, n
      a(k) = item(order(hits(1, k)))
      b(k) = item(order(hits(2, k)))
      image(k) = own_image
    end do
  end subroutine cairn_pairs_of_hits

  !> The same where some items are ghosts: items from `nb_real` on are periodic images of others. Each contact is met twice,
  !> once with a ghost of either side; the one with the ghost of the larger reach, then of the larger number, is kept, since
  !> ghosts reach as far as themselves, not as far as the largest. An image too far to encode is left as -1.
  pure subroutine cairn_pairs_of_ghosts(n, hits, order, item, nb_real, lattice, reach, a, b, image, kept) bind(c)
    integer(c_int64_t), value :: n                      !< hits
    integer(c_int32_t), intent(in) :: hits(2, n)        !< places in the sorted order
    integer(c_int32_t), intent(in) :: order(0:*)        !< item at each place
    integer(c_int32_t), intent(in) :: item(0:*)         !< contactor of each item
    integer(c_int64_t), value :: nb_real                !< items that are no ghosts
    integer(c_int32_t), intent(in) :: lattice(3, 0:*)   !< lattice point by which the item is moved from where its contactor is
    real(c_double), intent(in) :: reach(0:*)            !< of the items [m]
    integer(c_int32_t), intent(inout) :: a(n), b(n)     !< contactors
    integer(c_int32_t), intent(inout) :: image(n)       !< of b seen from a
    integer(c_int64_t), intent(out) :: kept
    integer(c_int64_t) :: k
    integer(c_int32_t) :: i, j, d(3)

    kept = 0
    do k = 1, n
      i = order(hits(1, k))
      j = order(hits(2, k))
      if (i > j) then
        d(1) = i
        i = j
        j = d(1)
      end if
      if (i >= nb_real) cycle
      d = lattice(:, j) - lattice(:, i)
      if (j >= nb_real) then
        if (reach(j) < reach(i)) cycle
        if (.not. reach(j) > reach(i)) then
          if (item(j) < item(i)) cycle
          if (item(j) == item(i) .and. .not. upward(d)) cycle
        end if
      end if
      kept = kept + 1
      a(kept) = item(i)
      b(kept) = item(j)
      image(kept) = -1
      if (maxval(abs(d)) <= 511) image(kept) = own_image + d(1) + 1024*(d(2) + 1024*d(3))
    end do
  end subroutine cairn_pairs_of_ghosts

  pure function upward(d)
    integer(c_int32_t), intent(in) :: d(3)
    logical :: upward
    upward = d(3) > 0 .or. (d(3) == 0 .and. (d(2) > 0 .or. (d(2) == 0 .and. d(1) > 0)))
  end function upward

  !> Which bodies something could move: a byte each, which the pairs then find in the cache.
  pure subroutine cairn_pair_movable(dofs, first, last, inverse_mass, movable) bind(c)
    integer(c_int32_t), value :: dofs                   !< of a body
    integer(c_int64_t), value :: first, last            !< bodies to treat
    real(c_double), intent(in) :: inverse_mass(dofs, 0:last - 1) !< [1/kg, 1/(kg m2)]
    integer(c_int8_t), intent(inout) :: movable(0:last - 1) !< 1, or 0
    integer(c_int64_t) :: i

    do i = first, last - 1
      movable(i) = 1_c_int8_t
      if (.not. inverse_mass(1, i) > 0) movable(i) = merge(1_c_int8_t, 0_c_int8_t, any(inverse_mass(:, i) > 0))
    end do
  end subroutine cairn_pair_movable

  !> Keeps the pairs of different bodies, not both immovable, of shapes that a row of pairs.def serves and of materials that
  !> meet; turns each so that a is the candidate. Works in place.
  pure subroutine cairn_pair_admit(n, a, b, image, shapes, kind_of, turn_of, body, shape, id, movable, rules, &
                                   material, meet, word, apart, alone, any_rule, places, key, rule, kind, kept) bind(c)
    integer(c_int64_t), value :: n                      !< pairs
    integer(c_int32_t), intent(inout) :: a(n), b(n), image(n)
    integer(c_int32_t), value :: shapes
    integer(c_int32_t), intent(in) :: kind_of(0:shapes - 1, 0:shapes - 1) !< row of pairs.def, -1: none
    integer(c_int32_t), intent(in) :: turn_of(0:shapes - 1, 0:shapes - 1) !< 1: the first is the antagonist; 2: by number
    integer(c_int32_t), intent(in) :: body(0:*)
    integer(c_int16_t), intent(in) :: shape(0:*)
    integer(c_int64_t), intent(in) :: id(0:*)
    integer(c_int8_t), intent(in) :: movable(0:*)       !< of the bodies
    integer(c_int32_t), value :: rules                  !< 0: all materials meet
    integer(c_int32_t), intent(in) :: material(0:*)     !< of the contactors
    integer(c_int8_t), intent(in) :: meet(-2:*)         !< of the rules: 0, its materials do not meet; see law_rules
    integer(c_int32_t), intent(in) :: word(2, 0:*)
    integer(c_int8_t), intent(in) :: apart(0:*)
    integer(c_int32_t), intent(in) :: alone(0:*)
    integer(c_int32_t), value :: any_rule
    integer(c_int64_t), value :: places
    integer(c_int32_t), intent(in) :: key(2, 0:*), rule(0:*)
    integer(c_int32_t), intent(inout) :: kind(n)        !< row of pairs.def
    integer(c_int64_t), intent(out) :: kept
    integer(c_int64_t) :: k
    integer(c_int32_t) :: i, j, turn, row

    kept = 0
    do k = 1, n
      i = a(k)
      j = b(k)
      if (body(i) == body(j)) cycle
      row = kind_of(shape(i), shape(j))
      if (row < 0) cycle
      if (movable(body(i)) == 0 .and. movable(body(j)) == 0) cycle
      if (rules > 0) then
        if (meet(rule_between(material(i), material(j), word, apart, alone, any_rule, places, key, rule)) == 0) cycle
      end if
      turn = turn_of(shape(i), shape(j))
      if (turn == 2) turn = merge(1, 0, id(i) > id(j))
      kept = kept + 1
      a(kept) = merge(j, i, turn == 1)
      b(kept) = merge(i, j, turn == 1)
      image(kept) = merge(2*own_image - image(k), image(k), turn == 1 .and. image(k) >= 0)
      kind(kept) = row
    end do
  end subroutine cairn_pair_admit

  !> How many pairs each candidate has; slot = (place of the kind)*contactors + a.
  pure subroutine cairn_pair_count(n, contactors, slot_of_kind, kind, a, count) bind(c)
    integer(c_int64_t), value :: n                      !< pairs
    integer(c_int64_t), value :: contactors
    integer(c_int32_t), intent(in) :: slot_of_kind(0:*)
    integer(c_int32_t), intent(in) :: kind(n), a(n)
    integer(c_int32_t), intent(inout) :: count(0:*)     !< of each slot; added to
    integer(c_int64_t) :: k, slot

    do k = 1, n
      slot = slot_of_kind(kind(k))*contactors + a(k)
      count(slot) = count(slot) + 1
    end do
  end subroutine cairn_pair_count

  !> From counts to the place of the first pair of each slot.
  pure subroutine cairn_pair_starts(slots, place) bind(c)
    integer(c_int64_t), value :: slots
    integer(c_int32_t), intent(inout) :: place(0:slots - 1)
    integer(c_int64_t) :: k
    integer(c_int32_t) :: here, count

    here = 0
    do k = 0, slots - 1
      count = place(k)
      place(k) = here
      here = here + count
    end do
  end subroutine cairn_pair_starts

  !> Puts each pair where those of its slot are. `place` moves on to the end of each slot.
  pure subroutine cairn_pair_scatter(n, contactors, slot_of_kind, kind, a, b, image, place, a_out, b_out, image_out) bind(c)
    integer(c_int64_t), value :: n                      !< pairs
    integer(c_int64_t), value :: contactors
    integer(c_int32_t), intent(in) :: slot_of_kind(0:*)
    integer(c_int32_t), intent(in) :: kind(n), a(n), b(n), image(n)
    integer(c_int32_t), intent(inout) :: place(0:*)
    integer(c_int32_t), intent(inout) :: a_out(0:*), b_out(0:*), image_out(0:*)
    integer(c_int64_t) :: k, slot
    integer(c_int32_t) :: p

    do k = 1, n
      slot = slot_of_kind(kind(k))*contactors + a(k)
      p = place(slot)
      place(slot) = p + 1
      a_out(p) = a(k)
      b_out(p) = b(k)
      image_out(p) = image(k)
    end do
  end subroutine cairn_pair_scatter

  !> Sorts the pairs of slots first to last-1 by b, then image, then (bit 30 of the image) declared before found.
  pure subroutine cairn_pair_tidy(first, last, place, b, image) bind(c)
    integer(c_int64_t), value :: first, last            !< slots
    integer(c_int32_t), intent(in) :: place(0:last - 1) !< end of each slot
    integer(c_int32_t), intent(inout) :: b(0:*), image(0:*)
    integer(c_int64_t) :: k
    integer(c_int32_t) :: begin, end

    begin = 0
    if (first > 0) begin = place(first - 1)
    do k = first, last - 1
      end = place(k)
      if (end - begin > 1) then
        if (end - begin <= longest_insertion) then
          call insertion_sort(end - begin, b(begin), image(begin))
        else
          call heap_sort(end - begin, b(begin), image(begin))
        end if
      end if
      begin = end
    end do
  end subroutine cairn_pair_tidy

  elemental function rank_of(b, image) result(rank)
    integer(c_int32_t), intent(in) :: b, image
    integer(c_int64_t) :: rank
    rank = shiftl(int(b, c_int64_t), 32) + 2*iand(int(image, c_int64_t), 2_c_int64_t**30 - 1) + merge(0, 1, btest(image, 30))
  end function rank_of

  pure subroutine insertion_sort(n, b, image)
    integer(c_int32_t), intent(in) :: n
    integer(c_int32_t), intent(inout) :: b(n), image(n)
    integer(c_int32_t) :: i, j, bi, mi

    do i = 2, n
      bi = b(i)
      mi = image(i)
      do j = i - 1, 1, -1
        if (rank_of(b(j), image(j)) <= rank_of(bi, mi)) exit
        b(j + 1) = b(j)
        image(j + 1) = image(j)
      end do
      b(j + 1) = bi
      image(j + 1) = mi
    end do
  end subroutine insertion_sort

  !> In place and never slow (Williams 1964): a huge body has as many neighbours as there is room around it.
  pure subroutine heap_sort(n, b, image)
    integer(c_int32_t), intent(in) :: n
    integer(c_int32_t), intent(inout) :: b(n), image(n)
    integer(c_int32_t) :: k

    do k = n/2, 1, -1
      call sift(k, n, b(k), image(k), b, image)
    end do
    do k = n, 2, -1
      call sink_last(k, b, image)
    end do
  end subroutine heap_sort

  pure subroutine sink_last(k, b, image)
    integer(c_int32_t), intent(in) :: k
    integer(c_int32_t), intent(inout) :: b(k), image(k)
    integer(c_int32_t) :: bk, mk
    bk = b(k)
    mk = image(k)
    b(k) = b(1)
    image(k) = image(1)
    call sift(1_c_int32_t, k - 1, bk, mk, b, image)
  end subroutine sink_last

  !> Lets (b_new, image_new) sink from the root of a heap of the first n.
  pure subroutine sift(root, n, b_new, image_new, b, image)
    integer(c_int32_t), intent(in) :: root, n
    integer(c_int32_t), value :: b_new, image_new
    integer(c_int32_t), intent(inout) :: b(*), image(*)
    integer(c_int32_t) :: i, child

    i = root
    do while (2*i <= n)
      child = 2*i
      if (child < n) then
        if (rank_of(b(child), image(child)) < rank_of(b(child + 1), image(child + 1))) child = child + 1
      end if
      if (rank_of(b(child), image(child)) <= rank_of(b_new, image_new)) exit
      b(i) = b(child)
      image(i) = image(child)
      i = child
    end do
    b(i) = b_new
    image(i) = image_new
  end subroutine sift


  !> Counts contactors that went farther since pairs were sought, or reach farther by now, than their room then allows.
  pure subroutine cairn_pairs_beyond(dim, first, last, centre, reach, centre_then, room, beyond) bind(c)
    integer(c_int32_t), value :: dim                      !< 2 or 3
    integer(c_int64_t), value :: first, last              !< contactors to look at
    real(c_double), intent(in) :: centre(dim, 0:last - 1), centre_then(dim, 0:last - 1) !< [m]
    real(c_double), intent(in) :: reach(0:last - 1)       !< now [m]
    real(c_double), intent(in) :: room(0:last - 1)        !< reach of that search [m]
    integer(c_int64_t), intent(out) :: beyond             !< how many; no number counts
    real(c_double), parameter :: share = 1 - 2.0_c_double**(-19) !< reduces the remaining room by the rounding of squares and sums
    real(c_double), parameter :: smallest_square = tiny(1.0_c_double)*2.0_c_double**60 !< below it squares lose digits
    real(c_double) :: left, way
    integer(c_int64_t) :: i

    beyond = 0
    do i = first, last - 1
      left = room(i) - reach(i)
      way = (centre(1, i) - centre_then(1, i))**2 + (centre(2, i) - centre_then(2, i))**2
      if (dim == 3) way = way + (centre(3, i) - centre_then(3, i))**2
      left = merge(left*left*share, -1.0_c_double, left > 0)
      beyond = beyond + merge(0, 1, way + smallest_square <= left .and. left <= huge(left))
    end do
  end subroutine cairn_pairs_beyond

end module pair_lists
