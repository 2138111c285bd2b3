!> Which rule is about a pair of materials. Each material is called by two words, of its group and of itself; a rule is about
!> pairs of words, or about a word and anything. The more closely a rule names both, the more it counts; among equals the later.
module law_rules
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_int8_t
  implicit none
  private
  public :: rule_between, cairn_law_rule_between, cairn_law_rule_place

  integer(c_int32_t), parameter, public :: no_rule = -1, kept_apart = -2

contains

  !> The rule that counts for materials a and b, from 0; no_rule, or kept_apart where both are of those that do not meet unless a
  !> rule names both their groups.
  pure function rule_between(a, b, word, apart, alone, any, places, key, rule) result(found)
    integer(c_int32_t), intent(in) :: a, b
    integer(c_int32_t), intent(in) :: word(2, 0:*)      !< of the materials: their group's, -1 without, and their own
    integer(c_int8_t), intent(in) :: apart(0:*)         !< of the materials
    integer(c_int32_t), intent(in) :: alone(0:*)        !< of the words: the last rule about it and anything
    integer(c_int32_t), intent(in) :: any               !< the last rule about anything and anything
    integer(c_int64_t), intent(in) :: places            !< of key and rule, a power of two; 0 without rules about two words
    integer(c_int32_t), intent(in) :: key(2, 0:*), rule(0:*)
    integer(c_int32_t) :: found

    found = of_words(word(1, a), word(1, b), places, key, rule)
    if (found >= 0) return
    if (apart(a) /= 0 .and. apart(b) /= 0) then
      found = kept_apart
      return
    end if
    found = max(of_words(word(1, a), word(2, b), places, key, rule), of_words(word(2, a), word(1, b), places, key, rule))
    if (found >= 0) return
    found = max(of_word(word(1, a), alone), of_word(word(1, b), alone))
    if (found >= 0) return
    found = of_words(word(2, a), word(2, b), places, key, rule)
    if (found >= 0) return
    found = max(of_word(word(2, a), alone), of_word(word(2, b), alone))
    if (found < 0) found = any
  end function rule_between

  pure subroutine cairn_law_rule_between(a, b, word, apart, alone, any, places, key, rule, found) bind(c)
    integer(c_int32_t), value :: a, b                   !< materials
    integer(c_int32_t), intent(in) :: word(2, 0:*)
    integer(c_int8_t), intent(in) :: apart(0:*)
    integer(c_int32_t), intent(in) :: alone(0:*)
    integer(c_int32_t), value :: any
    integer(c_int64_t), value :: places
    integer(c_int32_t), intent(in) :: key(2, 0:*), rule(0:*)
    integer(c_int32_t), intent(out) :: found            !< see rule_between

    found = rule_between(a, b, word, apart, alone, any, places, key, rule)
  end subroutine cairn_law_rule_between

  !> Puts a rule about two words into the table, where a later rule about the same two takes the place of an earlier one.
  pure subroutine cairn_law_rule_place(a, b, number, places, key, rule, added) bind(c)
    integer(c_int32_t), value :: a, b                   !< words
    integer(c_int32_t), value :: number                 !< of the rule
    integer(c_int64_t), value :: places                 !< more than there are rules, or there is no end
    integer(c_int32_t), intent(inout) :: key(2, 0:*)    !< -1: free
    integer(c_int32_t), intent(inout) :: rule(0:*)
    integer(c_int32_t), intent(out) :: added            !< 1: these two words are new
    integer(c_int64_t) :: at

    at = place_of(min(a, b), max(a, b), places, key)
    added = merge(1, 0, key(1, at) < 0)
    key(:, at) = [min(a, b), max(a, b)]
    rule(at) = number
  end subroutine cairn_law_rule_place

  pure function of_word(a, alone) result(found)
    integer(c_int32_t), intent(in) :: a, alone(0:*)
    integer(c_int32_t) :: found

    found = no_rule
    if (a >= 0) found = alone(a)
  end function of_word

  pure function of_words(a, b, places, key, rule) result(found)
    integer(c_int32_t), intent(in) :: a, b, key(2, 0:*), rule(0:*)
    integer(c_int64_t), intent(in) :: places
    integer(c_int32_t) :: found
    integer(c_int64_t) :: at

    found = no_rule
    if (a < 0 .or. b < 0 .or. places == 0) return
    at = place_of(min(a, b), max(a, b), places, key)
    if (key(1, at) >= 0) found = rule(at)
  end function of_words

  !> Where a pair of words is in the table, or the free place where it belongs (Knuth 1998, 6.4: open addressing, multiplicative
  !> hashing).
  pure function place_of(low, high, places, key) result(at)
    integer(c_int32_t), intent(in) :: low, high, key(2, 0:*)
    integer(c_int64_t), intent(in) :: places
    integer(c_int64_t), parameter :: first = 2654435761_c_int64_t, second = 1640531527_c_int64_t
    integer(c_int64_t) :: at

    at = iand(ishft(first*low + second*high, -15), places - 1)
    do while (key(1, at) >= 0)
      if (key(1, at) == low .and. key(2, at) == high) exit
      at = iand(at + 1, places - 1)
    end do
  end function place_of
end module law_rules
