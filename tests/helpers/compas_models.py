"""Models of compas_dem for tests; a test that imports this has asked for compas_dem before."""

import numpy as np
from compas.datastructures import Mesh
from compas.geometry import Box, Frame
from compas_dem.material import Stone
from compas_dem.models import BlockModel

DENSITY = 2000.0


def model_of(meshes, supports, density=DENSITY, **stone):
    """A model of these meshes, all of one stone."""
    model = BlockModel()
    for mesh in meshes:
        model.add_block_from_mesh(mesh)
    model.add_supports(supports)
    material = Stone(density=density, **stone)
    model.add_material(material)
    model.assign_material(material, elements=list(model.elements()))
    return model


def stack(count, size=1.0, **stone):
    """Cubes on each other, the lowest a support."""
    boxes = [Box(size, size, size, Frame([0.0, 0.0, k * size], [1, 0, 0], [0, 1, 0])) for k in range(count)]
    return model_of([Mesh.from_shape(b) for b in boxes], [0], **stone)


def weight(model, density=DENSITY):
    """Weight of the blocks that can move [N]."""
    return 9.81 * density * sum(abs(b.modelgeometry.volume()) for b in model.blocks())


def loads_on_supports(model, results):
    """Sum of contact forces on the supports, (3,) [N]."""
    held = {b.graphnode for b in model.supports()}
    total = np.zeros(3)
    for u, v in results.edges():
        if (u in held) != (v in held):
            total += np.array(results.resultant_global((u, v))) * (1.0 if u in held else -1.0)
    return total
