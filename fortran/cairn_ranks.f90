!> One scene over several ranks, for Fortran. Programs use the module cairn; cairn/ranks.h tells what the calls mean.
module cairn_ranks
  use, intrinsic :: iso_c_binding
  use cairn_calls
  use cairn_simulations, only: cairn_simulation
  implicit none
  private
  public :: simulate_over_mpi, simulate_over_ranks, ranks_of, gather_contacts

  interface
    integer(c_int32_t) function c_over_mpi(simulation, communicator, library, once_a_sweep, error) &
        bind(c, name="cairn_simulation_over_mpi")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: communicator, once_a_sweep
      character(c_char), intent(in) :: library(*)
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_over_ranks(simulation, ranks, once_a_sweep, error) bind(c, name="cairn_simulation_over_ranks")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), value :: ranks, once_a_sweep
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_ranks(simulation, rank, ranks, error) bind(c, name="cairn_simulation_ranks")
      import
      type(c_ptr), value :: simulation
      integer(c_int32_t), intent(out) :: rank, ranks
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_gather(simulation, error) bind(c, name="cairn_simulation_gather")
      import
      type(c_ptr), value :: simulation
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> Over the ranks of a communicator of MPI, before the first step. All processes call it, with the same simulation.
  subroutine simulate_over_mpi(simulation, communicator, library, once_a_sweep, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: communicator                          !< as MPI gives it to Fortran
    character(*), intent(in), optional :: library                !< path of libcairn_mpi.so; found by the linker without
    logical, intent(in), optional :: once_a_sweep                !< fewer messages, other bits; after each colour without
    type(cairn_error), intent(out), optional :: error
    character(:), allocatable :: path
    type(c_error) :: what

    path = ""
    if (present(library)) path = library
    call report_back(c_over_mpi(simulation%handle, int(communicator, c_int32_t), c_text(path), flag(once_a_sweep), what), &
                     what, error)
  end subroutine simulate_over_mpi

  !> Over ranks that take turns in this process.
  subroutine simulate_over_ranks(simulation, ranks, once_a_sweep, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(in) :: ranks
    logical, intent(in), optional :: once_a_sweep
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_over_ranks(simulation%handle, int(ranks, c_int32_t), flag(once_a_sweep), what), what, error)
  end subroutine simulate_over_ranks

  !> The rank of this process, and the number of ranks.
  subroutine ranks_of(simulation, rank, ranks, error)
    type(cairn_simulation), intent(in) :: simulation
    integer, intent(out) :: rank, ranks
    type(cairn_error), intent(out), optional :: error
    integer(c_int32_t) :: own, all
    type(c_error) :: what

    call report_back(c_ranks(simulation%handle, own, all, what), what, error)
    rank = int(own)
    ranks = int(all)
  end subroutine ranks_of

  !> Contacts of all ranks can be read on each, until the next step. All processes call it.
  subroutine gather_contacts(simulation, error)
    type(cairn_simulation), intent(in) :: simulation
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_gather(simulation%handle, what), what, error)
  end subroutine gather_contacts

  pure integer(c_int32_t) function flag(given)
    logical, intent(in), optional :: given

    flag = 0
    if (present(given)) flag = merge(1_c_int32_t, 0_c_int32_t, given)
  end function flag
end module cairn_ranks
