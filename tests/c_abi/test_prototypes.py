"""The build's comparison of core.h with the Fortran kernels finds each kind of disagreement."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "cmake" / "check_prototypes.cmake"
HEADER = ROOT / "core_f90" / "include" / "cairn" / "core.h"

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, ("cmake", "gfortran", "gcc"))), reason="needs cmake, gfortran and gcc"
)

KERNEL = """
module sample
  use, intrinsic :: iso_c_binding
  implicit none
  private
  public :: cairn_sample, sample_record
  type, bind(c) :: sample_record
    integer(c_int32_t) :: count
    real(c_double) :: h
    type(c_ptr) :: values
    type(c_funptr) :: law
  end type
  abstract interface
    subroutine sample_law(n, r) bind(c)
      import
      integer(c_int32_t), value :: n
      real(c_double), intent(inout) :: r(n)
    end subroutine
  end interface
contains
  pure subroutine cairn_sample(n, w, record, r) bind(c)
    integer(c_int64_t), value :: n
    real(c_double), intent(in) :: w(n, 3)
    type(sample_record), intent(in) :: record
    real(c_double), intent(inout) :: r(n)
    r = w(:, 1)*record%h
  end subroutine
end module
"""
RIGHT = """
#include <stdint.h>
typedef void cairn_sample_law(int32_t n, double* r);
typedef struct sample_record {
  int32_t count;
  double h;
  const double* values;
  cairn_sample_law* law;
} sample_record;
void cairn_sample(int64_t n, const double* w, const sample_record* record, double* r);
"""


def agree(folder, source, header):
    (folder / "cairn").mkdir(exist_ok=True)
    (folder / "cairn" / "core.h").write_text(header)
    (folder / "cairn" / "rows.h").write_text('#include "core.h"\n')  # of kernels of lists, of which there are none here
    settings = {"FORTRAN": "gfortran", "C": "gcc", "SOURCE": source, "HEADER": folder / "cairn" / "core.h"}
    settings |= {"MODULES": folder, "OUTPUT": folder / "out"}
    command = ["cmake", *(f"-D{name}={value}" for name, value in settings.items()), "-P", str(SCRIPT)]
    return subprocess.run(command, capture_output=True, text=True).returncode == 0


@pytest.mark.parametrize(
    "right, wrong",
    [
        ("int64_t n, const double* w", "int32_t n, const double* w"),
        ("const double* w", "const float* w"),
        ("const double* w", "double* w"),
        ("const sample_record* record, double* r", "double* r, const sample_record* record"),
        (", double* r);\n", ");\n"),
        ("void cairn_sample(", "int32_t cairn_sample("),
        ("void cairn_sample(", "void cairn_simple("),
        ("int32_t count;", "int64_t count;"),
        ("  int32_t count;\n  double h;", "  double h;\n  int32_t count;"),
        ("  cairn_sample_law* law;\n", ""),
        ("int32_t n, double* r", "int64_t n, double* r"),
    ],
)
def test_disagreement_is_found(tmp_path, right, wrong):
    source = tmp_path / "sample.f90"
    source.write_text(KERNEL)
    assert right in RIGHT
    assert agree(tmp_path, source, RIGHT)
    assert not agree(tmp_path, source, RIGHT.replace(right, wrong, 1))


def test_a_changed_type_of_a_real_kernel_is_found(tmp_path):
    source = ROOT / "core_f90" / "integrators" / "rotation.f90"
    for lists in {path.parent for path in (ROOT / "core_f90").glob("*/*.def")}:
        shutil.copytree(lists, tmp_path / lists.name, ignore=shutil.ignore_patterns("*.f90"))
    include = tmp_path / "include"
    shutil.copytree(HEADER.parent.parent, include)
    header = HEADER.read_text()
    declaration = "void cairn_rotate(int64_t nb"
    assert declaration in header
    assert agree(include, source, header)
    assert not agree(include, source, header.replace(declaration, "void cairn_rotate(int32_t nb"))
