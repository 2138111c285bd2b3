"""Reports of a simulation, sim.info and sim.energy: dicts whose KeyError says why a name is missing."""

from ..names import listed


class Info(dict):
    """Report of the last step; the KeyError of a missing name gives the reason."""

    def __init__(self, told, steps):
        super().__init__(told)
        self._steps = steps

    def __missing__(self, name):
        if not self._steps and name != "energy":
            raise KeyError(f"info has no {name!r} before the first step: run one, sim.step()")
        if name in ("joint_error", "joint_gap", "joint_contact"):
            told = "exists in scenes with joints about which a rigid body turns; this scene has none"
            raise KeyError(f"info has no {name!r}, which {told}")
        raise KeyError(f"info has no {name!r}; it has {listed(self, name)}")


class Terms(dict):
    """Terms of a balance; the KeyError of a missing name tells those that there are."""

    def __missing__(self, name):
        raise KeyError(f"there is no term {name!r}; there are {listed(self, name)}")
