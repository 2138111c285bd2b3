!> Frictional contact problems of Cairn for Fortran: u = W r + q with Coulomb's cone at each contact. Programs use the module cairn.
module cairn_problems
  use, intrinsic :: iso_c_binding
  use cairn_calls
  implicit none
  private
  public :: cairn_problem, problem_report, create_problem, read_problem, destroy_problem, solve_problem, measure_problem
  public :: problem_dimension, problem_contacts

  type :: cairn_problem
    private
    type(c_ptr) :: handle = c_null_ptr
  end type

  !> status: 0 converged, 1 iteration limit, 2 time limit, 3 diverged, 4 stalled, 5 no solution, 6 memory limit; the rest as in
  !> cairn/problems.h.
  type :: problem_report
    integer :: status = 0
    integer(c_int64_t) :: iterations = 0, worst_contact = -1
    real(dp) :: error = 0, worst_error = 0, penetration_rate = 0, cone_distance = 0, energy_created = 0, cpu_seconds = 0
    character(:), allocatable :: solver, hint
  end type

  type, bind(c) :: c_report
    integer(c_int32_t) :: status
    integer(c_int64_t) :: iterations, worst_contact
    real(c_double) :: error, worst_error, penetration_rate, cone_distance, energy_created, cpu_seconds
    character(c_char) :: solver(64), hint(256)
  end type

  interface
    integer(c_int32_t) function c_create(dim, n, row_start, column, block, q, mu, problem, error) &
        bind(c, name="cairn_problem_create")
      import
      integer(c_int32_t), value :: dim
      integer(c_int64_t), value :: n
      integer(c_int64_t), intent(in) :: row_start(*)
      integer(c_int32_t), intent(in) :: column(*)
      real(c_double), intent(in) :: block(*), q(*), mu(*)
      type(c_ptr), intent(out) :: problem
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_read(path, problem, error) bind(c, name="cairn_problem_read")
      import
      character(c_char), intent(in) :: path(*)
      type(c_ptr), intent(out) :: problem
      type(c_error), intent(inout) :: error
    end function
    subroutine c_destroy(problem) bind(c, name="cairn_problem_destroy")
      import
      type(c_ptr), value :: problem
    end subroutine
    integer(c_int32_t) function c_dimension(problem) bind(c, name="cairn_problem_dimension")
      import
      type(c_ptr), value :: problem
    end function
    integer(c_int64_t) function c_contacts(problem) bind(c, name="cairn_problem_contacts")
      import
      type(c_ptr), value :: problem
    end function
    integer(c_int32_t) function c_solve(problem, solver, tolerance, max_iterations, warm_start, impulse, report, error) &
        bind(c, name="cairn_problem_solve")
      import
      type(c_ptr), value :: problem
      character(c_char), intent(in) :: solver(*)
      real(c_double), value :: tolerance
      integer(c_int32_t), value :: max_iterations, warm_start
      real(c_double), intent(inout) :: impulse(*)
      type(c_report), intent(inout) :: report
      type(c_error), intent(inout) :: error
    end function
    integer(c_int32_t) function c_measure(problem, impulse, report, error) bind(c, name="cairn_problem_measure")
      import
      type(c_ptr), value :: problem
      real(c_double), intent(in) :: impulse(*)
      type(c_report), intent(inout) :: report
      type(c_error), intent(inout) :: error
    end function
  end interface

contains

  !> W in blocks by rows, counted from 0 as in C: those of row i from row_start(i) on, the diagonal block of each row there.
  subroutine create_problem(problem, row_start, column, block, q, mu, error)
    type(cairn_problem), intent(out) :: problem
    integer(c_int64_t), intent(in), contiguous :: row_start(:)  !< (n + 1)
    integer(c_int32_t), intent(in), contiguous :: column(:)     !< (blocks), rising in a row
    real(dp), intent(in), contiguous :: block(:, :, :)          !< (dim, dim, blocks) [1/kg]
    real(dp), intent(in), contiguous :: q(:, :)                 !< (dim, n) [m/s]
    real(dp), intent(in), contiguous :: mu(:)                   !< (n) friction [-]
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    if (.not. has_size("row_start", size(row_start), size(mu) + 1, error)) return
    if (.not. has_size("q", size(q), size(q, 1)*size(mu), error)) return
    if (.not. has_size("column", size(column), int(row_start(size(row_start))), error)) return
    if (.not. has_size("block", size(block), size(q, 1)**2*size(column), error)) return
    call report_back(c_create(int(size(q, 1), c_int32_t), size(mu, kind=c_int64_t), row_start, column, block, q, mu, &
      problem%handle, what), what, error)
  end subroutine create_problem

  !> The local problem of a file in the layout of FCLIB, without compression.
  subroutine read_problem(problem, path, error)
    type(cairn_problem), intent(out) :: problem
    character(*), intent(in) :: path
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what

    call report_back(c_read(c_text(path), problem%handle, what), what, error)
  end subroutine read_problem

  subroutine destroy_problem(problem)
    type(cairn_problem), intent(inout) :: problem

    call c_destroy(problem%handle)
    problem%handle = c_null_ptr
  end subroutine destroy_problem

  integer function problem_dimension(problem) result(dim)
    type(cairn_problem), intent(in) :: problem

    dim = int(c_dimension(problem%handle))
  end function problem_dimension

  integer(c_int64_t) function problem_contacts(problem) result(n)
    type(cairn_problem), intent(in) :: problem

    n = c_contacts(problem%handle)
  end function problem_contacts

  !> Solves the problem by a solver of solvers.def or "auto", to a tolerance on the true error.
  subroutine solve_problem(problem, solver, impulse, report, tolerance, max_iterations, warm_start, error)
    type(cairn_problem), intent(in) :: problem
    character(*), intent(in) :: solver
    real(dp), intent(inout), contiguous :: impulse(:, :)       !< (dim, n) first guess of a warm start; out [N s]
    type(problem_report), intent(out), optional :: report
    real(dp), intent(in), optional :: tolerance                !< 1e-8
    integer, intent(in), optional :: max_iterations            !< 10000
    logical, intent(in), optional :: warm_start                !< false
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what
    type(c_report) :: found
    real(dp) :: tol
    integer(c_int32_t) :: most, warm

    if (.not. has_size("impulse", size(impulse), problem_dimension(problem)*int(problem_contacts(problem)), error)) return
    tol = 1e-8_dp
    if (present(tolerance)) tol = tolerance
    most = 10000
    if (present(max_iterations)) most = int(max_iterations, c_int32_t)
    warm = 0
    if (present(warm_start)) warm = merge(1_c_int32_t, 0_c_int32_t, warm_start)
    found = nothing()
    call report_back(c_solve(problem%handle, c_text(solver), tol, most, warm, impulse, found, what), what, error)
    if (present(report)) report = plain(found)
  end subroutine solve_problem

  !> Figures of impulses of any origin.
  subroutine measure_problem(problem, impulse, report, error)
    type(cairn_problem), intent(in) :: problem
    real(dp), intent(in), contiguous :: impulse(:, :) !< (dim, n) [N s]
    type(problem_report), intent(out) :: report
    type(cairn_error), intent(out), optional :: error
    type(c_error) :: what
    type(c_report) :: found

    if (.not. has_size("impulse", size(impulse), problem_dimension(problem)*int(problem_contacts(problem)), error)) return
    found = nothing()
    call report_back(c_measure(problem%handle, impulse, found, what), what, error)
    report = plain(found)
  end subroutine measure_problem

  pure type(c_report) function nothing()
    nothing%status = 0
    nothing%iterations = 0
    nothing%worst_contact = -1
    nothing%error = 0
    nothing%worst_error = 0
    nothing%penetration_rate = 0
    nothing%cone_distance = 0
    nothing%energy_created = 0
    nothing%cpu_seconds = 0
    nothing%solver = c_null_char
    nothing%hint = c_null_char
  end function nothing

  pure type(problem_report) function plain(found)
    type(c_report), intent(in) :: found

    character(:), allocatable :: solver, hint ! gfortran frees the result of a function only where it is assigned

    solver = from_c(found%solver)
    hint = from_c(found%hint)
    plain = problem_report(int(found%status), found%iterations, found%worst_contact, found%error, found%worst_error, &
      found%penetration_rate, found%cone_distance, found%energy_created, found%cpu_seconds, solver, hint)
  end function plain
end module cairn_problems
