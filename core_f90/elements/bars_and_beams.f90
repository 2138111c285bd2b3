!> Stiffness of straight bars, and of straight beams of even section that bend and shear (Przemieniecki 1968), in the axes of space.
module bars_and_beams
  use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_int64_t
  implicit none
  private
  public :: cairn_bar_stiffness, cairn_beam_stiffness
contains

  !> n bars between two nodes each, in 2D or 3D: dofs are displacements.
  pure subroutine cairn_bar_stiffness(dim, n, x, young, area, stiffness) bind(c)
    integer(c_int32_t), value   :: dim
    integer(c_int64_t), value   :: n
    real(c_double), intent(in)  :: x(dim, 2, n) !< [m]
    real(c_double), intent(in)  :: young(n)     !< [Pa]
    real(c_double), intent(in)  :: area(n)      !< [m2]
    real(c_double), intent(out) :: stiffness(dim, 2, dim, 2, n) !< [N/m]
    real(c_double) :: along(dim), size
    integer(c_int64_t) :: i
    integer :: a, b
    do i = 1, n
      along = x(:, 2, i) - x(:, 1, i)
      size = norm2(along)
      along = along/size
      do b = 1, 2
        do a = 1, 2
          stiffness(:, a, :, b, i) = merge(1, -1, a == b)*young(i)*area(i)/size*spread(along, 2, dim)*spread(along, 1, dim)
        end do
      end do
    end do
  end subroutine cairn_bar_stiffness

  !> n beams: dofs of a node are displacements and then rotations, 3 in 2D and 6 in 3D. A shear area of 0: no shear (Bernoulli).
  pure subroutine cairn_beam_stiffness(dim, n, x, up, young, shear, area, inertia, torsion, shear_area, stiffness) bind(c)
    integer(c_int32_t), value   :: dim
    integer(c_int64_t), value   :: n
    real(c_double), intent(in)  :: x(dim, 2, n)  !< [m]
    real(c_double), intent(in)  :: up(3)         !< in 3D: the second axis of sections lies in the plane of this and the beam
    real(c_double), intent(in)  :: young(n), shear(n) !< [Pa]
    real(c_double), intent(in)  :: area(n)       !< [m2]
    real(c_double), intent(in)  :: inertia(2, n) !< of bending along the second axis (and in 2D), along the third [m4]
    real(c_double), intent(in)  :: torsion(n)    !< [m4]
    real(c_double), intent(in)  :: shear_area(n) !< [m2]
    real(c_double), intent(out) :: stiffness(6*dim - 6, 6*dim - 6, n) !< [N/m, N, N m]
    real(c_double) :: own(12, 12), axes(3, 3), turn(12, 12), along(3), size
    integer(c_int64_t) :: i
    integer :: k, place(6)
    do i = 1, n
      along = 0
      along(:dim) = x(:, 2, i) - x(:, 1, i)
      size = norm2(along)
      along = along/size
      axes(1, :) = along
      if (dim == 2) then
        axes(2, :) = [-along(2), along(1), 0.0_c_double]
      else
        axes(2, :) = up - dot_product(up, along)*along
        axes(2, :) = axes(2, :)/norm2(axes(2, :))
      end if
      axes(3, :) = [axes(1, 2)*axes(2, 3) - axes(1, 3)*axes(2, 2), axes(1, 3)*axes(2, 1) - axes(1, 1)*axes(2, 3), &
                    axes(1, 1)*axes(2, 2) - axes(1, 2)*axes(2, 1)]
      own = 0
      call axial(own, 1, young(i)*area(i)/size)
      call axial(own, 4, shear(i)*torsion(i)/size)
      call bending(own, 2, 6, 1.0_c_double, size, young(i)*inertia(1, i), shear(i)*shear_area(i))
      call bending(own, 3, 5, -1.0_c_double, size, young(i)*inertia(2, i), shear(i)*shear_area(i))
      turn = 0
      do k = 0, 3
        turn(3*k + 1:3*k + 3, 3*k + 1:3*k + 3) = axes
      end do
      own = matmul(transpose(turn), matmul(own, turn))
      if (dim == 3) then
        stiffness(:, :, i) = own
      else
        place = [1, 2, 6, 7, 8, 12]
        stiffness(:, :, i) = own(place, place)
      end if
    end do
  end subroutine cairn_beam_stiffness

  pure subroutine axial(k, dof, stiff)
    real(c_double), intent(inout) :: k(12, 12)
    integer, intent(in)           :: dof
    real(c_double), intent(in)    :: stiff
    k(dof, dof) = stiff
    k(dof + 6, dof + 6) = stiff
    k(dof, dof + 6) = -stiff
    k(dof + 6, dof) = -stiff
  end subroutine axial

  !> Displacement w and rotation r across the beam; sign of w by r.
  pure subroutine bending(k, w, r, sign, size, bend, shear)
    real(c_double), intent(inout) :: k(12, 12)
    integer, intent(in)           :: w, r
    real(c_double), intent(in)    :: sign, size, bend, shear
    real(c_double) :: soft, unit
    integer :: dof(4)
    soft = 0
    if (shear > 0) soft = 12*bend/(shear*size**2)
    unit = bend/(size**3*(1 + soft))
    dof = [w, r, w + 6, r + 6]
    k(dof, dof(1)) = unit*[12.0_c_double, sign*6*size, -12.0_c_double, sign*6*size]
    k(dof, dof(2)) = unit*[sign*6*size, (4 + soft)*size**2, -sign*6*size, (2 - soft)*size**2]
    k(dof, dof(3)) = -k(dof, dof(1))
    k(dof, dof(4)) = unit*[sign*6*size, (2 - soft)*size**2, -sign*6*size, (4 + soft)*size**2]
  end subroutine bending
end module bars_and_beams
