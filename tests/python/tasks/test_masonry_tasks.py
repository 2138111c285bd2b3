"""Tasks of a masonry engineer, from the pages alone: a collapse load from IFC, an axle on a bridge, cracks of a shear wall."""

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np
import pytest
from cairn.post import assessment, cracks
from cairn.post.collapse import collapse_multiplier
from cairn.pre import importing, masonry


def write_ifc(path, drawn):
    """An IFC model in millimetres with an element for each block, as a tool for buildings writes it."""
    ifcopenshell = pytest.importorskip("ifcopenshell")
    api = pytest.importorskip("ifcopenshell.api")
    model = ifcopenshell.file(schema="IFC4")
    run = lambda what, **options: api.run(what, model, **options)
    run("root.create_entity", ifc_class="IfcProject", name="arch")
    run("unit.assign_unit")
    context = run("context.add_context", context_type="Model")
    body = run("context.add_context", context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=context)
    for part, corners, faces in zip(drawn.part, drawn.vertices, drawn.faces):
        element = run("root.create_entity", ifc_class="IfcBuildingElementProxy", name=part)
        shape = run("geometry.add_mesh_representation", context=body, vertices=[corners.tolist()],
                    faces=[[[int(i) for i in f] for f in faces]], force_faceted_brep=True)  # fmt: skip
        run("geometry.assign_representation", product=element, representation=shape)
        run("geometry.edit_object_placement", product=element)
    model.write(str(path))


def test_an_arch_from_ifc_to_its_collapse_load(tmp_path):
    write_ifc(tmp_path / "arch.ifc", masonry.arch(radius=5.0, thickness=0.9, voussoirs=9, depth=1.0))
    blocks, report = importing.read(tmp_path / "arch.ifc")
    assert report.unit == "millimetre" and len(blocks.vertices) == 11 and report.joints == 10
    found = collapse_multiplier(blocks, mu=0.7, load="tilt", progress=False)
    assert found.multiplier == pytest.approx(found.limit, rel=0.02)


def test_a_bridge_under_an_axle(tmp_path):
    bridge = masonry.arch(span=6.0, thickness=0.6, voussoirs=9)
    passage = assessment.moving_load(bridge, 10e3, joint=0.7, positions=5, dt=5e-3)
    multiplier, place = passage.least
    assert multiplier > 1 and abs(place) < 3.5 and not passage.fell
    passage.plot()
    plt.savefig(tmp_path / "passage.png")
    assert (tmp_path / "passage.png").stat().st_size > 5000


def test_a_shear_wall_with_its_crack_pattern(tmp_path):
    mortar = cn.MAL(normal_stiffness=8.2e10, tangential_stiffness=3.6e10, mu=0.75, normal_strength=2.5e5,
                    tangential_strength=3.5e5, normal_work=18.0, tangential_work=125.0)  # fmt: skip
    wall = masonry.panel(2, 3, brick=(0.21, 0.052))
    wall.add_box((0.0, 0.156), (0.42, 0.25), "beam")
    meshed = masonry.mesh(wall, size=0.11, young=1.67e10, poisson=0.15, joint=mortar, rigid=("support", "beam"))
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    ids = meshed.add_to(scene, cn.Material("brick", density=1900.0), rigid_options={"beam": {"force": (0.0, -5e4, 0.0)}})
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0))
    sim.run(steps=5, progress=False)
    sim.drive(ids[-1], "vx", 0.02)
    sim.run(steps=12, progress=False)
    pattern = cracks.MeshedStructure(meshed, sim, ids)
    found = cracks.cracks(pattern)
    assert np.nanmax(found.damage) > 0.5 and np.nanmin(found.damage) < 0.5 and found.largest_slip.max() > 5e-5
    cracks.draw(pattern, colour="damage")
    plt.savefig(tmp_path / "cracks.png")
    assert (tmp_path / "cracks.png").stat().st_size > 5000
