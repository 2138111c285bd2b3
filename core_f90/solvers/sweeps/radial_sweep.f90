!> The sweep over a packed batch (see cairn/core.h): what load_bodies, the gathers of radial2 and radial3, the cone's closed form
!> and the scatters do one after the other, done eight contacts at a time without leaving the registers. Most contacts of most
!> scenes are of this kind, and this is about twice as fast; everything else goes the open way. The inverse masses of the records
!> give W, and the normal gives the tangents: less to read from memory, which is what limits a large scene.
module radial_sweep
  use, intrinsic :: iso_c_binding, only: c_int32_t, c_int64_t, c_double
  use contact_batch, only: cairn_record
  implicit none
  private
  public :: sweep_radial2, sweep_radial3, sweep_associated2, sweep_associated3
  public :: sweep_extrapolated2, sweep_extrapolated3, sweep_extrapolated_associated2, sweep_extrapolated_associated3
  public :: sweep_counted2, sweep_counted3, units
  integer, parameter :: w8 = 8 !< contacts at a time: a register of doubles
  real(c_double), parameter :: most = 2.0_c_double**51 !< units of a term, at most
  !> A number that is added and taken off again leaves the nearest multiple of 2^26, or of 1, in as many instructions for eight
  !> contacts as for one. A batch has fewer than 2^26 contacts, so that sums of both parts of its terms are exact.
  real(c_double), parameter :: large = 1.5_c_double*2.0_c_double**78, whole = 1.5_c_double*2.0_c_double**52
contains

  !> Spheres.
  subroutine sweep_radial3(packs, contacts, body_a, body_b, relaxation, pack, record, change, ahead, before, along, &
                           unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .false., extrapolated = .false., counted = .false.
    include "radial_sweep3.inc"
  end subroutine sweep_radial3

  !> Disks.
  subroutine sweep_radial2(packs, contacts, body_a, body_b, relaxation, pack, record, change, ahead, before, along, &
                           unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .false., extrapolated = .false., counted = .false.
    include "radial_sweep2.inc"
  end subroutine sweep_radial2

  !> Spheres with associated slip (associated_normal).
  subroutine sweep_associated3(packs, contacts, body_a, body_b, relaxation, pack, record, change, ahead, before, along, &
                               unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .true., extrapolated = .false., counted = .false.
    include "radial_sweep3.inc"
  end subroutine sweep_associated3

  !> Disks with associated slip (associated_normal).
  subroutine sweep_associated2(packs, contacts, body_a, body_b, relaxation, pack, record, change, ahead, before, along, &
                               unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .true., extrapolated = .false., counted = .false.
    include "radial_sweep2.inc"
  end subroutine sweep_associated2

  !> Spheres, from beyond the last sweep: see extrapolated_sweep.
  subroutine sweep_extrapolated3(packs, contacts, body_a, body_b, relaxation, pack, record, change, ahead, before, along, &
                                 unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .false., extrapolated = .true., counted = .false.
    include "radial_sweep3.inc"
  end subroutine sweep_extrapolated3

  !> Disks, from beyond the last sweep: see extrapolated_sweep.
  subroutine sweep_extrapolated2(packs, contacts, body_a, body_b, relaxation, pack, record, change, ahead, before, along, &
                                 unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .false., extrapolated = .true., counted = .false.
    include "radial_sweep2.inc"
  end subroutine sweep_extrapolated2

  !> Spheres with associated slip (associated_normal), extrapolated from the last sweep (extrapolated_sweep).
  subroutine sweep_extrapolated_associated3(packs, contacts, body_a, body_b, relaxation, pack, record, change, &
                                            ahead, before, along, unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .true., extrapolated = .true., counted = .false.
    include "radial_sweep3.inc"
  end subroutine sweep_extrapolated_associated3

  !> Disks with associated slip (associated_normal), extrapolated from the last sweep (extrapolated_sweep).
  subroutine sweep_extrapolated_associated2(packs, contacts, body_a, body_b, relaxation, pack, record, change, &
                                            ahead, before, along, unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .true., extrapolated = .true., counted = .false.
    include "radial_sweep2.inc"
  end subroutine sweep_extrapolated_associated2

  !> Spheres, from beyond the last sweep, with sums of whole numbers: see ranked_sweep.
  subroutine sweep_counted3(packs, contacts, body_a, body_b, relaxation, pack, record, change, ahead, before, along, &
                            unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .false., extrapolated = .true., counted = .true.
    include "radial_sweep3.inc"
  end subroutine sweep_counted3

  !> Disks, from beyond the last sweep, with sums of whole numbers: see ranked_sweep.
  subroutine sweep_counted2(packs, contacts, body_a, body_b, relaxation, pack, record, change, ahead, before, along, &
                            unit_change, unit_along, changed, turned)
    logical, parameter :: associated = .false., extrapolated = .true., counted = .true.
    include "radial_sweep2.inc"
  end subroutine sweep_counted2

  !> The nearest whole number to a term. One that is too large, or no number, counts as the largest that is allowed.
  elemental integer(c_int64_t) function units(x)
    real(c_double), intent(in) :: x !< [units]
    real(c_double) :: within
    within = merge(x, most, x < most)
    within = merge(within, -most, within > -most)
    units = int((within + whole) - whole, c_int64_t)
  end function units

  !> The normal impulse where slip opens a contact by mu times as much: the nearest point of the cone in the energy of the contact.
  !> Contacts of this kind make a convex problem (Anitescu 2006; Tasora & Anitescu 2011), and where nothing slips in its solution
  !> this is one of Coulomb's law.
  elemental real(c_double) function associated_normal(wn, wt, mu, normal, tangential)
    real(c_double), intent(in) :: wn, wt     !< W_NN, W_TT [1/kg]
    real(c_double), intent(in) :: mu         !< friction [-]
    real(c_double), intent(in) :: normal     !< impulse that would stop the contact, of any sign [N s]
    real(c_double), intent(in) :: tangential !< size of that along the tangent [N s]
    real(c_double), parameter :: largest = 2.0_c_double**20 !< beyond it the cone is a half-space, but for rounding
    real(c_double) :: m
    m = min(mu, largest)
    associated_normal = max(0.0_c_double, &
                            merge(normal, (wn*normal + m*wt*tangential)/(wn + m*m*wt), tangential <= m*normal))
  end function associated_normal
end module radial_sweep
