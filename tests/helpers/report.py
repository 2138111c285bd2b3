"""Every case prints figure, reference and error before it is judged."""

import numpy as np


def judge(name, figure, reference, gate, scale=None):
    """Asserts |figure - reference| <= gate * scale; scale is |reference| unless given."""
    figure, reference = np.asarray(figure, float), np.asarray(reference, float)
    scale = np.max(np.abs(reference)) if scale is None else scale
    error = np.max(np.abs(figure - reference)) / scale
    print(f"{name}: figure {figure} reference {reference} error {error:.3g} gate {gate:g}")
    assert np.all(np.isfinite(figure)), f"{name} is {figure}"
    assert error <= gate, f"{name} is {figure}, {reference} was expected: error {error:.3g}, gate {gate:g}"
