!> Return mapping to Mises' yield surface about a back stress at large strains: F = Fe Fp, energies of Hencky's elastic strain and
!> of the plastic one, H/3 |ln Vp|^2. The derivative of the latter is the back stress 2 H/3 ln Vp in axes of the relaxed material
!> (Lion 2000; Montans & Bathe 2005; Vladimirov, Pietryga & Reese 2008 without recovery), a function of Fp'Fp without a state of its
!> own. The flow has no plastic spin and is integrated by the exponential, Fp = exp(change) Fp (Weber & Anand 1990), at the stresses
!> of the end of the step; axes of stress, back stress and flow may differ. The flow minimises the sum of energies and dissipation
!> (Ortiz & Stainier 1999), which is convex along geodesics of positive tensors, so it is unique.
!> Symmetric tensors as vectors have their shear times the root of two, so that products of vectors are those of tensors.
module finite_back_stress
  use, intrinsic :: iso_c_binding, only: c_double
  use tensor_functions, only: symmetric_eigen, inverse, to_strain, to_stress, from_strain, first_index, second_index, &
                              half_log_difference, log1p, expm1
  use radial_return, only: hardening_law, mises, yield_stress, hardening_slope, hardening_energy
  implicit none
  private
  public :: point_with_back_stress
  real(c_double), parameter :: root = sqrt(2.0_c_double/3), weight(6) = [1.0_c_double, 1.0_c_double, 1.0_c_double, &
                                                         sqrt(2.0_c_double), sqrt(2.0_c_double), sqrt(2.0_c_double)]

  !> Principal values and axes of the flow of the step, and of the logarithms of the stretches that it leaves.
  type :: flow_state
    real(c_double) :: flow(3), axes(3, 3), elastic(3), elastic_axes(3, 3), plastic(3), plastic_axes(3, 3)
    real(c_double) :: left(6) !< of the flow rule, in axes of the flow [Pa]
    real(c_double) :: size    !< of its terms [Pa]
  end type flow_state
contains

  !> Stress of a point; Cp^-1 - 1 and accumulated plastic strain go on. A fault as in radial_return.
  pure subroutine point_with_back_stress(bulk, shear, law, gradient, plastic, accumulated, stress, tangent, energy, fault)
    real(c_double), intent(in)      :: bulk, shear, gradient(3, 3) !< F - 1
    type(hardening_law), intent(in) :: law
    real(c_double), intent(inout)   :: plastic(3, 3), accumulated
    real(c_double), intent(out)     :: stress(3, 3), tangent(3, 3, 3, 3), energy
    integer, intent(out)            :: fault
    real(c_double) :: x(3), q(3, 3), relaxed(3, 3), before(3, 3), trial(3, 3), change(3, 3), back(3, 3), factor(6, 6)
    type(flow_state) :: at
    logical :: flows
    call symmetric_eigen(plastic, x, q)
    relaxed = tensor(sqrt(1 + x), q) ! Up^-1 at the begin
    before = tensor(-x/(1 + x), q)   ! Cp - 1 there
    change = gradient + transpose(gradient) + matmul(transpose(gradient), gradient)
    trial = plastic + stretched(relaxed, change) ! less 1
    change = 0
    call look(shear, law, accumulated, trial, before, change, at)
    call radial_flow(bulk, shear, law, at, accumulated, change, fault)
    if (.not. maxval(abs(change)) <= huge(x)) fault = 2
    flows = maxval(abs(change)) > 0
    if (flows .and. fault == 0) call find_flow(shear, law, accumulated, trial, before, change, at, factor, fault)
    if (.not. (minval(1 + x) > 0 .and. all(abs(at%elastic) <= huge(x)) .and. all(abs(at%plastic) <= huge(x)))) fault = 2
    if (fault /= 0) then
      stress = 0
      tangent = 0
      energy = 0
      return
    end if
    back = relaxed ! Fp^-1 at the end
    if (flows) then
      change = tensor(exp(-at%flow), at%axes)
      back = matmul(relaxed, change)
      change = tensor(exp_less_one(-2*at%flow), at%axes)
      plastic = plastic + stretched(relaxed, change)
      accumulated = accumulated + root*magnitude(at%flow)
      if (yield_stress(law, accumulated) < 0) fault = 4
    end if
    call give(bulk, shear, gradient, back, flows, at, factor, stress, tangent)
    energy = 0.5_c_double*bulk*sum(at%elastic)**2 + shear*sum(deviator(at%elastic)**2) &
             + law%kinematic/3*sum(at%plastic**2) + hardening_energy(law, accumulated)
  end subroutine point_with_back_stress

  !> The flow of the step if the axes of the trial strain were those of the flow; none within the yield surface.
  pure subroutine radial_flow(bulk, shear, law, at, accumulated, change, fault)
    real(c_double), intent(in)      :: bulk, shear, accumulated
    type(hardening_law), intent(in) :: law
    type(flow_state), intent(in)    :: at
    real(c_double), intent(out)     :: change(3, 3)
    integer, intent(out)            :: fault
    real(c_double) :: back(6), strain, flow(6), stress(6), moduli(6, 6)
    back = to_stress(tensor(2*law%kinematic/3*at%plastic, at%plastic_axes))
    strain = accumulated
    call mises(bulk, shear, law, to_strain(tensor(at%elastic, at%elastic_axes)), back, strain, flow, stress, moduli, fault)
    change = from_strain(flow)
  end subroutine radial_flow

  !> Newton's method for the flow, which is halved where it leaves more of the flow rule; the matrix at the end, in factors.
  pure subroutine find_flow(shear, law, accumulated, trial, before, change, at, factor, fault)
    real(c_double), intent(in)      :: shear, accumulated, trial(3, 3), before(3, 3)
    type(hardening_law), intent(in) :: law
    real(c_double), intent(inout)   :: change(3, 3)
    type(flow_state), intent(out)   :: at
    real(c_double), intent(out)     :: factor(6, 6)
    integer, intent(inout)          :: fault
    type(flow_state) :: next
    real(c_double)   :: further(6), share
    integer          :: pass, half
    integer, parameter :: most = 100, most_halves = 30
    call look(shear, law, accumulated, trial, before, change, at)
    do pass = 1, most
      call factorise(shear, law, accumulated, at, factor, fault)
      if (fault /= 0) return
      if (magnitude(at%left) <= 4*epsilon(share)*at%size) return
      further = from_parts(at, solution(factor, to_parts(at, sheared(at)*at%left)))
      share = 1
      do half = 1, most_halves
        call look(shear, law, accumulated, trial, before, change + share*from_axes(further, at%axes), next)
        if (magnitude(next%left) < magnitude(at%left)) exit
        share = share/2
        if (magnitude(at%left) <= 1e-12_c_double*at%size .or. half == most_halves) then ! rounding is left
          if (.not. magnitude(at%left) <= 1e-10_c_double*at%size) fault = 2
          return
        end if
      end do
      change = change + share*from_axes(further, at%axes)
      at = next
    end do
    fault = 2
  end subroutine find_flow

  !> Residual of the flow rule for Fp = exp(change) Up: (deviator of the stress) - back stress - (yield stress along the flow).
  pure subroutine look(shear, law, accumulated, trial, before, change, at)
    real(c_double), intent(in)      :: shear, accumulated, trial(3, 3), before(3, 3), change(3, 3)
    type(hardening_law), intent(in) :: law
    type(flow_state), intent(out)   :: at
    real(c_double) :: size, strength
    call symmetric_eigen(change, at%flow, at%axes)
    call half_logarithm(between(tensor(exp_less_one(-at%flow), at%axes), trial), at%elastic, at%elastic_axes)
    call half_logarithm(between(tensor(exp_less_one(at%flow), at%axes), before), at%plastic, at%plastic_axes)
    size = magnitude(at%flow)
    strength = root*yield_stress(law, accumulated + root*size)
    at%left = in_axes(2*shear*deviator(at%elastic), at%elastic_axes, at%axes) &
              - in_axes(2*law%kinematic/3*deviator(at%plastic), at%plastic_axes, at%axes)
    if (size > 0) at%left(:3) = at%left(:3) - strength*at%flow/size
    at%size = max(2*shear*magnitude(at%elastic), 2*law%kinematic/3*magnitude(at%plastic), strength)
  end subroutine look

  !> Second derivatives of energies and dissipation by the flow where the flow rule holds, in its axes and `parts`, as R'R. With x
  !> a difference of principal values, derivatives of the logarithm bring x coth x, those of the exponential sinh x / x.
  pure subroutine factorise(shear, law, accumulated, at, factor, fault)
    real(c_double), intent(in)      :: shear, accumulated
    type(hardening_law), intent(in) :: law
    type(flow_state), intent(in)    :: at
    real(c_double), intent(out)     :: factor(6, 6)
    integer, intent(inout)          :: fault
    real(c_double) :: size, strain, ratio, t(6)
    integer :: i, k
    size = magnitude(at%flow)
    strain = accumulated + root*size
    ratio = root*yield_stress(law, strain)/size
    t = sheared(at)
    factor = 2*shear*of_logarithm(at%elastic, at%elastic_axes, at) &
             + 2*law%kinematic/3*of_logarithm(at%plastic, at%plastic_axes, at)
    do k = 1, 6
      factor(:, k) = t*factor(:, k)*t(k)
      if (k > 1) factor(k, k) = factor(k, k) &
                                + ratio*t(k)*cosh(at%flow(first_index(k)) - at%flow(second_index(k)))
    end do
    factor(1, 1) = factor(1, 1) + 2*hardening_slope(law, strain)/3
    do k = 1, 6
      do i = 1, k
        factor(i, k) = factor(i, k) - dot_product(factor(:i - 1, i), factor(:i - 1, k))
        if (i < k) factor(i, k) = factor(i, k)/factor(i, i)
      end do
      if (.not. factor(k, k) > 0) then
        fault = 2
        return
      end if
      factor(k, k) = sqrt(factor(k, k))
    end do
  end subroutine factorise

  !> Along the flow, across it, and the trace: a flow as small as rounding has far more stiffness across it than along it.
  pure function parts(at) result(basis)
    type(flow_state), intent(in) :: at
    real(c_double) :: basis(3, 3)
    real(c_double), parameter :: even = sqrt(1.0_c_double/3)
    basis(:, 1) = at%flow/magnitude(at%flow)
    basis(:, 2) = even*[basis(2, 1) - basis(3, 1), basis(3, 1) - basis(1, 1), basis(1, 1) - basis(2, 1)]
    basis(:, 3) = even
  end function parts

  pure function to_parts(at, v) result(w)
    type(flow_state), intent(in) :: at
    real(c_double), intent(in)   :: v(6)
    real(c_double) :: w(6), basis(3, 3)
    integer :: k
    basis = parts(at)
    w = v
    do k = 1, 3
      w(k) = sum(basis(:, k)*v(:3))
    end do
  end function to_parts

  pure function from_parts(at, v) result(w)
    type(flow_state), intent(in) :: at
    real(c_double), intent(in)   :: v(6)
    real(c_double) :: w(6), basis(3, 3)
    basis = parts(at)
    w = v
    w(:3) = basis(:, 1)*v(1) + basis(:, 2)*v(2) + basis(:, 3)*v(3)
  end function from_parts

  pure function solution(factor, right) result(x)
    real(c_double), intent(in) :: factor(6, 6), right(6)
    real(c_double) :: x(6)
    integer :: k
    do k = 1, 6
      x(k) = (right(k) - dot_product(factor(:k - 1, k), x(:k - 1)))/factor(k, k)
    end do
    do k = 6, 1, -1
      x(k) = (x(k) - dot_product(factor(k, k + 1:), x(k + 1:)))/factor(k, k)
    end do
  end function solution

  !> First Piola-Kirchhoff stress and its derivative by F: that at a held Fp, less what the flow gives way.
  pure subroutine give(bulk, shear, gradient, back, flows, at, factor, stress, tangent)
    real(c_double), intent(in)   :: bulk, shear, gradient(3, 3), back(3, 3) !< F - 1, Fp^-1
    logical, intent(in)          :: flows
    type(flow_state), intent(in) :: at
    real(c_double), intent(in)   :: factor(6, 6)
    real(c_double), intent(out)  :: stress(3, 3), tangent(3, 3, 3, 3) !< of stress(i, j) by F(k, l)
    real(c_double) :: f(3, 3), f_back(3, 3), q(3, 3), first(3, 3), half(3, 3), change(3, 3), push(3, 3), turned(3, 3), &
                      g(3, 3), ways(6, 3, 3), answer(6)
    integer :: i, j, k, l
    f = gradient
    do k = 1, 3
      f(k, k) = f(k, k) + 1
    end do
    f_back = inverse(f)
    q = matmul(f, matmul(back, at%elastic_axes)) ! axes of the left elastic stretch
    do k = 1, 3
      q(:, k) = q(:, k)*exp(-at%elastic(k))
    end do
    push = tensor(bulk*sum(at%elastic) + 2*shear*deviator(at%elastic), q)
    stress = matmul(push, transpose(f_back))
    half = matmul(back, matmul(transpose(back), transpose(f)))
    turned = transpose(q)
    g = matmul(turned, transpose(f_back))
    do k = 1, 3
      do i = 1, 3
        first(i, k) = half_log_difference(exp(2*at%elastic(i)), exp(2*at%elastic(k)))
      end do
    end do
    do l = 1, 3
      do k = 1, 3
        change = 0 ! of the left elastic stretch, squared, by F(k, l)
        change(k, :) = half(l, :)
        change(:, k) = change(:, k) + half(l, :)
        change = matmul(q, matmul(first*matmul(transpose(q), matmul(change, q)), transpose(q)))
        push = 2*shear*change
        do i = 1, 3
          push(i, i) = push(i, i) + (bulk - 2*shear/3)*(change(1, 1) + change(2, 2) + change(3, 3))
        end do
        push = matmul(push, transpose(f_back))
        do i = 1, 3
          push(:, i) = push(:, i) - stress(:, l)*f_back(i, k)
        end do
        tangent(:, :, k, l) = push
        if (flows) ways(:, k, l) = drive(shear, at, turned(:, k), g(:, l))
      end do
    end do
    if (.not. flows) return
    do l = 1, 3
      do k = 1, 3
        answer = solution(factor, ways(:, k, l))
        do j = 1, 3
          do i = 1, 3
            tangent(i, j, k, l) = tangent(i, j, k, l) - sum(answer*ways(:, i, j))
          end do
        end do
      end do
    end do
  end subroutine give

  !> Derivative of the driving stress of the flow, in its axes, by a change of F along a dyad a b', b' seen through F^-1.
  pure function drive(shear, at, a, b) result(by)
    real(c_double), intent(in)   :: shear, a(3), b(3) !< in axes of the elastic stretch
    type(flow_state), intent(in) :: at
    real(c_double) :: by(6), rate(3, 3)
    integer :: i, k
    do k = 1, 3
      do i = 1, 3
        rate(i, k) = shear*(a(i)*b(k) + a(k)*b(i))/sinh_ratio(at%elastic(i) - at%elastic(k))
      end do
    end do
    rate = full_turn(rate, at%elastic_axes, at%axes)
    by = sheared(at)*weight*to_stress(rate)
    by(:3) = by(:3) - sum(by(:3))/3
    by = to_parts(at, by)
  end function drive

  !> sinh x / x for the differences of the principal flows.
  pure function sheared(at) result(t)
    type(flow_state), intent(in) :: at
    real(c_double) :: t(6)
    integer :: k
    do k = 1, 6
      t(k) = sinh_ratio(at%flow(first_index(k)) - at%flow(second_index(k)))
    end do
  end function sheared

  !> x coth x of the differences of logarithms, as a matrix in axes and parts of the flow.
  pure function of_logarithm(value, axes, at) result(c)
    real(c_double), intent(in)   :: value(3), axes(3, 3)
    type(flow_state), intent(in) :: at
    real(c_double) :: c(6, 6), r(3, 3), turn(6, 6), x
    integer :: i, j, k, l, m, p
    r = matmul(transpose(at%axes), axes)
    do m = 1, 6
      k = first_index(m)
      l = second_index(m)
      do p = 1, 6
        i = first_index(p)
        j = second_index(p)
        turn(p, m) = weight(p)*weight(m)*0.5_c_double*(r(i, k)*r(j, l) + r(i, l)*r(j, k))
      end do
      turn(:, m) = to_parts(at, turn(:, m))
    end do
    do m = 1, 6
      x = value(first_index(m)) - value(second_index(m))
      c(:, m) = turn(:, m)*cosh(x)/sinh_ratio(x)
    end do
    c = matmul(c, transpose(turn))
  end function of_logarithm

  pure elemental function sinh_ratio(x) result(y)
    real(c_double), intent(in) :: x
    real(c_double) :: y
    y = 1
    if (abs(x) > 0) y = sinh(x)/x
  end function sinh_ratio

  !> Half the logarithm of 1 + a: principal values and axes.
  pure subroutine half_logarithm(a, value, axes)
    real(c_double), intent(in)  :: a(3, 3)
    real(c_double), intent(out) :: value(3), axes(3, 3)
    integer :: k
    call symmetric_eigen(a, value, axes)
    do k = 1, 3
      value(k) = 0.5_c_double*log1p(value(k))
    end do
  end subroutine half_logarithm

  !> Norm of a vector without overflow of its square.
  pure function magnitude(v) result(size)
    real(c_double), intent(in) :: v(:)
    real(c_double) :: size, unit
    unit = scale(1.0_c_double, max(-1000, min(1000, exponent(maxval(abs(v))))))
    size = unit*sqrt(sum((v/unit)**2))
  end function magnitude

  pure function exp_less_one(x) result(y)
    real(c_double), intent(in) :: x(3)
    real(c_double) :: y(3)
    integer :: k
    do k = 1, 3
      y(k) = expm1(x(k))
    end do
  end function exp_less_one

  !> (1 + e) (1 + a) (1 + e) - 1.
  pure function between(e, a) result(b)
    real(c_double), intent(in) :: e(3, 3), a(3, 3)
    real(c_double) :: b(3, 3)
    b = e + a + matmul(e, a)
    b = symmetric(b + e + matmul(b, e))
  end function between

  !> u a u of symmetric u and a.
  pure function stretched(u, a) result(b)
    real(c_double), intent(in) :: u(3, 3), a(3, 3)
    real(c_double) :: b(3, 3)
    b = matmul(a, u)
    b = symmetric(matmul(u, b))
  end function stretched

  pure function symmetric(a) result(b)
    real(c_double), intent(in) :: a(3, 3)
    real(c_double) :: b(3, 3)
    b = 0.5_c_double*(a + transpose(a))
  end function symmetric

  pure function tensor(value, axes) result(a)
    real(c_double), intent(in) :: value(3), axes(3, 3)
    real(c_double) :: a(3, 3)
    integer :: i, k
    do k = 1, 3
      do i = 1, 3
        a(i, k) = axes(i, 1)*value(1)*axes(k, 1) + axes(i, 2)*value(2)*axes(k, 2) + axes(i, 3)*value(3)*axes(k, 3)
      end do
    end do
    a = symmetric(a)
  end function tensor

  pure function deviator(value) result(d)
    real(c_double), intent(in) :: value(3)
    real(c_double) :: d(3)
    d = value - sum(value)/3
  end function deviator

  !> A symmetric tensor in other axes than those it is given in.
  pure function full_turn(a, axes, wanted) result(b)
    real(c_double), intent(in) :: a(3, 3), axes(3, 3), wanted(3, 3)
    real(c_double) :: b(3, 3), r(3, 3)
    r = matmul(transpose(wanted), axes)
    b = symmetric(matmul(r, matmul(a, transpose(r))))
  end function full_turn

  pure function in_axes(value, axes, wanted) result(v)
    real(c_double), intent(in) :: value(3), axes(3, 3), wanted(3, 3)
    real(c_double) :: v(6)
    v = weight*to_stress(tensor(value, matmul(transpose(wanted), axes)))
  end function in_axes

  pure function from_axes(v, axes) result(a)
    real(c_double), intent(in) :: v(6), axes(3, 3)
    real(c_double) :: a(3, 3)
    a = from_strain(weight*v)
    a = symmetric(matmul(axes, matmul(a, transpose(axes))))
  end function from_axes
end module finite_back_stress
