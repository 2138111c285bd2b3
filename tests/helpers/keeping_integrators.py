"""Integrators that keep derivatives of the motion, one of each kind, for tests of bonds and joints."""

import cairn as cn

KEEPING = {
    "velocity verlet": cn.VelocityVerlet(),
    "gear 4": cn.Gear(values=4),
    "gear 5": cn.Gear(values=5),
    "gear 6": cn.Gear(values=6),
    "newmark": cn.Newmark(beta=0.3025, gamma=0.6),
    "hht": cn.HHT(alpha=-0.1),
    "generalised alpha": cn.GeneralisedAlpha(spectral_radius=0.8),
}
