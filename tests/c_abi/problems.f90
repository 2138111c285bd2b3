!> A problem of two contacts through the Fortran module.
module fortran_problem
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  use cairn
  implicit none
  private
  public :: cairn_fortran_problem
contains
  subroutine cairn_fortran_problem(found, status, wrong) bind(c)
    real(c_double), intent(out) :: found(2, 2)  !< impulses
    integer(c_int32_t), intent(out) :: status   !< of the solution
    integer(c_int32_t), intent(out) :: wrong    !< code of a call with a solver that is none
    type(cairn_problem) :: problem
    type(problem_report) :: report
    type(cairn_error) :: error
    real(c_double) :: block(2, 2, 4)

    block = 0
    block(:, :, 1) = reshape([0.5_c_double, 0.0_c_double, 0.0_c_double, 0.5_c_double], [2, 2])
    block(:, :, 4) = block(:, :, 1)
    block(1, 1, 2:3) = 0.1_c_double
    call create_problem(problem, [0_c_int64_t, 2_c_int64_t, 4_c_int64_t], [0, 1, 0, 1], block, &
      reshape([-1.0_c_double, 2.0_c_double, 3.0_c_double, 0.0_c_double], [2, 2]), [0.3_c_double, 0.4_c_double])
    call solve_problem(problem, "nlgs", found, report, tolerance=1e-12_c_double)
    status = int(report%status, c_int32_t)
    if (report%error > 1e-12_c_double .or. report%solver /= "nlgs") status = -2
    call solve_problem(problem, "nlgz", found, report, error=error, warm_start=.true.)
    wrong = int(error%code, c_int32_t)
    call destroy_problem(problem)
  end subroutine cairn_fortran_problem
end module fortran_problem
